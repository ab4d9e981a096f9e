"""What is drawn over the cells of a picture, or beside them: tables of marks, one row each."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
import numpy.typing as npt

from taichi_ants.rendering import colours

DOTS_BELOW = 2.5  # pixels from the centre of a cell to its corners: ants are dots
_DARTS_BELOW = 11.0  # ants have no legs
DOT = 0.9  # pixels, the radius of an ant in cells that are too small for it
_DOT_WITH_FOOD = 0x9A3F00
_FILL = 0.83  # the radius of an ant in sizes of its cell; the largest disc in one is 0.866


class Mark(IntEnum):
    """The shapes, whose outlines are in `shapes`."""

    HEXAGON = 0
    OUTLINE = 1  # of a hexagon
    FOOD = 2
    QUEEN = 3
    ARROW = 4
    DOT = 5
    DART = 6
    DART_WITH_FOOD = 7
    ANT = 8
    ANT_WITH_FOOD = 9


_COLOURS = {Mark.FOOD: colours.CELL_FOOD, Mark.QUEEN: colours.CELL_QUEEN}
# By the letters of states: the colour of a cell, and what stands on it.
_CELLS: dict[str, tuple[int, Mark | None]] = {
    "E": (colours.CELL_EMPTY, None),
    "O": (colours.CELL_OBSTACLE, None),
    "T": (int(colours.TRAIL_RAMP[120]), None),
    "S": (colours.CELL_NEARER, None),
    "F": (colours.FLOOR_FOOD, Mark.FOOD),
    "Q": (colours.FLOOR_QUEEN, Mark.QUEEN),
}
CELL_LETTERS = "".join(_CELLS)


def marks(
    places: npt.ArrayLike,
    radius: float,
    mark: int | np.ndarray,
    colour: int | np.ndarray,
    headings: npt.ArrayLike = 0,
    opacity: float = 1.0,
) -> np.ndarray:
    """Marks at places (n, 2), float32 (n, 7), as `raster_kernels.draw_marks` reads them.

    Args:
        places: Their middles in pixels; (2,) for a single one.
        radius: Of the circle that holds them, in pixels.
        mark: Of the kind `Mark`, one for all or one for each, as what follows.
        colour: 0xRRGGBB.
        headings: Where they point, 0 to 5.
        opacity: From 0 to 1.
    """
    places = np.asarray(places, dtype=np.float32).reshape(-1, 2)
    table = np.empty((len(places), 7), dtype=np.float32)  # colours are below 2^24, so it holds them
    table[:, :2] = places
    for column, value in enumerate((radius, headings, mark, opacity, colour), start=2):
        table[:, column] = value
    return table


def thing(places: npt.ArrayLike, hexagon: float, mark: Mark) -> np.ndarray:
    """Marks of food or queens on cells of a size."""
    return marks(places, 0.72 * hexagon, mark, _COLOURS[mark])


def cell_colour(letter: str) -> int:
    """The colour of a cell by its letter in a state; letters of other observations look empty."""
    return _CELLS.get(letter[0], _CELLS["E"])[0]


def cell(letter: str, centre: npt.ArrayLike, hexagon: float) -> np.ndarray:
    """Marks of a cell as it is called in a state, with what stands on it."""
    table = marks(centre, hexagon, Mark.HEXAGON, cell_colour(letter))
    stands = _CELLS.get(letter, _CELLS["E"])[1]
    return table if stands is None else np.concatenate([table, thing(centre, hexagon, stands)])


def ants(
    places: npt.ArrayLike,
    headings: npt.ArrayLike,
    carries: np.ndarray,
    hexagon: float,
    radius: float | None = None,
    opacity: float = 1.0,
) -> np.ndarray:
    """Marks of ants (n,) as they look in cells of a size, or with another radius in pixels."""
    if hexagon < DOTS_BELOW:
        colour = np.where(carries, _DOT_WITH_FOOD, colours.ANT)
        return marks(places, max(_FILL * hexagon, DOT), Mark.DOT, colour, opacity=opacity)
    without, with_food = Mark.ANT, Mark.ANT_WITH_FOOD
    if hexagon < _DARTS_BELOW:
        without, with_food = Mark.DART, Mark.DART_WITH_FOOD
    look = np.where(carries, with_food, without)
    return marks(places, radius or _FILL * hexagon, look, colours.ANT, headings, opacity)
