"""Of the 128 indices of states exactly 100 can be met, as the paper counts (section 1.5)."""

import itertools

from hypothesis import given, settings
from hypothesis import strategies as st

from taichi_ants.reference.ants import Ant
from taichi_ants.reference.geometry import existing_cells
from taichi_ants.reference.observations import observe
from taichi_ants.reference.world_state import WorldState
from taichi_ants.task import Task
from taichi_ants.task.constants import EMPTY
from taichi_ants.task.states import REACHABLE_STATES
from taichi_ants.worlds.world import World

E, O, CUE, GOAL = range(4)  # noqa: E741


def reachable_states() -> set[int]:
    views = set(itertools.product((E, O, CUE, GOAL), repeat=3))
    without_food = {(0, *view) for view in views}
    lures_both_sides = {(CUE, middle, CUE) for middle in (E, O, CUE)}
    no_queen = {view for view in views if GOAL not in view} - lures_both_sides
    one_queen = {view for view in views if view.count(GOAL) == 1 and CUE not in view}
    assert (len(without_food), len(no_queen), len(one_queen)) == (64, 24, 12)
    with_food = {(1, *view) for view in no_queen | one_queen}
    return {
        64 * carries + 16 * left + 4 * forward + right
        for carries, left, forward, right in without_food | with_food
    }


REACHABLE = reachable_states()


@st.composite
def worlds(draw) -> World:
    ranges = draw(st.tuples(*[st.integers(2, 5)] * 3))
    order = draw(st.permutations(existing_cells(ranges)))
    queen, *rest = order
    n_foods = draw(st.integers(0, len(rest) // 2))
    n_obstacles = draw(st.integers(0, len(rest) // 2 - 1))
    foods, obstacles = rest[:n_foods], rest[n_foods : n_foods + n_obstacles]
    free = rest[n_foods + n_obstacles :]
    levels = draw(st.lists(st.integers(0, 30), min_size=len(free), max_size=len(free)))
    ant = (free[0], draw(st.integers(0, 5)))
    return World(ranges, queen, foods, obstacles, list(zip(free, levels, strict=True)), [ant])


def states_everywhere(world: World) -> set[int]:
    """What ants see from each free cell in each heading, with and without food."""
    state = WorldState(world, Task())
    free = [cell for cell in existing_cells(world.ranges) if state.content(cell) == EMPTY]
    places = itertools.product(free, range(6), (False, True))
    return {observe(state, Ant(*place)) for place in places}


@given(worlds())
@settings(max_examples=60, deadline=None)
def test_no_other_state_is_seen_anywhere(world):
    assert states_everywhere(world) <= REACHABLE


def test_all_hundred_can_be_seen():
    assert set(REACHABLE_STATES) == REACHABLE
    assert len(REACHABLE) == 100
    seen: set[int] = set()
    # The ant stands in the middle and looks to heading 1, at these three cells.
    ahead = ((1, 0, 0), (1, 1, 0), (0, 1, 0))
    queens = [*ahead, *(c for c in existing_cells((4, 4, 4)) if c not in (*ahead, (0, 0, 0)))]
    for queen, contents in itertools.product(queens, itertools.product("eotf", repeat=3)):
        held = {cell: what for cell, what in zip(ahead, contents, strict=True) if cell != queen}
        world = World(
            (4, 4, 4),
            queen,
            foods=[cell for cell, what in held.items() if what == "f"],
            obstacles=[cell for cell, what in held.items() if what == "o"],
            trails=[(cell, 9) for cell, what in held.items() if what == "t"],
        )
        state = WorldState(world, Task())
        seen |= {observe(state, Ant((0, 0, 0), 1, carries)) for carries in (False, True)}
    assert seen == REACHABLE
