"""What pictures know of the states of an observation."""

from __future__ import annotations

from collections.abc import Sequence

from taichi_ants.task import Observation, observations
from taichi_ants.task.states import REACHABLE_STATES, TASK_NAMES

PAPER = observations.get("paper")


def name_parts(observation: Observation, state: int) -> tuple[str, str, list[str]]:
    """The task in a state's name or "", the rest, and in it a letter or two for each cell in view.

    Of two letters the first tells the kind of cell, as in "T3". Names of other forms have none.
    """
    name = observation.name_of(state)
    task, _, rest = name.partition(" ")
    if task not in TASK_NAMES:
        return "", name, []
    letters = rest.split()
    one_each = len(letters) == len(observation.cells) and max(map(len, letters)) <= 2
    return task, rest, letters if one_each else []


def possible_states(observation: Observation) -> Sequence[int]:
    """The states that an ant can come into, as far as is known."""
    paper = observation.name == PAPER.name
    return REACHABLE_STATES if paper else range(observation.n_states)
