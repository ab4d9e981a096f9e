"""Draws the cells and the ants of a world."""

from __future__ import annotations

import math
from types import ModuleType

import numpy as np
import numpy.typing as npt

from taichi_ants import runtime
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.rendering import colours
from taichi_ants.rendering.snapshot import Snapshot
from taichi_ants.rendering.viewport import Viewport
from taichi_ants.task.constants import DEPOSIT_LEVEL, EMPTY, FOOD, OBSTACLE, QUEEN

# Hexagons of fewer pixels are drawn by the mean of what a pixel covers.
_SMALLEST_HEXAGON = 2.5
# From this size on, food and queen are drawings on a light floor, below the whole cell is coloured.
_SMALLEST_DRAWING = 6.0
_SMALLEST_ANT = 11.0  # with legs; below, an ant is a dart
_SMALLEST_LETTERS = 10.0
# Below, the outlines of three cells would bury the ant: one stands around it and what it sees.
_SMALLEST_OUTLINE = 7.0
_MARK = 2.7  # its radius in sizes of the hexagon, and in pixels at least
_SMALLEST_MARK = 8.0

_FILL = 0.83  # radius of what stands on a cell, in sizes of the hexagon; the largest disc is 0.866
_DOT_RADIUS = 0.9  # pixels, of an ant in cells that are too small for it
_QUEEN_RADIUS, _QUEEN_RING = 2.5, 6.5  # pixels
_DOT_WITH_FOOD = 0x9A3F00
_FREE_SHARE = 0.3  # of the world, which dots may cover at full strength
_SQRT_3 = math.sqrt(3.0)


class Rasteriser:
    """Draws worlds of one grid as pictures of one size.

    What depends on these alone, which cells a pixel shows and by how much, is found once.

    Args:
        grid: The grid of all worlds to draw.
        viewport: The size, and where the cells lie.
        full_level: The trail level that has the last colour of the ramp, as stronger ones have.
        shown: bool (grid.size,), cells to draw, all others are page; None draws all that exist.
        ants_like: Draw ants as in hexagons of this size, in pixels, for a legend; None takes that
            of the viewport.
    """

    def __init__(
        self,
        grid: AxialGrid,
        viewport: Viewport,
        full_level: float = DEPOSIT_LEVEL,
        shown: np.ndarray | None = None,
        ants_like: float | None = None,
    ) -> None:
        self.grid = grid
        self.viewport = viewport
        self._full_level = np.float32(full_level)
        self._ants_like = viewport.hexagon if ants_like is None else ants_like
        self._shown = grid.exists if shown is None else shown
        self._map = self._map_pixels() if self.has_hexagons else None

    @property
    def kernels(self) -> ModuleType:
        """The kernels, with Taichi started: it has to be configured before it is imported."""
        runtime.start()
        from taichi_ants.rendering import raster_kernels

        return raster_kernels

    @property
    def has_hexagons(self) -> bool:
        """Whether cells are large enough to be drawn one by one."""
        return self.viewport.hexagon >= _SMALLEST_HEXAGON

    @property
    def has_room_for_letters(self) -> bool:
        """Whether a letter in a cell could be read."""
        return self.viewport.hexagon >= _SMALLEST_LETTERS

    def draw(self, snapshot: Snapshot, in_view: np.ndarray | None = None) -> np.ndarray:
        """The picture of a world with its ants, uint8 (height, width, 3).

        Args:
            snapshot: The world, of this grid.
            in_view: Flat indices of the cells that ant number 0 sees, to be marked.
        """
        frame = self.draw_cells(self._colour_cells(snapshot))
        layers = [*self._things(snapshot), *self._view(snapshot, in_view), self._ants(snapshot)]
        if not self.has_hexagons:
            # Dots overlap. A dot of hers over the ants would hide those beside her, one under them
            # may be hidden by a crowd: they lie over it, and a ring around it over them.
            queens = np.flatnonzero(snapshot.ground == QUEEN)
            ring = {"fill": 0.0, "least": _QUEEN_RING}
            layers.append(self.shapes(queens, self.kernels.RING, colours.CELL_QUEEN, **ring))
        self.kernels.draw_shapes(frame, np.concatenate(layers))
        return frame

    def colour_of(self, cells: np.ndarray) -> np.ndarray:
        """The colours, uint32 (...), in which `draw` has just drawn cells (flat indices (...))."""
        return self._colours[cells]

    def draw_cells(self, of_cells: np.ndarray) -> np.ndarray:
        """The picture of the cells in the given colours, uint32 (grid.size,)."""
        frame = np.empty((self.viewport.height, self.viewport.width, 3), dtype=np.uint8)
        if self._map is not None:
            self.kernels.draw_cells(frame.reshape(-1), *self._map, of_cells, self.viewport.width)
        else:
            self.kernels.draw_small_cells(frame, of_cells, *self._layout())
        return frame

    def shapes(
        self,
        cells: np.ndarray,
        shape: int | np.ndarray,
        colour: int,
        headings: npt.ArrayLike = 0,
        fill: float = _FILL,
        least: float = 0.0,
    ) -> np.ndarray:
        """A table of shapes on cells (flat indices (n,)), float32 (n, 7), see `raster_kernels`.

        Their radius is `fill` sizes of a hexagon, and at least so many pixels.
        """
        table = np.empty((len(cells), 7), dtype=np.float32)
        table[:, :2] = self.viewport.centres(self.grid.cells(cells))
        table[:, 2] = max(fill * self.viewport.hexagon, least)
        table[:, 3] = headings
        table[:, 4] = shape
        table[:, 5] = 1.0
        table[:, 6] = colour  # below 2^24, so that float32 holds it
        return table

    def _things(self, snapshot: Snapshot) -> list[np.ndarray]:
        """Food and queen."""
        kernels = self.kernels
        queens = np.flatnonzero(snapshot.ground == QUEEN)
        if self.viewport.hexagon < _SMALLEST_DRAWING:
            return [self.shapes(queens, kernels.DOT, colours.CELL_QUEEN, least=_QUEEN_RADIUS)]
        foods = np.flatnonzero(snapshot.ground == FOOD)
        return [
            self.shapes(foods, kernels.FOOD, colours.CELL_FOOD, fill=0.72),
            self.shapes(queens, kernels.QUEEN, colours.CELL_QUEEN, fill=0.72),
        ]

    def _view(self, snapshot: Snapshot, in_view: np.ndarray | None) -> list[np.ndarray]:
        """The outlines of the cells in view, or around the ant where cells are small."""
        if in_view is None:
            return []
        cells, size = in_view, {"fill": 0.98}
        if self.viewport.hexagon < _SMALLEST_OUTLINE:
            cells, size = snapshot.ant_cells[:1], {"fill": _MARK, "least": _SMALLEST_MARK}
        return [self.shapes(cells, self.kernels.IN_VIEW, colours.INK, **size)]

    def _ants(self, snapshot: Snapshot) -> np.ndarray:
        kernels, hexagon = self.kernels, self._ants_like
        carries = snapshot.ant_carries
        dots = hexagon < _SMALLEST_HEXAGON
        if dots:
            shape = np.full(len(carries), kernels.DOT)
        elif hexagon < _SMALLEST_ANT:
            shape = np.where(carries, kernels.DART_WITH_FOOD, kernels.DART)
        else:
            shape = np.where(carries, kernels.ANT_WITH_FOOD, kernels.ANT)
        ants = self.shapes(snapshot.ant_cells, shape, colours.ANT, snapshot.ant_headings)
        if dots:
            ants[:, 2] = max(_FILL * hexagon, _DOT_RADIUS)
            ants[:, 5] = self._dot_opacity(len(ants))
            ants[carries, 6] = _DOT_WITH_FOOD
        return ants

    def _dot_opacity(self, n: int) -> float:
        """How strong n dots are drawn: fully, unless they would hide the world and each other.

        Then all dots together cover a share of the world that grows with the logarithm of n, up to
        the whole when there is an ant in each cell.
        """
        cell = 1.5 * _SQRT_3 * self.viewport.hexagon**2
        dot = math.pi * _DOT_RADIUS**2
        covered = n * dot / (self.grid.count * cell)
        most = max(dot / cell, 1.0)
        if covered <= _FREE_SHARE:
            return 1.0
        growth = math.log(covered / _FREE_SHARE) / math.log(most / _FREE_SHARE)
        return min(1.0, (_FREE_SHARE + (1.0 - _FREE_SHARE) * growth) / covered)

    def _colour_cells(self, snapshot: Snapshot) -> np.ndarray:
        """The colours of all cells, uint32 (grid.size,): by what they hold, else by the trail."""
        small = self.viewport.hexagon < _SMALLEST_DRAWING
        of_ground = np.full(16, colours.CELL_EMPTY, dtype=np.uint32)
        of_ground[OBSTACLE] = colours.CELL_OBSTACLE
        of_ground[FOOD] = colours.CELL_FOOD if small else colours.FLOOR_FOOD
        of_ground[QUEEN] = colours.CELL_QUEEN if small else colours.FLOOR_QUEEN
        of_cells = of_ground[snapshot.ground & 15]
        marked = np.flatnonzero((snapshot.ground == EMPTY) & (snapshot.trail >= 1))
        share = np.minimum(snapshot.trail[marked].astype(np.float32) / self._full_level, 1)
        of_cells[marked] = colours.TRAIL_RAMP[(share * 255 + 0.5).astype(np.int32)]
        of_cells[~self._shown] = colours.PAGE
        self._colours = of_cells
        return of_cells

    def _map_pixels(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        shape = (self.viewport.height, self.viewport.width)
        nearest, second, shares = (np.empty(shape, dtype=np.int32) for _ in range(3))
        # The lines fade away where cells are small, and don't grow with large ones for ever.
        line = float(np.clip(0.09 * self.viewport.hexagon - 0.25, 0.0, 3.0))
        self.kernels.map_pixels(nearest, second, shares, line, *self._layout())
        return nearest.reshape(-1), second.reshape(-1), shares.reshape(-1)

    def _layout(self) -> tuple[float, float, float, int, int, int]:
        """Origin and size of the hexagons, columns and rows of the grid, and its last range."""
        grid, viewport = self.grid, self.viewport
        return (*viewport.origin, viewport.hexagon, grid.width, grid.height, grid.ranges[2])
