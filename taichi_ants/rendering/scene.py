"""Pictures of a world with a panel: the state and action values of an ant, and a legend."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from taichi_ants.errors import AntsError, as_array, expect
from taichi_ants.features.cues import COMPASS, CUES
from taichi_ants.features.fields import TRAIL
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.records import Snapshot
from taichi_ants.rendering import colours, text
from taichi_ants.rendering.colours import Mark
from taichi_ants.rendering.rasteriser import Rasteriser, ants, cell, draw_marks, marks
from taichi_ants.task import Observation, Task, observations
from taichi_ants.task.constants import ACTION_NAMES, FOOD, N_ACTIONS, QUEEN
from taichi_ants.task.states import TASK_NAMES

_PAPER = observations.get("paper")
SMALLEST_SIDE, LARGEST_SIDE = 64, 4096
DEFAULT_SIZE = (1280, 720)
# In multiples of the text size.
_PANEL_WIDTH = 15
_TITLE_HEIGHT = 2.2
_LEGEND_HEIGHT = 14.8
_PITCH = 1.55  # between entries of the legend
_SMALLEST_LETTERS = 10.0  # smallest hexagon with a letter, in pixels


class _Entry(NamedTuple):
    """An entry of the legend: a cell with what is on it, and its label."""

    label: str
    cell: str = "E"  # letter in a state; "" for the field of this number
    number: int = 0  # of the field, nest or kind of food
    letter: str = ""  # drawn on the cell
    ant: bool | None = None  # whether it carries food; None for no ant


_LEGEND = (
    _Entry("empty (E)"),
    _Entry("obstacle (O)", "O"),
    _Entry("food (F)", "F"),
    _Entry("queen (Q)", "Q"),
    _Entry("", letter="S"),  # the label is that of the cue
    _Entry("ant", ant=False),
    _Entry("ant with food", ant=True),
)


def name_parts(observation: Observation, state: int) -> tuple[str, str, list[str]]:
    """Return the parts of a state's name: task ("" if none), the remainder, labels of cells.

    There is one label for each cell in view: a letter that names the kind of cell, and for some
    observations a second one, as in "T3". Names of other forms have no labels.
    """
    name = observation.name_of(state)
    task, _, rest = name.partition(" ")
    if task not in TASK_NAMES:
        return "", name, []
    letters = rest.split()
    one_each = len(letters) == len(observation.cells) and max(map(len, letters)) <= 2
    return task, rest, letters if one_each else []


@dataclass(frozen=True, eq=False)
class Status:
    """Text for the panel of a snapshot, with the state of ant number 0 and its action values.

    Attributes:
        lines: Names and values, for example ("step", "12").
        state: The index of the state; None if there is none to show.
        q_values: float (5,), the action values in the state; None draws no bars.
        action: The chosen action, 0 to 4.
        q_range: The scale of the bars, from at most 0 to above 0.
        observation: The observation that encodes the state.
    """

    lines: tuple[tuple[str, str], ...]
    state: int | None = None
    q_values: np.ndarray | None = None
    action: int | None = None
    q_range: tuple[float, float] = (0.0, 1.0)
    observation: Observation = _PAPER


def check_size(size: tuple[int, int]) -> tuple[int, int]:
    """Return width and height in pixels; raise AntsError unless both are from 64 to 4096."""
    name = "the size (a width and a height in pixels)"
    width, height = as_array(name, size, "iu", (2,), SMALLEST_SIDE, LARGEST_SIDE).tolist()
    return width, height


class Scene:
    """Draws snapshots of worlds of one grid as pictures of one size.

    The panel on the right has the text and bars of the `Status`, and a legend. Outlines and letters
    mark the cells that ant number 0 sees. Pictures whose shorter side is below 323 pixels have no
    panel, because text would not fit.

    Args:
        grid: The grid of all worlds to draw.
        size: Width and height of the pictures, 64 to 4096 pixels each.
        title: A line above the panel.
        overlay: Draw the panel and the marks; False draws the world alone.
        view: Leave space for cells in view outside the border of the world.
        task: The task of the ants, from which the legend takes cues and the names of kinds of
            food, and fields their strongest levels. If deposits diffuse, add up or follow your
            rule, each picture fits the scale to its levels.

    Raises:
        AntsError: An argument is of the wrong kind, or the size is not allowed.

    >>> snapshot = rendering.at_start(worlds.paper())
    >>> scene = rendering.Scene(snapshot.grid, size=(640, 360), title="The paper's world")
    >>> scene.draw(snapshot, rendering.Status([("step", "0")])).shape
    (360, 640, 3)
    """

    def __init__(
        self,
        grid: AxialGrid,
        size: tuple[int, int] = DEFAULT_SIZE,
        *,
        title: str = "",
        overlay: bool = True,
        view: bool = False,
        task: Task | None = None,
    ) -> None:
        expect("grid", grid, AxialGrid)
        expect("task", task, Task, type(None))
        self._task, self._title, self._overlay = task, title, overlay
        fields = {} if task is None else task.pheromones
        regular = ("none", "set", "fading")  # other deposits, and diffusion, have no usual levels
        scales = {
            name: rule.darkest if rule.deposit in regular and not rule.diffusion else None
            for name, rule in fields.items()
        }
        width, self._height = check_size(size)
        shorter = min(size)
        letters, margin = round(shorter / 38), max(2, round(shorter / 60))
        self._panel: tuple[int, int, int] | None = None  # left edge, width, text size
        room = width  # pixels for the world, on the left
        self._page = np.full((self._height, width, 3), colours.channels(colours.PAGE))
        if overlay and letters >= text.SMALLEST:
            room -= _PANEL_WIDTH * letters + margin
            self._panel = room, width - margin - room, letters
        self._margin = margin
        self._legend: tuple[list[_Entry], str, np.ndarray]
        self._legend = [], "", np.zeros(0)
        beyond = view and overlay
        self._rasteriser = Rasteriser(grid, room, self._height, margin, beyond, scales)

    def draw(self, snapshot: Snapshot, status: Status | None = None) -> np.ndarray:
        """Return the picture of a snapshot and its panel, uint8 (height, width, 3).

        The panel shows the text of `status`, if one is given. Raises AntsError if an argument is of
        the wrong kind, or the snapshot has another grid.
        """
        expect("the snapshot", snapshot, Snapshot)
        expect("status", status, Status, type(None))
        if snapshot.grid.ranges != self._rasteriser.grid.ranges:
            raise AntsError(
                f"the snapshot has ranges {snapshot.grid.ranges}, but the scene has "
                f"{self._rasteriser.grid.ranges}; use a Scene of the same grid."
            )
        world = self._draw_world(snapshot, status)
        if self._panel is None:
            return world
        frame = self._page.copy()
        frame[:, : world.shape[1]] = world
        left, width, size = self._panel
        text.write(frame, self._title, left, self._margin + size, size, room=width)
        if status is not None:
            top = self._margin + round(_TITLE_HEIGHT * size) * bool(self._title)
            _draw_status(frame, status, top, *self._panel)
        self._add_legend(frame, snapshot)
        return frame

    def _add_legend(self, frame: np.ndarray, snapshot: Snapshot) -> None:
        """Draw the legend: its pixels of the last frame, unless a scale or an entry has changed."""
        assert self._panel is not None
        entries = [*self._further_entries(snapshot), *_LEGEND]
        most = f"{self._rasteriser.darkest(TRAIL, snapshot.trail)} and more"
        if self._legend[:2] != (entries, most):
            page = self._page.copy()
            self._draw_legend(page, entries, most, *self._panel)
            rows, columns, _ = (page != self._page).nonzero()
            self._legend = entries, most, page[rows.min() :, columns.min() :]
        legend = self._legend[2]
        corner = np.s_[-legend.shape[0] :, -legend.shape[1] :]
        if (frame[corner] == self._page[corner]).all():
            frame[corner] = legend
        else:  # in a small picture, it covers a part of the status
            self._draw_legend(frame, entries, most, *self._panel)

    def _draw_legend(
        self, frame: np.ndarray, entries: list[_Entry], most: str, left: int, width: int, size: int
    ) -> None:
        """Draw the legend, which grows upwards with its entries."""
        cue = self._task.homing_cue if self._task else COMPASS
        if cue in CUES:
            label = CUES[cue].words
        else:
            label = "trail (S)" if cue == TRAIL else f"field {cue} (S)"
        entries = [entry._replace(label=label) if entry.letter else entry for entry in entries]
        pitch, radius = round(_PITCH * size), 0.82 * size
        x, hexagon = left + 0.85 * size, self._rasteriser.hexagon
        first = self._height - self._margin - round(_LEGEND_HEIGHT * size) + len(_LEGEND) * pitch
        for row, entry in enumerate(entries, start=-len(entries)):
            y = first + row * pitch + 0.75 * size
            ant_x, label_x = x, left + round(2.1 * size)
            strongest = int(colours.field_ramp(entry.number)[-1])
            field = marks((x, y), radius, Mark.HEXAGON, strongest)
            tables = [cell(entry.cell, (x, y), radius, entry.number) if entry.cell else field]
            if entry.ant is not None:
                if entry.cell == "Q":  # to the right of the queen
                    ant_x, label_x = x + 1.7 * size, label_x + round(1.7 * size)
                look, colour = (entry.ant, hexagon, 0.83 * radius), int(colours.ANTS[entry.number])
                tables.append(ants((ant_x, y), 1, *look, colour=colour))
            draw_marks(frame, *tables)
            baseline = round(y + 0.36 * size)
            text.write(frame, entry.letter, x, baseline, size, align="middle")
            text.write(frame, entry.label, label_x, baseline, size)
        y = first + round(1.45 * size)
        text.write(frame, "trail (T), by strength", left, y, size)
        y += round(0.45 * size)
        columns = np.linspace(0, len(colours.TRAIL_RAMP) - 1, width).astype(int)
        ramp = colours.channels(colours.TRAIL_RAMP[columns])
        frame[y : y + round(0.7 * size), left : left + width] = ramp
        y += round(1.75 * size)
        text.write(frame, "1", left, y, size, colours.FAINT_INK)
        text.write(frame, most, left + width, y, size, colours.FAINT_INK, align="right")

    def _further_entries(self, snapshot: Snapshot) -> list[_Entry]:
        """Return entries of further fields, several nests and several kinds of food."""
        further = [
            _Entry(f"field {name}, {self._rasteriser.darkest(name, levels)} and more", "", number)
            for number, (name, levels) in enumerate(snapshot.further_fields.items())
        ]
        if len(snapshot.queens) > 1:
            nests = range(len(snapshot.queens))
            further += [_Entry(f"nest {n}", "Q", n, ant=False) for n in nests]
        kinds = 1 if snapshot.world is None else snapshot.world.n_food_kinds
        named = self._task.foods if self._task else ()
        foods = [*named] or [f"of kind {n}" for n in range(kinds)]
        if len(foods) > 1:
            further += [_Entry(f"food {name}", "F", n) for n, name in enumerate(foods)]
        return further

    def _draw_world(self, snapshot: Snapshot, status: Status | None) -> np.ndarray:
        """Draw the world, with outlines and letters on the cells that ant number 0 sees."""
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
            taken = np.isin(snapshot.ground[cells], (FOOD, QUEEN))  # these have drawings instead
            for number, letter in enumerate(letters):
                if not taken[number]:
                    text.write_on(world, letter, centres[number], hexagon, floors[number])
        return world


def _draw_status(
    frame: np.ndarray, status: Status, top: int, left: int, width: int, size: int
) -> None:
    """Draw the lines and bars of a status into a part of a frame."""
    y = top + size
    for label, value in status.lines:
        text.write(frame, label, left, y, size, colours.FAINT_INK)
        room = width - text.width(label + "  ", size)
        text.write(frame, value, left + width, y, size, align="right", room=room)
        y += round(1.45 * size)
    if status.q_values is None:
        return
    y += round(0.3 * size)
    text.write(frame, "action values Q", left, y, size, colours.FAINT_INK)
    top = y + round(0.5 * size)
    start = left + max(text.width(name, size) for name in ACTION_NAMES) + 0.6 * size
    end = left + width - text.width("-00.00", size) - 0.3 * size
    low, high = status.q_range
    pixels = (end - start) / (high - low)
    zero = start - low * pixels
    pitch, thickness = round(1.4 * size), round(0.75 * size)
    for action, value in enumerate(np.asarray(status.q_values, dtype=float).tolist()):
        y = top + action * pitch
        ends = sorted((zero, zero + min(max(value, low), high) * pixels))
        bar, ink = colours.RULE, colours.INK
        if action == status.action:
            bar = ink = colours.CHOSEN
        fill(frame, ends[0], y + 0.35 * size, ends[1] - ends[0], thickness, bar)
        baseline = y + round(1.05 * size)
        text.write(frame, ACTION_NAMES[action], left, baseline, size, ink)
        number = f"{round(value, 2) + 0.0:.2f}"  # 0.0 turns -0.0 into 0.0
        text.write(frame, number, left + width, baseline, size, ink, align="right")
    fill(frame, zero - 1, top + 0.1 * size, 1, N_ACTIONS * pitch - 0.1 * size, colours.FAINT_INK)


def fill(
    frame: np.ndarray, left: float, top: float, width: float, height: float, colour: int
) -> None:
    """Fill a rectangle whose edges are rounded to whole pixels."""
    x, y = max(0, round(left)), max(0, round(top))
    frame[y : round(top + height), x : round(left + width)] = colours.channels(colour)
