"""The one place where observations are registered.

An observation tells which row of its table of action values an ant looks at. What an ant can do and
what it is paid for never depends on it: these go by the percept, the paper's state. To add one,
write a file beside this one and a line in `__init__.py`; or call `register` from a file of your
own.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from taichi_ants.errors import AntsError, check_whole, shown

# Tables of this many rows hold 5 * 2**20 values; kernels index many of them by 32 bits.
MAX_STATES = 1 << 20
AHEAD = (-1, 0, 1)


@dataclass(frozen=True)
class Observation:
    """A way to number what an ant sees.

    Attributes:
        name: The name by which tasks call it.
        n_states: The rows of a table of action values, at least 1.
        row: A function of one argument, what the ant can look at, that returns the row, from 0 to
            n_states - 1. It is compiled for the kernels, so it computes with whole numbers alone:
            arithmetic, comparisons, `if`, and `for` over a `range`; no imports and no calls.
            Its argument has, each a whole number (levels are floats where trails halve or spread):
            `carries`, 1 with food, else 0; `percept`, the paper's state, 0 to 127; `codes`, what
            each cell in `cells` looks like (0 E, 1 O, 2 T or S, 3 F or Q; T is measured against
            the strongest trail of the three cells ahead); `levels`, the trail of each if it is
            empty or an ant stands there, else 0; `strongest`, the largest level of the three cells
            ahead that counts; `ants`, 0 for no ant there, 1 for one without food, 2 for one with
            food; `nearer`, 1 if the cell is nearer to the queen than the ant's own; and
            `own_level`, the trail on its own cell.
        cells: The cells in view: their headings relative to the ant's, each from -2 to 3; -1, 0
            and 1, the cells ahead, are among them.
        name_of: The name of a row for people.
        summary: One line for listings.
    """

    name: str
    n_states: int
    row: Callable[[Any], int]
    cells: tuple[int, ...] = AHEAD
    name_of: Callable[[int], str] = str
    summary: str = ""


_OBSERVATIONS: dict[str, Observation] = {}


def register(observation: Observation) -> Observation:
    """Make an observation known by its name.

    Raises:
        AntsError: The name is taken or not usable in files and on command lines, or a field has
            not the form that it must have.
    """
    if not isinstance(observation, Observation):
        raise AntsError(f"{shown(observation)} is not an Observation; wrap it in Observation(...).")
    name = observation.name
    if not isinstance(name, str) or not name.isidentifier():
        raise AntsError(
            f"{shown(name)} cannot name an observation; use letters, digits and underscores."
        )
    if name in _OBSERVATIONS:
        raise AntsError(f"an observation named {name!r} exists already; choose another name.")
    check_whole(f"n_states of {name!r}", observation.n_states, 1, MAX_STATES)
    row = observation.row
    named = inspect.isfunction(row) and row.__name__ != "<lambda>"  # kernels cannot take lambdas
    if not named or len(inspect.signature(row).parameters) != 1:
        raise AntsError(
            f"row of {name!r} is {shown(row)}; it must be a function of one argument that is "
            "written with def, see taichi_ants.task.Observation."
        )
    cells = observation.cells
    known = all(isinstance(cell, int) and -2 <= cell <= 3 for cell in cells)
    if not known or len(set(cells)) < len(cells) or not set(AHEAD) <= set(cells):
        raise AntsError(
            f"cells of {name!r} is {shown(cells)}; it must hold -1, 0 and 1, and may hold -2, 2 "
            "and 3, each once."
        )
    _OBSERVATIONS[name] = observation
    return observation


def get(name: str) -> Observation:
    """The observation of that name.

    Raises:
        AntsError: There is none; the message lists those that exist.
    """
    if not isinstance(name, str) or name not in _OBSERVATIONS:
        raise AntsError(
            f"there is no observation {shown(name)}; choose one of {', '.join(names())}."
        )
    return _OBSERVATIONS[name]


def names() -> tuple[str, ...]:
    """The names of all registered observations, in the order of registration."""
    return tuple(_OBSERVATIONS)
