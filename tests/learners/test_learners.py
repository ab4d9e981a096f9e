"""What every registered learner must be, in whatever file it stands."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
import taichi as ti
from plain_runs import train_with_tables
from random_worlds import random_world

from taichi_ants import (
    AntsError,
    TrainingConfig,
    evaluate,
    learners,
    reference,
    trace_training,
    train,
)
from taichi_ants.learners import registry, td_learner
from taichi_ants.reference.learners import Sarsa
from taichi_ants.task import Task
from taichi_ants.worlds import paper

DELIVERIES = ("terminates", "truncates")


@ti.func
def clipped_td_error(value, reward, discount, next_values, next_action, epsilon):
    """SARSA that never believes a surprise of more than 2."""
    next_value = next_values[0]
    for a in ti.static(range(1, 5)):
        if next_action == a:
            next_value = next_values[a]
    error = reward + discount * next_value - value
    return ti.max(ti.min(error, 2.0), -2.0)


class ClippedSarsa(Sarsa):
    def error(self, step, epsilon):
        return max(min(super().error(step, epsilon), np.float32(2)), np.float32(-2))


CLIPPED = td_learner("clipped_sarsa", clipped_td_error, draws_next_action=True)


@pytest.fixture(autouse=True)
def _clipped_sarsa(monkeypatch):
    """A learner from outside of the package, known during these tests only."""
    monkeypatch.setattr(registry.LEARNERS, "yours", dict(registry.LEARNERS.yours))
    learners.register(CLIPPED)
    monkeypatch.setitem(reference.LEARNERS, "clipped_sarsa", ClippedSarsa)


NAMES = (*learners.names(), "clipped_sarsa")


def config_for(name, **changes):
    settings = {"learning_rate": 0.1, "discount": 0.9, "epsilon": 0.3, "epsilon_decay": 0.97}
    hyperparameters = {"dyna_q": {"planning_steps": 3}, "sarsa_lambda": {"trace_decay": 0.5}}
    return TrainingConfig(name, **{**settings, **hyperparameters.get(name, {}), **changes})


def test_the_registry_lists_them():
    assert set(NAMES) <= set(learners.names())
    assert set(reference.LEARNERS) == set(NAMES)
    assert learners.get("clipped_sarsa") is CLIPPED


@pytest.mark.parametrize("name", NAMES)
def test_it_has_a_twin_in_the_reference(name):
    learner, twin = learners.get(name), reference.LEARNERS[name]
    assert learner.name == name
    assert learner.draws_next_action == twin.draws_next_action
    assert (learner.td_error is not None) == twin.shares
    usual = {field.name: field.default for field in fields(learner.hyperparameters)}
    assert usual == twin.hyperparameters


def test_one_of_ones_own_equals_its_twin():
    """Some hundred steps in random worlds, to the bit; the package's own: tests/engines."""
    steps = deliveries = 0
    for seed in range(12):
        world = random_world(seed + 200)
        config = config_for("clipped_sarsa", learning_rate=0.37, discount=0.99, epsilon=0.2)
        task = Task(delivery=DELIVERIES[seed % 2], evaporation_in_training=seed % 4 < 2)
        ours = trace_training(world, config, seed, 3, 30, task)
        plain, tables = train_with_tables(world, config, seed, 3, 30, task)
        assert len(ours) == len(plain.trace)
        for k, step in enumerate(plain.trace):
            assert (ours.states[k], ours.actions[k]) == (step.state, step.action)
            assert ours.td_errors[k] == step.td_error
            assert np.array_equal(ours.tables[k], tables[k])
        result = train(world, config, seed, 3, 30, task)
        assert np.array_equal(result.q_values[0, 0], plain.q_values)
        steps += len(ours)
        deliveries += sum(plain.deliveries)
    assert steps > 300
    assert deliveries > 0


@pytest.mark.parametrize("delivery", DELIVERIES)
def test_all_learn_to_deliver_in_the_papers_world(delivery):
    configs = [config_for(name) for name in NAMES]
    result = train(paper(), configs, range(10), 400, 600, Task(delivery=delivery))
    assert np.isfinite(result.q_values).all()
    greedy = evaluate(paper(), result.q_values, 10, range(10))
    for c, name in enumerate(NAMES):
        late, early = result.steps[c, :, -50:], result.steps[c, :, :3]
        assert late.mean() < early.mean() / 2, name
        assert greedy.deliveries[c].mean() > 0.9, name
        assert np.median(greedy.steps[c]) <= 36, name  # 34 is the shortest way
    untrained = evaluate(paper(), np.zeros((128, 5)), 100)
    assert untrained.deliveries.mean() < 0.5


@ti.func
def no_td_error(value, reward, discount, next_values, next_action, epsilon):
    return 0.0 * reward


def test_a_learner_of_ones_own_is_replaced():
    """As in a cell of a notebook that is run again; the next training uses the new one."""
    config = TrainingConfig("mine", 0.5, 0.9, 0.5, 1.0)
    tables = []
    for td_error in (no_td_error, clipped_td_error):
        mine = learners.register(td_learner("mine", td_error, True))
        assert learners.get("mine") is mine
        tables.append(train(paper(), config, 0, 2).q_values)
    assert not tables[0].any()
    assert tables[1].any()
    assert learners.names().count("mine") == 1


def test_built_in_learners_are_not_replaced():
    for name in registry.BUILT_IN:
        with pytest.raises(AntsError, match=f"^'{name}' is the name of a built-in learner, which"):
            learners.register(td_learner(name, clipped_td_error, True))


@pytest.mark.parametrize(
    ("learner", "says"),
    [
        (None, "learner is None; it must be a Learner"),
        (clipped_td_error, "it must be a Learner"),
        (replace(CLIPPED, name="two words"), "the name of the learner is 'two words'; it must"),
        (replace(CLIPPED, name=""), "the name of the learner is ''; it must"),
        (replace(CLIPPED, name="a/b"), "the name of the learner is 'a/b'; it must"),
        (replace(CLIPPED, name=3), "the name of the learner is 3; it must"),
    ],
)
def test_what_cannot_be_registered(learner, says):
    before = learners.names()
    with pytest.raises(AntsError) as caught:
        learners.register(learner)
    assert says in str(caught.value)
    assert learners.names() == before


def test_an_unknown_name_is_answered_with_the_known_ones():
    with pytest.raises(AntsError, match=r"no learner 'td_zero'; choose one of q_learning, .*"):
        learners.get("td_zero")
