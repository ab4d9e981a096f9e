"""The yardsticks in C of training and of colonies: more writings of the rules, equal to the bit."""

from itertools import product

import colony_in_c
import numpy as np
import pytest
import throughput
from random_worlds import random_world

from taichi_ants import AntsError, Task, TrainingConfig, train
from taichi_ants.worlds import paper


def loaded(load, folder):
    """What C compiles to with threads, or without if no compiler has OpenMP."""
    if throughput.compiler(1) is None:
        pytest.skip("there is no C compiler")
    try:
        return load(throughput.compiler(2), folder, 2)
    except AntsError:
        return load(throughput.compiler(1), folder, 1)


@pytest.fixture(scope="module")
def yardsticks(tmp_path_factory):
    return loaded(throughput.load_yardsticks, tmp_path_factory.mktemp("c"))


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return loaded(colony_in_c.load, tmp_path_factory.mktemp("c"))


@pytest.mark.parametrize("name", throughput.YARDSTICKS.values())
@pytest.mark.parametrize("delivery", ["truncates", "terminates"])
@pytest.mark.parametrize("learner", throughput.LEARNERS)
def test_c_gives_the_same_runs(learner, delivery, name, yardsticks):
    if name not in yardsticks:
        pytest.skip("this processor or its compiler has no AVX-512")
    configs = throughput.grid(*throughput.LEARNERS[learner])[::5]
    more = configs[0].hyperparameters
    for numbers in ((1.0, 0.9, 0.7, 0.5, 0.2), (0.5, 0.9, 1.0, 0.2, 0.0)):
        configs.append(TrainingConfig(configs[0].learner, *numbers, hyperparameters=more))
    deliveries = 0
    for world in (paper(), *(random_world(seed + 60, 6) for seed in range(12))):
        seeds = (0, 7, 2**63 + 5)
        result = train(world, configs, seeds, 25, 150, Task(delivery=delivery))
        deliveries += result.deliveries.sum()
        for threads, yardstick in product((1, 2), yardsticks[name]):
            given = (delivery == "truncates", 25, 150, threads)
            trained = throughput.train_in_c(yardstick, world, configs, seeds, *given)
            throughput.check_same(trained, result)
    assert deliveries > 100


@pytest.mark.parametrize("rules", ["the paper's", "queueing"])  # which has those of foraging
def test_c_gives_the_same_colonies(rules, library):
    colony = colony_in_c.scattered(colony_in_c.TASKS[rules], 300)
    colony.begin_episode()
    before = {name: array.copy() for name, array in colony.arrays.items()}
    one, two = (colony_in_c.live_in_c(library, colony, 400, threads) for threads in (1, 2))
    assert np.array_equal(one.q_values, two.q_values)
    assert one[1:] == two[1:]
    assert one.deliveries > 20
    assert one.blocked > 10_000
    assert all(np.array_equal(before[name], colony.arrays[name]) for name in before)
    colony_in_c.check_same(library, colony, 400, 2)
    colony.arrays["rewards"][3] += 1  # of C alone
    colony.begin_episode()
    other = colony_in_c.live_in_c(library, colony, 400, 1)
    assert other.returns != one.returns
