"""What a world computes, against plain walks over its cells."""

import numpy as np
from hexagons import neighbours
from hypothesis import given
from hypothesis import strategies as st

from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.task.constants import EMPTY
from taichi_ants.worlds import World


@st.composite
def crowded_worlds(draw: st.DrawFn) -> World:
    """Worlds in which rocks and foods block many ways."""
    ranges = draw(st.tuples(*[st.integers(1, 6)] * 3))
    grid = AxialGrid(ranges)
    cells = grid.cells(np.flatnonzero(grid.exists)).tolist()
    kinds = draw(st.lists(st.sampled_from("..##F"), min_size=len(cells), max_size=len(cells)))
    kinds[draw(st.integers(0, len(cells) - 1))] = "Q"
    listed = {kind: [c for c, k in zip(cells, kinds, strict=True) if k == kind] for kind in "#FQ"}
    return World(ranges, listed["Q"][0], foods=listed["F"], obstacles=listed["#"])


@given(crowded_worlds())
def test_foods_are_reachable_where_a_walk_leads(world: World) -> None:
    ground = world.ground()

    def beside(cell: tuple) -> list[tuple]:
        around = [tuple(n) for n in neighbours(cell).tolist()]
        return [n for n in around if (np.array(n) < world.ranges).all()]

    def empty(cell: tuple) -> bool:
        return ground[world.grid.index(cell)] == EMPTY

    reached: set[tuple] = set()
    frontier = [cell for cell in beside(world.queen) if empty(cell)]
    while frontier:
        cell = frontier.pop()
        if cell not in reached:
            reached.add(cell)
            frontier += [other for other in beside(cell) if empty(other)]
    expected = [not reached.isdisjoint(beside(tuple(food))) for food in world.foods.tolist()]
    assert world.reachable_foods().tolist() == expected
