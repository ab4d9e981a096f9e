"""Render a policy sheet: the best action in each state for which something was learned.

There is one part for foraging and one for carrying, or a single part if state names have no task.
States are ordered by the cell ahead, then by the other cells in view. The policy is that of a file,
or of an ant that the script trains first. See docs/reference/rendering.md.
"""

from __future__ import annotations

from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    import math
    from collections.abc import Iterator, Sequence

    import numpy as np

    from taichi_ants.commands import render
    from taichi_ants.grid.constants import HEADING_STEPS, N_HEADINGS
    from taichi_ants.grid.hexgrid import centre_of
    from taichi_ants.learners.policies import checked_table
    from taichi_ants.rendering import colours, rasteriser, save_picture, text
    from taichi_ants.rendering.colours import Mark
    from taichi_ants.rendering.scene import fill, name_parts
    from taichi_ants.rendering.writers import check_file
    from taichi_ants.studies.command_line import Parser, given_world, run_command
    from taichi_ants.studies.plugins import load_plugin
    from taichi_ants.task import Observation, Task
    from taichi_ants.task.constants import ACTION_NAMES, GIVE, PICK_UP, RIGHT
    from taichi_ants.task.states import REACHABLE_STATES, TASK_NAMES

MOST = 128  # states drawn in each part
_HARDLY = 0.01  # share of the usual spread below which a state counts as not learned

# Lengths in pixels.
WIDTH, _MARGIN, _COLUMNS = 1280, 20, 8
_TILE = (WIDTH - 2 * _MARGIN) // _COLUMNS
_HEXAGON = _TILE / 5.7
_SMALL, _LARGE = 18, 27  # text sizes
_TOP, _HEADING, _BELOW = 145, 70, 47  # heights of the header, of a part's heading, below a state

_PARTS = {
    **dict(zip(TASK_NAMES, ("Foraging (without food)", "Carrying (with food)"), strict=True)),
    "": "States",
}
_EXPLANATION = (
    "A drawing is a state: what the ant sees. The arrow and the word are its best action.",
    "The longer the bar, the worse the second best action; where the bar is empty, it is as good.",
    "E empty, O obstacle (or the outside), T trail, S nearer to the queen",
)
_GOALS = "FQ"
_ARROW_COLOURS = {PICK_UP: colours.CELL_FOOD, GIVE: colours.CELL_QUEEN}


def possible_states(observation: Observation) -> Sequence[int]:
    """Return the states that can occur: the reachable ones of the paper, otherwise all states."""
    paper = observation.name == "paper"
    return REACHABLE_STATES if paper else range(observation.n_states)


def usual_spread(q_values: np.ndarray, observation: Observation) -> float:
    """Return the mean spread of action values, over possible states whose values differ."""
    spreads = np.ptp(q_values.astype(np.float64)[list(possible_states(observation))], axis=1)
    return float(spreads[spreads > 0].mean()) if spreads.any() else 0.0


def clarity(values: np.ndarray, spread: float) -> float:
    """Return the gap between the two best of action values (5,) as a share of the usual spread."""
    *_, second, best = np.sort(values.astype(np.float64)).tolist()
    return min(1.0, (best - second) / spread)


def learned(values: np.ndarray, spread: float) -> bool:
    """Return whether action values (5,) differ by 1 % of the usual spread or more.

    If they differ by less, the best action may just be the one that was tried least.
    """
    gap = float(np.ptp(values.astype(np.float64)))
    return gap > 0 and gap >= _HARDLY * spread


def policy_sheet(
    q_values: np.ndarray, title: str = "Policy", *, task: Task | None = None
) -> np.ndarray:
    """Return a picture of a policy's best actions, uint8 (height, 1280, 3), with a title.

    Args:
        q_values: float (n_states, 5), finite action values; or the `TrainingResult` of a single
            run, or a `Policy`.
        task: The task of the policy, which defines its states; None is the paper's.
    """
    task = Task() if task is None else task
    table = checked_table(q_values, task)
    observation, spread = task.sees, usual_spread(table, task.sees)
    picture = StateDrawing(observation)
    parts: dict[str, list[int]] = {}
    for state in possible_states(observation):
        parts.setdefault(name_parts(observation, state)[0], []).append(state)
    known = {
        name: [state for state in part if learned(table[state], spread)]
        for name, part in parts.items()
    }
    drawn = [sorted(states, key=picture.order)[:MOST] for states in known.values()]
    tile = picture.height + _BELOW
    heights = [_HEADING + max(1, math.ceil(len(states) / _COLUMNS)) * tile for states in drawn]
    sheet = np.full((_TOP + sum(heights) + _MARGIN, WIDTH, 3), colours.channels(colours.PAGE))
    write_head(sheet, title, observation)
    top = _TOP
    for (task_name, every), states, height in zip(parts.items(), drawn, heights, strict=True):
        n = len(known[task_name])
        words = f"{n} of {len(every)} states learned" if n else "nothing was learned here"
        if len(states) == MOST:
            words += f"; {MOST} are shown"
        y = top + round(1.7 * _LARGE)
        text.write(sheet, _PARTS[task_name], _MARGIN, y, _LARGE)
        text.write(sheet, words, WIDTH - _MARGIN, y, _SMALL, colours.FAINT_INK, align="right")
        for place, state in enumerate(states):
            row, column = divmod(place, _COLUMNS)
            x, y = _MARGIN + column * _TILE, top + _HEADING + row * tile
            part, values = sheet[y : y + tile, x : x + _TILE], table[state]
            best = np.flatnonzero(values == values.max()).tolist()
            part[: picture.height] = picture.draw(state, best)
            write_action(part, picture.height, best, clarity(values, spread))
        top += height
    return sheet


def write_head(sheet: np.ndarray, title: str, observation: Observation) -> None:
    room = WIDTH - 2 * _MARGIN
    text.write(sheet, title, _MARGIN, _MARGIN + _LARGE, _LARGE, room=room)
    *lines, letters = _EXPLANATION
    letters = "; ".join(filter(None, [letters, observation.letters])) + "."
    if not name_parts(observation, 0)[2]:
        letters = "The text in a drawing is the name or number of the state; cells have no letters."
    for number, line in enumerate([*lines, letters]):
        y = _MARGIN + 2 * _LARGE + number * 1.5 * _SMALL
        text.write(sheet, line, _MARGIN, y + 7, _SMALL, colours.FAINT_INK, room=room)


def write_action(tile: np.ndarray, top: int, best: list[int], clear: float) -> None:
    """Write the best actions below a state, with a bar of relative length `clear`."""
    words, size = " / ".join(ACTION_NAMES[action] for action in best), _SMALL
    while text.width(words, size) > _TILE:
        size -= 1
    ink, length = _ARROW_COLOURS.get(best[0], colours.CHOSEN), 0.72 * _TILE
    fill(tile, (_TILE - length) / 2, top + 23, length, 6, colours.CELL_EMPTY)
    fill(tile, (_TILE - length) / 2, top + 23, length * clear, 6, ink)
    text.write(tile, words, _TILE / 2, top + 15, size, ink, align="middle")


class StateDrawing:
    """Draws states: an ant, the cells that it sees, and its best actions as arrows."""

    def __init__(self, observation: Observation) -> None:
        self._observation = observation
        self._headings = np.array(observation.cells) % N_HEADINGS
        steps = [HEADING_STEPS[heading] for heading in self._headings]
        centres = centre_of([(0, 0, 0), *steps], _HEXAGON)
        low, high = centres[:, 1].min(), centres[:, 1].max()
        self.height = round(float(high - low) + 1.87 * _HEXAGON)
        centres += (_TILE / 2, (self.height - high - low) / 2)
        self._own, *self._seen = centres

    def order(self, state: int) -> list[int]:
        """Return a sort key: the cell ahead first, then the others."""
        *_, letters = name_parts(self._observation, state)
        if letters:
            letters.insert(0, letters.pop(self._observation.cells.index(0)))
        return [*(rasteriser.CELL_LETTERS.find(letter[0]) for letter in letters), state]

    def draw(self, state: int, actions: list[int]) -> np.ndarray:
        """Return the picture of a state, uint8 (height, width, 3)."""
        frame = np.full((self.height, _TILE, 3), colours.channels(colours.PAGE))
        task, rest, letters = name_parts(self._observation, state)
        carries, radius = np.array([task == TASK_NAMES[1]]), 0.96 * _HEXAGON
        seen = list(zip(letters or ["E"] * len(self._seen), self._seen, strict=True))
        shown = [("E", self._own), *seen]
        cells = [rasteriser.cell(letter, centre, radius) for letter, centre in shown]
        place = self._own + (0, 0.2 * _HEXAGON)
        ant = rasteriser.ants(place, 0, carries, _HEXAGON, 0.62 * _HEXAGON)
        rasteriser.draw_marks(frame, *cells, ant, *self._arrows(letters, actions))
        if not letters:  # the name has no letters of cells
            text.write(frame, rest, _TILE / 2, _SMALL, _SMALL, align="middle", room=_TILE)
        for letter, (x, y) in seen if letters else ():
            if letter not in _GOALS:
                place = x, y - 0.12 * _HEXAGON
                text.write_on(frame, letter, place, _HEXAGON, rasteriser.cell_colour(letter))
        return frame

    def _arrows(self, letters: list[str], actions: list[int]) -> Iterator[np.ndarray]:
        """Yield an arrow for each action: to the target of a move, from the food, to the queen."""
        for action in actions:
            for place, turn in enumerate(self._observation.cells):
                towards = turn == action - 1
                if action > RIGHT:  # pick up and give reach only the cells ahead
                    goal = letters[place : place + 1] == [_GOALS[action == GIVE]]
                    towards = goal and -1 <= turn <= 1
                if towards:
                    heading = self._headings[place] + (3 if action == PICK_UP else 0)
                    middle = 0.55 * self._own + 0.45 * self._seen[place]
                    colour = _ARROW_COLOURS.get(action, colours.CHOSEN)
                    yield rasteriser.marks(middle, 0.37 * _HEXAGON, Mark.ARROW, colour, heading)


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = Parser(__doc__)
    flags = ("--out", "--title", "--world", "--seed", "--plugin", "--policy", "--episodes")
    render.add_options(parser, flags, kind="sheet", out="results/renders/policy_sheet.png")
    return render.parse(parser, arguments)


def show(settings: argparse.Namespace) -> None:
    """Write the sheet, and print a summary."""
    check_file(settings.out, "one picture", ".png")
    load_plugin(settings.plugin)
    q_values, task, title = render.find_policy(settings, given_world(settings))
    save_picture(settings.out, policy_sheet(q_values, title, task=task))
    print(f"{settings.out}: the best action in each state")


if __name__ == "__main__":
    run_command(lambda: show(parse_arguments()))
