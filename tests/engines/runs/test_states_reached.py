"""The kernels meet the 100 reachable states and no other.

Micro-worlds are built from the letters of each state; which cells are nearer to the queen is worked
out here, without the package's geometry.
"""

from __future__ import annotations

import itertools

import numpy as np
from random_worlds import random_world

from taichi_ants import Task, TrainingConfig, rollout, trace_training, train
from taichi_ants.task.constants import N_STATES, PICK_UP
from taichi_ants.task.states import REACHABLE_STATES, state_name
from taichi_ants.worlds import World

Cell = tuple[int, int, int]

STEPS = ((1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), (1, 0, 1))
RANGES = (6, 6, 6)
CENTRE = (1, 2, 0)
CELLS = [cell for cell in itertools.product(range(6), repeat=3) if min(cell) == 0]
PICKS_UP = np.zeros((N_STATES, 5))
PICKS_UP[:, PICK_UP] = 1

CARRYING = [index for index in REACHABLE_STATES if index >= 64]


def normal(cell: Cell) -> Cell:
    return tuple(part - min(cell) for part in cell)


def beside(cell: Cell, heading: int) -> Cell:
    return normal(tuple(a + b for a, b in zip(cell, STEPS[heading % 6], strict=True)))


def distance(one: Cell, other: Cell) -> int:
    return max(normal(tuple(a - b for a, b in zip(one, other, strict=True))))


def letters_of(state: int) -> str:
    """The three letters of a state's name: left, forward, right."""
    return "".join(state_name(state).split()[1:])


def view_from_centre(heading: int) -> list[Cell]:
    return [beside(CENTRE, heading + turn) for turn in (-1, 0, 1)]


def queens(state: int, heading: int) -> list[Cell]:
    """Where the queen can be, for an ant in the centre with this heading to see this state."""
    letters = letters_of(state)
    looks = dict(zip(view_from_centre(heading), letters, strict=True))
    taken = {CENTRE, beside(CENTRE, heading + 3)}
    return [
        queen
        for queen in CELLS
        if queen not in taken
        and (queen in looks) == ("Q" in letters)
        and (state < 64 or all(fits_queen(looks[cell], cell, queen) for cell in looks))
    ]


def micro_world(state: int, heading: int, queen: Cell) -> World:
    """A world in which an ant in the centre with this heading sees this state.

    An ant without food starts there. One with food starts with its back to the view and food before
    it; it picks that up and turns round.
    """
    carries = state >= 64
    looks = dict(zip(view_from_centre(heading), letters_of(state), strict=True))
    picked_up = [beside(CENTRE, heading + 3)] if carries else []
    return World(
        RANGES,
        queen,
        foods=[cell for cell in looks if looks[cell] == "F"] + picked_up,
        obstacles=[cell for cell in looks if looks[cell] == "O"],
        trails=[(cell, 9) for cell in looks if looks[cell] == "T"],
        ants=[(CENTRE, (heading + 3) % 6 if carries else heading)],
    )


def fits_queen(letter: str, cell: Cell, queen: Cell) -> bool:
    """Whether an ant with food in the centre sees this letter on a cell, for this queen."""
    if letter == "O":
        return cell != queen
    if letter == "Q":
        return cell == queen
    return cell != queen and (distance(cell, queen) < distance(CENTRE, queen)) == (letter == "S")


def seen(world: World, carries: bool) -> int:
    """The state that the kernel observes first, or after its pick-up."""
    trace = rollout(world, PICKS_UP, max_steps=1)
    if not carries:
        return trace.states[0]
    assert trace.rewards[0] == 3
    return trace.next_states[0]


def test_there_are_a_hundred():
    assert len(set(REACHABLE_STATES)) == 100
    assert len(CARRYING) == 36


def test_micro_worlds_reach_every_state():
    for number, state in enumerate(REACHABLE_STATES):
        for heading in range(6):
            places = queens(state, heading)
            assert places, f"no world shows {state_name(state)}"
            world = micro_world(state, heading, places[(7 * number + heading) % len(places)])
            assert seen(world, state >= 64) == state, state_name(state)


def test_random_worlds_show_no_other_state():
    """Random walks and learning ants, in all kinds of worlds."""
    met: set[int] = set()
    for number in range(60):
        config = TrainingConfig("sarsa", 0.5, 0.9, 1.0 if number % 2 else 0.3, 1.0)
        world = random_world(number + 3000, 6)
        task = Task(evaporation_in_training=number % 3 == 0)
        trace = trace_training(world, config, number, 3, 40, task)
        met |= {*trace.states.tolist(), *trace.next_states.tolist()}
    assert met <= set(REACHABLE_STATES)
    assert len(met) > 90


def test_training_touches_no_other_row():
    """Long runs of all learners: the action values of other states stay as they were."""
    configs = [
        TrainingConfig("q_learning", 0.3, 0.9, 1.0, 1.0),
        TrainingConfig("expected_sarsa", 0.3, 0.9, 0.5, 0.99),
        TrainingConfig("dyna_q", 0.3, 0.9, 1.0, 1.0, planning_steps=2),
    ]
    others = sorted(set(range(N_STATES)) - set(REACHABLE_STATES))
    touched = np.zeros(N_STATES, bool)
    for number in range(16):
        world = random_world(number + 5000, 8)
        task = Task(evaporation_in_training=number % 2 == 0)
        result = train(world, configs, range(6), 15, 80, task)
        touched |= result.q_values.any(axis=(0, 1, 3))
    assert not touched[others].any()
    assert touched.sum() > 95
