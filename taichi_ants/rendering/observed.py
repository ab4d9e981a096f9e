"""What pictures know of an observation: how many states it tells apart, and their names."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from taichi_ants.task.constants import N_STATES
from taichi_ants.task.states import REACHABLE_STATES, state_name


class Observation(NamedTuple):
    """What an ant sees.

    Attributes:
        name: Its name.
        n_states: How many states there are, the rows of a table.
        cells: Headings of the cells in view, relative to the ant's.
        name_of: The name of a state, for example "foraging E T O": the task, then a letter for
            each cell in view.
    """

    name: str
    n_states: int
    cells: tuple[int, ...]
    name_of: Callable[[int], str]


PAPER = Observation("paper", N_STATES, (-1, 0, 1), state_name)


def task_and_letters(observation: Observation, state: int) -> tuple[str, list[str]]:
    """The task in a state's name, and a letter or two for each cell in view; none if it has others.

    Of two letters the first tells the kind of cell, as in "T3".
    """
    task, *letters = observation.name_of(state).split()
    one_each = len(letters) == len(observation.cells) and max(map(len, letters)) <= 2
    return task, letters if one_each else []


def possible_states(observation: Observation) -> Sequence[int]:
    """The states that an ant can come into, as far as is known."""
    paper = observation.name == PAPER.name
    return REACHABLE_STATES if paper else range(observation.n_states)
