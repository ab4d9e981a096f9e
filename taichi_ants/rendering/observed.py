"""What pictures know of the states of an observation."""

from __future__ import annotations

from collections.abc import Sequence

from taichi_ants.task import Observation, observations
from taichi_ants.task.states import REACHABLE_STATES

PAPER = observations.get("paper")


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
