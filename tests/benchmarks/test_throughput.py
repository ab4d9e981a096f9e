"""The benchmark, and its yardsticks in C: two more writings of the rules, equal to the bit."""

from __future__ import annotations

import pytest
import throughput
from random_worlds import random_world

from taichi_ants import AntsError, Task, TrainingConfig, train
from taichi_ants.worlds import paper


@pytest.fixture(scope="module")
def yardsticks(tmp_path_factory):
    if throughput.compiler(1) is None:
        pytest.skip("there is no C compiler")
    try:
        return throughput.load_yardsticks(throughput.compiler(2), tmp_path_factory.mktemp("c"), 2)
    except AntsError:  # no compiler has OpenMP
        return throughput.load_yardsticks(throughput.compiler(1), tmp_path_factory.mktemp("c"), 1)


def yardstick_of(yardsticks, name):
    if name not in yardsticks:
        pytest.skip("this processor or its compiler has no AVX-512")
    return yardsticks[name]


@pytest.mark.parametrize("name", throughput.YARDSTICKS.values())
@pytest.mark.parametrize("delivery", ["truncates", "terminates"])
@pytest.mark.parametrize("learner", throughput.LEARNERS)
def test_c_gives_the_same_runs(learner, delivery, name, yardsticks):
    yardstick = yardstick_of(yardsticks, name)
    configs = throughput.grid(*throughput.LEARNERS[learner])[::5]
    more = configs[0].hyperparameters
    for numbers in ((1.0, 0.9, 0.7, 0.5, 0.2), (0.5, 0.9, 1.0, 0.2, 0.0)):
        configs.append(TrainingConfig(configs[0].learner, *numbers, hyperparameters=more))
    deliveries = 0
    for world in (paper(), *(random_world(seed + 60, 6) for seed in range(12))):
        seeds = (0, 7, 2**63 + 5)
        result = train(world, configs, seeds, 25, 150, Task(delivery=delivery))
        deliveries += result.deliveries.sum()
        for threads in (1, 2):
            given = (delivery == "truncates", 25, 150, threads)
            trained = throughput.train_in_c(yardstick, world, configs, seeds, *given)
            throughput.check_same(trained, result)
    assert deliveries > 100
