"""The learners and the policy of the reference, against values worked out by hand.

Learning rate and discount are 1/2, unless a test says otherwise, so that all values are exact.
"""

import numpy as np
import pytest
from colonies import GAMMA, training
from transitions import transition, values_of

from taichi_ants.reference import LEARNERS
from taichi_ants.reference.features.choice import choose_action
from taichi_ants.reference.random_stream import RandomStream


def made(name, values=(), n_states=5, **settings):
    """A learner whose table holds these values, {(state, action): value}, and zeros."""
    q_values = np.zeros((n_states, 5), np.float32)
    for pair, value in dict(values).items():
        q_values[pair] = value
    return LEARNERS[name](training(name, **settings), n_states, q_values)


def learn(learner, *steps, rng_state=0):
    """The TD errors of these steps."""
    stream = RandomStream(rng_state)
    errors = [learner.learn(step, 0.0, stream) for step in steps]
    assert all(type(error) is np.float32 for error in errors)
    return errors


def td_error(name, value, reward, discount, next_values, next_action=0, epsilon=0.0):
    values = {(0, 2): value, **{(1, action): one for action, one in enumerate(next_values)}}
    step = transition(0, 2, reward, 1, next_action=next_action)
    result = made(name, values, discount=discount).error(step, epsilon)
    assert type(result) is np.float32
    return float(result)


NEXT = (2, -1, 4, 0, 0)  # the next values; the present one is 0.5, and the reward is 1


@pytest.mark.parametrize(
    ("names", "options", "error"),
    [
        (("q_learning", "dyna_q", "prioritized_sweeping"), {}, 2.5),  # 1 + 0.5 * 4 - 0.5
        (("sarsa", "sarsa_lambda", "n_step_sarsa"), {"next_action": 0}, 1.5),  # 1 + 0.5 * 2 - 0.5
        (("sarsa", "sarsa_lambda", "n_step_sarsa"), {"next_action": 1}, 0.0),  # 1 - 0.5 - 0.5
        # Mean (2 - 1 + 4) / 5 = 1; 4 + 0.5 * (1 - 4) = 2.5; 1 + 0.5 * 2.5 - 0.5.
        (("expected_sarsa",), {"epsilon": 0.5}, 1.75),
        (("expected_sarsa",), {"epsilon": 0.0}, 2.5),  # as Q-learning
        (("expected_sarsa",), {"epsilon": 1.0}, 1.0),  # by the mean: 1 + 0.5 * 1 - 0.5
    ],
)
def test_each_learner_bootstraps_from_its_next_value(names, options, error):
    for name in names:
        assert td_error(name, 0.5, 1, 0.5, NEXT, **options) == error


@pytest.mark.parametrize("name", LEARNERS)
def test_a_terminal_step_leaves_the_reward(name):
    # 10 - 0.5, whatever the next values are; and with rate 1/2 half of it is learnt.
    learner = made(name, {(0, 2): 0.5, (1, 0): 4, (1, 1): -8}, **planning(name, 1))
    [error] = learn(learner, transition(0, 2, 10, 1, terminated=True))
    assert error == 9.5
    expected = {"dyna_q": 7.625, "double_q": 2.875}.get(name, 5.25)
    assert learner.rows[0][2] == expected


def planning(name, steps):
    return {"planning_steps": steps} if "planning_steps" in LEARNERS[name].hyperparameters else {}


# The first draw from state 0 is 0xE220A839 (0.883 of the range), so table B is updated; from state
# GAMMA it is 0x6E789E6A (0.432), so it is A.
TO_A, TO_B = GAMMA, 0


def test_double_q_by_hand():
    learner = made("double_q", {(0, 1): 1, (1, 0): 2, (1, 1): 4, (1, 2): 3})
    # B: best of state 1 is action 1, in A worth 4: 3 + 0.5 * 4 - 1 = 4. B(0, 1) = 3; mean 2.
    assert learn(learner, transition(0, 1, 3, 1), rng_state=TO_B) == [4]
    assert learner.rows[0][1] == 2
    # A: best of state 0 is action 1, in B worth 3: -4 + 1.5 - 4 = -6.5. A(1, 1) = 0.75; mean 2.375.
    assert learn(learner, transition(1, 1, -4, 0), rng_state=TO_A) == [-6.5]
    assert learner.rows[1][1] == 2.375
    # A: its best of state 1 is now action 2, in B worth 3: 3 + 1.5 - 1 = 3.5. A(0, 1) = 2.75; mean
    # (2.75 + 3) / 2. (Chosen in B, it would be action 1, worth 0.75 in A.)
    assert learn(learner, transition(0, 1, 3, 1), rng_state=TO_A) == [3.5]
    assert values_of(learner) == {(0, 1): 2.875, (1, 0): 2, (1, 1): 2.375, (1, 2): 3}


def test_sarsa_lambda_by_hand():
    # Traces fade by discount * decay = 1/4; two of them are kept.
    learner = made("sarsa_lambda", {(1, 0): 4}, trace_decay=0.5, trace_length=2)
    # 2 + 0.5 * 4 - 0 = 4; Q(0, 0) = 0 + 2 * 1.
    assert learn(learner, transition(0, 0, 2, 1, next_action=0)) == [4]
    assert values_of(learner) == {(0, 0): 2, (1, 0): 4}
    # 0 + 0 - 4; Q(1, 0) = 4 - 2 * 1, Q(0, 0) = 2 - 2 * 1/4.
    assert learn(learner, transition(1, 0, 0, 2, next_action=1)) == [-4]
    assert values_of(learner) == {(0, 0): 1.5, (1, 0): 2}
    # 1 + 0.5 * 2 - 1.5 = 0.5. The old trace of (0, 0) is replaced, not added to: Q(0, 0) = 1.5 +
    # 0.25 * 1, Q(1, 0) = 2 + 0.25 * 1/4.
    assert learn(learner, transition(0, 0, 1, 1, next_action=0)) == [0.5]
    assert values_of(learner) == {(0, 0): 1.75, (1, 0): 2.0625}
    # Ended: 8 - 0. The trace of (0, 0) fades all the same; that of (1, 0) is pushed out.
    assert learn(learner, transition(2, 1, 8, 3, terminated=True)) == [8]
    assert values_of(learner) == {(0, 0): 2.75, (1, 0): 2.0625, (2, 1): 4}
    learner.begin()
    # 2 + 0 - 0, of this pair alone.
    assert learn(learner, transition(3, 3, 2, 4, next_action=0)) == [2]
    assert values_of(learner) == {(0, 0): 2.75, (1, 0): 2.0625, (2, 1): 4, (3, 3): 1}


def test_n_step_sarsa_by_hand():
    learner = made("n_step_sarsa", {(1, 0): 4, (2, 1): 8}, n_steps=2)
    # 2 + 0.5 * 4 - 0: the error of one step; nothing is learnt yet.
    assert learn(learner, transition(0, 0, 2, 1, next_action=0)) == [4]
    assert values_of(learner) == {(1, 0): 4, (2, 1): 8}
    # 4 + 0.5 * 8 - 4. The target of (0, 0) is 2 + 0.5 * (4 + 0.5 * 8) = 6.
    assert learn(learner, transition(1, 0, 4, 2, next_action=1)) == [4]
    assert values_of(learner) == {(0, 0): 3, (1, 0): 4, (2, 1): 8}
    # Ended: 10 - 8. The target of (1, 0) is 4 + 0.5 * 10 = 9, that of (2, 1) is 10.
    assert learn(learner, transition(2, 1, 10, 3, terminated=True)) == [2]
    assert values_of(learner) == {(0, 0): 3, (1, 0): 6.5, (2, 1): 9}


def test_n_step_sarsa_learns_what_is_left_where_the_episode_is_truncated():
    learner = made("n_step_sarsa", {(0, 0): 8}, n_steps=3)
    learn(learner, transition(0, 0, 0, 1, next_action=0))
    # The target of (0, 0) is 0.5 * 0.5 * 8 = 2, so 5. That of (1, 0) is read after this: 0.5 * 5.
    learn(learner, transition(1, 0, 0, 0, next_action=0, truncated=True))
    assert values_of(learner) == {(0, 0): 5, (1, 0): 1.25}
    # Nothing waits: the next step is the first of three.
    learn(learner, transition(2, 0, 9, 3, next_action=0))
    assert values_of(learner) == {(0, 0): 5, (1, 0): 1.25}


def test_prioritized_sweeping_by_hand():
    learner = made("prioritized_sweeping", planning_steps=2, threshold=1.0)
    # No error, so nothing to plan.
    assert learn(learner, transition(0, 0, 0, 1)) == [0]
    assert values_of(learner) == {}
    # Error 8. First (1, 0): 0 + 0.5 * 8. (0, 0) leads to state 1, its error is now 0.5 * 4 = 2, so
    # it is next: 0 + 0.5 * 2.
    assert learn(learner, transition(1, 0, 8, 2)) == [8]
    assert values_of(learner) == {(0, 0): 1, (1, 0): 4}
    # Ended: 16. First (2, 0) = 8. (1, 0) leads there, error 8 + 0.5 * 8 - 4 = 8: 4 + 0.5 * 8.
    # (0, 0) has the error 0.5 * 8 - 1 = 3, but there are two updates a step.
    assert learn(learner, transition(2, 0, 16, 3, terminated=True)) == [16]
    assert values_of(learner) == {(0, 0): 1, (1, 0): 8, (2, 0): 8}
    # It is there still in the next step, itself without an error: 1 + 0.5 * 3.
    assert learn(learner, transition(3, 0, 0, 4)) == [0]
    assert values_of(learner) == {(0, 0): 2.5, (1, 0): 8, (2, 0): 8}


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
