"""Pictures of a world: the cells, and beside them what the ant does and what the colours mean."""

from __future__ import annotations

import math
from numbers import Real

import numpy as np

from taichi_ants.errors import AntsError, check_whole, checked_flag, expect, shown
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.rendering import colours, panel, text
from taichi_ants.rendering.observed import task_and_letters
from taichi_ants.rendering.panel import Status
from taichi_ants.rendering.rasteriser import Rasteriser
from taichi_ants.rendering.snapshot import Snapshot
from taichi_ants.rendering.viewport import Viewport
from taichi_ants.task.constants import DEPOSIT_LEVEL, FOOD, QUEEN

SMALLEST_SIDE, LARGEST_SIDE = 64, 4096
DEFAULT_SIZE = (1280, 720)
# In sizes of the text.
_PANEL_WIDTH = 15
_TITLE_HEIGHT = 2.2
_SMALLEST_LETTERS = 10.0  # size of a hexagon in pixels


def check_size(size: tuple[int, int]) -> tuple[int, int]:
    """Width and height of a picture; AntsError if they are no two numbers from 64 to 4096."""
    if not isinstance(size, (tuple, list)) or len(size) != 2:
        raise AntsError(f"the size is {shown(size)}; it must be a width and a height in pixels.")
    for name, side in zip(("width", "height"), size, strict=True):
        check_whole(f"the {name} of the size", side, SMALLEST_SIDE, LARGEST_SIDE, " pixels")
    return size[0], size[1]


class Scene:
    """Draws snapshots of worlds of one grid as pictures of one size.

    Beside the world stands a panel: the lines and bars of the `Status` given with a snapshot, and
    what the colours mean. The cells that ant number 0 sees are marked, with its letters for them.
    Pictures whose shorter side is below 323 pixels have no room for text and no panel.

    Args:
        grid: The grid of all worlds to draw.
        size: Width and height of the pictures, 64 to 4096 pixels each.
        title: A line above the panel.
        plain: Whether to draw the world alone, without panel and marks.
        full_level: The trail level that has the last colour of the ramp, as stronger ones have.

    Raises:
        AntsError: An argument is of the wrong kind, or the size is not allowed.
    """

    def __init__(
        self,
        grid: AxialGrid,
        size: tuple[int, int] = DEFAULT_SIZE,
        *,
        title: str = "",
        plain: bool = False,
        full_level: float = DEPOSIT_LEVEL,
    ) -> None:
        expect("grid", grid, AxialGrid)
        width, height = check_size(size)
        expect("title", title, str)
        if not isinstance(full_level, (float, Real)) or not 0 < full_level < math.inf:
            raise AntsError(f"full_level is {shown(full_level)}; it must be a number above 0.")
        self._marks_view = not checked_flag("plain", plain)
        self._text_size = letters = round(min(width, height) / 38)
        self._has_panel = not plain and letters >= text.SMALLEST
        self._background = np.full((height, width, 3), colours.channels(colours.PAGE))
        margin = max(2, round(min(width, height) / 60))
        room = width, height  # for the world, in the upper left
        if self._has_panel and width >= height:
            room = width - _PANEL_WIDTH * letters - margin, height
        elif self._has_panel:
            room = width, height - round((panel.STATUS_HEIGHT + _TITLE_HEIGHT) * letters) - margin
        self.viewport = Viewport.fit(grid, *room, margin=margin)
        self._rasteriser = Rasteriser(grid, self.viewport, full_level)
        if self._has_panel:
            self._draw_background(room, margin, title, full_level)

    def _draw_background(
        self, room: tuple[int, int], margin: int, title: str, full_level: float
    ) -> None:
        """Draw title and legend, and note where the status goes: beside the world, or below."""
        height, width, _ = self._background.shape
        size, beside = self._text_size, width >= height
        left, top = (room[0], margin) if beside else (margin, room[1])
        column = width - margin - left
        if title:
            text.write(self._background, title, left, top + size, size, room=column)
            top += round(_TITLE_HEIGHT * size)
        if beside:
            legend = left, height - margin - round(panel.LEGEND_HEIGHT * size)
        else:
            column = column // 2 - size
            legend = left + column + 2 * size, top
        self._status_place = left, top, column, size
        hexagon = self.viewport.hexagon
        panel.draw_legend(self._background, *legend, column, size, full_level, hexagon)

    def draw(self, snapshot: Snapshot, status: Status | None = None) -> np.ndarray:
        """A picture, uint8 (height, width, 3), of a world and of what is said of it.

        Raises:
            AntsError: An argument is of the wrong kind, or the snapshot is of another grid.
        """
        expect("the snapshot", snapshot, Snapshot)
        expect("status", status, Status, type(None))
        if snapshot.grid.ranges != self._rasteriser.grid.ranges:
            raise AntsError(
                f"the snapshot is of ranges {snapshot.grid.ranges}, the scene of "
                f"{self._rasteriser.grid.ranges}; draw it with a Scene of its own grid."
            )
        in_view = self._cells_in_view(snapshot, status)
        world = self._rasteriser.draw(snapshot, in_view)
        if in_view is not None and status is not None and status.state is not None:
            _, letters = task_and_letters(status.observation, status.state)
            self._write_letters(world, snapshot, in_view, letters)
        frame = self._background.copy()
        frame[: world.shape[0], : world.shape[1]] = world
        if self._has_panel and status is not None:
            panel.draw_status(frame, status, *self._status_place)
        return frame

    def _cells_in_view(self, snapshot: Snapshot, status: Status | None) -> np.ndarray | None:
        """Flat indices of the cells that ant number 0 sees, if they are to be marked."""
        if not self._marks_view or status is None or status.state is None:
            return None
        if not len(snapshot.ant_cells):
            return None
        turned = (snapshot.ant_headings[0] + np.array(status.observation.cells)) % N_HEADINGS
        return snapshot.ant_cells[0] + snapshot.grid.offsets[turned]

    def _write_letters(
        self, world: np.ndarray, snapshot: Snapshot, cells: np.ndarray, letters: list[str]
    ) -> None:
        hexagon = self.viewport.hexagon
        if hexagon < _SMALLEST_LETTERS:
            return
        floors = self._rasteriser.cell_colours(snapshot)[cells].tolist()
        centres = self.viewport.centres(snapshot.grid.cells(cells)).tolist()
        taken = np.isin(snapshot.ground[cells], (FOOD, QUEEN)).tolist()  # by their drawings
        for letter, centre, floor, drawing in zip(letters, centres, floors, taken, strict=False):
            if not drawing:
                text.write_on(world, letter, centre, hexagon, floor)
