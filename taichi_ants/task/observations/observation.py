"""The class of observations, which determine the state index of an ant.

Actions and rewards do not depend on the observation, but on the paper's state.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from taichi_ants.registry import Registry
from taichi_ants.task.states import CELL_LETTERS, name_of_codes

AHEAD = (-1, 0, 1)


@dataclass(frozen=True)
class Observation:
    """A mapping from the view of an ant to a state index.

    The view of an ant has these whole numbers, except that levels are floats if trails evaporate
    exponentially or spread. Those marked (k) have an entry for each cell in `cells`.

    - `carries`: 1 with food, else 0; `paper_state`: the paper's state, 0 to 127.
    - `codes` (k): 0 E, 1 O, 2 T or S, 3 F or Q, relative to the strongest trail ahead.
    - `levels` (k): The trail level if the cell is empty or has an ant on it, else 0.
    - `ants` (k): 0 for no ant, 1 for an ant without food, 2 for an ant with food.
    - `other_nest_ants` (k): 1 if an ant of another nest is on the cell, where `ants` is 0.
    - `nearer` (k): 1 if the cell is nearer to the queen than the ant's own.
    - `strongest`: The level of the strongest trail ahead; `own_level`: the ant's own cell.
    - `NAME` (k), for each NAME in `reads`: The level of this field, like `levels`; `own_NAME`: that
      of the ant's own cell.

    Trails and levels are those of the task's outbound cue. If the homing cue is a pheromone, those
    of ants with food are its levels, and `nearer` is 1 if the level exceeds `own_level`.

    Attributes:
        name: The name that tasks use.
        n_states: The number of states, at least 1.
        encode: A function of the view that returns the state index, from 0 to n_states - 1. It is
            compiled for the kernels. It computes with whole numbers: arithmetic, comparisons, `if`,
            `for` over a `range`, `min`, `max` and `abs`. Its only `return` is its last line.
        reads: The names of fields to read, or "trail"; the task must have these fields.
        cells: The cells in view, as headings relative to the ant's, each from -2 to 3. They must
            include -1, 0 and 1, the cells ahead.
        name_of: A function that returns the name of a state for people.
        summary: A line for listings.
        letters: The meaning of letters in names other than the paper's E, O, T, S, F and Q.
        shape: The number of values of each part of a state index, if it has several parts.
            Environments show neural networks each part.
    """

    name: str
    n_states: int
    encode: Callable[[Any], int]
    cells: tuple[int, ...] = AHEAD
    name_of: Callable[[int], str] = str
    summary: str = ""
    letters: str = ""
    shape: tuple[int, ...] = ()
    reads: tuple[str, ...] = ()

    def __reduce__(self) -> Any:
        # A pickle holds only the name, because reading it requires the registered observation.
        registered = self.name in OBSERVATIONS.names() and OBSERVATIONS.get(self.name) is self
        return (_named, (self.name,)) if registered else object.__reduce_ex__(self, 2)

    @property
    def parts(self) -> tuple[int, ...]:
        """The number of values of each part of a state index: `shape`, or (n_states,)."""
        return self.shape or (self.n_states,)

    @property
    def ahead(self) -> tuple[int, ...]:
        """The indices in `cells` of the cells left, forward and right."""
        return tuple(self.cells.index(cell) for cell in AHEAD)


def of_codes(
    encode: Callable[[Any], int],
    names: tuple[str, str] = CELL_LETTERS,
    cells: tuple[int, ...] = AHEAD,
    summary: str = "",
    letters: str = "",
) -> Observation:
    """Return an observation whose state is the load, then a code of each cell, as digits.

    `names` has a letter for each code, for an ant without food and with food.
    """
    base, n, name = len(names[0]), len(cells), encode.__name__
    name_of, shape = name_of_codes(n, *names), (2, *[base] * n)
    return Observation(name, 2 * base**n, encode, cells, name_of, summary, letters, shape)


# The package's `__init__` adds the built-in ones.
OBSERVATIONS: Registry[Observation] = Registry(
    "observation", "taichi_ants.task.observations.register", {}
)


def _named(name: str) -> Observation:
    return OBSERVATIONS.get(name)
