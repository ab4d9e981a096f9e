"""What every registered learner must be, in whatever file it stands."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
import taichi as ti

from taichi_ants import (
    AntsError,
    TrainingConfig,
    evaluate,
    learners,
    reference,
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


@pytest.mark.parametrize("name", NAMES)
def test_it_has_a_twin_in_the_reference(name):
    learner, twin = learners.get(name), reference.LEARNERS[name]
    assert learner.name == name
    assert learner.draws_next_action == twin.draws_next_action
    assert (learner.td_error is not None) == twin.shares
    usual = {field.name: field.default for field in fields(learner.hyperparameters)}
    assert usual == twin.hyperparameters


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


@pytest.mark.parametrize(
    ("learner", "says"),
    [
        (None, "learner is None; it must be a Learner"),
        (clipped_td_error, "it must be a Learner"),
    ],
)
def test_what_cannot_be_registered(learner, says):
    before = learners.names()
    with pytest.raises(AntsError) as caught:
        learners.register(learner)
    assert says in str(caught.value)
    assert learners.names() == before
