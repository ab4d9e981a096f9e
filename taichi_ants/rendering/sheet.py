"""A policy on one sheet: what the ant does in each state.

The states stand in two halves, foraging and carrying, ordered by the cell ahead, then by the other
cells in view. A sheet shows the states in which something was learned, or all that an ant can come
into; of very many the first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from taichi_ants.checks import checked_q_values, checked_task
from taichi_ants.errors import checked_flag, expect
from taichi_ants.grid.constants import HEADING_STEPS, N_HEADINGS
from taichi_ants.grid.hexgrid import centre_of
from taichi_ants.rendering import colours, text
from taichi_ants.rendering.marks import CELL_LETTERS, Mark, ants, cell, cell_colour, marks
from taichi_ants.rendering.observed import Observation, possible_states, task_and_letters
from taichi_ants.rendering.panel import fill
from taichi_ants.rendering.rasteriser import draw_marks
from taichi_ants.task import Task
from taichi_ants.task.constants import ACTION_NAMES, GIVE, PICK_UP, RIGHT
from taichi_ants.task.states import TASK_NAMES

MOST = 256  # states of a half that are drawn
_HARDLY = 0.01  # of the usual spread: below, nothing was learned

# Lengths in pixels.
WIDTH, _MARGIN, _COLUMNS = 1280, 20, 8
_TILE = (WIDTH - 2 * _MARGIN) // _COLUMNS
_HEXAGON = _TILE / 5.7
_SMALL, _LARGE = 18, 27  # sizes of text
_TOP, _HEADING, _BELOW = 145, 70, 47  # heights of what stands above all, a half; below a state

_HALVES = ("Foraging (without food)", "Carrying (with food)")
_EXPLANATION = (
    "A drawing is a state: what the ant sees{}. The arrow and the word are its best action.",
    "The longer the bar, the worse the second best action; where the bar is empty, it is as good.",
    "E empty, O obstacle (or the outside), T trail, S nearer to the queen.",
)
_PALE = 0.4  # how much of its colours a state keeps in which nothing was learned
_GOALS = "FQ"
_ARROW_COLOURS = {PICK_UP: colours.CELL_FOOD, GIVE: colours.CELL_QUEEN}


def usual_spread(q_values: np.ndarray, observation: Observation) -> float:
    """By how much the action values (n_states, 5) of a state usually differ.

    The mean of the gaps from the best to the worst, over the possible states with values that
    differ; 0 where there are none.
    """
    rows = q_values.astype(np.float64)[list(possible_states(observation))]
    spreads = np.ptp(rows, axis=1)
    return float(spreads[spreads > 0].mean()) if spreads.any() else 0.0


def clarity(values: np.ndarray, spread: float) -> float:
    """How clear the best of action values (5,) is, from 0 to 1.

    The gap from the best to the second best as a share of `spread`, the table's `usual_spread`: a
    state's own values would make every hair's breadth look like a clear choice.
    """
    *_, second, best = np.sort(values.astype(np.float64)).tolist()
    return min(1.0, (best - second) / spread)


def learned(values: np.ndarray, spread: float) -> bool:
    """Whether action values (5,) differ by 1 % of the table's `usual_spread` or more.

    Below, the best action may be the one that was tried least rather than one that is good.
    """
    gap = float(np.ptp(values.astype(np.float64)))
    return gap > 0 and gap >= _HARDLY * spread


def policy_sheet(
    q_values: np.ndarray,
    title: str = "Policy",
    *,
    complete: bool = False,
    task: Task | None = None,
) -> np.ndarray:
    """The sheet of a policy, uint8 (height, 1280, 3).

    Args:
        q_values: float (n_states, 5), finite action values.
        title: Stands above it, in ASCII.
        complete: Whether to draw all states that can occur, and not only those in which something
            was learned; the others are pale.
        task: Whose states they are; None is the paper's.

    Raises:
        AntsError: The table is no policy of the task, or the title no text.
    """
    task = checked_task(Task() if task is None else task)
    table = checked_q_values(q_values, task)
    expect("title", title, str)
    complete = checked_flag("complete", complete)
    spread = usual_spread(table, task.sees)
    states = [_State(row, table[row], spread, task.sees) for row in possible_states(task.sees)]
    view = _View(task.sees)
    halves = [[one for one in states if one.carries == carries] for carries in (False, True)]
    drawn = [
        sorted((one for one in half if complete or one.learned), key=view.order)[:MOST]
        for half in halves
    ]
    tile_height = view.height + _BELOW
    heights = [_HEADING + max(1, math.ceil(len(some) / _COLUMNS)) * tile_height for some in drawn]
    sheet = np.full((_TOP + sum(heights) + _MARGIN, WIDTH, 3), colours.channels(colours.PAGE))
    _write_head(sheet, title, task.sees)
    top = _TOP
    for half, some, name, height in zip(halves, drawn, _HALVES, heights, strict=True):
        _write_heading(sheet, top, name, half, len(some))
        for place, state in enumerate(some):
            row, column = divmod(place, _COLUMNS)
            y = top + _HEADING + row * tile_height
            _draw_tile(sheet, state, view, _MARGIN + column * _TILE, y, spread)
        top += height
    return sheet


class _State:
    """A state with its action values (5,); no letters where its name has another form."""

    def __init__(
        self, row: int, values: np.ndarray, spread: float, observation: Observation
    ) -> None:
        self.row = row
        self.values = values
        self.learned = learned(values, spread)
        self.name = observation.name_of(row)
        task, self.letters = task_and_letters(observation, row)
        self.carries = task == TASK_NAMES[1]


class _View:
    """Where an ant and the cells that it sees lie in the picture of a state."""

    def __init__(self, observation: Observation) -> None:
        self.turns = observation.cells
        self.headings = np.array(observation.cells) % N_HEADINGS
        steps = [HEADING_STEPS[heading] for heading in self.headings]
        centres = centre_of([(0, 0, 0), *steps], _HEXAGON)
        low, high = centres[:, 1].min(), centres[:, 1].max()
        self.height = round(float(high - low) + 1.87 * _HEXAGON)
        middle = np.array([_TILE / 2, (self.height - high - low) / 2])
        self.own, self.seen = centres[0] + middle, centres[1:] + middle

    def order(self, state: _State) -> list[int]:
        """Sorts by the cell ahead, then by the others."""
        letters = list(state.letters)
        if letters:
            letters.insert(0, letters.pop(self.turns.index(0)))
        return [*(CELL_LETTERS.find(letter[0]) for letter in letters), state.row]


def _write_head(sheet: np.ndarray, title: str, observation: Observation) -> None:
    room = WIDTH - 2 * _MARGIN
    text.write(sheet, title, _MARGIN, _MARGIN + _LARGE, _LARGE, room=room)
    ahead = " to its left, ahead and to its right" if len(observation.cells) == 3 else ""
    for number, line in enumerate(_EXPLANATION):
        y = _MARGIN + 2 * _LARGE + number * 1.5 * _SMALL
        text.write(sheet, line.format(ahead), _MARGIN, y + 7, _SMALL, colours.FAINT_INK)


def _write_heading(
    sheet: np.ndarray, top: int, name: str, states: list[_State], drawn: int
) -> None:
    y = top + round(1.7 * _LARGE)
    text.write(sheet, name, _MARGIN, y, _LARGE)
    n = sum(state.learned for state in states)
    words = f"{n} of {len(states)} states learned" if n else "nothing was learned here"
    if drawn == MOST:
        words += f"; {MOST} are shown"
    text.write(sheet, words, WIDTH - _MARGIN, y, _SMALL, colours.FAINT_INK, align="right")


def _draw_tile(
    sheet: np.ndarray, state: _State, view: _View, left: int, top: int, spread: float
) -> None:
    """Draw a state, and below it the best action and how clear it is."""
    corner, middle = np.array([left, top]), left + _TILE / 2
    best = np.flatnonzero(state.values == state.values.max()).tolist() if state.learned else []
    _draw_cells(sheet, state, view, corner)
    own = corner + view.own
    ant = ants(own + (0, 0.2 * _HEXAGON), 0, np.array([state.carries]), _HEXAGON, 0.62 * _HEXAGON)
    draw_marks(sheet, ant, *_arrows(state, view, corner, best))
    y = top + view.height + 15
    if not state.learned:
        picture = sheet[top : top + view.height, left : left + _TILE]
        picture[:] = _PALE * picture + (1 - _PALE) * 255
        text.write(sheet, "not learned", middle, y, _SMALL, colours.FAINT_INK, align="middle")
        return
    words = " / ".join(ACTION_NAMES[action] for action in best)
    colour = _ARROW_COLOURS.get(best[0], colours.CHOSEN)
    text.write(sheet, words, middle, y, _SMALL, colour, align="middle", room=_TILE)
    length = 0.72 * _TILE
    fill(sheet, middle - length / 2, y + 8, length, 6, colours.CELL_EMPTY)
    filled = length * clarity(state.values, spread)
    fill(sheet, middle - length / 2, y + 8, filled, 6, colour)


def _draw_cells(sheet: np.ndarray, state: _State, view: _View, corner: np.ndarray) -> None:
    """Draw the ant's cell and those in view, with their letters, or with the state's name."""
    radius = 0.96 * _HEXAGON
    letters = state.letters or ["E"] * len(view.seen)
    tables = [cell("E", corner + view.own, radius)]
    tables += [
        cell(letter, corner + centre, radius)
        for letter, centre in zip(letters, view.seen, strict=True)
    ]
    draw_marks(sheet, *tables)
    for letter, centre in zip(state.letters, view.seen, strict=False):
        if letter not in _GOALS:
            x, y = (corner + centre).tolist()
            text.write_on(sheet, letter, (x, y - 0.12 * _HEXAGON), _HEXAGON, cell_colour(letter))
    if not state.letters:
        (x, y), name = corner.tolist(), state.name.partition(" ")[2]
        size = round(0.6 * _HEXAGON)
        text.write(sheet, name, x + _TILE / 2, y + size, size, align="middle", room=_TILE)


def _arrows(
    state: _State, view: _View, corner: np.ndarray, actions: list[int]
) -> Iterator[np.ndarray]:
    """An arrow to where a move goes, from the food that is picked up, or to the queen."""
    for action in actions:
        colour = _ARROW_COLOURS.get(action, colours.CHOSEN)
        for place, turn in enumerate(view.turns):
            towards = state.letters[place : place + 1] == ["Q" if action == GIVE else "F"]
            if action <= RIGHT:
                towards = turn == action - 1
            if towards and -1 <= turn <= 1:  # it reaches what lies ahead only
                heading = view.headings[place] + (3 if action == PICK_UP else 0)
                middle = corner + 0.55 * view.own + 0.45 * view.seen[place]
                yield marks(middle, 0.37 * _HEXAGON, Mark.ARROW, colour, heading)
