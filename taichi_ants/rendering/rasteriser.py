"""Drawing of cells and ants as tables of marks, one row per mark."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from taichi_ants import runtime
from taichi_ants.features.fields import TRAIL
from taichi_ants.features.pheromone import DEPOSIT_LEVEL
from taichi_ants.grid import hexgrid
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.records import Snapshot
from taichi_ants.rendering import colours
from taichi_ants.rendering.colours import Mark
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN

# Sizes of hexagons are in pixels, from the centre to a corner.
# At this size and above, food and queen are drawings on a light background. In smaller cells, food
# is a dot with a light ring, and the queen is a filled cell.
_SMALLEST_DRAWING = 6.0
# Radius of the dot as a share of the hexagon, its minimum in pixels, width of the ring in pixels.
_CRUMB, _SMALLEST_CRUMB, _CRUMB_RING = 0.6, 1.4, 1.8
# Below this size, outlines of single cells would hide the ant: one outline encloses all of them.
_SMALLEST_OUTLINE = 7.0
_MARK = 2.7  # radius of that outline as a multiple of the hexagon
_SMALLEST_MARK = 8.0  # its minimum in pixels

_SQRT_3 = math.sqrt(3.0)
_QUEEN, _QUEEN_OUTLINE = 2.5, 7.0  # pixels, the queen's minimum radius and that of her outline
_DOTS_BELOW = 2.5  # size of a hexagon below which ants are dots
_DARTS_BELOW = 11.0  # size below which ants are darts
_DOT = 0.9  # pixels, the minimum radius of a dot
_THING = 0.72  # radius of food and queens as a share of their hexagon
_FILL = 0.83  # radius of an ant as a share of its hexagon, whose inner circle has 0.866

# Colours of cells by their letters in states.
_CELLS = {
    **{"E": colours.CELL_EMPTY, "O": colours.CELL_OBSTACLE, "T": int(colours.TRAIL_RAMP[120])},
    **{"S": colours.CELL_NEARER, "F": colours.FLOOR_FOOD, "Q": colours.FLOOR_QUEEN},
}
CELL_LETTERS = "".join(_CELLS)
# Cells with something on them: the mark, its colours and those of the cell, by number.
_THINGS = {
    "F": (Mark.FOOD, colours.FOODS, colours.FOOD_FLOORS),
    "Q": (Mark.QUEEN, colours.QUEENS, colours.QUEEN_FLOORS),
}


def marks(
    places: npt.ArrayLike,
    radius: float,
    mark: int | np.ndarray,
    colour: int | np.ndarray,
    headings: npt.ArrayLike = 0,
    opacity: float = 1.0,
    load: int | np.ndarray = colours.CELL_FOOD,
) -> np.ndarray:
    """Return a table of marks, float32 (n, 8), centred at `places` (n, 2) in pixels.

    `mark` is of type `Mark`, `radius` is the radius of the enclosing circle in pixels, and
    `headings` are directions, 0 to 5. `load` is the colour of the food that ants carry.
    """
    places = np.asarray(places, dtype=np.float32).reshape(-1, 2)
    table = np.empty((len(places), 8), dtype=np.float32)  # exact for colours, which are below 2^24
    table[:, :2] = places
    for column, value in enumerate((radius, headings, mark, opacity, colour, load), start=2):
        table[:, column] = value
    return table


def cell_colour(letter: str) -> int:
    """Return the colour of a cell by its letter in a state; unknown letters look empty."""
    return _CELLS.get(letter[0], colours.CELL_EMPTY)


def cell(letter: str, centre: npt.ArrayLike, hexagon: float, number: int = 0) -> np.ndarray:
    """Return marks of a cell by its letter in a state, with the food or queen of a number on it."""
    if letter not in _THINGS:
        return marks(centre, hexagon, Mark.HEXAGON, cell_colour(letter))
    mark, of_things, floors = _THINGS[letter]
    floor = marks(centre, hexagon, Mark.HEXAGON, floors[number])
    return np.concatenate([floor, marks(centre, _THING * hexagon, mark, of_things[number])])


def ants(
    places: npt.ArrayLike,
    headings: npt.ArrayLike,
    carries: bool | np.ndarray,
    hexagon: float,
    radius: float | None = None,
    opacity: float = 1.0,
    colour: int | np.ndarray = colours.ANT,
    load: int | np.ndarray = colours.CELL_FOOD,
) -> np.ndarray:
    """Return marks (n,) of ants. The default of `radius` suits cells of the radius `hexagon`."""
    if hexagon < _DOTS_BELOW:
        loaded = np.where(load == np.uint32(colours.CELL_FOOD), colours.FOOD_DOT, load)
        colour = np.where(carries, loaded, colour)
        return marks(places, max(_FILL * hexagon, _DOT), Mark.DOT, colour, opacity=opacity)
    without, with_food = Mark.ANT, Mark.ANT_WITH_FOOD
    if hexagon < _DARTS_BELOW:
        without, with_food = Mark.DART, Mark.DART_WITH_FOOD
    look = np.where(carries, with_food, without)
    return marks(places, radius or _FILL * hexagon, look, colour, headings, opacity, load)


def draw_marks(frame: np.ndarray, *tables: np.ndarray) -> None:
    """Draw tables of `marks` over a frame, uint8 (height, width, 3), in their order."""
    _launch("draw_marks", frame, np.concatenate(tables))


def _launch(kernel: str, *arguments: object) -> None:
    """Run a kernel after starting Taichi, which must run before kernels are imported."""
    runtime.start()
    from taichi_ants.rendering import raster_kernels

    with runtime.quiet():
        getattr(raster_kernels, kernel)(*arguments)


def _things_of(snapshot: Snapshot) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return flat indices and kinds of food items, and flat indices of queens by nest."""
    foods, kinds = np.flatnonzero(snapshot.ground == FOOD), snapshot.food_kinds
    queens = snapshot.queens if len(snapshot.queens) else np.flatnonzero(snapshot.ground == QUEEN)
    return foods, kinds[foods] if len(kinds) else 0 * foods, queens


class Rasteriser:
    """Draws worlds of one grid as pictures of one size, centred and as large as fits.

    Pixel coordinates are x to the right and y downwards; the centre of the pixel in column i and
    row j is (i + 0.5, j + 0.5).

    Args:
        grid: The grid of all worlds to draw.
        width, height, margin: The size of the pictures and the margin on each side, in pixels.
        beyond: Leave space for the cells just outside the border of the world.
        strongest: The level of the darkest colour of fields by name, by default that of a deposit;
            None fits it to each picture.

    Attributes:
        hexagon: Pixels from the centre of a cell to its corners.
    """

    def __init__(
        self,
        grid: AxialGrid,
        width: int,
        height: int,
        margin: float = 0.0,
        beyond: bool = False,
        strongest: Mapping[str, int | None] | None = None,
    ) -> None:
        self.grid, self._strongest = grid, strongest or {}
        self.width, self.height = width, height
        x_range, y_range, z_range = grid.ranges
        # The lowest and the highest (x, y), relative to cell (0, 0, 0) in hexagon sizes. In
        # `hexgrid.centre_of`, x increases with y and decreases with z; y decreases with x.
        low = np.array([-1.5 * (z_range - 1) - 1, -_SQRT_3 * (x_range - 0.5)])
        high = np.array([1.5 * (y_range - 1) + 1, _SQRT_3 * (y_range + z_range - 1) / 2])
        ring = beyond * np.array([1.5, _SQRT_3])
        low, high = low - ring, high + ring
        size = np.array([width, height])
        self.hexagon = float((np.maximum(size - 2 * margin, 1) / (high - low)).min())
        self._origin = size / 2 - self.hexagon * (low + high) / 2

    def centres(self, cells: object) -> np.ndarray:
        """Return pixel coordinates of the centres of cells (..., 3), float64 (..., 2)."""
        return hexgrid.centre_of(cells, self.hexagon) + self._origin

    def draw(self, snapshot: Snapshot, in_view: np.ndarray | None = None) -> np.ndarray:
        """Return the picture of a world with its ants, uint8 (height, width, 3).

        `in_view` are flat indices of the cells to mark, those that ant number 0 sees.
        """
        hexagon, tables = self.hexagon, []
        frame = self.draw_cells(self.cell_colours(snapshot))
        food_cells, kinds, queen_cells = _things_of(snapshot)
        foods, of_foods = self._places(food_cells), colours.FOODS[kinds]
        queens, of_queens = self._places(queen_cells), colours.QUEENS[: len(queen_cells)]
        if hexagon < _SMALLEST_DRAWING:
            # The ring distinguishes food from trails, some of which are as light as its dot.
            radius = max(_CRUMB * hexagon, _SMALLEST_CRUMB)
            tables.append(marks(foods, radius + _CRUMB_RING, Mark.DOT, colours.FLOOR_FOOD))
            tables.append(marks(foods, radius, Mark.DOT, of_foods))
            tables.append(marks(queens, max(hexagon, _QUEEN), Mark.DOT, of_queens))
        else:
            tables.append(marks(foods, _THING * hexagon, Mark.FOOD, of_foods))
            tables.append(marks(queens, _THING * hexagon, Mark.QUEEN, of_queens))
        if in_view is not None:
            places, radius = self._places(in_view), 0.98 * hexagon
            if hexagon < _SMALLEST_OUTLINE:
                places = self._places(snapshot.ant_cells[:1])
                radius = max(_MARK * hexagon, _SMALLEST_MARK)
            tables.append(marks(places, radius, Mark.OUTLINE, colours.INK))
        tables.append(self._ants(snapshot))
        if hexagon < _DOTS_BELOW:
            # The crowd around the queen hides her dot, and on top of it, the dot would hide ants.
            tables.append(marks(queens, _QUEEN_OUTLINE, Mark.OUTLINE, of_queens))
        draw_marks(frame, *tables)
        return frame

    def draw_cells(self, of_cells: np.ndarray) -> np.ndarray:
        """Return a picture of cells in these colours, uint32 (grid.size,)."""
        grid, hexagon = self.grid, self.hexagon
        frame = np.full((self.height, self.width, 3), colours.PAGE & 255, np.uint8)
        if hexagon < _DOTS_BELOW:
            layout = (*self._origin.tolist(), hexagon, grid.width, grid.height, grid.ranges[2])
            _launch("draw_small_cells", frame, of_cells, *layout)
            return frame
        # The lines between cells vanish in small cells, and are at most 3 pixels wide.
        line = min(max(0.09 * hexagon - 0.25, 0.0), 3.0)
        # The page shows through the smooth edges of neighbours, so a narrow line needs less space.
        gap = line if line > 1 else 2 * math.sqrt(line) - 1
        existing, radius = np.flatnonzero(grid.exists), hexagon - gap / _SQRT_3
        draw_marks(frame, marks(self._places(existing), radius, Mark.HEXAGON, of_cells[existing]))
        return frame

    def cell_colours(self, snapshot: Snapshot) -> np.ndarray:
        """Return the colours of all cells, uint32 (grid.size,), by content or trail level."""
        plain = np.array([colours.CELL_EMPTY, colours.CELL_OBSTACLE], np.uint32)
        of_cells = plain[(snapshot.ground == OBSTACLE).astype(np.uint8)]
        foods, kinds, queens = _things_of(snapshot)
        of_cells[foods] = colours.FOOD_FLOORS[kinds]
        small = self.hexagon < _SMALLEST_DRAWING
        of_cells[queens] = (colours.QUEENS if small else colours.QUEEN_FLOORS)[: len(queens)]
        fields = [(TRAIL, snapshot.trail), *snapshot.further_fields.items()]
        for number, (name, of_field) in reversed([*enumerate(fields, start=-1)]):
            # The trail, which comes last, covers further fields.
            ramp = colours.TRAIL_RAMP if name == TRAIL else colours.field_ramp(number)
            marked = np.flatnonzero((snapshot.ground == EMPTY) & (of_field >= 1))
            levels = of_field[marked].astype(np.float32)
            share = np.minimum(levels / np.float32(self.darkest(name, of_field)), 1)
            of_cells[marked] = ramp[(share * 255 + 0.5).astype(np.int32)]
        of_cells[~self.grid.exists] = colours.PAGE
        return of_cells

    def darkest(self, field: str, levels: np.ndarray) -> int:
        """Return the level of the darkest colour of a field.

        A level that fits is 1, 2 or 5 times a power of 10, so it changes rarely in an animation;
        at most 5 % of the visible levels are above it.
        """
        fixed = self._strongest.get(field, DEPOSIT_LEVEL)
        if fixed is not None:
            return fixed
        seen = levels[levels >= 1]
        most = float(np.quantile(seen, 0.95)) if len(seen) else 1.0
        power = 10 ** math.floor(math.log10(most))
        return next(factor * power for factor in (1, 2, 5, 10) if factor * power >= most)

    def _places(self, cells: np.ndarray) -> np.ndarray:
        """Pixel coordinates (n, 2) of flat indices (n,)."""
        return self.centres(self.grid.cells(cells))

    def _ants(self, snapshot: Snapshot) -> np.ndarray:
        hexagon, opacity = self.hexagon, 1.0
        places = self._places(snapshot.ant_cells)
        if hexagon < _DOTS_BELOW:
            # Crowded dots would hide the world, so their opacity decreases with their total area.
            world = self.grid.count * 1.5 * _SQRT_3 * hexagon**2
            covered = len(places) * math.pi * _DOT**2 / world
            opacity = min(1.0, 0.5 * max(covered, 1e-9) ** -0.6)
        look: dict[str, Any] = {}
        if len(snapshot.ant_nests):
            look["colour"] = colours.ANTS[snapshot.ant_nests]
        if len(snapshot.ant_foods):
            look["load"] = colours.FOODS[np.maximum(snapshot.ant_foods, 0)]
        poses = snapshot.ant_headings, snapshot.ant_carries
        return ants(places, *poses, hexagon, opacity=opacity, **look)
