"""The registry of observations.

To add one to the package, write a file in this folder and add it to `BUILT_IN`. To add your own
observation, call `register` from a plugin file.
"""

from __future__ import annotations

import inspect
import math

from taichi_ants.errors import AntsError, checked_whole, expect, shown
from taichi_ants.task.observations.ants import ANTS
from taichi_ants.task.observations.ants_seen import ANTS_SEEN
from taichi_ants.task.observations.five_cells import FIVE_CELLS
from taichi_ants.task.observations.observation import AHEAD, OBSERVATIONS, Observation
from taichi_ants.task.observations.paper import PAPER
from taichi_ants.task.observations.queues import QUEUES
from taichi_ants.task.observations.six_cells import SIX_CELLS
from taichi_ants.task.observations.trail_levels import TRAIL_LEVELS
from taichi_ants.task.observations.trial import try_in_python

BUILT_IN = (PAPER, FIVE_CELLS, SIX_CELLS, TRAIL_LEVELS, ANTS_SEEN, ANTS, QUEUES)
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
    for text in ("letters", "summary"):
        expect(f"{text} of {name!r}", getattr(observation, text), str)
    checked_whole(f"n_states of {name!r}", observation.n_states, 1, MAX_STATES)
    # Kernels cannot compile lambdas.
    named = inspect.isfunction(encode) and encode.__name__ != "<lambda>"
    if not named or len(inspect.signature(encode).parameters) != 1:
        raise AntsError(
            f"encode of {name!r} is {shown(encode)}; it must be a function of one argument, "
            "defined with def; see taichi_ants.task.Observation."
        )
    known = isinstance(cells, tuple) and all(cell in range(-2, 4) for cell in cells)
    if not known or len(set(cells)) < len(cells) or not set(AHEAD) <= set(cells):
        raise AntsError(
            f"cells of {name!r} is {shown(cells)}; it must be a tuple of -1, 0, 1, and optionally "
            "-2, 2 and 3, each once."
        )
    _check_reads(observation)
    shape = observation.shape
    expect(f"shape of {name!r}", shape, tuple)
    lengths = [checked_whole(f"shape of {name!r}", length) for length in shape]
    if shape and math.prod(lengths) != observation.n_states:
        raise AntsError(
            f"shape of {name!r} is {shape}, whose product is not its n_states, "
            f"{observation.n_states}; correct one of them."
        )
    try_in_python(observation)
    return OBSERVATIONS.add(name, observation)


def _check_reads(observation: Observation) -> None:
    reads = observation.reads
    expect(f"reads of {observation.name!r}", reads, tuple)
    taken = {*_OF_VIEWS, *(f"own_{name}" for name in reads if isinstance(name, str))}
    for name in reads:
        is_word = isinstance(name, str) and name.isidentifier()
        if not is_word or name in taken or f"own_{name}" in _OF_VIEWS:
            raise AntsError(
                f"reads of {observation.name!r} contains {shown(name)}; it must contain names of "
                f"fields, each once, and neither they nor own_NAME can be names in a view."
            )
        taken.add(name)
