"""The conflict rule of the colony, in drawn micro-worlds: both outcomes, worked by hand."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_ants import Colony, World
from taichi_ants.grid.randomness import GAMMA, mix
from taichi_ants.task import Life, Pheromone, Task
from taichi_ants.task.constants import EMPTY, FORWARD, GIVE, PICK_UP


def begun(world: World, ants: int, life: Life = Life()) -> Colony:  # noqa: B008
    """A colony in its first episode whose ants do what they are given."""
    colony = Colony(world, Task(life=life), None, ants=ants, sharing="frozen")
    colony.begin_episode()
    return colony


def act(world: World, actions: list[int], life: Life = Life()) -> Colony:  # noqa: B008
    """One tick in which the listed ants do these actions."""
    colony = begun(world, len(actions), life)
    colony.act(np.array([actions]))
    return colony


def ants(colony: Colony) -> list[tuple[tuple[int, ...], int, int, int]]:
    """Cell, heading, carries and reward of each ant."""
    cells = colony.grid.cells(colony.cells[0]).tolist()
    rewards = colony.arrays["rewards"][colony.events[0]]
    rows = (colony.headings[0], colony.carrying[0], rewards)
    return [(tuple(cell), *map(int, row)) for cell, *row in zip(cells, *rows, strict=True)]


def key(world: World, cell: tuple[int, int, int], tick: int = 0) -> int:
    """The conflict key, written once more from its definition."""
    inner = int(mix((int(world.grid.index(cell)) + GAMMA) % 2**64))
    return int(mix(((inner ^ tick) + GAMMA) % 2**64))


@pytest.mark.parametrize("row", range(6))
def test_of_two_ants_that_want_one_cell_one_wins(row):
    """Both face (3, row, 0), from (2, row, 0) and from (4, row, 0); the loser is blocked."""
    cells = [(2, row, 0), (4, row, 0)]
    world = World((8, 8, 1), (0, 7, 0), ants=[(cells[0], 0), (cells[1], 3)])
    first, second = ants(act(world, [FORWARD, FORWARD]))
    if key(world, cells[0]) < key(world, cells[1]):
        assert first == (tuple(normal((3, row, 0))), 0, 0, 0)
        assert second == (tuple(normal(cells[1])), 3, 0, -1)
    else:
        assert first == (tuple(normal(cells[0])), 0, 0, -1)
        assert second == (tuple(normal((3, row, 0))), 3, 0, 0)


def test_one_food_goes_to_one_of_two_ants():
    """The winner turns round with the food; the loser gets -1 and stays as it is."""
    cells = [(2, 2, 0), (4, 2, 0)]
    world = World((8, 8, 1), (0, 7, 0), foods=[(3, 2, 0)], ants=[(cells[0], 0), (cells[1], 3)])
    colony = act(world, [PICK_UP, PICK_UP])
    first, second = ants(colony)
    winner, loser = (
        (first, second) if key(world, cells[0]) < key(world, cells[1]) else (second, first)
    )
    assert (winner[1], winner[2], winner[3]) == (3 if winner is first else 0, 1, 3)
    assert (loser[1], loser[2], loser[3]) == (0 if loser is first else 3, 0, -1)
    assert colony.snapshot().ground[world.grid.index((3, 2, 0))] == EMPTY


def test_six_ants_around_the_queen_all_give_in_one_tick():
    queen = np.array([3, 3, 0])
    steps = [(1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), (1, 0, 1)]
    around = [(tuple((queen + step).tolist()), (h + 3) % 6) for h, step in enumerate(steps)]
    world = World((8, 8, 1), tuple(queen.tolist()), ants=around)
    colony = begun(world, 6)
    colony.arrays["carries"][:] = 1
    colony.arrays["paper_state"][:] = 64 | 3 << 2  # the queen ahead
    colony.act(np.full((1, 6), GIVE))
    assert [ant[2:] for ant in ants(colony)] == [(0, 10)] * 6
    assert [ant[1] for ant in ants(colony)] == [(h + 3) % 6 for h in range(6)]
    assert colony.outcome().deliveries[0, 0] == 6


def test_a_steep_deposit_after_long_carrying_leaves_nothing():
    """Slope times ticks does not fit into 32 bits."""
    world = World((8, 8, 1), (0, 7, 0), ants=[((2, 2, 0), 0)])
    task = Task(pheromone=Pheromone(deposit="fading", level=250, slope=100))
    colony = Colony(world, task, None, ants=1, sharing="frozen")
    colony.begin_episode()
    colony.arrays["carries"][:] = 1
    colony.arrays["carried"][:] = 30_000_000
    colony.arrays["paper_state"][:] = 64  # with food, and three empty cells ahead
    colony.act(np.array([[FORWARD]]))
    assert ants(colony)[0][0] == (3, 2, 0)
    assert not colony.snapshot().trail.any()


def normal(cell: tuple[int, int, int]) -> list[int]:
    return [c - min(cell) for c in cell]
