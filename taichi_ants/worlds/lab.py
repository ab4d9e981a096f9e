"""The worlds of the lab, the page in `docs/lab.html`: hexagons with rocks and piles of food.

A world is a list of shapes, which are painted in order: discs, repeated along a heading. The page
makes the same worlds from the same lists (`lab/page/worlds.js`), so there are only whole numbers.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from typing import NamedTuple

import numpy as np

from taichi_ants.errors import checked_whole
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.worlds.world import World

EMPTY, SCENT, ROCK, FOOD = 0, 2, 5, 7  # what a shape paints
STEPS = ((1, 0), (1, 1), (0, 1), (-1, 0), (-1, -1), (0, -1))  # (q, r) by heading
HOME = 14  # square of the radius around the queen that is empty
TRAIL = 25  # level of scent in worlds that start with some
PILE = 12  # square of the radius of a pile that is drawn
FROM_HOME, FROM_EDGE = 8, 4  # distances of the middles of shapes that are drawn
_WORD = 0xFFFFFFFF


class Shape(NamedTuple):
    """Discs in a row: the first at (q, r), and n more along a heading.

    A disc has the cells (a, b) around its middle with a * a - a * b + b * b <= `square`.
    """

    paints: int
    q: int
    r: int
    square: int
    heading: int = 0
    n: int = 0


class LabWorld(NamedTuple):
    """A world: its radius and queen, and shapes; or numbers of rocks and piles to draw."""

    name: str
    radius: int
    queen: tuple[int, int]
    shapes: tuple[tuple[int, ...], ...] = ()
    walled: bool = False  # whether all is rock before the shapes are painted
    rocks: int = 0
    largest: int = 0  # rocks have squares below this
    piles: int = 0
    nearest: int = 0  # distance of a pile from the queen
    daily: bool = False  # whether the seed of the ants also draws the world


_MEADOW_ROCKS = (
    *((6, -12, 9), (9, -9, 13), (11, -5, 6), (23, 4, 9), (23, 7, 6), (12, -1, 5), (-9, 3, 13)),
    *((-10, 6, 9), (-14, -1, 6), (2, 19, 12), (1, 21, 8), (-28, -16, 9), (-28, -13, 5)),
    *((-20, 8, 9), (-17, 11, 4), (-4, -25, 7), (-7, -25, 3), (27, 15, 6), (26, 17, 3)),
    *((16, 28, 4),),
)
_BRIDGE = (
    *((EMPTY, -17, 0, 27), (EMPTY, -12, 0, 1, 0, 2), (EMPTY, 10, 0, 1, 0, 2), (EMPTY, 17, 0, 27)),
    *((EMPTY, -10, 0, 1, 1, 3), (EMPTY, -7, 3, 1, 0, 17), (EMPTY, 10, 3, 1, 5, 3)),
    *((EMPTY, -10, 0, 1, 5, 9), (EMPTY, -10, -9, 1, 0, 11), (EMPTY, 1, -9, 1, 1, 9)),
    (FOOD, 17, 0, 9),
)
WORLDS = (
    LabWorld(
        *("meadow", 32, (-15, -18)),
        shapes=(*((ROCK, *rock) for rock in _MEADOW_ROCKS), (FOOD, 17, 19, 13)),
    ),
    LabWorld("plain", 64, (0, 0), rocks=90, largest=24, piles=9, nearest=14),
    LabWorld("steppe", 130, (0, 0), rocks=260, largest=40, piles=24, nearest=14),
    LabWorld("bridge", 24, (-17, 0), shapes=_BRIDGE, walled=True),
    LabWorld("paper", 10, (-9, 0), shapes=((SCENT, -8, 0, 0, 0, 16), (FOOD, 9, 0, 0))),
    LabWorld("daily", 30, (-13, -15), rocks=40, largest=16, piles=2, nearest=28, daily=True),
)


def lab_world(number: int, seed: int = 0) -> World:
    """Return a world of the lab by its number; only the daily one depends on the seed.

    Raises:
        AntsError: There is no such world.
    """
    checked_whole("the number of the world", number, 0, len(WORLDS) - 1)
    lab = WORLDS[number]
    grid = AxialGrid((lab.radius,) * 3)
    r, q = (each - lab.radius for each in np.divmod(np.arange(grid.size), grid.width))
    ground = np.where(grid.exists & lab.walled, ROCK, EMPTY)
    scent = np.zeros(grid.size, bool)
    shapes = [Shape(*shape) for shape in lab.shapes] or list(_drawn(lab, seed))
    for shape in (*shapes, Shape(EMPTY, *lab.queen, HOME)):
        for k in range(shape.n + 1):
            a = q - shape.q - k * STEPS[shape.heading][0]
            b = r - shape.r - k * STEPS[shape.heading][1]
            painted = grid.exists & (a * a - a * b + b * b <= shape.square)
            if shape.paints == SCENT:
                scent |= painted
            else:
                ground[painted] = shape.paints
    foods, rocks, trail = (np.flatnonzero(w) for w in (ground == FOOD, ground == ROCK, scent))
    queen = (lab.queen[1] + lab.radius) * grid.width + lab.queen[0] + lab.radius
    return World(
        grid.ranges,
        grid.cells(queen).tolist(),
        grid.cells(foods),
        grid.cells(rocks),
        [(cell, TRAIL) for cell in grid.cells(trail).tolist()],
    )


def _drawn(lab: LabWorld, seed: int) -> Iterator[Shape]:
    """Yield rocks, a path to the first pile, and piles, at random places."""
    words = (_word(seed if lab.daily else 0, number) for number in count())

    def place(nearest: int) -> tuple[int, int]:
        while True:
            q, r = (next(words) % (2 * lab.radius) - lab.radius for _ in "qr")
            far = _length(q - lab.queen[0], r - lab.queen[1])
            if _length(q, r) < lab.radius - FROM_EDGE and far >= nearest:
                return q, r

    for _ in range(lab.rocks):
        yield Shape(ROCK, *place(FROM_HOME), next(words) % lab.largest)
    for pile in range(lab.piles):
        q, r = place(lab.nearest)
        if pile == 0:
            yield from _path(lab.queen, (q, r))
        yield Shape(FOOD, q, r, PILE)


def _path(start: tuple[int, int], end: tuple[int, int]) -> Iterator[Shape]:
    """Yield a shortest path, at most three straight rows of empty cells."""
    (q, r), (dq, dr) = start, (b - a for a, b in zip(start, end, strict=True))
    both = max(min(dq, dr), 0) + min(max(dq, dr), 0)  # steps along heading 1, which change both
    for heading, n in ((1, both), (0, dq - both), (2, dr - both)):
        yield Shape(EMPTY, q, r, 0, heading if n >= 0 else heading + 3, abs(n))
        q, r = q + n * STEPS[heading][0], r + n * STEPS[heading][1]


def _length(q: int, r: int) -> int:
    """Return the length of a shortest path of (q, r)."""
    return max(q, r, 0) - min(q, r, 0)


def _word(seed: int, number: int) -> int:
    """Return a random word of 32 bits."""
    word = (seed ^ 0x9E3779B9) * 0x85EBCA6B ^ (number + 0x7F4A7C15) * 0xC2B2AE35
    word = ((word & _WORD) ^ (word & _WORD) >> 15) * 0x2C1B3C6D & _WORD
    word = (word ^ word >> 12) * 0x297A2D39 & _WORD
    return word ^ word >> 15
