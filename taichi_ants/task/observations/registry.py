"""The registry of observations.

To add one to the package, write a function in `built_in.py` and add a line to `BUILT_IN`. To add
your own observation, call `register` from a plugin file.
"""

from __future__ import annotations

import inspect
import math

from taichi_ants.errors import AntsError, checked_whole, expect, shown
from taichi_ants.task.observations.built_in import BUILT_IN
from taichi_ants.task.observations.observation import AHEAD, OBSERVATIONS, Observation
from taichi_ants.task.observations.trial import try_in_python

OBSERVATIONS.built_in = {observation.name: observation for observation in BUILT_IN}
get, names = OBSERVATIONS.get, OBSERVATIONS.names

# Tables of this many rows have 5 * 2**20 values; kernels index several tables with 32 bits.
MAX_STATES = 1 << 20
# Names of a view, and of the methods of a view in kernels.
_OF_VIEWS = (
    *("carries", "paper_state", "codes", "levels", "ants", "other_nest_ants", "nearer"),
    *("strongest", "own_level", "entries", "keys", "items"),
)


def register(observation: Observation) -> Observation:
    """Return an observation after registering it; it replaces your own one of the same name.

    Raises AntsError if the name is not an identifier or belongs to a built-in observation, a field
    does not have the right form, or a state index is outside its range.
    """
    expect("observation", observation, Observation)
    name, encode, cells = observation.name, observation.encode, observation.cells
    OBSERVATIONS.check_new(name)
    n_states = checked_whole(f"n_states of {name!r}", observation.n_states, 1, MAX_STATES)
    # Kernels cannot compile lambdas.
    is_function = inspect.isfunction(encode) and encode.__name__ != "<lambda>"
    reads = observation.reads if isinstance(observation.reads, tuple) else ("",)
    in_view = [str(read) for read in reads] + [f"own_{read}" for read in reads]
    shape = observation.shape if isinstance(observation.shape, tuple) else (0,)
    lengths = [length if isinstance(length, int) else 0 for length in shape]
    for field, fits, form in (
        (
            "encode",
            is_function and len(inspect.signature(encode).parameters) == 1,
            "a function of one argument, defined with def",
        ),
        (
            "cells",
            isinstance(cells, tuple)
            and len(set(cells)) == len(cells)
            and set(AHEAD) <= set(cells) <= set(range(-2, 4)),
            "a tuple of -1, 0, 1, and optionally -2, 2 and 3, each once",
        ),
        (
            "reads",
            len({*in_view, *_OF_VIEWS}) == len(in_view) + len(_OF_VIEWS)
            and all(map(str.isidentifier, in_view)),
            "a tuple of names of fields, each once, and neither they nor own_NAME can be names in "
            "a view",
        ),
        (
            "shape",
            not lengths or math.prod(lengths) == n_states,
            f"a tuple of whole numbers whose product is n_states, {n_states}",
        ),
    ):
        if not fits:
            raise AntsError(
                f"{field} of {name!r} is {shown(getattr(observation, field))}; it must be {form}; "
                "see taichi_ants.task.Observation."
            )
    try_in_python(observation)
    return OBSERVATIONS.add(name, observation)
