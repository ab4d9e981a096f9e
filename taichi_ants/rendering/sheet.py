"""A policy on one sheet: what the ant does in each of the 100 states that it can come into.

The states stand in two halves, foraging and carrying. Each half has four blocks, by the cell ahead;
a block has a row for each cell to the left and a column for each cell to the right.
"""

from __future__ import annotations

import math

import numpy as np

from taichi_ants.constants import (
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
from taichi_ants.errors import AntsError
from taichi_ants.hexgrid import AxialGrid
from taichi_ants.rendering import colours, text
from taichi_ants.rendering.panel import fill
from taichi_ants.rendering.rasteriser import Rasteriser
from taichi_ants.rendering.scene import write_letter
from taichi_ants.rendering.viewport import Viewport
from taichi_ants.states import CELL_LETTERS, REACHABLE_STATES, State, state_index

DEFAULT_WIDTH = 1920
HARDLY = 0.01
SMALLEST_WIDTH, LARGEST_WIDTH = 1200, 4096

_HALVES = ("Foraging (without food)", "Carrying (with food)")
_AHEAD = (
    ("ahead: empty", "ahead: obstacle", "ahead: trail", "ahead: food"),
    ("ahead: empty", "ahead: obstacle", "ahead: nearer to the queen", "ahead: queen"),
)
_EXPLANATION = (
    "Each picture shows what the ant sees: the cells to its left, ahead and to its right. "
    "The arrow and the word below it are its best action.",
    "The bar tells how clear the choice is: the gap from the best action value to the second best. "
    "It is full where the gap is as large as the mean gap from best to worst, over all states.",
    "Pale, hardly visited: the values differ by less than 1 % of that. Paler, not visited: "
    "they are equal. Empty places are states that cannot occur.",
    "E empty, O obstacle (also the outside and other ants), T trail, F food, "
    "S nearer to the queen, Q queen.",
)
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
    return np.flatnonzero(values == np.max(values)).tolist()


def usual_spread(q_values: np.ndarray) -> float:
    """By how much the action values (128, 5) of a state usually differ.

    The mean of the gaps from the best to the worst, over the reachable states with values that
    differ; 0 where there are none.
    """
    rows = np.asarray(q_values, dtype=np.float64)[list(REACHABLE_STATES)]
    spreads = np.ptp(rows, axis=1)
    return float(spreads[spreads > 0].mean()) if spreads.any() else 0.0


def clarity(values: np.ndarray, spread: float) -> float:
    """How clear the best of action values (5,) is, from 0 to 1.

    The gap from the best to the second best as a share of `spread`, the table's `usual_spread`: a
    state's own values would make every hair's breadth look like a clear choice. NaN where all
    values are equal.
    """
    worst, *_, second, best = np.sort(np.asarray(values, dtype=np.float64)).tolist()
    return min(1.0, (best - second) / spread) if best > worst else math.nan


def hardly_learned(values: np.ndarray, spread: float) -> bool:
    """Whether action values (5,) differ by less than 1 % of the table's `usual_spread`."""
    return float(np.ptp(np.asarray(values, dtype=np.float64))) < HARDLY * spread


def policy_sheet(
    q_values: np.ndarray, title: str = "Policy", width: int = DEFAULT_WIDTH
) -> np.ndarray:
    """The sheet of a policy, uint8 (height, width, 3).

    Args:
        q_values: float (128, 5), finite action values.
        title: Stands above it, in ASCII.
        width: In pixels, 1200 to 4096.

    Raises:
        AntsError: The table is no policy, or the width is not allowed.
    """
    table = np.asarray(q_values)
    if table.shape != (N_STATES, N_ACTIONS) or table.dtype.kind not in "fiu":
        raise AntsError(
            f"q_values is {table.dtype} {table.shape}; it must be numbers of shape "
            f"({N_STATES}, {N_ACTIONS})."
        )
    if width not in range(SMALLEST_WIDTH, LARGEST_WIDTH + 1):
        raise AntsError(
            f"the width is {width!r}; it must be a whole number of pixels from {SMALLEST_WIDTH} to "
            f"{LARGEST_WIDTH}."
        )
    return _Sheet(table, int(width)).draw(title)


class _Sheet:
    """Where everything lies; all lengths follow from the width."""

    def __init__(self, table: np.ndarray, width: int) -> None:
        self._table = table
        self._spread = usual_spread(table)
        self._width = width
        self._small = round(width / 150)  # sizes of text
        self._large = round(width / 75)
        self._margin = round(width / 64)
        self._row_label = round(1.6 * self._small)
        block_gap = round(width / 80)
        self._block_pitch = (width - 2 * self._margin + block_gap) // 4
        self._tile_width = (self._block_pitch - block_gap - self._row_label) // 4
        hexagon = self._tile_width / 5.5
        self._picture_height = round(3.55 * hexagon)
        self._tile_height = self._picture_height + round(2.3 * self._small)
        self._heading = round(3.9 * self._large)  # of a half, with the labels of its blocks
        self._half_height = self._heading + 4 * self._tile_height + round(0.5 * self._large)
        self._top = round(3.0 * self._large) + len(_EXPLANATION) * round(1.6 * self._small)
        self._picture = _Picture(self._tile_width, self._picture_height, hexagon)

    def draw(self, title: str) -> np.ndarray:
        height = self._top + 2 * self._half_height
        sheet = np.empty((height, self._width, 3), dtype=np.uint8)
        sheet[:] = colours.channels(colours.PAGE)
        y = self._margin + self._large
        title = text.shortened(title, self._large, self._width - 2 * self._margin)
        text.write(sheet, title, self._margin, y, self._large)
        y += round(0.4 * self._large)
        for line in _EXPLANATION:
            y += round(1.6 * self._small)
            text.write(sheet, line, self._margin, y, self._small, colours.FAINT_INK)
        for carries in (False, True):
            self._draw_half(sheet, carries, self._top + self._half_height * carries)
        return sheet

    def _draw_half(self, sheet: np.ndarray, carries: bool, top: int) -> None:
        y = top + round(1.6 * self._large)
        text.write(sheet, _HALVES[carries], self._margin, y, self._large)
        letters = CELL_LETTERS[carries]
        for ahead, label in enumerate(_AHEAD[carries]):
            left = self._margin + ahead * self._block_pitch
            y = top + self._heading - round(0.35 * self._small)
            tiles = left + self._row_label
            text.write(sheet, label, tiles, y - round(1.5 * self._small), self._small)
            for code, letter in enumerate(letters):
                x = tiles + (code + 0.5) * self._tile_width
                name = f"right {letter}"
                text.write(sheet, name, x, y, self._small, colours.FAINT_INK, align="middle")
                y_row = top + self._heading + (code + 0.4) * self._tile_height
                self._write_upwards(sheet, f"left {letter}", left, y_row)
            for on_left in range(4):
                for on_right in range(4):
                    state = State(carries, on_left, ahead, on_right)
                    x = tiles + on_right * self._tile_width
                    self._draw_tile(
                        sheet, state, x, top + self._heading + on_left * self._tile_height
                    )

    def _write_upwards(self, sheet: np.ndarray, words: str, left: int, middle: float) -> None:
        """Write words from below to above, their middle at a height."""
        length = math.ceil(text.width(words, self._small)) + 2
        strip = np.empty((self._row_label, length, 3), dtype=np.uint8)
        strip[:] = colours.channels(colours.PAGE)
        text.write(strip, words, 1, self._small, self._small, colours.FAINT_INK)
        y = round(middle - length / 2)
        sheet[y : y + length, left : left + self._row_label] = np.rot90(strip)

    def _draw_tile(self, sheet: np.ndarray, state: State, left: int, top: int) -> None:
        index = state_index(state.carries, *state.view)
        if index not in REACHABLE_STATES:
            return
        values = self._table[index]
        best, clear = best_actions(values), clarity(values, self._spread)
        doubt = self._doubt(values)
        width, height = self._tile_width, self._picture_height
        picture = self._picture.draw(state, [] if doubt == _NOT_VISITED else best)
        if doubt:
            picture = (_PALE[doubt] * picture + (1 - _PALE[doubt]) * 255).astype(np.uint8)
        sheet[top : top + height, left : left + width] = picture
        y = top + height + round(0.75 * self._small)
        middle = left + width / 2
        if doubt:
            text.write(sheet, doubt, middle, y, self._small, colours.FAINT_INK, align="middle")
            return
        words = text.shortened(
            " / ".join(ACTION_NAMES[action] for action in best), self._small, width
        )
        colour = _ARROW_COLOURS.get(best[0], colours.CHOSEN)
        text.write(sheet, words, middle, y, self._small, colour, align="middle")
        y += round(0.4 * self._small)
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
