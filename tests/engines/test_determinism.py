"""A run depends on its world, configuration and seed alone: to the bit, on every repeat."""

import random
from dataclasses import replace

import numpy as np
import pytest

from taichi_ants import Task, TrainingConfig, continue_training, evaluate, train
from taichi_ants.worlds import paper

# Uneven on purpose: some deliver within 34 steps, some walk in circles for all of an episode, a
# step of Dyna-Q costs several of the others, and memories differ in size.
TRUNCATES = Task(delivery="truncates")
CONFIGS = (
    TrainingConfig("q_learning", 0.01, 0.99, 0.3, 0.9),
    TrainingConfig("dyna_q", 0.01, 0.99, 0.5, 0.99, planning_steps=5),
    TrainingConfig("sarsa", 0.1, 0.9, 0.3, 0.95, learning_rate_decay=0.9, initial_q=3),
    TrainingConfig("dyna_q", 0.1, 0.9, 0.3, 0.9, planning_steps=1),
    TrainingConfig("double_q", 0.37, 0.9, 0.3, 0.9),
    TrainingConfig("dyna_q", 0.001, 0.99, 0.3, 0.9, planning_steps=5),
    TrainingConfig("sarsa_lambda", 0.1, 0.9, 0.3, 0.9, trace_length=9),
    TrainingConfig("n_step_sarsa", 0.1, 0.9, 0.3, 0.9),
    TrainingConfig("q_learning", 0.001, 0.9, 0.0, 1.0),
)
SEEDS = (3, 0, 2**64 - 1, -7, 12, 5, 4, 99, 31)
EPISODES, MAX_STEPS = 24, 200
ARRAYS = ("returns", "steps", "deliveries", "q_values")
GREEDY = ARRAYS[:3]


@pytest.fixture(scope="module")
def expected():
    result = train(paper(), CONFIGS, SEEDS, EPISODES, MAX_STEPS, TRUNCATES)
    lengths = result.steps.mean(axis=(1, 2))
    assert lengths.max() > 2 * lengths.min()  # uneven indeed
    assert 0 < result.deliveries.mean() < 1
    return result


def assert_same(one, other, names=ARRAYS):
    for name in names:
        assert np.array_equal(getattr(one, name), getattr(other, name)), name


def test_repeats(expected):
    again = train(paper(), CONFIGS, SEEDS, EPISODES, MAX_STEPS, TRUNCATES)
    assert_same(again, expected)
    assert again.state == expected.state


def test_whatever_else_is_in_the_sweep(expected):
    """Single runs, parts of the sweep, and all of it in other orders."""
    shuffle = random.Random(1)
    for _ in range(3):
        chosen = shuffle.sample(range(len(CONFIGS)), shuffle.randint(1, len(CONFIGS)))
        seeds = shuffle.sample(range(len(SEEDS)), shuffle.randint(1, len(SEEDS)))
        part = train(
            *(paper(), [CONFIGS[c] for c in chosen], [SEEDS[s] for s in seeds]),
            *(EPISODES, MAX_STEPS, TRUNCATES),
        )
        for name in ARRAYS:
            whole = getattr(expected, name)[np.ix_(chosen, seeds)]
            assert np.array_equal(getattr(part, name), whole), name
    for c, config in enumerate(CONFIGS[:3]):
        alone = train(paper(), config, SEEDS[c], EPISODES, MAX_STEPS, TRUNCATES)
        for name in ARRAYS:
            assert np.array_equal(getattr(alone, name)[0, 0], getattr(expected, name)[c, c])


def test_training_that_is_continued_is_longer_training():
    """10 and 10 episodes are 20; so are other parts."""
    world = replace(paper(), ants=())  # the ant is placed by the seed
    whole = train(world, CONFIGS, SEEDS[:3], 20, 120)
    for parts in ((10, 10), (1, 18, 1)):
        result = train(world, CONFIGS, SEEDS[:3], parts[0], 120)
        for part in parts[1:]:
            result = continue_training(result, part)
        assert result.episodes == 20
        assert_same(result, whole)
        assert result.state == whole.state


def test_evaluation(expected):
    """On repeats, table by table and rollout by rollout."""
    tables = expected.q_values
    options = {"max_steps": 150, "epsilon": 0.1}
    whole = evaluate(paper(), tables, 20, SEEDS, **options)
    assert_same(evaluate(paper(), tables, 20, SEEDS, **options), whole, GREEDY)
    order = [4, 1, 6, 0]
    some = evaluate(paper(), tables[2:5, order], 7, [SEEDS[s] for s in order], **options)
    alone = evaluate(paper(), tables[3, 2], 20, SEEDS[2], **options)
    for name in GREEDY:
        assert np.array_equal(getattr(some, name), getattr(whole, name)[2:5, order, :7])
        assert np.array_equal(getattr(alone, name), getattr(whole, name)[3, 2])


def test_threads(expected):
    """One thread, which compiles kernels again: the last test, and one learner."""
    tables = expected.q_values
    several = evaluate(paper(), tables[:1], 5, SEEDS)
    one = train(paper(), CONFIGS[:1], SEEDS, EPISODES, MAX_STEPS, TRUNCATES, threads=1)
    for name in ARRAYS:
        assert np.array_equal(getattr(one, name), getattr(expected, name)[:1]), name
    assert_same(evaluate(paper(), tables[:1], 5, SEEDS, threads=1), several, GREEDY)
