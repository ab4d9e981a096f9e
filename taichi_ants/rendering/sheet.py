"""A policy on one sheet: what the ant does in each state.

The states stand in two halves, foraging and carrying, ordered by the cell ahead, then by the one to
the left, then by the one to the right. A sheet shows the states in which something was learned, or
all 100 that an ant can come into.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from taichi_ants.errors import AntsError, checked_flag, expect, shown
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.grid.randomness import whole
from taichi_ants.rendering import colours, text
from taichi_ants.rendering.panel import fill
from taichi_ants.rendering.rasteriser import Rasteriser
from taichi_ants.rendering.scene import write_letter
from taichi_ants.rendering.viewport import Viewport
from taichi_ants.task.constants import (
    ACTION_NAMES,
    GIVE,
    LEFT,
    N_ACTIONS,
    N_STATES,
    PICK_UP,
    RIGHT,
    SEES_EMPTY,
    SEES_GOAL,
    SEES_LURE,
    SEES_OBSTACLE,
)
from taichi_ants.task.states import (
    CELL_LETTERS,
    REACHABLE_STATES,
    State,
    state_from_index,
    state_index,
)

# Width in pixels and states side by side, of a sheet of what was learned and of all states. The
# first is read at the width of a page, the second needs a screen of its own.
DEFAULT_WIDTH, _COLUMNS = 1280, 9
COMPLETE_WIDTH, _COMPLETE_COLUMNS = 1920, 16
SMALLEST_WIDTH, LARGEST_WIDTH = 800, 4096
HARDLY = 0.01

_HALVES = ("Foraging (without food)", "Carrying (with food)")
_EXPLANATION = (
    "A drawing is a state: what the ant sees to its left, ahead and to its right. "
    "The arrow and the word are its best action.",
    "The longer the bar, the worse the second best action; where the bar is empty, it is as good.",
    "E empty, O obstacle (or the outside), T trail, F food, S nearer to the queen, Q queen.",
)
_NOTHING = "nothing was learned here"
# How much of a picture's colours is left, by the words that stand below it.
_NOT_VISITED, _HARDLY_VISITED = "not visited", "hardly visited"
_PALE = {_NOT_VISITED: 0.35, _HARDLY_VISITED: 0.55}
_FLOOR_NEARER = 0xDCE3F2
_TRAIL = 120  # of the ramp
_ARROW_COLOURS = {PICK_UP: colours.CELL_FOOD, GIVE: colours.CELL_QUEEN}
# The pictures' cells among those of ranges (2, 2, 2): the ant's, then left, ahead, right.
_CELLS = np.array([(0, 0, 0), (1, 0, 1), (1, 0, 0), (1, 1, 0)])
_HEADINGS = np.array([5, 0, 1])
_SQRT_3 = math.sqrt(3.0)


def best_actions(values: np.ndarray) -> list[int]:
    """The actions of the highest value among values (5,); all five if all are equal."""
    values = _numbers("values", values, (N_ACTIONS,))
    return np.flatnonzero(values == np.max(values)).tolist()


def usual_spread(q_values: np.ndarray) -> float:
    """By how much the action values (128, 5) of a state usually differ.

    The mean of the gaps from the best to the worst, over the reachable states with values that
    differ; 0 where there are none.
    """
    table = _numbers("q_values", q_values, (N_STATES, N_ACTIONS))
    rows = table.astype(np.float64)[list(REACHABLE_STATES)]
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
    q_values: np.ndarray, title: str = "Policy", width: int | None = None, *, complete: bool = False
) -> np.ndarray:
    """The sheet of a policy, uint8 (height, width, 3).

    Args:
        q_values: float (128, 5), finite action values.
        title: Stands above it, in ASCII.
        width: In pixels, 800 to 4096; None takes 1280, of a complete sheet 1920.
        complete: Whether to draw all 100 states that can occur, those not visited pale, and not
            only those in which something was learned.

    Raises:
        AntsError: The table is no policy, the title no text, or the width is not allowed.
    """
    table = _numbers("q_values", q_values, (N_STATES, N_ACTIONS))
    expect("title", title, str)
    complete = checked_flag("complete", complete)
    if width is None:
        width = COMPLETE_WIDTH if complete else DEFAULT_WIDTH
    if whole("the width", width) not in range(SMALLEST_WIDTH, LARGEST_WIDTH + 1):
        raise AntsError(
            f"the width is {width}; it must be a whole number of pixels from {SMALLEST_WIDTH} to "
            f"{LARGEST_WIDTH}."
        )
    return _Sheet(table, int(width), complete).draw(title)


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

    def __init__(self, table: np.ndarray, width: int, complete: bool) -> None:
        self._table = table
        self._spread = usual_spread(table)
        self._width = width
        self._columns = _COMPLETE_COLUMNS if complete else _COLUMNS
        self._margin = round(width / 64)
        self._tile_width = (width - 2 * self._margin) // self._columns
        self._small = round(min(width / 70, self._tile_width / 7))  # sizes of text
        self._large = round(1.5 * self._small)
        hexagon = self._tile_width / 5.7
        self._picture_height = round(3.6 * hexagon)
        self._tile_height = self._picture_height + round(2.6 * self._small)
        self._heading = round(2.6 * self._large)  # of a half
        self._top = round(2.6 * self._large) + len(_EXPLANATION) * round(1.5 * self._small)
        self._halves = [self._states(carries, complete) for carries in (False, True)]
        self._picture = _Picture(self._tile_width, self._picture_height, hexagon)

    def _states(self, carries: bool, complete: bool) -> list[State]:
        """The states of a half that are drawn, in their order."""
        views = itertools.product(range(4), repeat=3)
        states = [State(carries, left, ahead, right) for ahead, left, right in views]
        return [
            state
            for state in states
            if (index := state_index(carries, *state.view)) in REACHABLE_STATES
            and (complete or not self._doubt(self._table[index]))
        ]

    def _height(self, states: list[State]) -> int:
        rows = max(1, math.ceil(len(states) / self._columns))
        return self._heading + rows * self._tile_height

    def draw(self, title: str) -> np.ndarray:
        height = self._top + sum(map(self._height, self._halves)) + self._margin // 2
        sheet = np.empty((height, self._width, 3), dtype=np.uint8)
        sheet[:] = colours.channels(colours.PAGE)
        y = self._margin + self._large
        title = text.shortened(title, self._large, self._width - 2 * self._margin)
        text.write(sheet, title, self._margin, y, self._large)
        y += round(0.3 * self._large)
        for line in _EXPLANATION:
            y += round(1.5 * self._small)
            text.write(sheet, line, self._margin, y, self._small, colours.FAINT_INK)
        top = self._top
        for carries, states in enumerate(self._halves):
            self._draw_half(sheet, bool(carries), states, top)
            top += self._height(states)
        return sheet

    def _draw_half(self, sheet: np.ndarray, carries: bool, states: list[State], top: int) -> None:
        y = top + round(1.7 * self._large)
        text.write(sheet, _HALVES[carries], self._margin, y, self._large)
        number = sum(not self._doubt(self._table[state_index(carries, *s.view)]) for s in states)
        of_all = sum(state_from_index(index).carries == carries for index in REACHABLE_STATES)
        right = self._width - self._margin
        words = f"{number} of {of_all} states learned" if number else _NOTHING
        text.write(sheet, words, right, y, self._small, colours.FAINT_INK, align="right")
        for place, state in enumerate(states):
            row, column = divmod(place, self._columns)
            x = self._margin + column * self._tile_width
            self._draw_tile(sheet, state, x, top + self._heading + row * self._tile_height)

    def _draw_tile(self, sheet: np.ndarray, state: State, left: int, top: int) -> None:
        values = self._table[state_index(state.carries, *state.view)]
        best, clear = best_actions(values), clarity(values, self._spread)
        doubt = self._doubt(values)
        width, height = self._tile_width, self._picture_height
        picture = self._picture.draw(state, [] if doubt == _NOT_VISITED else best)
        if doubt:
            picture = (_PALE[doubt] * picture + (1 - _PALE[doubt]) * 255).astype(np.uint8)
        sheet[top : top + height, left : left + width] = picture
        y = top + height + round(0.85 * self._small)
        middle = left + width / 2
        if doubt:
            text.write(sheet, doubt, middle, y, self._small, colours.FAINT_INK, align="middle")
            return
        words = text.shortened(
            " / ".join(ACTION_NAMES[action] for action in best), self._small, width
        )
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
    """Draws an ant with the three cells that it sees, and its best actions as arrows."""

    def __init__(self, width: int, height: int, hexagon: float) -> None:
        grid = AxialGrid((2, 2, 2))
        shown = np.zeros(grid.size, dtype=bool)
        self._cells = grid.index(_CELLS)
        shown[self._cells] = True
        middle = (height - 2 * _SQRT_3 * hexagon) / 2  # free above and below
        self._viewport = Viewport(
            0, 0, width, height, hexagon, (width / 2, height - middle - 0.5 * _SQRT_3 * hexagon)
        )
        self._rasteriser = Rasteriser(grid, self._viewport, shown=shown)
        self._frame = np.empty((height, width, 3), dtype=np.uint8)
        self._size = grid.size

    def draw(self, state: State, actions: list[int]) -> np.ndarray:
        """The picture, uint8 (height, width, 3); valid until the next one is drawn."""
        of_cells = np.full(self._size, colours.PAGE, dtype=np.uint32)
        of_cells[self._cells[0]] = colours.CELL_EMPTY
        for cell, code in zip(self._cells[1:], state.view, strict=True):
            of_cells[cell] = _floor(state.carries, code)
        self._rasteriser.draw_colours(self._frame, of_cells)
        self._draw_things(state)
        self._draw_ant(state.carries)
        centres = self._viewport.centres(_CELLS[1:]).tolist()
        for code, centre in zip(state.view, centres, strict=True):
            write_letter(
                self._frame,
                CELL_LETTERS[state.carries][code],
                (centre[0], centre[1] - _rise(code) * self._viewport.hexagon),
                self._viewport.hexagon,
                floor=_floor(state.carries, code),
                beside=code == SEES_GOAL,
            )
        self._draw_arrows(state, actions)
        return self._frame

    def _draw_things(self, state: State) -> None:
        kernels = self._rasteriser.kernels
        shape, colour = (
            (kernels.QUEEN, colours.CELL_QUEEN)
            if state.carries
            else (kernels.FOOD, colours.CELL_FOOD)
        )
        cells = self._cells[1:][np.array(state.view) == SEES_GOAL]
        marks = self._rasteriser.shapes(cells, shape, fill=0.72)
        marks[:, 0] -= 0.58 * marks[:, 2]  # room for a letter beside them
        marks[:, 2] *= 0.6
        marks[:, 1] -= _rise(SEES_GOAL) * self._viewport.hexagon
        self._rasteriser.draw_shapes(self._frame, marks, _repeated(colour, len(marks)))

    def _draw_ant(self, carries: bool) -> None:
        kernels = self._rasteriser.kernels
        shape = kernels.ANT_WITH_FOOD if carries else kernels.ANT
        ant = self._rasteriser.shapes(self._cells[:1], shape, fill=0.62)
        ant[:, 1] += 0.2 * self._viewport.hexagon
        self._rasteriser.draw_shapes(self._frame, ant, _repeated(colours.ANT, 1))

    def _draw_arrows(self, state: State, actions: list[int]) -> None:
        """An arrow to where a move goes, from the food that is picked up, or to the queen."""
        hexagon = self._viewport.hexagon
        rows, of_rows = [], []
        for action in actions:
            if LEFT <= action <= RIGHT:
                places = [action]
            else:
                places = [place for place, code in enumerate(state.view) if code == SEES_GOAL]
            for place in places:
                centres = self._viewport.centres(_CELLS[[0, place + 1]])
                x, y = (0.5 * centres[0] + 0.5 * centres[1]).tolist()
                turned = _HEADINGS[place] + (3 if action == PICK_UP else 0)
                rows.append((x, y, 0.37 * hexagon, turned, self._rasteriser.kernels.ARROW, 1.0))
                of_rows.append(_ARROW_COLOURS.get(action, colours.CHOSEN))
        if rows:
            self._rasteriser.draw_shapes(
                self._frame, np.array(rows, np.float32), np.array(of_rows, np.uint32)
            )


def _rise(code: int) -> float:
    """How far what is drawn on a cell moves up for the arrows, in sizes of a hexagon."""
    return 0.27 if code == SEES_GOAL else 0.12


def _floor(carries: bool, code: int) -> int:
    """The colour of a cell by what the ant sees."""
    if code == SEES_LURE:
        return _FLOOR_NEARER if carries else int(colours.TRAIL_RAMP[_TRAIL])
    if code == SEES_GOAL:
        return colours.FLOOR_QUEEN if carries else colours.FLOOR_FOOD
    return {SEES_EMPTY: colours.CELL_EMPTY, SEES_OBSTACLE: colours.CELL_OBSTACLE}[code]


def _repeated(colour: int, n: int) -> np.ndarray:
    return np.full(n, colour, dtype=np.uint32)
