"""How the ants of a world learn, against values worked out by hand.

Learning rate and discount are 1/2 throughout.
"""

import numpy as np
import pytest
from colonies import GAMMA, act, begun, load, training
from transitions import transition, values_of

from taichi_ants.learners.config import update_weights
from taichi_ants.reference import LEARNERS
from taichi_ants.reference.learners import learn_together, mean_error
from taichi_ants.reference.random_stream import RandomStream
from taichi_ants.task.constants import FORWARD, GIVE, LEFT, PICK_UP
from taichi_ants.worlds import World


def shared(learner="q_learning", q_values=None, **settings):
    return LEARNERS[learner](training(learner, **settings), 128, q_values)


def learn(learner, steps, streams):
    learn_together(learner, steps, streams, epsilon=0.0, most=8)


def streams(n, state=0):
    return [RandomStream(state) for _ in range(n)]


def table(**values):
    """A table of zeros but for values given as s<state>a<action>=value."""
    q_values = np.zeros((128, 5), np.float32)
    for name, value in values.items():
        state, action = name[1:].split("a")
        q_values[int(state), int(action)] = value
    return q_values


def test_three_errors_of_one_pair_and_one_of_another():
    # Errors by the table as it was before: 3 + 4/2 - 2 = 3, -1 + 0 - 2 = -3, 10 - 2 = 8 (ended);
    # the mean 8/3 times 1 - 1/8; both in float32. The other pair: 1 + 2/2 - 4 = -2.
    learner = shared(q_values=table(s0a1=2, s5a0=4))
    steps = [
        transition(0, 1, 3, 5),
        transition(5, 0, 1, 0, number=1),
        transition(0, 1, -1, 6, number=2),
        transition(0, 1, 10, 5, number=3, terminated=True),
    ]
    learn(learner, steps, streams(4))
    assert [step.td_error for step in steps] == [3, -2, -3, 8]
    mean = np.float32(8 / 3)
    value = np.float32(2) + np.float32(0.875) * mean
    assert values_of(learner) == {(0, 1): float(value), (5, 0): 3.0}


@pytest.mark.parametrize(
    ("errors", "mean"),
    [
        ([1, 2], 1.5),
        ([2**-34, 2**-34], 0),  # below half a unit of 2**-32: nothing
        ([2**-33, 2**-33], 2**-32),  # half a unit goes up
        ([-(2**-33), -(2**-33)], 0),  # upwards, not away from zero
        ([3 * 2**-34, 0], 2**-33),  # three quarters of a unit are one; half of it
        ([1, 2**-32, 2**-32], 1 / 3),  # 1/3 in float32 whatever the small ones
        ([1000, -1000, 2**-32], 2**-32 / 3),  # no small one gets lost
    ],
)
def test_the_sum_is_exact_in_units_of_two_to_the_minus_32(errors, mean):
    result = mean_error([np.float32(error) for error in errors])
    assert type(result) is np.float32
    assert result == np.float32(mean)


def test_the_weights():
    weights = update_weights(0.1, 40)
    alpha = float(np.float32(0.1))
    assert weights.dtype == np.float32
    assert weights.shape == (41,)
    assert weights[0] == 0
    assert weights[1] == np.float32(0.1)
    assert float(weights[3]) == pytest.approx(3 * alpha - 3 * alpha**2 + alpha**3, rel=1e-7)
    assert (np.diff(weights) > 0).all()
    assert update_weights(0.5, 3).tolist() == [0, 0.5, 0.75, 0.875]
    assert update_weights(1.0, 2).tolist() == [0, 1, 1]
    assert update_weights(1e-12, 2)[1] == np.float32(1e-12)
    assert update_weights(0.3, 0).tolist() == [0]


@pytest.mark.parametrize(("learner", "then"), [("sarsa", FORWARD), ("q_learning", LEFT)])
def test_sarsa_chooses_by_the_table_before_the_update(learner, then):
    # Two ants far apart go forward over free land. Q(E E E, forward) falls from 1/4, by 3/4 of
    # 1/8 - 1/4, below Q(E E E, left) = 3/16. Sarsa has drawn forward once more by then.
    world = World((9, 9, 9), (0, 0, 8), ants=[((0, 0, 0), 0), ((0, 5, 0), 0)])
    q_values = table(s0a1=0.25, s0a0=0.1875)
    colony = begun(world, training(learner), "shared", q_values=q_values)
    act(colony, FORWARD, FORWARD)
    assert [step.td_error for step in colony.transitions] == [-0.125, -0.125]
    assert colony.q_values[0, FORWARD] == 0.15625
    drawn = then if learner == "sarsa" else None
    assert [step.next_action for step in colony.transitions] == [drawn] * 2
    colony.tick()
    assert [step.action for step in colony.transitions] == [then] * 2


def entries(learner):
    return [
        (*pair, seen.reward, seen.next_state, seen.terminated)
        for pair, seen in learner.model.items()
    ]


def test_the_model_of_all():
    learner = shared("dyna_q", learning_rate=1.0, planning_steps=1)
    # Of one pair the highest number counts (not the slot, not the place in the list), and new
    # pairs come in ascending order of 5 * state + action.
    learn(
        learner,
        [
            transition(9, 2, 0, 3, number=4, slot=1),
            transition(7, 3, 3, 4, number=7, slot=0),
            transition(7, 3, -1, 5, number=2, slot=5),
            transition(7, 0, 1, 6, number=9, slot=2),
        ],
        streams(4),
    )
    first = [(7, 0, 1, 6, False), (7, 3, 3, 4, False), (9, 2, 0, 3, False)]
    assert entries(learner) == first
    # Pairs known already keep their places; what was seen last replaces what was seen before, be
    # the ant's number as low as it may.
    learn(
        learner,
        [transition(9, 2, 10, 1, number=0, terminated=True), transition(1, 1, 0, 2, number=1)],
        streams(2),
    )
    assert entries(learner) == [*first[:2], (9, 2, 10, 1, True), (1, 1, 0, 2, False)]


def test_a_round_of_planning_by_hand():
    # Real updates: pair (0, 1), reward 8, ended, by two ants: 8 * 3/4 = 6. Then one round: both
    # draw the one visited pair, error 8 - 6 = 2, twice: 6 + 2 * 3/4 = 7.5. Another: 7.875.
    for rounds, value in ((1, 7.5), (2, 7.875)):
        learner = shared("dyna_q", planning_steps=rounds)
        ants = streams(2)
        steps = [transition(0, 1, 8, 5, number=k, terminated=True) for k in range(2)]
        learn(learner, steps, ants)
        assert [step.td_error for step in steps] == [8, 8]  # of the real transitions alone
        assert values_of(learner) == {(0, 1): value}
        assert [stream.state for stream in ants] == [rounds * GAMMA % 2**64] * 2


def test_an_ant_born_into_a_slot_begins_with_nothing():
    # The second ant dies; the first gives twice, so that slots 2 and then 1 are taken.
    queen = (0, 0, 0)
    world = World((5, 5, 5), queen, ants=[((0, 0, 1), 1), ((3, 0, 0), 0)])
    learning = training("dyna_q", planning_steps=1)
    q_values = table(s127a0=9)
    colony = begun(
        world, learning, "independent", q_values=q_values, births=True, capacity=3, lifespan=50
    )
    assert (colony.q_values[:, 127, 0] == 9).all()
    colony.ants[1].own["age"] = 49
    load(colony, 0)
    act(colony, GIVE, FORWARD)
    assert sorted(colony.ants) == [0, 2]
    assert len(colony.learners[1].model) == 1
    load(colony, 0)
    act(colony, GIVE, PICK_UP)
    tables, learners = colony.q_values, colony.learners
    assert {slot: ant.number for slot, ant in colony.ants.items()} == {0: 0, 1: 3, 2: 2}
    assert not tables[1].any()
    assert learners[1].model == {}
    # The one that was born first has learnt since: a pick-up in vain.
    [(pair, seen)] = learners[2].model.items()
    assert (pair, seen.reward) == (colony.transitions[1].pair, -1)
    assert tables[2].min() == -0.75
    # A table stays with its slot in the next episode.
    colony.end_episode()
    colony.begin_episode()
    np.testing.assert_array_equal(colony.q_values, tables)
