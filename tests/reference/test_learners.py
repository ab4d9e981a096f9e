"""The TD errors and the policy of the reference, against values worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_ants.errors import AntsError
from taichi_ants.reference import (
    RandomStream,
    choose_action,
    learner_named,
    learner_names,
    learners,
    register,
)

GAMMA = 0x9E3779B97F4A7C15


def td_error(name, value, reward, discount, next_values, next_action=-1, epsilon=0.0):
    result = learner_named(name).td_error(
        np.float32(value),
        np.float32(reward),
        np.float32(discount),
        [np.float32(number) for number in next_values],
        next_action,
        np.float32(epsilon),
    )
    assert type(result) is np.float32
    return float(result)


def test_the_four_learners():
    assert learner_names() == ("q_learning", "sarsa", "expected_sarsa", "dyna_q")
    drawing = [name for name in learner_names() if learner_named(name).draws_next_action]
    planning = [name for name in learner_names() if learner_named(name).plans]
    assert (drawing, planning) == (["sarsa"], ["dyna_q"])


@pytest.mark.parametrize("name", ["q_learning", "dyna_q"])
def test_q_learning_bootstraps_from_the_best(name):
    # 1 + 0.5 * 4 - 0.5
    assert td_error(name, 0.5, 1, 0.5, (2, -1, 4, 0, 0)) == 2.5
    # 0 + 0.5 * (-1) - 0.5
    assert td_error(name, 0.5, 0, 0.5, (-2, -1, -4, -8, -1)) == -1.0


def test_sarsa_bootstraps_from_the_next_action():
    # 1 + 0.5 * 2 - 0.5 and 1 + 0.5 * (-1) - 0.5
    assert td_error("sarsa", 0.5, 1, 0.5, (2, -1, 4, 0, 0), next_action=0) == 1.5
    assert td_error("sarsa", 0.5, 1, 0.5, (2, -1, 4, 0, 0), next_action=1) == 0.0


def test_expected_sarsa_mixes_best_and_mean():
    # Mean (2 - 1 + 4) / 5 = 1; 4 + 0.5 * (1 - 4) = 2.5; 1 + 0.5 * 2.5 - 0.5.
    assert td_error("expected_sarsa", 0.5, 1, 0.5, (2, -1, 4, 0, 0), epsilon=0.5) == 1.75
    # Epsilon 0 is Q-learning; epsilon 1 the mean: 1 + 0.5 * 1 - 0.5.
    assert td_error("expected_sarsa", 0.5, 1, 0.5, (2, -1, 4, 0, 0), epsilon=0.0) == 2.5
    assert td_error("expected_sarsa", 0.5, 1, 0.5, (2, -1, 4, 0, 0), epsilon=1.0) == 1.0


@pytest.mark.parametrize("name", learner_names())
def test_discount_zero_leaves_the_reward(name):
    # 10 - 0.5, whatever the next values are.
    assert td_error(name, 0.5, 10, 0.0, (2, -1, 4, 0, 0), epsilon=0.5) == 9.5


@pytest.mark.parametrize("name", learner_names())
def test_the_target_is_rounded_before_the_value_is_subtracted(name):
    # In float32 1 + 2**24 is 2**24, so the difference is 0; any other order gives 1.
    big = 2.0**24
    assert td_error(name, big, 1, 1, (big,) * 5, next_action=0) == 0.0


def test_the_mean_is_summed_from_left_to_right():
    # 1 + 2**-24 rounds to 1 (ties to even), twice; so the sum is 1 and the mean 0.2 in float32,
    # 13421773 / 2**26. Minus the best, 1: -53687091 / 2**26, which rounds to -13421773 / 2**24.
    # Plus 1: (16777216 - 13421773) / 2**24. Summed from the right it would be one unit more.
    tiny = 2.0**-24
    result = td_error("expected_sarsa", 0, 0, 1, (1, tiny, tiny, 0, 0), epsilon=1)
    assert result == 3355443 / 2**24


def test_the_mean_is_a_product_with_a_fifth():
    # 0.2 in float32 is 13421773 / 2**26; times 9 it is 120795957 / 2**26, which rounds to
    # 15099495 / 2**23. A division by 5 would give 1.8 * 2**23 = 15099494.4, rounded down.
    result = td_error("expected_sarsa", 0, 0, 1, (-9, 0, 0, 0, 0), epsilon=1)
    assert result == -15099495 / 2**23


def test_a_name_is_registered_once(monkeypatch):
    monkeypatch.setattr(learners, "_learners", dict(learners._learners))
    register("mine", learner_named("sarsa").td_error, draws_next_action=True)
    assert learner_named("mine").draws_next_action
    assert not learner_named("mine").plans
    with pytest.raises(AntsError, match="mine"):
        register("mine", learner_named("sarsa").td_error)


def test_an_unknown_name_is_refused():
    with pytest.raises(AntsError, match=r"'q_lerning'.*q_learning, sarsa"):
        learner_named("q_lerning")


# The first draw from state 0 is 0xE220A839 (0.883 of the range), 0x7B1DCDAF (0.481); from state
# GAMMA it is 0x6E789E6A (0.432), 0xA1B965F4 (0.632).
@pytest.mark.parametrize(
    ("values", "epsilon", "rng_state", "action"),
    [
        ((0, 1, 0, 0, 0), 0.0, 0, 1),  # one best
        ((0, 0, 0, 0, 0), 0.0, 0, 2),  # 0.481 of five
        ((7, 0, 7, 0, 7), 0.0, 0, 2),  # 0.481 of three: the second, action 2
        ((7, 0, 0, 0, 7), 0.0, 0, 0),  # 0.481 of two: the first
        ((7, 0, 0, 0, 7), 0.0, GAMMA, 4),  # 0.632 of two: the second
        ((-3, -1, -2, -1, -9), 0.0, GAMMA, 3),  # negative values, two best
        ((7, 0, 0, 0, 0), 0.89, 0, 2),  # 0.883 < 0.89: random, 0.481 of five
        ((7, 0, 0, 0, 0), 0.88, 0, 0),  # 0.883 >= 0.88: best
        ((7, 0, 0, 0, 0), 1.0, GAMMA, 3),  # always random: 0.632 of five
    ],
)
def test_epsilon_greedy(values, epsilon, rng_state, action):
    stream = RandomStream(rng_state)
    row = [np.float32(value) for value in values]
    assert choose_action(row, epsilon, stream) == action
    assert stream.state == (rng_state + GAMMA) % 2**64  # always one draw


def test_the_threshold_of_exploration_is_strict():
    # Epsilon is exactly the high word of the draw: not below it, so the best action.
    row = [np.float32(value) for value in (7, 0, 0, 0, 0)]
    assert choose_action(row, 0xE220A839 / 2**32, RandomStream(0)) == 0
    assert choose_action(row, 0xE220A83A / 2**32, RandomStream(0)) == 2
