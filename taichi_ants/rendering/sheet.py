"""A policy on one sheet: what the ant does in each state.

The states stand in two halves, foraging and carrying, ordered by the cell ahead, then by the other
cells in view. A sheet shows the states in which something was learned, or all that an ant can come
into; of very many the first.
"""

from __future__ import annotations

import math

import numpy as np

from taichi_ants.errors import AntsError, checked_flag, expect, shown, whole
from taichi_ants.grid.constants import HEADING_STEPS, N_HEADINGS
from taichi_ants.grid.hexgrid import AxialGrid, centre_of
from taichi_ants.rendering import colours, text
from taichi_ants.rendering.observed import (
    PAPER,
    Observation,
    possible_states,
    task_and_letters,
)
from taichi_ants.rendering.panel import fill
from taichi_ants.rendering.rasteriser import Rasteriser
from taichi_ants.rendering.scene import write_letter
from taichi_ants.rendering.viewport import Viewport
from taichi_ants.task.constants import ACTION_NAMES, GIVE, N_ACTIONS, PICK_UP, RIGHT
from taichi_ants.task.states import TASK_NAMES

# Width in pixels and states side by side, of a sheet of what was learned and of all states. The
# first is read at the width of a page, the second needs a screen of its own.
DEFAULT_WIDTH, _COLUMNS = 1280, 9
COMPLETE_WIDTH, _COMPLETE_COLUMNS = 1920, 16
SMALLEST_WIDTH, LARGEST_WIDTH = 800, 4096
HARDLY = 0.01
MOST = 256  # states of a half that are drawn

_HALVES = ("Foraging (without food)", "Carrying (with food)")
_EXPLANATION = (
    "A drawing is a state: what the ant sees{}. The arrow and the word are its best action.",
    "The longer the bar, the worse the second best action; where the bar is empty, it is as good.",
    "E empty, O obstacle (or the outside), T trail, F food, S nearer to the queen, Q queen.",
)
_NOTHING = "nothing was learned here"
# How much of a picture's colours is left, by the words that stand below it.
_NOT_VISITED, _HARDLY_VISITED = "not visited", "hardly visited"
_PALE = {_NOT_VISITED: 0.35, _HARDLY_VISITED: 0.55}
# The colours of cells by the letters of states, in which their order is that of the sheet.
_FLOORS = {
    "E": colours.CELL_EMPTY,
    "O": colours.CELL_OBSTACLE,
    "T": int(colours.TRAIL_RAMP[120]),
    "S": 0xDCE3F2,
    "F": colours.FLOOR_FOOD,
    "Q": colours.FLOOR_QUEEN,
}
_LETTERS = "".join(_FLOORS)
_GOALS = "FQ"
_ARROW_COLOURS = {PICK_UP: colours.CELL_FOOD, GIVE: colours.CELL_QUEEN}
_SQRT_3 = math.sqrt(3.0)


def best_actions(values: np.ndarray) -> list[int]:
    """The actions of the highest value among values (5,); all five if all are equal."""
    values = _numbers("values", values, (N_ACTIONS,))
    return np.flatnonzero(values == np.max(values)).tolist()


def usual_spread(q_values: np.ndarray, observation: Observation = PAPER) -> float:
    """By how much the action values (n_states, 5) of a state usually differ.

    The mean of the gaps from the best to the worst, over the possible states with values that
    differ; 0 where there are none.
    """
    table = _numbers("q_values", q_values, (observation.n_states, N_ACTIONS))
    rows = table.astype(np.float64)[list(possible_states(observation))]
    spreads = np.ptp(rows, axis=1)
    return float(spreads[spreads > 0].mean()) if spreads.any() else 0.0


def clarity(values: np.ndarray, spread: float) -> float:
    """How clear the best of action values (5,) is, from 0 to 1.

    The gap from the best to the second best as a share of `spread`, the table's `usual_spread`: a
    state's own values would make every hair's breadth look like a clear choice. NaN where all
    values are equal.
    """
    values = _numbers("values", values, (N_ACTIONS,)).astype(np.float64)
    worst, *_, second, best = np.sort(values).tolist()
    return min(1.0, (best - second) / spread) if best > worst else math.nan


def hardly_learned(values: np.ndarray, spread: float) -> bool:
    """Whether action values (5,) differ by less than 1 % of the table's `usual_spread`."""
    return float(np.ptp(np.asarray(values, dtype=np.float64))) < HARDLY * spread


def policy_sheet(
    q_values: np.ndarray,
    title: str = "Policy",
    width: int | None = None,
    *,
    complete: bool = False,
    observation: Observation = PAPER,
) -> np.ndarray:
    """The sheet of a policy, uint8 (height, width, 3).

    Args:
        q_values: float (n_states, 5), finite action values.
        title: Stands above it, in ASCII.
        width: In pixels, 800 to 4096; None takes 1280, of a complete sheet 1920.
        complete: Whether to draw all states that can occur, those not visited pale, and not only
            those in which something was learned.
        observation: Whose states they are.

    Raises:
        AntsError: The table is no policy, the title no text, or the width is not allowed.
    """
    table = _numbers("q_values", q_values, (observation.n_states, N_ACTIONS))
    expect("title", title, str)
    complete = checked_flag("complete", complete)
    if width is None:
        width = COMPLETE_WIDTH if complete else DEFAULT_WIDTH
    if whole("the width", width) not in range(SMALLEST_WIDTH, LARGEST_WIDTH + 1):
        raise AntsError(
            f"the width is {width}; it must be a whole number of pixels from {SMALLEST_WIDTH} to "
            f"{LARGEST_WIDTH}."
        )
    return _Sheet(table, int(width), complete, observation).draw(title)


def _numbers(name: str, values: object, shape: tuple[int, ...]) -> np.ndarray:
    """Values as an array of finite numbers of this shape."""
    try:
        array = np.asarray(values)
    except ValueError:  # rows of different lengths
        array = np.asarray(values, dtype=object)
    if array.shape != shape or array.dtype.kind not in "fiu" or not np.isfinite(array).all():
        raise AntsError(
            f"{name} is {shown(array if array.ndim else values)}; it must be finite numbers of "
            f"shape {shape}."
        )
    return array


class _Sheet:
    """Where everything lies; all lengths follow from the width."""

    def __init__(
        self, table: np.ndarray, width: int, complete: bool, observation: Observation
    ) -> None:
        self._table = table
        self._observation = observation
        self._spread = usual_spread(table, observation)
        self._width = width
        self._columns = _COMPLETE_COLUMNS if complete else _COLUMNS
        self._margin = round(width / 64)
        self._tile_width = (width - 2 * self._margin) // self._columns
        self._small = round(min(width / 70, self._tile_width / 7))  # sizes of text
        self._large = round(1.5 * self._small)
        self._picture = _Picture(self._tile_width, observation)
        self._tile_height = self._picture.height + round(2.6 * self._small)
        self._heading = round(2.6 * self._large)  # of a half
        self._top = round(2.6 * self._large) + len(_EXPLANATION) * round(1.5 * self._small)
        self._halves: tuple[list[int], list[int]] = ([], [])
        for state in possible_states(observation):
            self._halves[self._task(state) == TASK_NAMES[1]].append(state)
        self._drawn = [
            sorted(
                (one for one in states if complete or not self._doubt(self._table[one])),
                key=self._order,
            )[:MOST]
            for states in self._halves
        ]

    def _task(self, state: int) -> str:
        return task_and_letters(self._observation, state)[0]

    def _order(self, state: int) -> list[int]:
        """Sorts by the cell ahead, then by the others."""
        _, letters = task_and_letters(self._observation, state)
        if letters:
            letters.insert(0, letters.pop(self._observation.cells.index(0)))
        return [*(_LETTERS.find(letter[0]) for letter in letters), state]

    def _height(self, states: list[int]) -> int:
        rows = max(1, math.ceil(len(states) / self._columns))
        return self._heading + rows * self._tile_height

    def draw(self, title: str) -> np.ndarray:
        height = self._top + sum(map(self._height, self._drawn)) + self._margin // 2
        sheet = np.empty((height, self._width, 3), dtype=np.uint8)
        sheet[:] = colours.channels(colours.PAGE)
        y = self._margin + self._large
        title = text.shortened(title, self._large, self._width - 2 * self._margin)
        text.write(sheet, title, self._margin, y, self._large)
        y += round(0.3 * self._large)
        ahead = " to its left, ahead and to its right"
        for line in _EXPLANATION:
            y += round(1.5 * self._small)
            line = line.format(ahead if len(self._observation.cells) == 3 else "")
            text.write(sheet, line, self._margin, y, self._small, colours.FAINT_INK)
        top = self._top
        for half, states in enumerate(self._drawn):
            self._draw_half(sheet, half, top)
            top += self._height(states)
        return sheet

    def _draw_half(self, sheet: np.ndarray, half: int, top: int) -> None:
        y = top + round(1.7 * self._large)
        text.write(sheet, _HALVES[half], self._margin, y, self._large)
        states = self._halves[half]
        learned = sum(not self._doubt(self._table[state]) for state in states)
        words = f"{learned} of {len(states)} states learned" if learned else _NOTHING
        if len(self._drawn[half]) == MOST:
            words += f"; {MOST} are shown"
        right = self._width - self._margin
        text.write(sheet, words, right, y, self._small, colours.FAINT_INK, align="right")
        for place, state in enumerate(self._drawn[half]):
            row, column = divmod(place, self._columns)
            x = self._margin + column * self._tile_width
            self._draw_tile(sheet, state, x, top + self._heading + row * self._tile_height)

    def _draw_tile(self, sheet: np.ndarray, state: int, left: int, top: int) -> None:
        values = self._table[state]
        best, clear = best_actions(values), clarity(values, self._spread)
        doubt = self._doubt(values)
        width, height = self._tile_width, self._picture.height
        picture = self._picture.draw(state, [] if doubt == _NOT_VISITED else best)
        if doubt:
            picture = (_PALE[doubt] * picture + (1 - _PALE[doubt]) * 255).astype(np.uint8)
        sheet[top : top + height, left : left + width] = picture
        y = top + height + round(0.85 * self._small)
        middle = left + width / 2
        if doubt:
            text.write(sheet, doubt, middle, y, self._small, colours.FAINT_INK, align="middle")
            return
        names = " / ".join(ACTION_NAMES[action] for action in best)
        words = text.shortened(names, self._small, width)
        colour = _ARROW_COLOURS.get(best[0], colours.CHOSEN)
        text.write(sheet, words, middle, y, self._small, colour, align="middle")
        y += round(0.45 * self._small)
        length, thickness = round(0.72 * width), max(2, round(0.32 * self._small))
        fill(sheet, middle - length / 2, y, length, thickness, colours.CELL_EMPTY)
        fill(sheet, middle - length / 2, y, length * clear, thickness, colour)

    def _doubt(self, values: np.ndarray) -> str:
        """What stands below a state in place of an action; empty where something was learned."""
        if np.ptp(values) == 0:
            return _NOT_VISITED
        return _HARDLY_VISITED if hardly_learned(values, self._spread) else ""


class _Picture:
    """Draws an ant with the cells that it sees, and its best actions as arrows."""

    def __init__(self, width: int, observation: Observation) -> None:
        self._observation = observation
        self._headings = np.array(observation.cells) % N_HEADINGS
        grid = AxialGrid((2, 2, 2))  # a cell and those around it
        own, seen = (0, 0, 0), [HEADING_STEPS[heading] for heading in self._headings]
        cells = np.array([own, *seen])
        self._cells = grid.index(cells)
        shown = np.zeros(grid.size, dtype=bool)
        shown[self._cells] = True
        hexagon = width / 5.7
        rows = centre_of(cells, hexagon)[:, 1]
        room = float(rows.max() - rows.min()) + _SQRT_3 * hexagon
        self.height = round(room + 0.136 * hexagon)
        y = (self.height - room) / 2 + 0.5 * _SQRT_3 * hexagon - float(rows.min())
        viewport = Viewport(width, self.height, hexagon, (width / 2, y))
        self._hexagon = hexagon
        self._centres = viewport.centres(cells)
        self._rasteriser = Rasteriser(grid, viewport, shown=shown)
        self._floors = np.full(grid.size, colours.PAGE, dtype=np.uint32)

    def draw(self, state: int, actions: list[int]) -> np.ndarray:
        """The picture, uint8 (height, width, 3)."""
        task, letters = task_and_letters(self._observation, state)
        carries, unnamed = task == TASK_NAMES[1], not letters
        letters = letters or [" "] * len(self._observation.cells)
        floors = [_FLOORS.get(letter[0], colours.CELL_EMPTY) for letter in letters]
        self._floors[self._cells] = [colours.CELL_EMPTY, *floors]
        frame = self._rasteriser.draw_cells(self._floors)
        self._draw_things(frame, letters)
        self._draw_ant(frame, carries)
        for letter, floor, (x, y) in zip(letters, floors, self._centres[1:].tolist(), strict=True):
            goal = letter in _GOALS
            place = x, y - _rise(goal) * self._hexagon
            write_letter(frame, letter, place, self._hexagon, floor=floor, beside=goal)
        if unnamed:
            size, width = round(0.6 * self._hexagon), frame.shape[1]
            name = self._observation.name_of(state).partition(" ")[2]
            name = text.shortened(name, size, width)
            text.write(frame, name, width / 2, size, size, align="middle")
        self._draw_arrows(frame, letters, actions)
        return frame

    def _draw_things(self, frame: np.ndarray, letters: list[str]) -> None:
        kernels = self._rasteriser.kernels
        goals = {"F": (kernels.FOOD, colours.CELL_FOOD), "Q": (kernels.QUEEN, colours.CELL_QUEEN)}
        for cell, letter in zip(self._cells[1:], letters, strict=True):
            if letter in goals:
                mark = self._rasteriser.shapes(cell[None], *goals[letter], fill=0.72)
                mark[:, 0] -= 0.58 * mark[:, 2]  # room for a letter beside it
                mark[:, 2] *= 0.6
                mark[:, 1] -= _rise(True) * self._hexagon
                kernels.draw_shapes(frame, mark)

    def _draw_ant(self, frame: np.ndarray, carries: bool) -> None:
        kernels = self._rasteriser.kernels
        shape = kernels.ANT_WITH_FOOD if carries else kernels.ANT
        ant = self._rasteriser.shapes(self._cells[:1], shape, colours.ANT, fill=0.62)
        ant[:, 1] += 0.2 * self._hexagon
        kernels.draw_shapes(frame, ant)

    def _draw_arrows(self, frame: np.ndarray, letters: list[str], actions: list[int]) -> None:
        """An arrow to where a move goes, from the food that is picked up, or to the queen."""
        kernels, own = self._rasteriser.kernels, self._cells[:1]
        for action in actions:
            colour = _ARROW_COLOURS.get(action, colours.CHOSEN)
            for place, turn in enumerate(self._observation.cells):
                towards = turn == action - 1 if action <= RIGHT else letters[place] in _GOALS
                if towards and -1 <= turn <= 1:  # it reaches what lies ahead only
                    turned = self._headings[place] + (3 if action == PICK_UP else 0)
                    arrow = self._rasteriser.shapes(own, kernels.ARROW, colour, turned, fill=0.37)
                    arrow[:, :2] = 0.5 * (self._centres[0] + self._centres[place + 1])
                    kernels.draw_shapes(frame, arrow)


def _rise(goal: bool) -> float:
    """How far what is drawn on a cell moves up for the arrows, in sizes of a hexagon."""
    return 0.27 if goal else 0.12
