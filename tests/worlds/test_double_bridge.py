"""The double bridge, walked breadth first with the reference's geometry."""

from collections.abc import Iterable
from dataclasses import replace

import pytest

from taichi_ants.errors import AntsError
from taichi_ants.reference.geometry import Cell, existing_cells, listed_cells, neighbour
from taichi_ants.worlds import World
from taichi_ants.worlds.double_bridge import bridge_paths, double_bridge

LENGTHS = [(23, 36), (23, 23), (23, 43), (4, 4), (4, 5), (5, 7), (10, 13), (30, 56)]


def walkable(world: World) -> set[Cell]:
    """All cells without rocks."""
    return set(existing_cells(world.ranges)) - set(listed_cells(world.obstacles))


def steps(cells: set[Cell], start: Cell) -> dict[Cell, int]:
    """The steps from a cell to all others that can be walked to."""
    found, todo = {start: 0}, [start]
    for cell in todo:
        for heading in range(6):
            ahead = neighbour(cell, heading)
            if ahead in cells and ahead not in found:
                found[ahead] = found[cell] + 1
                todo.append(ahead)
    return found


def mirrored(cells: Iterable[Cell]) -> set[Cell]:
    """Left and right exchanged: up stays, up-right becomes up-left."""
    return {(x, z, y) for x, y, z in cells}


# With steps by which the food lies aside.
ASIDE = [*((*one, 0) for one in LENGTHS), (23, 36, 1), (23, 23, 1), (23, 40, 3), (10, 13, 4)]


@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize(("short", "long", "aside"), ASIDE)
def test_branches_are_as_long_as_asked_for(short: int, long: int, aside: int, flip: bool) -> None:
    cells = walkable(double_bridge(short, long, flip, aside))
    junctions, paths = bridge_paths(short, long, flip, aside)
    nest, food = listed_cells(junctions)
    branches = [set(listed_cells(cells)) for cells in paths]
    assert branches[0] | branches[1] < cells
    assert not branches[0] & branches[1]
    for closed, length in zip(reversed(branches), (short, long), strict=True):
        assert steps(cells - closed, nest)[food] == length
    assert food not in steps(cells - branches[0] - branches[1], nest)


@pytest.mark.parametrize(("short", "long", "aside"), ASIDE)
def test_a_mirrored_bridge_is_the_mirror_image(short: int, long: int, aside: int) -> None:
    world, mirror = (double_bridge(short, long, flip, aside) for flip in (False, True))
    assert world.ranges == mirror.ranges
    assert walkable(mirror) == mirrored(walkable(world))
    assert set(listed_cells(mirror.foods)) == mirrored(listed_cells(world.foods))
    assert mirror.queen == world.queen == (0, 0, 0)
    for name, cells in world.regions.items():
        assert set(listed_cells(mirror.regions[name])) == mirrored(listed_cells(cells))
    unnamed = [replace(one, regions={}) for one in (world, mirror)]
    assert (unnamed[0] == unnamed[1]) == (short == long and not aside)


def test_the_way_to_the_food_and_who_starts_where() -> None:
    world = double_bridge()
    assert world.reachable_foods().any()
    length = steps(walkable(world), world.queen)
    nearest = min(length[food] for food in listed_cells(world.foods))
    assert nearest == 6 + 23 + 2 + 1  # to the junction, over the bridge, into the pile
    cells, _ = world.start(3, 90)
    assert world.distances()[cells].max() == 5  # all in the nest
    assert len(world.trails) == len(world.ants) == 0


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"long": 22}, "`world.long` is 22; .* it must be between 23 and 43"),
        ({"long": 44}, "`world.long` is 44; with `short` 23"),
        ({"long": 43, "aside": 1}, "`world.long` is 43; with `short` 23 and `aside` 1"),
        ({"aside": 20}, "`world.aside` is 20; with .* it must be between 0 and 19"),
        ({"mirrored": 1}, "`world.mirrored` is 1; it must be True or False"),
    ],
)
def test_errors_name_what_is_wrong(settings: dict, message: str) -> None:
    with pytest.raises(AntsError, match=message):
        double_bridge(**settings)
