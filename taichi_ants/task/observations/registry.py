"""The registry of observations.

To add one to the package, write a file in this folder and add it to `BUILT_IN`. To add your own
observation, call `register` from a plugin file.
"""

from __future__ import annotations

import ast
import inspect
import math
from collections.abc import Iterator
from textwrap import dedent
from types import SimpleNamespace
from typing import Any

from taichi_ants.errors import AntsError, checked_whole, expect, shown, unusable, whole
from taichi_ants.rules.inputs import Vector
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN, SEES_LURE
from taichi_ants.task.observations.ants import ANTS
from taichi_ants.task.observations.ants_seen import ANTS_SEEN
from taichi_ants.task.observations.five_cells import FIVE_CELLS
from taichi_ants.task.observations.observation import AHEAD, OBSERVATIONS, Observation
from taichi_ants.task.observations.paper import PAPER
from taichi_ants.task.observations.queues import QUEUES
from taichi_ants.task.observations.six_cells import SIX_CELLS
from taichi_ants.task.observations.trail_levels import TRAIL_LEVELS

BUILT_IN = (PAPER, FIVE_CELLS, SIX_CELLS, TRAIL_LEVELS, ANTS_SEEN, ANTS, QUEUES)
OBSERVATIONS.built_in = {observation.name: observation for observation in BUILT_IN}
get, names = OBSERVATIONS.get, OBSERVATIONS.names

# Tables of this many rows have 5 * 2**20 values; kernels index several tables with 32 bits.
MAX_STATES = 1 << 20
# Names of a view, and of the methods of a view in kernels.
_OF_VIEWS = (
    *("carries", "percept", "codes", "levels", "ants", "strangers", "nearer", "strongest"),
    *("own_level", "entries", "keys", "items"),
)
_VIEWS = 3000  # the number of views, and of names of states, that a check tries


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
    _try_functions(observation)
    return OBSERVATIONS.add(name, observation)


def _check_reads(observation: Observation) -> None:
    reads = observation.reads
    expect(f"reads of {observation.name!r}", reads, tuple)
    taken = {*_OF_VIEWS, *(f"own_{name}" for name in reads if isinstance(name, str))}
    for name in reads:
        if not isinstance(name, str) or not name.isidentifier() or name in taken:
            raise AntsError(
                f"reads of {observation.name!r} contains {shown(name)}; it must contain names of "
                "fields, each once, other than the names in a view."
            )
        if f"own_{name}" in _OF_VIEWS:
            raise AntsError(
                f"reads of {observation.name!r} contains {name!r}, but `own_{name}` of a view has "
                "another meaning; rename the field."
            )
        taken.add(name)


def _try_functions(observation: Observation) -> None:
    """Compute and name many states in Python, because kernels do not check their indices."""
    import numpy as np  # here, so that commands show their help without NumPy

    function, last = "encode", observation.n_states - 1
    try:
        (source,) = ast.parse(dedent(inspect.getsource(observation.encode))).body
        returns = [node for node in ast.walk(source) if isinstance(node, ast.Return)]
        if not isinstance(source, ast.FunctionDef) or returns != source.body[-1:]:
            raise ValueError("its only return must be its last line")
        with np.errstate(all="raise"):
            for view in _drawn_views(observation):
                state = whole("the state", observation.encode(view))
                if not 0 <= state <= last:
                    raise ValueError(f"it returns {state}, which must lie between 0 and {last}")
        function = "name_of"
        for state in np.linspace(0, last, min(last + 1, _VIEWS), dtype=int).tolist():
            expect(f"the name of state {state}", observation.name_of(state), str)
    except Exception as error:
        raise unusable(observation, f"{function} fails ({error})") from error


class _View(SimpleNamespace):
    """A drawn view; its message about a name that it does not have lists those that it has."""

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(
            f"a view has no `{name}`; choose one of {', '.join(vars(self))}, or add a field to "
            "`reads`"
        )


def _drawn_views(observation: Observation) -> Iterator[_View]:
    import numpy as np

    rng, shape = np.random.default_rng(0), (_VIEWS, len(observation.cells))
    ahead = list(observation.ahead)
    ants = rng.integers(0, 3, shape, np.int32) * (rng.random(shape) < 0.3)
    drawn = rng.choice([EMPTY, EMPTY, OBSTACLE, FOOD, QUEEN], shape)
    ground = np.where(ants > 0, OBSTACLE, drawn).astype(np.int32)
    nearer = rng.integers(0, 2, shape, np.int32)
    carries = rng.integers(0, 2, _VIEWS, np.int32)
    trails = rng.integers(0, 2, shape) * 10.0 ** rng.uniform(-1, 6, shape)
    for n in range(_VIEWS):
        trail = trails[n].astype(np.int32 if n % 2 else np.float32)
        levels = trail * ((ground[n] == EMPTY) | (ants[n] > 0))
        visible = trail * (ground[n] == EMPTY)
        strongest = visible[ahead].max()
        if carries[n]:
            lure, codes = (ground[n] == EMPTY) & (nearer[n] == 1), ground[n] >> 2
        else:
            lure, codes = 2 * visible >= max(strongest, 2), ground[n] & 3
        codes[lure] = SEES_LURE
        left, forward, right = codes[ahead]
        yield _View(
            carries=carries[n],
            percept=carries[n] << 6 | left << 4 | forward << 2 | right,
            codes=Vector(codes),
            levels=Vector(levels),
            strongest=strongest,
            ants=Vector(ants[n]),
            strangers=Vector((ants[n] == 0) & (ground[n] == OBSTACLE) & (trails[n] > 1)),
            nearer=Vector(nearer[n]),
            own_level=trail[0],
            **{name: Vector(np.roll(levels, 1 + r)) for r, name in enumerate(observation.reads)},
            **{f"own_{name}": trail[-1] for name in observation.reads},
        )
