"""Training by the reference, in an episode of two steps worked out by hand.

    M   food, (1, 1, 0), ahead: heading 1
    A   the ant, at the origin
    Q   queen, (0, 0, 1), behind: heading 4

Step 0: the ant sees E F E, state 12. Picking up pays 3 and turns it round, to heading 4. It then
sees E Q E with food, state 64 + 12 = 76: the cells beside the queen are at distance 1, as the ant.
Step 1: giving pays 10. The ant then sees E O E without food, state 4; the trail lies on A and M,
out of view.

The tables below make these two actions the only best ones: with epsilon 0 the episode is certain.
Learning rate and discount are 1/2, so that all values are exact.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from colonies import GAMMA, training
from plain_runs import train, train_with_tables

from taichi_ants.errors import AntsError
from taichi_ants.reference import LEARNERS
from taichi_ants.task import Task
from taichi_ants.task.constants import GIVE, PICK_UP
from taichi_ants.task.events import Event
from taichi_ants.worlds.world import World

TWO_STEPS = World((3, 3, 3), (0, 0, 1), foods=[(1, 1, 0)], ants=[((0, 0, 0), 1)])


def prepared(learning, task=None, rng_state=0):
    """A run to start from: Q(12, pick up) = 1, Q(76, give) = 2, Q(4, forward) = 4."""
    q_values = np.zeros((128, 5), np.float32)
    q_values[12, PICK_UP], q_values[76, GIVE], q_values[4, 1] = 1, 2, 4
    run = train(TWO_STEPS, learning, 0, 0, 600, task)
    run.colony.learners.tables[0] = LEARNERS[learning.learner](learning, 128, q_values)
    run.colony.streams[0].state = rng_state
    return run


def train_once(learning, delivery="terminates", max_steps=600, rng_state=0):
    task = Task(delivery=delivery)
    begun = prepared(learning, task, rng_state)
    return train(TWO_STEPS, learning, 0, 1, max_steps, task, start_from=begun)


def outcomes_of(run):
    return [
        (pair, (seen.reward, seen.next_state, seen.terminated)) for pair, seen in run.model.items()
    ]


def draws(run):
    """How many draws the run made from state 0: each adds GAMMA."""
    return next(n for n in range(100) if n * GAMMA % 2**64 == run.rng_state)


def test_the_record_of_the_episode():
    run = train_once(training())
    assert (run.returns, run.steps, run.deliveries) == ([13], [2], [1])
    first, second = run.trace
    assert (first.cell, first.heading, first.state) == ((0, 0, 0), 1, 12)
    assert (first.action, first.reward, first.event) == (PICK_UP, 3, Event.PICKED_UP)
    assert (first.next_state, first.terminated, first.truncated) == (76, False, False)
    assert (second.cell, second.heading, second.state) == ((0, 0, 0), 4, 76)
    assert (second.action, second.reward, second.event) == (GIVE, 10, Event.DELIVERED)
    assert (second.next_state, second.terminated, second.truncated) == (4, True, False)
    assert [(step.episode, step.step) for step in run.trace] == [(0, 0), (0, 1)]


# All learners see the same errors here: a' is the best action, and epsilon is 0.
#   Step 0: 3 + 0.5 * 2 - 1 = 3.
#   Step 1, terminates: 10 - 2 = 8; truncates: 10 + 0.5 * 4 - 2 = 10.
@pytest.mark.parametrize(("delivery", "last"), [("terminates", 8.0), ("truncates", 10.0)])
@pytest.mark.parametrize("learner", LEARNERS)
def test_td_errors_by_delivery_setting(learner, delivery, last):
    run = train_once(training(learner), delivery)
    assert [step.td_error for step in run.trace] == [3.0, last]
    assert [step.terminated for step in run.trace] == [False, delivery == "terminates"]
    assert run.deliveries == [1]


@pytest.mark.parametrize(("delivery", "given"), [("terminates", 6.0), ("truncates", 7.0)])
@pytest.mark.parametrize("learner", ["q_learning", "sarsa", "expected_sarsa"])
def test_the_table_moves_by_the_learning_rate(learner, delivery, given):
    run = train_once(training(learner), delivery)
    expected = prepared(training()).colony.learners.tables[0].table()
    expected[12, PICK_UP] = 1 + 0.5 * 3
    expected[76, GIVE] = given  # 2 + 0.5 * 8 and 2 + 0.5 * 10
    np.testing.assert_array_equal(run.q_values, expected)
    assert run.q_values.dtype == np.float32
    assert run.model == {}


@pytest.mark.parametrize("delivery", ["terminates", "truncates"])
@pytest.mark.parametrize("learner", LEARNERS)
def test_truncation_bootstraps(learner, delivery):
    run = train_once(training(learner), delivery, max_steps=1)
    [step] = run.trace
    assert (step.truncated, step.terminated) == (True, False)
    assert step.td_error == 3.0  # as without the limit
    assert (run.returns, run.steps, run.deliveries) == ([3], [1], [0])


def test_a_delivery_in_the_last_step_is_no_truncation():
    last = train_once(training(), max_steps=2).trace[-1]
    assert (last.event, last.terminated, last.truncated) == (Event.DELIVERED, True, False)


@pytest.mark.parametrize(
    ("learner", "delivery", "max_steps", "expected"),
    [
        ("q_learning", "terminates", 600, 2),  # one for each choice
        ("expected_sarsa", "truncates", 600, 2),
        ("sarsa", "terminates", 600, 2),  # the second is a' of the first step, none at the end
        ("sarsa", "truncates", 600, 3),  # a' at the delivery, for the target
        ("sarsa", "terminates", 1, 2),  # a' at truncation, for the target
        ("dyna_q", "terminates", 600, 8),  # 2 choices and 2 * 3 planning steps
    ],
)
def test_how_many_draws_are_made(learner, delivery, max_steps, expected):
    run = train_once(training(learner), delivery, max_steps)
    assert draws(run) == expected


def test_planning_repeats_the_last_seen_transition():
    # Only (12, pick up) is visited; its target is 3 + 0.5 * 2 = 4. The value goes from 1 halfway to
    # 4 in the step, and three times more: 2.5, 3.25, 3.625, 3.8125.
    run = train_once(training("dyna_q"), max_steps=1)
    assert run.q_values[12, PICK_UP] == 3.8125
    assert outcomes_of(run) == [((12, PICK_UP), (3, 76, False))]


@pytest.mark.parametrize(
    ("rng_state", "pick_up", "give"),
    [
        # Step 0: 1 -> 2.5, planned towards 4: 3.25. Step 1: Q(76, give) 2 -> 6 (target 10).
        # The draw of the second planning step is the fourth: 0xF88BB8A8 (0.97) from state 0, the
        # second of two pairs, 6 -> 8; 0x1B39896A (0.11) from state GAMMA, the first pair, whose
        # target is now 3 + 0.5 * 6 = 6: 3.25 -> 4.625.
        (0, 3.25, 8.0),
        (GAMMA, 4.625, 6.0),
    ],
)
def test_planning_draws_one_of_the_visited_pairs(rng_state, pick_up, give):
    run = train_once(training("dyna_q", planning_steps=1), rng_state=rng_state)
    assert run.q_values[12, PICK_UP] == pick_up
    assert run.q_values[76, GIVE] == give
    assert outcomes_of(run) == [
        ((12, PICK_UP), (3, 76, False)),
        ((76, GIVE), (10, 4, True)),
    ]


def test_the_model_holds_the_last_outcome_in_the_order_of_first_visit():
    learning = training("dyna_q", epsilon=1.0)
    run = train(TWO_STEPS, learning, 3, 8, 40, Task(delivery="truncates"))
    outcomes, changed = {}, 0
    for step in run.trace:
        pair, outcome = (step.state, step.action), (step.reward, step.next_state, False)
        changed += outcomes.get(pair, outcome) != outcome
        outcomes[pair] = outcome
    assert outcomes_of(run) == list(outcomes.items())
    assert changed > 0  # the test would not see the difference otherwise


@pytest.mark.parametrize("delivery", ["terminates", "truncates"])
def test_sarsa_executes_the_action_it_learned_from(delivery):
    learning, task = training("sarsa", epsilon=0.7), Task(delivery=delivery)
    run, tables = train_with_tables(TWO_STEPS, learning, 1, 6, 30, task)
    followed = 0
    for table, step, after in zip(tables, run.trace[1:], run.trace[2:], strict=False):
        if step.episode == after.episode:
            target = step.reward + 0.5 * float(table[step.next_state, after.action])
            expected = target - float(table[step.state, step.action])
            assert float(step.td_error) == pytest.approx(expected, abs=1e-5)
            followed += after.action != table[step.next_state].argmax()
    assert followed > 0  # some of these actions were not the greedy ones


def test_the_table_of_each_step_leads_to_the_next():
    run, tables = train_with_tables(TWO_STEPS, training(epsilon=0.5), 1, 3, 30)
    table = np.zeros((128, 5), np.float32)
    for step, after in zip(run.trace, tables, strict=True):
        table[step.state, step.action] += np.float32(0.5) * step.td_error
        np.testing.assert_array_equal(after, table)
    np.testing.assert_array_equal(run.q_values, table)


def test_epsilon_decays_to_its_floor():
    learning = training(epsilon=0.5, epsilon_decay=0.5, min_epsilon=0.2)
    epsilons = [train(TWO_STEPS, learning, 0, n, 5).epsilon for n in range(4)]
    assert epsilons == [0.5, 0.25, 0.2, 0.2]


def test_the_floor_never_raises_epsilon():
    learning = training(epsilon=0.0, min_epsilon=0.01)
    assert [train(TWO_STEPS, learning, 0, n, 5).epsilon for n in range(2)] == [0.0, 0.0]


@pytest.mark.parametrize("learner", LEARNERS)
def test_going_on_gives_what_training_in_one_go_gives(learner):
    learning = training(learner, epsilon=0.6, epsilon_decay=0.9)
    task = Task(delivery="truncates")
    whole = train(TWO_STEPS, learning, 9, 12, 40, task)
    half = train(TWO_STEPS, learning, 9, 5, 40, task)
    table_before, model_before = half.q_values.copy(), dict(half.model)
    resumed = train(TWO_STEPS, learning, 9, 7, 40, task, start_from=half)
    for run_field in ("returns", "steps", "deliveries", "epsilon", "rng_state", "trace"):
        assert getattr(resumed, run_field) == getattr(whole, run_field)
    assert list(resumed.model.items()) == list(whole.model.items())
    np.testing.assert_array_equal(resumed.q_values, whole.q_values)
    # What was gone on from is as it was.
    np.testing.assert_array_equal(half.q_values, table_before)
    assert half.model == model_before
    assert len(half.returns) == 5


def test_a_run_depends_on_its_seed():
    learning = training(epsilon=0.6)
    runs = [train(TWO_STEPS, learning, seed, 5, 40) for seed in (0, 0, 1)]
    assert runs[0].steps == runs[1].steps
    assert runs[0].rng_state == runs[1].rng_state != runs[2].rng_state


def test_every_episode_starts_from_the_same_world():
    run = train(TWO_STEPS, training(epsilon=1.0), 2, 20, 100)
    assert sum(run.deliveries) > 1
    starts = [step for step in run.trace if step.step == 0]
    assert {(step.cell, step.heading, step.state) for step in starts} == {((0, 0, 0), 1, 12)}


def test_a_hyperparameter_of_another_learner_is_refused():
    with pytest.raises(AntsError, match=r"'planning_steps'.*'q_learning'"):
        train(TWO_STEPS, training("q_learning", planning_steps=3), 0, 1, 1)


def test_each_step_begins_where_the_last_one_ended():
    run = train(TWO_STEPS, training(epsilon=0.8), 4, 4, 30)
    for step, after in itertools.pairwise(run.trace):
        if step.event is Event.DELIVERED or step.truncated:
            assert (after.episode, after.step) == (step.episode + 1, 0)
        else:
            assert (after.episode, after.step) == (step.episode, step.step + 1)
            assert after.state == step.next_state
    for episode, (gained, length) in enumerate(zip(run.returns, run.steps, strict=True)):
        steps = [step for step in run.trace if step.episode == episode]
        assert (sum(step.reward for step in steps), len(steps)) == (gained, length)
