"""Starts and rollouts of the reference."""

from __future__ import annotations

import numpy as np
import pytest
from plain_runs import rollout, train

from taichi_ants.errors import AntsError
from taichi_ants.grid.constants import STREAM_START_CELL, STREAM_START_HEADING
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.reference.ants import starts
from taichi_ants.reference.geometry import distance, normal_form
from taichi_ants.reference.random_stream import stream_state
from taichi_ants.task import Task
from taichi_ants.task.constants import FORWARD, GIVE, PICK_UP
from taichi_ants.worlds.world import World

PAPER = World(
    (10, 10, 10),
    (0, 9, 9),
    foods=[(9, 0, 0)],
    trails=[((i, 0, 0), 25) for i in range(-8, 9)],
    ants=[((0, 8, 8), 0)],
)


def followers_policy():
    """The policy that walks the paper's trail to the food, and back.

    Away from the queen the ant sees E T E (8) until the food is ahead, E F E (12); turned round it
    sees E S E with food (64 + 8) until the queen is ahead, E Q E (64 + 12).
    """
    q_values = np.zeros((128, 5), np.float32)
    for state, action in ((8, FORWARD), (12, PICK_UP), (72, FORWARD), (76, GIVE)):
        q_values[state, action] = 1
    return q_values


@pytest.mark.parametrize("evaporation", [True, False])
def test_along_the_papers_trail(evaporation):
    # 16 moves from (0, 8, 8) to (8, 0, 0) at +1, +3, 16 moves back at +1, +10.
    task = Task(evaporation_in_evaluation=evaporation)
    played = rollout(PAPER, followers_policy(), task=task)
    assert (played.returns, played.steps, played.deliveries) == ([45], [34], [1])
    assert [step.cell for step in played.trace[:17]] == [normal_form(i, 0, 0) for i in range(-8, 9)]
    assert [step.cell for step in played.trace[17:]] == [
        normal_form(i, 0, 0) for i in range(8, -9, -1)
    ]
    assert [step.state for step in played.trace] == [8] * 16 + [12] + [72] * 16 + [76]
    assert [step.step for step in played.trace] == list(range(34))


def test_the_step_limit_truncates_a_rollout():
    played = rollout(PAPER, followers_policy(), max_steps=33)
    assert (played.returns, played.steps, played.deliveries) == ([35], [33], [0])
    assert played.trace[-1].truncated
    assert not any(step.truncated for step in played.trace[:-1])
    assert rollout(PAPER, followers_policy(), max_steps=34).deliveries == [1]


@pytest.mark.parametrize(("evaporation", "then"), [(True, 0), (False, 8)])
def test_the_first_observation_sees_the_trail_undiminished(evaporation, then):
    # A trail of level 1 ahead, E T E (8). Giving without food leaves all as it is, but a tick
    # passes: with evaporation the trail is gone, E E E (0).
    world = World((5, 5, 5), (0, 0, 4), trails=[((1, 1, 0), 1)], ants=[((0, 0, 0), 1)])
    q_values = np.zeros((128, 5), np.float32)
    q_values[8, GIVE] = 1
    task = Task(evaporation_in_evaluation=evaporation)
    [step] = rollout(world, q_values, max_steps=1, task=task).trace
    assert (step.state, step.next_state) == (8, then)


@pytest.mark.parametrize("evaporation", [True, False])
def test_training_can_evaporate_too(evaporation):
    world = World((5, 5, 5), (0, 0, 4), trails=[((1, 1, 0), 1)], ants=[((0, 0, 0), 1)])
    config = TrainingConfig("q_learning", 0.1, 0.9, 1.0, 1.0)
    task = Task(evaporation_in_training=evaporation)
    # A seed whose first action leaves the ant where it is: pick up or give.
    for seed in range(100):
        [step] = train(world, config, seed, 1, 1, task).trace
        if step.action in (PICK_UP, GIVE):
            assert (step.state, step.next_state) == (8, 0 if evaporation else 8)
            return
    pytest.fail("no seed chose such an action")


def test_rollouts_have_streams_of_their_own():
    undecided = np.zeros((128, 5), np.float32)
    played = [rollout(PAPER, undecided, 0, number, 50) for number in (0, 0, 1)]
    actions = [[step.action for step in one.trace] for one in played]
    assert actions[0] == actions[1] != actions[2]
    other_seed = rollout(PAPER, undecided, 1, 0, 50)
    assert [step.action for step in other_seed.trace] != actions[0]


def test_a_rollout_with_epsilon_one_ignores_the_table():
    walked = rollout(PAPER, followers_policy(), max_steps=50, epsilon=1.0)
    wandered = rollout(PAPER, np.zeros((128, 5)), max_steps=50, epsilon=1.0)
    assert walked.trace == wandered.trace


def test_listed_ants_start_first():
    listed = [((0, 8, 8), 0), ((0, 1, 1), 4)]
    world = World((10, 10, 10), (0, 9, 9), ants=listed)
    assert starts(world, 0) == listed[:1]
    assert starts(world, 0, 2) == listed
    placed = starts(world, 0, 4)
    assert placed[:2] == listed
    assert all(distance(cell, (0, 9, 9)) == 1 for cell, _ in placed[2:])


def test_the_others_start_on_the_free_cells_nearest_to_the_queen():
    # Around the queen in the middle lie six cells: food, an obstacle, a listed ant, three free.
    world = World(
        (4, 4, 4),
        (0, 0, 0),
        foods=[(1, 0, 0)],
        obstacles=[(1, 1, 0)],
        ants=[((0, 1, 0), 2)],
    )
    for seed in range(20):
        cells = [cell for cell, _ in starts(world, seed, 5)]
        assert cells[0] == (0, 1, 0)
        assert set(cells[1:4]) == {(0, 1, 1), (0, 0, 1), (1, 0, 1)}
        assert distance(cells[4], (0, 0, 0)) == 2


def test_ties_and_headings_are_up_to_the_seed():
    world = World((4, 4, 4), (0, 0, 0))
    seeds = range(200)
    firsts = [starts(world, seed)[0] for seed in seeds]
    assert {cell for cell, _ in firsts} == {cell for cell, _ in starts(world, 0, 6)}
    assert {heading for _, heading in firsts} == set(range(6))
    assert firsts == [starts(world, seed)[0] for seed in seeds]
    # More ants do not move those that are there already.
    assert starts(world, 7, 20)[:5] == starts(world, 7, 5)


def test_the_order_of_ties_and_the_headings_come_from_named_streams():
    # Ranges (2, 2, 2), the queen in the middle: all other cells are at distance 1. In lexicographic
    # order the seven cells are (0,0,0), (0,0,1), (0,1,0), (0,1,1), (1,0,0), (1,0,1), (1,1,0).
    world = World((2, 2, 2), (0, 0, 0), ants=[((0, 1, 0), 3)])
    free = {1: (0, 0, 1), 3: (0, 1, 1), 4: (1, 0, 0), 5: (1, 0, 1), 6: (1, 1, 0)}
    for seed in (0, 12345):
        order = sorted(free, key=lambda number: stream_state(seed, STREAM_START_CELL, number))
        words = [stream_state(seed, STREAM_START_HEADING, ant) >> 32 for ant in range(6)]
        headings = [word * 6 >> 32 for word in words]
        # The ant that is listed is ant 0, so the first one placed is ant 1.
        expected = list(zip([free[number] for number in order], headings[1:], strict=True))
        assert starts(world, seed, 6)[1:] == expected


def test_too_few_free_cells_are_refused():
    # Ranges (2, 2, 2) have 7 cells: queen, obstacle, 5 free.
    world = World((2, 2, 2), (0, 0, 0), obstacles=[(1, 0, 0)])
    assert len(starts(world, 0, 5)) == 5
    with pytest.raises(AntsError, match=r"n is 6; .* 5 free cells"):
        starts(world, 0, 6)


def test_an_ant_that_is_not_listed_is_placed_for_every_episode():
    world = World((4, 4, 4), (0, 0, 0), foods=[(3, 0, 0)])
    config = TrainingConfig("q_learning", 0.1, 0.9, 1.0, 1.0)
    run = train(world, config, 5, 3, 10)
    firsts = {(step.cell, step.heading) for step in run.trace if step.step == 0}
    assert firsts == set(starts(world, 5))
