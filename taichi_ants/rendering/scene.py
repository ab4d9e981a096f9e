"""Pictures of a world: the cells, and beside them what the ant does and what the colours mean."""

from __future__ import annotations

import numpy as np

from taichi_ants.engines.records import Snapshot
from taichi_ants.errors import AntsError, checked_flag, checked_whole, expect, shown
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.rendering import colours, panel, text
from taichi_ants.rendering.panel import Status
from taichi_ants.rendering.rasteriser import Rasteriser
from taichi_ants.rendering.state_names import name_parts
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
    for side in size:
        checked_whole("a side of the size", side, SMALLEST_SIDE, LARGEST_SIDE, " pixels")
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
        overlay: Whether to draw the panel and marks, not the world alone.
        view: Whether to leave room for the cells in view beyond the border of the world.
        strongest: The trail level, 1 or more, from which trails have the darkest colour.

    Raises:
        AntsError: An argument is of the wrong kind, or the size is not allowed.
    """

    def __init__(
        self,
        grid: AxialGrid,
        size: tuple[int, int] = DEFAULT_SIZE,
        *,
        title: str = "",
        overlay: bool = True,
        view: bool = False,
        strongest: int = DEPOSIT_LEVEL,
    ) -> None:
        expect("grid", grid, AxialGrid)
        width, height = check_size(size)
        expect("title", title, str)
        view = checked_flag("view", view)
        strongest = checked_whole("strongest", strongest)
        self._overlay = checked_flag("overlay", overlay)
        letters = round(min(width, height) / 38)
        self._background = np.full((height, width, 3), colours.channels(colours.PAGE))
        margin = max(2, round(min(width, height) / 60))
        self._has_panel = overlay and letters >= text.SMALLEST
        room = width  # of the world, on the left
        if self._has_panel:
            room -= _PANEL_WIDTH * letters + margin
        self._rasteriser = Rasteriser(grid, room, height, margin, view and overlay, strongest)
        if self._has_panel:
            column = width - margin - room
            bottom = height - margin - round(panel.LEGEND_HEIGHT * letters)
            text.write(self._background, title, room, margin + letters, letters, room=column)
            top = margin + round(_TITLE_HEIGHT * letters) * bool(title)
            self._status_place = room, top, column, letters
            hexagon = self._rasteriser.hexagon
            panel.draw_legend(self._background, room, bottom, column, letters, hexagon, strongest)

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
        world = self._draw_world(snapshot, status)
        frame = self._background.copy()
        frame[:, : world.shape[1]] = world
        if self._has_panel and status is not None:
            panel.draw_status(frame, status, *self._status_place)
        return frame

    def _draw_world(self, snapshot: Snapshot, status: Status | None) -> np.ndarray:
        """The world; the cells that ant number 0 sees are marked, with its letters for them."""
        rasteriser, hexagon = self._rasteriser, self._rasteriser.hexagon
        state = None if status is None or not self._overlay else status.state
        if status is None or state is None or not len(snapshot.ant_cells):
            return rasteriser.draw(snapshot)
        turned = (snapshot.ant_headings[0] + np.array(status.observation.cells)) % N_HEADINGS
        cells = snapshot.ant_cells[0] + snapshot.grid.offsets[turned]
        world = rasteriser.draw(snapshot, in_view=cells)
        if hexagon >= _SMALLEST_LETTERS:
            *_, letters = name_parts(status.observation, state)
            floors = rasteriser.cell_colours(snapshot)[cells].tolist()
            centres = rasteriser.centres(snapshot.grid.cells(cells)).tolist()
            taken = np.isin(snapshot.ground[cells], (FOOD, QUEEN))  # by their drawings
            for number, letter in enumerate(letters):
                if not taken[number]:
                    text.write_on(world, letter, centres[number], hexagon, floors[number])
        return world
