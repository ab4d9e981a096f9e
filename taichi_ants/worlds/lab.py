"""The worlds of the lab, the page in `docs/lab.html`: hexagons with rocks and piles of food.

A world in `lab.json` has shapes, or numbers of rocks and piles that are drawn at random. A shape is
(what, q, r, square, heading, n): discs in a row, the first one at (q, r), and n more along the
heading. A disc has the cells (a, b) around its middle with `a * a - a * b + b * b <= square`. The
page paints the same shapes (`lab/page/worlds.js`), so there are only whole numbers.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.worlds.world import World

DATA: dict[str, Any] = json.loads(Path(__file__).with_suffix(".json").read_text("utf-8"))
WORLDS: list[dict[str, Any]] = DATA["worlds"]
STEPS = ((1, 0), (1, 1), (0, 1), (-1, 0), (-1, -1), (0, -1))  # (q, r) by heading
_EMPTY, _SCENT, _ROCK, _FOOD = 0, 2, 5, 7  # what a shape can be
_WORD = 0xFFFFFFFF


def lab_world(number: int, seed: int = 0) -> World:
    """Return a world of the lab by its number in `WORLDS`; the seed draws the daily one."""
    lab = WORLDS[number]
    radius, queen = lab["radius"], lab["queen"]
    grid = AxialGrid((radius, radius, radius))
    r, q = (one - radius for one in np.divmod(np.arange(grid.size), grid.width))
    ground = np.where(grid.exists & lab.get("walled", False), _ROCK, _EMPTY)
    scent = np.zeros_like(ground)
    shapes = lab["shapes"] or _drawn(lab, seed if lab.get("daily") else 0)
    for what, x, y, square, *row in (*shapes, (_EMPTY, *queen, DATA["home"])):
        heading, n = row or (0, 0)
        for k in range(n + 1):
            a, b = q - x - k * STEPS[heading][0], r - y - k * STEPS[heading][1]
            painted = grid.exists & (a * a - a * b + b * b <= square)
            (scent if what == _SCENT else ground)[painted] = what
    foods, rocks, trail = map(np.flatnonzero, (ground == _FOOD, ground == _ROCK, scent == _SCENT))
    return World(
        grid.ranges,
        (*queen, 0),
        grid.cells(foods),
        grid.cells(rocks),
        [(cell, DATA["trail"]) for cell in grid.cells(trail).tolist()],
    )


def distance(q: int, r: int) -> int:
    """Return the number of steps between two cells that are (q, r) apart."""
    return max(q, r, 0) - min(q, r, 0)


def _drawn(lab: dict[str, Any], seed: int) -> Iterator[tuple[int, ...]]:
    words = (_word(seed, number) for number in count())
    radius, queen = lab["radius"], lab["queen"]

    def place(nearest: int) -> tuple[int, int]:
        while True:
            q, r = (next(words) % (2 * radius) - radius for _ in "qr")
            inside = distance(q, r) < radius - DATA["fromEdge"]
            if inside and distance(q - queen[0], r - queen[1]) >= nearest:
                return q, r

    for _ in range(lab["rocks"]):
        yield _ROCK, *place(DATA["fromHome"]), next(words) % lab["largest"]
    for _ in range(lab["piles"]):
        yield _FOOD, *place(lab["nearest"]), DATA["pile"]


def _word(seed: int, number: int) -> int:
    word = ((seed ^ 0x9E3779B9) * 0x85EBCA6B ^ (number + 0x7F4A7C15) * 0xC2B2AE35) & _WORD
    word = (word ^ word >> 15) * 0x2C1B3C6D & _WORD
    word = (word ^ word >> 12) * 0x297A2D39 & _WORD
    return word ^ word >> 15
