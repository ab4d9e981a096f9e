"""The double bridge: a nest and food at the ends of a bridge with two branches.

This is the experiment of Goss, Aron, Deneubourg and Pasteels (Naturwissenschaften 76, 1989) on
hexagons. The queen, the junction at the nest, the junction at the food and the middle of the food
are on a line along heading 0. A branch leads away from this line, along it, and back to it. Between
junctions D steps apart, it takes k steps to the side, D - k ahead and k back, D + k in total. So
the branches differ only in k, and both turn off by one heading at a junction. The food and its
junction can be shifted away from the short branch, without a change of lengths and turns.

Corridors are two cells wide, so that ants can pass each other. The second lane goes around the
first, so that it offers no shorter path.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np

from taichi_ants.errors import AntsError
from taichi_ants.grid.hexgrid import AxialGrid, normal_form
from taichi_ants.settings import Setting, checked
from taichi_ants.worlds.world import World

ROOM_RADIUS = 5  # radius of the rooms around queen and food, with space for 90 ants and the queen
PILE_RADIUS = 3  # radius of the pile of food, which has 37 cells
MIN_STEPS, MAX_STEPS = 4, 500  # bounds of the length of the short branch
_NEST_JUNCTION = ROOM_RADIUS + 1  # x coordinate; the queen is at the origin
_BULGE = 3  # preferred number of steps of the short branch to the side


Short = Annotated[
    int, Setting("length of the short branch", unit="steps", least=MIN_STEPS, most=MAX_STEPS)
]
Long = Annotated[
    int, Setting("length of the long branch", unit="steps", least=MIN_STEPS, most=2 * MAX_STEPS)
]
Mirrored = Annotated[bool, Setting("put the short branch to the left of ants that leave the nest")]
Aside = Annotated[
    int,
    Setting("shift of the food to the side of the long branch", unit="steps"),
    Setting(least=0, most=MAX_STEPS - MIN_STEPS),
]


@checked
def double_bridge(
    short: Short = 23, long: Long = 36, mirrored: Mirrored = False, aside: Aside = 0
) -> World:
    """Return a world with a short and a long branch between nest and food, enclosed by rocks.

    The queen is at the origin, in the middle of a room. The food is a pile in the middle of another
    room. The branches without the junctions are the regions "short" and "long". There are no trails
    and no listed ants. Lengths are steps from junction to junction;
    `long` is at most 2 * short - 3 - aside. With `aside` 0, the first cells of both branches at the
    food's junction are as far from the queen as the junction. With larger values, the first cell of
    the short branch is nearer to her, and that of the long branch is not.

    >>> bridge = worlds.double_bridge(short=12, long=20)
    >>> len(bridge.region("long")) > len(bridge.region("short"))
    True
    """
    junctions, branches = bridge_paths(short, long, mirrored, aside)
    corridors = np.concatenate([*branches, junctions])
    x, y, z = pile = (junctions[0] + junctions[1]).tolist()
    # One cell of rock surrounds the paths. A bridge and its mirror image have equal ranges.
    most_x, *others = (np.maximum(corridors.max(axis=0), np.array(pile) + ROOM_RADIUS) + 2).tolist()
    grid = AxialGrid((most_x, max(others), max(others)))
    queen, to_pile = (0, 0, 0), grid.distances((x, y, z))
    walled = np.minimum(grid.distances(queen), to_pile) > ROOM_RADIUS
    walled[grid.index(corridors)] = False
    return World(
        grid.ranges,
        queen,
        foods=grid.cells(np.flatnonzero(grid.exists & (to_pile <= PILE_RADIUS))),
        obstacles=grid.cells(np.flatnonzero(grid.exists & walled)),
        regions=dict(zip(("short", "long"), branches, strict=True)),
    )


@checked
def bridge_paths(
    short: Short = 23, long: Long = 36, mirrored: Mirrored = False, aside: Aside = 0
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Return the junctions at the nest and at the food, int64 (2, 3), and the branches.

    These are the cells of the short and the long branch without junctions, int64 (n, 3) each.
    """
    for name, value, least, most, form in (
        ("aside", aside, 0, short - MIN_STEPS, f"short - {MIN_STEPS}"),
        ("long", long, short, 2 * short - 3 - aside, "2 * short - 3 - aside"),
    ):
        if not least <= value <= most:
            raise AntsError(
                f"`world.{name}` is {value}; with `short` {short} and `aside` {aside} it must be "
                f"between {least} and {most} ({form})."
            )
    # The steps ahead, D - k, of the short branch from junction to junction. A branch with as many
    # steps to the side as ahead would have a shortcut at its corner.
    ahead = max(short - _BULGE - aside, (long - aside) // 2 + 1)
    right = _corridor(short - ahead - aside, ahead, -aside)
    left = _corridor(long - ahead, ahead + aside, aside)
    junctions = np.array([(_NEST_JUNCTION, 0, 0), (_NEST_JUNCTION + ahead, -aside, 0)])
    branches = _placed(right, mirrored), _placed(left, not mirrored)
    return _placed(junctions, mirrored), branches


def _corridor(side: int, ahead: int, shift: int) -> np.ndarray:
    """Return the two lanes of a branch with `side` steps to the right and `ahead` ahead."""
    cells = []
    for outer in (0, 1):
        start, end = _NEST_JUNCTION - outer, _NEST_JUNCTION + ahead + outer
        widest = side + outer
        cells += [(start + y, y, 0) for y in range(1, widest)]
        cells += [(x, widest, 0) for x in range(start + widest, end + 1)]
        cells += [(end, y, 0) for y in range(widest - 1, shift, -1)]
    return np.array(cells)


def _placed(cells: np.ndarray, mirrored: bool) -> np.ndarray:
    cells = normal_form(cells)
    return cells[:, [0, 2, 1]] if mirrored else cells
