"""Maps of random worlds, and the smallest world that holds random cells."""

import itertools

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from taichi_ants.grid.hexgrid import AxialGrid, cube
from taichi_ants.worlds import World, from_text, to_text
from taichi_ants.worlds.text_map import smallest_world

coordinates = st.integers(-5, 5)
axial_cells = st.lists(st.tuples(coordinates, coordinates), min_size=1, max_size=8)


@st.composite
def drawable_worlds(draw: st.DrawFn) -> World:
    """Worlds with trails of one level, none of them under the queen or food."""
    ranges = draw(st.tuples(*[st.integers(1, 6)] * 3))
    grid = AxialGrid(ranges)
    cells = draw(st.permutations(grid.cells(np.flatnonzero(grid.exists)).tolist()))
    kinds = draw(st.lists(st.sampled_from(".#Ft0a"), min_size=len(cells), max_size=len(cells)))
    kinds[0] = "Q"
    level = draw(st.integers(1, 10**9))

    def are(characters: str) -> list[list[int]]:
        return [cell for cell, kind in zip(cells, kinds, strict=True) if kind in characters]

    return World(
        ranges,
        cells[0],
        foods=are("F"),
        obstacles=are("#"),
        trails=[(cell, level) for cell in are("ta")],
        ants=[(cell, draw(st.integers(0, 5))) for cell in are("0a")],
        regions=draw(
            st.dictionaries(
                st.sampled_from(["a", "region", "of_2"]),
                st.lists(st.sampled_from(cells), min_size=1),
            )
        ),
    )


@given(drawable_worlds())
def test_reading_undoes_drawing(world: World) -> None:
    drawn = to_text(world)
    again = from_text(drawn)
    assert to_text(again) == drawn
    assert sorted(again.ants.tolist()) == sorted(world.ants.tolist())
    contents = (world.foods, world.obstacles, world.trails)
    assert again == World(world.ranges, world.queen, *contents, again.ants, regions=world.regions)


@given(axial_cells)
def test_no_world_that_holds_the_cells_is_smaller(cells: list[tuple[int, int]]) -> None:
    axials = np.array(cells)
    ranges, origin = smallest_world(axials)
    assert (cube(axials - origin) < ranges).all()
    # Origins beyond the bounding box are tried as well; for each, the ranges follow.
    low, high = axials.min(axis=0) - 4, axials.max(axis=0) + 4
    origins = itertools.product(*(range(a, b + 1) for a, b in zip(low, high, strict=True)))
    smallest = min(
        AxialGrid(tuple((cube(axials - other).max(axis=0) + 1).tolist())).count for other in origins
    )
    assert AxialGrid(ranges).count == smallest
