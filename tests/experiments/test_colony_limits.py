"""What no colony can exceed: worked by hand, searched plainly, and reached."""

import itertools
import math

import numpy as np
import pytest
from colonies import act, begun, cells_of, load
from colony_limits import least_mean_cycle, limits_of
from hypothesis import given, settings
from hypothesis import strategies as st
from random_worlds import random_world

from taichi_ants import worlds
from taichi_ants.task import Task, foraging, queueing
from taichi_ants.task.constants import FORWARD, GIVE, LEFT, PICK_UP, RIGHT
from taichi_ants.worlds import World

STEPS = [(1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), (1, 0, 1)]


def test_the_papers_world() -> None:
    limits = limits_of(worlds.paper(), Task())
    # There and back are 16 moves each, the food is picked up, and given.
    assert limits.cycle == 36
    # The queen stands in a corner, with three neighbours that serve once in three ticks.
    assert limits.queen == 1000
    assert limits.deliveries(1) == pytest.approx(1000 / 36)
    assert limits.deliveries(10) == pytest.approx(10_000 / 36)
    assert limits.deliveries(64) == 1000


def corridor(length: int) -> World:
    """A queen and a food at the ends of a corridor one cell wide."""
    return World((length, 1, 1), (0, 0, 0), [(length - 1, 0, 0)], ants=[((1, 0, 0), 0)])


def test_a_corridor_by_hand() -> None:
    limits = limits_of(corridor(3), Task())
    # Beside both: pick up (which turns it round), give, turn by a sixth against the wall.
    assert limits.cycle == 3
    assert limits.queen == 1000 / 3
    assert limits.deliveries(5) == pytest.approx(1000 / 3)
    long = limits_of(corridor(7), Task())
    # Four moves each way and a pick-up, which turns it round, and a give, which does not: two more
    # blocked moves until the way back comes into view at its side.
    assert long.cycle == 4 + 1 + 4 + 1 + 2


def test_three_ticks_a_cycle_are_reached() -> None:
    """The ant between queen and food takes and gives once in three ticks, in the reference."""
    colony = begun(World((3, 1, 1), (0, 0, 0), [(2, 0, 0)], ants=[((1, 0, 0), 1)]), regrowth=0)
    act(colony, PICK_UP)  # the food is to its left; it now faces down-left, the queen to its left
    for turn in (RIGHT, LEFT) * 3:
        act(colony, GIVE)
        act(colony, turn)
        act(colony, PICK_UP)
    assert colony.record.deliveries == 6


def test_with_right_of_way_a_neighbour_cell_serves_once_in_two_ticks() -> None:
    """Ants with food push the one that has just given; the reference does it."""
    assert limits_of(worlds.paper(), foraging()).queen == 1500
    world = World((4, 1, 1), (0, 0, 0), [(3, 0, 0)], ants=[((1, 0, 0), 3), ((2, 0, 0), 3)])
    colony = begun(world, traffic="right_of_way")
    load(colony, 0, 1)
    act(colony, GIVE, FORWARD)  # the second is blocked by one with food
    act(colony, FORWARD, FORWARD)
    assert cells_of(colony) == [(2, 0, 0), (1, 0, 0)]
    act(colony, FORWARD, GIVE)
    assert colony.record.deliveries == 2


def plain_deliveries(world: World, ticks: int, task: Task) -> list[int]:
    """The most deliveries within 0 .. `ticks` ticks from any state without food, searched."""
    foods = set(map(tuple, world.foods.tolist()))
    rocks = set(map(tuple, world.obstacles.tolist()))
    cells = [c for c in itertools.product(*map(range, world.ranges)) if min(c) == 0]
    free = {*cells} - foods - rocks - {world.queen}

    def beside(cell: tuple, heading: int) -> tuple:
        moved = [a + b for a, b in zip(cell, STEPS[heading % 6], strict=True)]
        return tuple(value - min(moved) for value in moved)

    after: dict[tuple, list[tuple[tuple, int]]] = {}
    for cell, heading, carries in itertools.product(free, range(6), (False, True)):
        view = [beside(cell, heading + turn) for turn in (-1, 0, 1)]
        options = []
        for turn, target in zip((-1, 0, 1), view, strict=True):
            lands = target if target in free else cell
            options += [((place, (heading + turn) % 6, carries), 0) for place in (lands, cell)]
        if not carries and task.traffic.swap:
            around = [beside(cell, towards) for towards in range(6)]
            turned = itertools.product(free.intersection(around), (-1, 0, 1))
            options += [((place, (heading + turn) % 6, False), 0) for place, turn in turned]
        if carries and world.queen in view:
            options.append(((cell, (heading + 3 * task.turns_at_queen) % 6, False), 1))
        if not carries and foods & set(view):
            options.append(((cell, (heading + 3) % 6, True), 0))
        after[cell, heading, carries] = options
    best = dict.fromkeys(after, 0)
    most = [0]
    for _ in range(ticks):
        best = {
            state: max(best[then] + gain for then, gain in options)
            for state, options in after.items()
        }
        most.append(max(best[state] for state in best if not state[2]))
    return most


@given(st.integers(0, 10_000), st.sampled_from([Task(), foraging(), queueing()]))
@settings(max_examples=15)
def test_the_cycle_is_what_a_plain_search_delivers_in_the_long_run(seed: int, task: Task) -> None:
    world = random_world(seed, largest_range=4)
    most = plain_deliveries(world, 240, task)
    cycle = limits_of(world, task).cycle
    if math.isinf(cycle):
        assert most[-1] <= 1  # none, or the one of an ant that cannot come back for a second
    else:
        assert most[240] - most[120] == pytest.approx(120 / cycle, abs=1)


@given(st.integers(0, 10_000), st.integers(1, 5))
@settings(max_examples=60)
def test_the_least_mean_cycle_is_that_of_all_simple_cycles(seed: int, n: int) -> None:
    random = np.random.default_rng(seed)
    lengths = random.integers(1, 30, (n, n)).astype(float)
    lengths[random.random((n, n)) < 0.4] = np.inf
    means = [
        np.mean([lengths[a, b] for a, b in zip(cycle, (*cycle[1:], cycle[0]), strict=True)])
        for k in range(1, n + 1)
        for cycle in itertools.permutations(range(n), k)
    ]
    assert least_mean_cycle(lengths) == pytest.approx(min(means))
