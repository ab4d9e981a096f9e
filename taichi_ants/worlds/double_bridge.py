"""The double bridge: a nest and food at the ends of a bridge with two branches.

The experiment of Goss, Aron, Deneubourg and Pasteels (Naturwissenschaften 76, 1989) on hexagons.
The queen, the junction at the nest, the junction at the food and the middle of the food lie on one
line, along heading 0. A branch leads away from this line, along it, and back to it: between
junctions that are D steps apart, k steps to the side, D - k ahead and k to the other side are D + k
steps. So the branches differ in k alone, and both turn off by one heading at a junction. The food
and its junction can lie aside of that line, away from the short branch; lengths and turns stay.

Corridors are two cells wide, so that ants that meet can pass. The second lane lies around the
first, so that no way over it is shorter.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np

from taichi_ants.errors import AntsError
from taichi_ants.grid.hexgrid import AxialGrid, normal_form
from taichi_ants.settings import Is, checked
from taichi_ants.worlds.world import World

ROOM_RADIUS = 5  # of the rooms around queen and food: room for 90 ants beside the queen
PILE_RADIUS = 3  # of the food: 37 cells
MIN_STEPS, MAX_STEPS = 4, 1000  # of the short branch
_NEST_JUNCTION = ROOM_RADIUS + 1  # its x coordinate; the queen is at the origin
_BULGE = 3  # steps of the short branch to the side, if the long one leaves the choice


Short = Annotated[
    int, Is("length of the short branch", unit="steps", least=MIN_STEPS, most=MAX_STEPS)
]
Long = Annotated[
    int, Is("length of the long branch", unit="steps", least=MIN_STEPS, most=2 * MAX_STEPS)
]
Mirrored = Annotated[bool, Is("put the short branch to the left of ants that leave the nest")]
Aside = Annotated[
    int,
    Is("shift of the food to the side of the long branch", unit="steps"),
    Is(least=0, most=MAX_STEPS - MIN_STEPS),
]


@checked
def double_bridge(
    short: Short = 23, long: Long = 36, mirrored: Mirrored = False, aside: Aside = 0
) -> World:
    """A short and a long branch between nest and food, walled by rocks.

    The queen is at the origin, in the middle of a room; the food is a pile in the middle of another
    one. No trail, no listed ants. Lengths are steps from junction to junction; `long` is at most 2
    * short - 3 - aside. With `aside` 0 the first cells of both branches are as far from the queen
    as the food's junction; with more, that of the short branch is nearer to her, that of the long
    one is not.
    """
    grid = AxialGrid(bridge_ranges(short, long, mirrored, aside))
    queen = (0, 0, 0)
    pile, corridors = _walked(short, long, mirrored, aside)
    to_pile = grid.distances(pile)
    walled = np.minimum(grid.distances(queen), to_pile) > ROOM_RADIUS
    walled[grid.index(corridors)] = False
    return World(
        grid.ranges,
        queen,
        foods=grid.cells(np.flatnonzero(grid.exists & (to_pile <= PILE_RADIUS))),
        obstacles=grid.cells(np.flatnonzero(grid.exists & walled)),
    )


@checked
def bridge_ranges(
    short: Short = 23, long: Long = 36, mirrored: Mirrored = False, aside: Aside = 0
) -> tuple[int, int, int]:
    """Return the ranges of the world, before it is built; arguments and errors as the world's."""
    pile, corridors = _walked(short, long, mirrored, aside)
    # A cell of rock around all that can be walked. A bridge and its mirror image have equal ranges.
    x, *others = (np.maximum(corridors.max(axis=0), np.array(pile) + ROOM_RADIUS) + 2).tolist()
    return x, max(others), max(others)


def _walked(
    short: int, long: int, mirrored: bool, aside: int
) -> tuple[tuple[int, int, int], np.ndarray]:
    """The middle of the pile, and the cells (n, 3) of branches and junctions."""
    junctions = junction_cells(short, long, mirrored, aside)
    corridors = np.concatenate([*branch_cells(short, long, mirrored, aside), junctions])
    x, y, z = (junctions[1] + junctions[0]).tolist()
    return (x, y, z), corridors


@checked
def junction_cells(
    short: Short = 23, long: Long = 36, mirrored: Mirrored = False, aside: Aside = 0
) -> np.ndarray:
    """The junction at the nest and the one at the food, int64 (2, 3); arguments as the world's."""
    ahead = _ahead(short, long, aside)
    cells = np.array([(_NEST_JUNCTION, 0, 0), (_NEST_JUNCTION + ahead, -aside, 0)])
    return _placed(cells, mirrored)


@checked
def branch_cells(
    short: Short = 23, long: Long = 36, mirrored: Mirrored = False, aside: Aside = 0
) -> tuple[np.ndarray, np.ndarray]:
    """The cells of the short and of the long branch, int64 (n, 3) each, junctions left out."""
    ahead = _ahead(short, long, aside)
    right = _corridor(short - ahead - aside, ahead, -aside)
    left = _corridor(long - ahead, ahead + aside, aside)
    return _placed(right, mirrored), _placed(left, not mirrored)


def _ahead(short: int, long: int, aside: int) -> int:
    """Steps ahead from junction to junction, on the way of the short branch."""
    if aside > short - MIN_STEPS:
        raise AntsError(
            f"`world.aside` is {aside}; with `short` {short} it must be at most "
            f"{short - MIN_STEPS}."
        )
    most = 2 * short - 3 - aside
    if not short <= long <= most:
        raise AntsError(
            f"`world.long` is {long}; with `short` {short} and `aside` {aside} it must be between "
            f"{short} and {most} (2 * short - 3 - aside)."
        )
    # A branch that went as far to the side as ahead would have a corner that can be cut.
    return max(short - _BULGE - aside, (long - aside) // 2 + 1)


def _corridor(side: int, ahead: int, shift: int) -> np.ndarray:
    """The two lanes of a branch that leads `side` steps to the right and `ahead` ahead."""
    cells = []
    for outer in (0, 1):
        start, end = _NEST_JUNCTION - outer, _NEST_JUNCTION + ahead + outer
        widest = side + outer
        cells += [(start + y, y, 0) for y in range(1, widest)]
        cells += [(x, widest, 0) for x in range(start + widest, end + 1)]
        cells += [(end, y, 0) for y in range(widest - 1, shift, -1)]
    return np.array(cells)


def _placed(cells: np.ndarray, mirrored: bool) -> np.ndarray:
    """Cells in their normal form; in the mirror, y and z change places."""
    cells = normal_form(cells)
    return cells[:, [0, 2, 1]] if mirrored else cells
