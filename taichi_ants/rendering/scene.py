"""Pictures of a world: the cells, and beside them what the ant does and what the colours mean."""

from __future__ import annotations

import math
from numbers import Real

import numpy as np

from taichi_ants.errors import AntsError, checked_flag, expect, shown
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.rendering import colours, panel, text
from taichi_ants.rendering.observed import task_and_letters
from taichi_ants.rendering.panel import Status
from taichi_ants.rendering.rasteriser import Rasteriser
from taichi_ants.rendering.snapshot import Snapshot, check_snapshot
from taichi_ants.rendering.viewport import Viewport
from taichi_ants.task.constants import DEPOSIT_LEVEL, FOOD, QUEEN

SMALLEST_SIDE, LARGEST_SIDE = 64, 4096
DEFAULT_SIZE = (1280, 720)
# In sizes of the text.
_PANEL_WIDTH = 15
_TITLE_HEIGHT = 2.2


def check_size(size: tuple[int, int]) -> tuple[int, int]:
    """Width and height of a picture, in pixels.

    Raises:
        AntsError: They are no two whole numbers from 64 to 4096.
    """
    try:
        width, height = (int(side) for side in size)
        whole = [width, height] == list(size)
    except (TypeError, ValueError):
        whole = False
    if not whole or not all(SMALLEST_SIDE <= side <= LARGEST_SIDE for side in size):
        raise AntsError(
            f"the size is {shown(size)}; it must be two whole numbers of pixels from "
            f"{SMALLEST_SIDE} to {LARGEST_SIDE}."
        )
    return width, height


class Scene:
    """Draws snapshots of worlds of one grid as pictures of one size.

    Pictures whose shorter side is below 323 pixels have no room for text: there, head-up lines and
    legend are left out.

    Args:
        grid: The grid of all worlds to draw.
        size: Width and height of the pictures, 64 to 4096 pixels each.
        hud: Whether to draw the head-up lines, of the `Status` given with a snapshot.
        legend: Whether to draw what the colours mean.
        view: Whether to mark the cells that the ant of a `Status` sees, with its letters for them.
        title: A line above both.
        full_level: The trail level that has the last colour of the ramp, as stronger ones have.

    Raises:
        AntsError: An argument is of the wrong kind, or the size is not allowed.
    """

    def __init__(
        self,
        grid: AxialGrid,
        size: tuple[int, int] = DEFAULT_SIZE,
        *,
        hud: bool = True,
        legend: bool = True,
        view: bool = True,
        title: str = "",
        full_level: float = DEPOSIT_LEVEL,
    ) -> None:
        expect("grid", grid, AxialGrid)
        width, height = self.size = check_size(size)
        expect("title", title, str)
        if not isinstance(full_level, (float, Real)) or not 0 < full_level < math.inf:
            raise AntsError(f"full_level is {shown(full_level)}; it must be a number above 0.")
        self._text_size = round(min(width, height) / 38)
        readable = self._text_size >= text.SMALLEST
        self._hud = checked_flag("hud", hud) and readable
        self._legend = checked_flag("legend", legend) and readable
        self._view = checked_flag("view", view)
        margin = max(2, round(min(width, height) / 60))
        room = self._world_room(margin)
        self.viewport = Viewport.fit(grid, *room, margin=margin)
        self._rasteriser = Rasteriser(grid, self.viewport, full_level)
        self._background = np.empty((height, width, 3), dtype=np.uint8)
        self._background[:] = colours.channels(colours.PAGE)
        self._places = self._panel_places(room, margin, title)
        if self._legend:
            place, hexagon = self._places["legend"], self.viewport.hexagon
            panel.draw_legend(self._background, place, self._text_size, full_level, hexagon)

    def draw(self, snapshot: Snapshot, status: Status | None = None) -> np.ndarray:
        """A picture, uint8 (height, width, 3), of a world and of what is said of it.

        Raises:
            AntsError: An argument is of the wrong kind, or the snapshot no sound one of this grid.
        """
        check_snapshot(snapshot)
        expect("status", status, Status, type(None))
        if snapshot.grid.ranges != self._rasteriser.grid.ranges:
            raise AntsError(
                f"the snapshot is of ranges {snapshot.grid.ranges}, the scene of "
                f"{self._rasteriser.grid.ranges}; draw it with a Scene of its own grid."
            )
        world = self._draw_world(snapshot, status)
        frame = self._background.copy()
        frame[: world.shape[0], : world.shape[1]] = world
        if self._hud and status is not None:
            panel.draw_status(frame, status, self._places["status"], self._text_size)
        return frame

    def _draw_world(self, snapshot: Snapshot, status: Status | None) -> np.ndarray:
        """The world; if asked for, with letters in the cells that ant number 0 sees."""
        state = None if status is None else status.state
        if not self._view or state is None or status is None or not len(snapshot.ant_cells):
            return self._rasteriser.draw(snapshot)
        turned = (snapshot.ant_headings[0] + np.array(status.observation.cells)) % N_HEADINGS
        cells = snapshot.ant_cells[0] + snapshot.grid.offsets[turned]
        world = self._rasteriser.draw(snapshot, in_view=cells)
        _, letters = task_and_letters(status.observation, state)
        if letters and self._rasteriser.has_room_for_letters:
            centres = self.viewport.centres(snapshot.grid.cells(cells)).tolist()
            floors = self._rasteriser.colour_of(cells).tolist()
            taken = np.isin(snapshot.ground[cells], (FOOD, QUEEN)).tolist()  # by their drawings
            for number, letter in enumerate(letters):
                if not taken[number]:
                    hexagon = self.viewport.hexagon
                    write_letter(world, letter, centres[number], hexagon, floor=floors[number])
        return world

    def _world_room(self, margin: int) -> tuple[int, int]:
        """Width and height of the upper left part of the picture, which is for the world."""
        width, height = self.size
        if not (self._hud or self._legend):
            return width, height
        if width >= height:
            return width - _PANEL_WIDTH * self._text_size - margin, height
        lines = max(panel.STATUS_HEIGHT * self._hud, panel.LEGEND_HEIGHT * self._legend)
        return width, height - round((lines + _TITLE_HEIGHT) * self._text_size) - margin

    def _panel_places(
        self, room: tuple[int, int], margin: int, title: str
    ) -> dict[str, tuple[int, int, int]]:
        """Left, top and width of the head-up lines and of the legend; writes the title."""
        if not (self._hud or self._legend):
            return {}
        size, (width, height) = self._text_size, self.size
        beside = width >= height
        left, top = (room[0], margin) if beside else (margin, room[1])
        right = width - margin
        if title:
            room_for_title = right - left
            line = text.shortened(title, size, room_for_title)
            text.write(self._background, line, left, top + size, size)
            top += round(_TITLE_HEIGHT * size)
        if beside:
            bottom = height - margin - round(panel.LEGEND_HEIGHT * size)
            legend_top = bottom if self._hud else top
            column = right - left
            return {"status": (left, top, column), "legend": (left, legend_top, column)}
        column = (right - left - 2 * size) // 2
        legend_left = left + column + 2 * size if self._hud else left
        return {"status": (left, top, column), "legend": (legend_left, top, column)}


def write_letter(
    frame: np.ndarray,
    letter: str,
    centre: tuple[float, float],
    hexagon: float,
    floor: int,
    beside: bool = False,
) -> None:
    """Write a letter on a cell of the colour `floor`, `beside` what is drawn there if need be."""
    x, y = centre
    size = round((0.75 if beside else 0.85) * hexagon)
    x += 0.38 * hexagon if beside else 0.0
    red, green, blue = colours.channels(floor).tolist()
    dark = 0.30 * red + 0.59 * green + 0.11 * blue < 128
    ink = colours.PAGE if dark else colours.INK
    text.write(frame, letter, x, y + 0.36 * size, size, ink, align="middle")
