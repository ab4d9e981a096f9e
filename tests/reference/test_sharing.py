"""How the ants of a world learn, against values worked out by hand.

Learning rate and discount are 1/2 throughout.
"""

from __future__ import annotations

import itertools
from functools import partial

import numpy as np
import pytest
from colonies import GAMMA, act, begun, load, n_draws, training
from transitions import transition

from taichi_ants.errors import AntsError
from taichi_ants.grid.constants import STREAM_ANT
from taichi_ants.learners.config import update_weights
from taichi_ants.reference import LEARNERS, ReferenceColony
from taichi_ants.reference.random_stream import RandomStream, stream_state
from taichi_ants.reference.sharing import IndependentTables, SharedTable, mean_error
from taichi_ants.task.constants import FORWARD, GIVE, LEFT, PICK_UP
from taichi_ants.worlds import World


def maker(learner, **settings):
    return partial(LEARNERS[learner], training(learner, **settings), 128)


def shared(learner="q_learning", slots=8, q_values=None, **settings):
    return SharedTable(maker(learner, **settings), slots, q_values)


def streams(n, state=0):
    return [RandomStream(state) for _ in range(n)]


def errors_of(colony):
    return [step.td_error for step in colony.transitions]


def table(**values):
    """A table of zeros but for values given as s<state>a<action>=value."""
    q_values = np.zeros((128, 5), np.float32)
    for name, value in values.items():
        state, action = name[1:].split("a")
        q_values[int(state), int(action)] = value
    return q_values


def changed(learners):
    """The values that are not zero, by state and action."""
    q_values = learners.tables[0].table()
    return {(int(s), int(a)): float(q_values[s, a]) for s, a in np.argwhere(q_values)}


def test_one_error_counts_as_for_a_single_ant():
    learners = shared()
    step = transition(0, 1, 3, 5)
    learners.learn([step], streams(1), 0.0)
    assert step.td_error == 3
    assert changed(learners) == {(0, 1): 1.5}


def test_two_errors_of_one_pair():
    # Errors 3 and -1: the mean 1, times 1 - 1/4.
    learners = shared()
    learners.learn([transition(0, 1, 3, 5), transition(0, 1, -1, 6, number=1)], streams(2), 0.0)
    assert changed(learners) == {(0, 1): 0.75}


def test_three_errors_of_one_pair_and_one_of_another():
    # Errors by the table as it was before: 3 + 4/2 - 2 = 3, -1 + 0 - 2 = -3, 10 - 2 = 8 (ended);
    # the mean 8/3 times 1 - 1/8; both in float32. The other pair: 1 + 2/2 - 4 = -2.
    learners = shared(q_values=table(s0a1=2, s5a0=4))
    steps = [
        transition(0, 1, 3, 5),
        transition(5, 0, 1, 0, number=1),
        transition(0, 1, -1, 6, number=2),
        transition(0, 1, 10, 5, number=3, terminated=True),
    ]
    learners.learn(steps, streams(4), 0.0)
    assert [step.td_error for step in steps] == [3, -2, -3, 8]
    mean = np.float32(8 / 3)
    value = np.float32(2) + np.float32(0.875) * mean
    assert changed(learners) == {(0, 1): float(value), (5, 0): 3.0}


@pytest.mark.parametrize("n", [2, 3, 5, 8])
def test_equal_errors_go_as_far_as_so_many_updates_in_turn(n):
    # All towards one target that does not depend on the table: a terminal reward of 8.
    learners = shared()
    learners.learn(
        [transition(0, 1, 8, 5, number=k, terminated=True) for k in range(n)], streams(n), 0.0
    )
    value = 0.0
    for _ in range(n):
        value += 0.5 * (8 - value)
    assert changed(learners) == {(0, 1): value}


def test_the_order_of_the_ants_does_not_matter():
    # Three errors whose float32 sum would depend on it.
    q_values = table(s1a0=0.1, s2a0=1e4, s3a0=-1e4, s0a1=1e-3)
    ants = [transition(0, 1, 0, state, number=state) for state in (1, 2, 3)]
    results = []
    for order in itertools.permutations(ants):
        learners = shared(q_values=q_values)
        learners.learn(order, streams(3), 0.0)
        results.append(learners.tables[0].table())
    assert all((result == results[0]).all() for result in results)


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


def test_a_sum_of_more_than_64_bits_is_refused():
    assert mean_error([np.float32(2**30), np.float32(2**30 - 64)]) == np.float32(2**30)
    with pytest.raises(AssertionError, match="64 bits"):
        mean_error([np.float32(2**30), np.float32(2**30)])
    assert mean_error([np.float32(-(2**30))] * 2) == -(2**30)


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


@pytest.mark.parametrize("alpha", [1e-30, 1e-12, 0.001, 0.1, 0.3, 0.5, 0.999, 1 - 2**-24, 1.0])
def test_the_last_weight_is_that_of_all_larger_numbers(alpha):
    rate = np.float64(np.float32(alpha))
    n = np.arange(2, 100_000)
    weights = update_weights(alpha, int(n[-1]))
    assert len(weights) <= len(n) + 2
    expected = (1 - (1 - rate) ** n).astype(np.float32)
    assert np.array_equal(weights[np.minimum(n, len(weights) - 1)], expected)
    if alpha >= 0.001:
        assert len(weights) < 30 / alpha


# In the world: two ants want one cell, both by (0, forward).
MEETING = World((5, 5, 5), (0, 0, 4), ants=[((0, 0, 0), 0), ((2, 0, 0), 3)])


def test_two_ants_that_meet_update_one_pair():
    # The winner's reward is 0, the loser's -1: mean -1/2, times 3/4. All next values are 0.
    colony = begun(MEETING, sharing="shared")
    act(colony, FORWARD, FORWARD)
    assert sorted(errors_of(colony)) == [-1, 0]
    assert colony.q_values[0, FORWARD] == -0.375
    assert np.count_nonzero(colony.q_values) == 1


def test_with_own_tables_each_learns_its_own():
    colony = begun(MEETING, sharing="independent", capacity=3)
    act(colony, FORWARD, FORWARD)
    tables = colony.q_values
    assert tables.shape == (3, 128, 5)
    loser = [ant.reward for ant in colony.ants.values()].index(-1)
    assert tables[loser, 0, FORWARD] == -0.5
    assert np.count_nonzero(tables) == 1


def test_a_fixed_table_stays_as_it_is():
    q_values = table(s0a1=1)
    colony = begun(MEETING, sharing="frozen", q_values=q_values, seed=4)
    for _ in range(3):
        colony.tick()
    np.testing.assert_array_equal(colony.q_values, q_values)
    assert errors_of(colony) == [None, None]
    assert len(colony.transitions) == 2


@pytest.mark.parametrize(("learner", "n"), [("sarsa", 3), ("dyna_q", 3), ("q_learning", 3)])
def test_with_a_fixed_table_ants_draw_for_their_actions_alone(learner, n):
    colony = begun(MEETING, training(learner), sharing="frozen", seed=4)
    for _ in range(n):
        colony.tick()
    for number, ant in colony.ants.items():
        assert n_draws(ant.stream.state, stream_state(4, STREAM_ANT, number)) == n
        assert ant.chosen is None


@pytest.mark.parametrize(("learner", "then"), [("sarsa", FORWARD), ("q_learning", LEFT)])
def test_sarsa_chooses_by_the_table_before_the_update(learner, then):
    # Two ants far apart go forward over free land. Q(E E E, forward) falls from 1/4, by 3/4 of
    # 1/8 - 1/4, below Q(E E E, left) = 3/16. Sarsa has drawn forward once more by then.
    world = World((9, 9, 9), (0, 0, 8), ants=[((0, 0, 0), 0), ((0, 5, 0), 0)])
    q_values = table(s0a1=0.25, s0a0=0.1875)
    colony = begun(world, training(learner), "shared", q_values=q_values)
    act(colony, FORWARD, FORWARD)
    assert errors_of(colony) == [-0.125, -0.125]
    assert colony.q_values[0, FORWARD] == 0.15625
    drawn = then if learner == "sarsa" else None
    assert [step.next_action for step in colony.transitions] == [drawn] * 2
    colony.tick()
    assert [step.action for step in colony.transitions] == [then] * 2


def test_sarsa_after_a_delivery():
    # Absorbing: no a', no bootstrap, a fresh choice in the next tick. Continuing: a' is drawn and
    # executed, though the ant has just delivered.
    ready = World((5, 5, 5), (1, 0, 0), ants=[((0, 0, 0), 0)])
    start = stream_state(0, STREAM_ANT, 0)
    for delivery, error, draws in (("terminates", 10, 0), ("truncates", 12, 1)):
        q_values = table(s4a1=4)  # what the ant sees after it gave: E O E
        colony = begun(ready, training("sarsa"), "shared", q_values=q_values, delivery=delivery)
        load(colony, 0)
        act(colony, GIVE)
        [step] = colony.transitions
        assert step.next_state == 4
        assert step.terminated == (delivery == "terminates")
        assert step.next_action == (None if step.terminated else FORWARD)
        assert errors_of(colony) == [error]
        assert n_draws(colony.ants[0].stream.state, start) == draws
        colony.tick()
        assert colony.ants[0].action == FORWARD
        assert n_draws(colony.ants[0].stream.state, start) == 2


def entries(learners):
    return [
        (*pair, seen.reward, seen.next_state, seen.terminated)
        for pair, seen in learners.tables[0].model.items()
    ]


def test_the_model_of_all():
    learners = shared("dyna_q", learning_rate=1.0, planning_steps=1)
    # Of one pair the highest number counts (not the slot, not the place in the list), and new
    # pairs come in ascending order of 5 * state + action.
    learners.learn(
        [
            transition(9, 2, 0, 3, number=4, slot=1),
            transition(7, 3, 3, 4, number=7, slot=0),
            transition(7, 3, -1, 5, number=2, slot=5),
            transition(7, 0, 1, 6, number=9, slot=2),
        ],
        streams(4),
        0.0,
    )
    first = [(7, 0, 1, 6, False), (7, 3, 3, 4, False), (9, 2, 0, 3, False)]
    assert entries(learners) == first
    # Pairs known already keep their places; what was seen last replaces what was seen before, be
    # the ant's number as low as it may.
    learners.learn(
        [transition(9, 2, 10, 1, number=0, terminated=True), transition(1, 1, 0, 2, number=1)],
        streams(2),
        0.0,
    )
    assert entries(learners) == [*first[:2], (9, 2, 10, 1, True), (1, 1, 0, 2, False)]


def test_a_round_of_planning_by_hand():
    # Real updates: pair (0, 1), reward 8, ended, by two ants: 8 * 3/4 = 6. Then one round: both
    # draw the one visited pair, error 8 - 6 = 2, twice: 6 + 2 * 3/4 = 7.5. Another: 7.875.
    for rounds, value in ((1, 7.5), (2, 7.875)):
        learners = shared("dyna_q", planning_steps=rounds)
        ants = streams(2)
        steps = [transition(0, 1, 8, 5, number=k, terminated=True) for k in range(2)]
        learners.learn(steps, ants, 0.0)
        assert [step.td_error for step in steps] == [8, 8]  # of the real transitions alone
        assert changed(learners) == {(0, 1): value}
        assert [stream.state for stream in ants] == [rounds * GAMMA % 2**64] * 2


def test_a_round_sees_the_table_as_it_stood_at_its_start():
    # Two pairs that lead to each other's states: (0, 1) gives 8 and leads to state 1, (1, 0) gives
    # 0 and leads to state 0. Real: Q(0,1) = 4, Q(1,0) = 0. The first draw of state 0 takes the
    # second of two (0.883), that of state GAMMA the first (0.432).
    learners = shared("dyna_q", planning_steps=1)
    ants = [RandomStream(0), RandomStream(GAMMA)]
    learners.learn([transition(0, 1, 8, 1), transition(1, 0, 0, 0, number=1)], ants, 0.0)
    # (1, 0): error 0 + 4/2 - 0 = 2, so 1. (0, 1): error 8 + 0/2 - 4 = 4, so 6: Q(1, 0) was 0 still.
    assert changed(learners) == {(0, 1): 6, (1, 0): 1}


def test_own_tables_plan_each_from_its_own_model():
    learners = IndependentTables(maker("dyna_q", planning_steps=2), 3, None)
    ants = streams(2)
    learners.learn(
        [
            transition(0, 1, 8, 5, slot=0, terminated=True),
            transition(2, 2, 4, 5, slot=2, terminated=True),
        ],
        ants,
        0.0,
    )
    assert [list(learner.model) for learner in learners.tables] == [[(0, 1)], [], [(2, 2)]]
    # Three updates each: 1 - 1/8.
    assert learners.tables[0].table()[0, 1] == 7
    assert learners.tables[2].table()[2, 2] == 3.5
    assert not learners.tables[1].table().any()


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
    colony.ants[1].age = 49
    load(colony, 0)
    act(colony, GIVE, FORWARD)
    assert sorted(colony.ants) == [0, 2]
    assert len(colony.learners.tables[1].model) == 1
    load(colony, 0)
    act(colony, GIVE, PICK_UP)
    tables, learners = colony.q_values, colony.learners.tables
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


def test_tables_and_models_live_through_the_episodes_and_epsilon_decays():
    learning = training("dyna_q", epsilon=0.8, epsilon_decay=0.5, min_epsilon=0.3)
    colony = ReferenceColony(MEETING, None, learning, 5, ants=4)
    epsilons, sizes = [], []
    for _ in range(3):
        epsilons.append(colony.epsilon)
        colony.run(1, 20)
        sizes.append(len(colony.learners.tables[0].model))
    assert epsilons == [0.8, 0.4, 0.3]
    assert 0 < sizes[0] <= sizes[1] <= sizes[2]
    assert [record.ticks for record in colony.records] == [20] * 3
    # Two halves are a whole.
    again = ReferenceColony(MEETING, None, learning, 5, ants=4)
    again.run(3, 20)
    assert again.records == colony.records
    assert entries(again.learners) == entries(colony.learners)


def test_with_own_tables_an_ant_far_from_others_is_an_ant_alone():
    # Two ants shut in two rooms each run as each would alone in its world with its stream.
    rocks = [(0, y, 0) for y in range(4)] + [(0, 0, z) for z in range(1, 4)]
    world = World((4, 4, 4), (1, 0, 0), obstacles=rocks, ants=[((2, 0, 0), 0), ((0, 3, 3), 0)])
    alone = World((4, 4, 4), (1, 0, 0), obstacles=rocks, ants=[((2, 0, 0), 0)])
    learning = training("sarsa", epsilon=0.5)
    runs = []
    for place, n in ((world, 2), (alone, 1)):
        colony = ReferenceColony(place, None, learning, 8, ants=n, sharing="independent")
        colony.run(2, 60)
        runs.append(colony)
    np.testing.assert_array_equal(runs[0].q_values[0], runs[1].q_values[0])
    assert runs[0].ants[0] == runs[1].ants[0]


def test_a_table_for_each_slot_may_be_given():
    each = np.arange(2 * 640, dtype=np.float32).reshape(2, 128, 5)
    colony = ReferenceColony(
        MEETING, None, training(), 0, ants=2, sharing="independent", q_values=each
    )
    np.testing.assert_array_equal(colony.q_values, each)


@pytest.mark.parametrize(
    ("sharing", "learner", "message"),
    [
        ("common", "q_learning", "'common'.*shared, independent, frozen"),
        ("independent", "sarsi", "'sarsi'"),
    ],
)
def test_unknown_names_are_refused(sharing, learner, message):
    with pytest.raises(AntsError, match=message):
        ReferenceColony(MEETING, None, training(learner), 0, ants=2, sharing=sharing)


@pytest.mark.parametrize("learner", [name for name in LEARNERS if not LEARNERS[name].shares])
def test_learners_with_a_memory_of_their_own_cannot_share_a_table(learner):
    with pytest.raises(AntsError, match=f"'{learner}'.*independent"):
        begun(MEETING, training(learner), "shared")
    colony = begun(MEETING, training(learner), "independent")
    for _ in range(3):
        colony.tick()
    assert colony.q_values.shape == (2, 128, 5)


def test_learners_of_a_td_error_share_a_table():
    sharing = [name for name in LEARNERS if LEARNERS[name].shares]
    assert sharing == ["q_learning", "sarsa", "expected_sarsa", "dyna_q"]


def test_more_ants_than_cells_are_refused():
    with pytest.raises(AntsError, match="n is 61"):
        ReferenceColony(MEETING, None, training(), 0, ants=61)
    assert len(begun(MEETING, ants=60).ants) == 60


def test_failed_deeds_count_once_and_only_moves_can_be_blocked():
    colony = begun(MEETING)
    act(colony, LEFT, PICK_UP)
    act(colony, GIVE, PICK_UP)
    assert (colony.record.moves, colony.record.blocked) == (1, 0)
    assert colony.record.episode_return == -3
