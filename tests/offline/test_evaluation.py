"""Off-policy evaluation equals the reference, and is right where it promises to be."""

import numpy as np
import plain_offline as plain
import pytest
from plain_offline import behaviour_of, episodes_of, random_data
from random_worlds import random_world

from taichi_ants import Task, record, worlds
from taichi_ants.learners.policies import action_probabilities
from taichi_ants.offline.evaluation import importance_sampling, model_based
from taichi_ants.offline.learners import tolerance

STILL = Task(evaporation_in_evaluation=False)


@pytest.mark.parametrize("seed", range(2))
def test_both_equal_the_reference(seed):
    data = random_data(random_world(seed), seed)
    tables = np.random.default_rng(seed).normal(size=(2, 128, 5)).astype(np.float32)
    targets = action_probabilities(tables, 0.4)
    steps, behaviour = episodes_of(data), behaviour_of(data)
    for weighted in (False, True):
        ours = importance_sampling(data, tables, 0.95, 0.4, weighted, resamples=0)
        for k, target in enumerate(targets):
            value = plain.importance_sampling(steps, target, behaviour, 0.95, weighted)
            assert ours.value[k] == value
        assert np.isnan(ours.low).all()
    ours = model_based(data, tables, 0.95, 0.4, 0.5, resamples=0)
    for k, target in enumerate(targets):
        q = plain.q_iteration(steps, 128, 0.95, 0.5, tolerance(10, 0.95, 0.5), target)
        firsts = [episode[0][0] for episode in steps]
        value = sum(target[s, a] * q[s, a] for s in firsts for a in range(5)) / len(firsts)
        assert ours.value[k] == pytest.approx(value, rel=1e-12)


def test_the_behaviour_policy_itself_has_weights_of_one():
    table = np.random.default_rng(1).normal(size=(128, 5)).astype(np.float32)
    data = record(worlds.paper(), table, 30, 3, 80, STILL, epsilon=0.3)
    for weighted in (False, True):
        ours = importance_sampling(data, table, 0.9, 0.3, weighted)
        assert ours.value == pytest.approx(data.returns(0.9).mean(), rel=1e-12)
        assert ours.effective_sample_size == 30
        assert ours.low < ours.value < ours.high


def test_an_interval_covers_the_truth_about_as_often_as_it_says():
    table = np.random.default_rng(2).normal(size=(128, 5)).astype(np.float32)
    world = worlds.paper()
    truth = record(world, table, 20_000, 4, 5, epsilon=0.5).returns(0.9).mean()
    covered = 0
    for seed in range(40):
        data = record(world, None, 400, seed, 5)
        found = importance_sampling(data, table, 0.9, 0.5)
        covered += bool(found.low <= truth <= found.high)
    assert covered >= 33
