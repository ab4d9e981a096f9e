"""What every registered learner must be, in whatever file it stands."""

from dataclasses import fields

import numpy as np
import pytest

from taichi_ants import TrainingConfig, evaluate, learners, reference, train
from taichi_ants.task import Task
from taichi_ants.worlds import paper

NAMES = learners.registry.BUILT_IN


@pytest.mark.parametrize("name", NAMES)
def test_it_has_a_twin_in_the_reference(name):
    learner, twin = learners.get(name), reference.LEARNERS[name]
    assert learner.name == name
    assert learner.draws_next_action == twin.draws_next_action
    usual = {field.name: field.default for field in fields(learner.hyperparameters)}
    assert usual == twin.hyperparameters


@pytest.mark.parametrize("delivery", ["terminates", "truncates"])
def test_all_learn_to_deliver_in_the_papers_world(delivery):
    more = {"dyna_q": {"planning_steps": 3}, "sarsa_lambda": {"trace_decay": 0.5}}
    configs = [TrainingConfig(name, 0.1, 0.9, 0.3, 0.97, **more.get(name, {})) for name in NAMES]
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
