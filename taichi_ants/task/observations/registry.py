"""The one place where observations are registered.

An observation gives the index of the state that an ant sees. Actions and rewards never depend on
it: these go by the percept, the paper's state. To add one, write a file beside this one and a line
in `__init__.py`; or call `register` from a file of your own.
"""

from __future__ import annotations

import ast
import inspect
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from operator import index
from textwrap import dedent
from types import SimpleNamespace
from typing import Any

from taichi_ants.errors import AntsError, check_new_name, checked_whole, expect, shown, unusable
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN, SEES_LURE

# Tables of this many rows hold 5 * 2**20 values; kernels index many of them by 32 bits.
MAX_STATES = 1 << 20
AHEAD = (-1, 0, 1)
_VIEWS = 3000  # and as many names of states, in a check


@dataclass(frozen=True)
class Observation:
    """A way to number what an ant sees.

    Attributes:
        name: The name by which tasks call it.
        n_states: The number of states, at least 1.
        encode: A function of one argument, the ant's view, that returns the state index, from 0 to
            n_states - 1. It is compiled for the kernels, so it computes with whole numbers alone:
            arithmetic, comparisons, `if`, and `for` over a `range`; no imports and no calls; and it
            ends with its only `return`. The view has, each a whole number (levels are floats where
            trails halve or spread): `carries`, 1 with food, else 0; `percept`, the paper's state, 0
            to 127; `codes`, what each cell in `cells` looks like (0 E, 1 O, 2 T or S, 3 F or Q; T
            is measured against the strongest trail of the three cells ahead); `levels`, the trail
            of each if it is empty or an ant stands there, else 0; `strongest`, the largest level of
            the three cells ahead that counts; `ants`, 0 for no ant there, 1 for one without food, 2
            for one with food; `nearer`, 1 if the cell is nearer to the queen than the ant's own;
            and `own_level`.
        cells: The cells in view: their headings relative to the ant's, each from -2 to 3; -1, 0 and
            1, the cells ahead, are among them.
        name_of: The name of a state for people.
        summary: One line for listings.
        letters: What letters in names mean that are not the paper's E, O, T, S, F and Q.
        shape: The sizes of the parts of a state index, if it has several, as digits; environments
            show them to neural networks.
    """

    name: str
    n_states: int
    encode: Callable[[Any], int]
    cells: tuple[int, ...] = AHEAD
    name_of: Callable[[int], str] = str
    summary: str = ""
    letters: str = ""
    shape: tuple[int, ...] = ()

    def __reduce__(self) -> Any:
        # Pickles hold the name: where they are read, the same observation is registered.
        registered = _OBSERVATIONS.get(self.name) is self
        return (get, (self.name,)) if registered else object.__reduce_ex__(self, 2)

    @property
    def parts(self) -> tuple[int, ...]:
        """The sizes of the parts of a state index: its `shape`, or the index itself."""
        return self.shape or (self.n_states,)

    @property
    def ahead(self) -> tuple[int, ...]:
        """Where the cells left, forward and right stand among the cells in view."""
        return tuple(self.cells.index(cell) for cell in AHEAD)


_OBSERVATIONS: dict[str, Observation] = {}


def register(observation: Observation) -> Observation:
    """Make an observation known by its name; it replaces your own observation of the same name.

    AntsError if the name is that of an observation of the package or not an identifier, a field
    does not have the form that it must have, or a state index is outside of the range.
    """
    expect("what is registered", observation, Observation)
    name = observation.name
    check_new_name("observation", name, (one for one in _OBSERVATIONS if _is_built_in(one)))
    expect(f"letters of {name!r}", observation.letters, str)
    checked_whole(f"n_states of {name!r}", observation.n_states, 1, MAX_STATES)
    encode, cells = observation.encode, observation.cells
    named = (
        inspect.isfunction(encode) and encode.__name__ != "<lambda>"
    )  # kernels cannot take lambdas
    if not named or len(inspect.signature(encode).parameters) != 1:
        raise AntsError(
            f"encode of {name!r} is {shown(encode)}; it must be a function of one argument that is "
            "written with def, see taichi_ants.task.Observation."
        )
    known = isinstance(cells, tuple) and all(cell in range(-2, 4) for cell in cells)
    if not known or len(set(cells)) < len(cells) or not set(AHEAD) <= set(cells):
        raise AntsError(
            f"cells of {name!r} is {shown(cells)}; it must be a tuple of -1, 0 and 1, and may "
            "hold -2, 2 and 3, each once."
        )
    expect(f"summary of {name!r}", observation.summary, str)
    shape = observation.shape
    expect(f"shape of {name!r}", shape, tuple)
    if shape and math.prod(checked_whole(f"shape of {name!r}", n) for n in shape) != (
        observation.n_states
    ):
        raise AntsError(
            f"shape of {name!r} is {shape}, whose product is not its n_states, "
            f"{observation.n_states}; mend one of them."
        )
    if not encode.__module__.startswith("taichi_ants."):
        _try_functions(observation)
    _OBSERVATIONS[name] = observation
    return observation


def _is_built_in(name: str) -> bool:
    return _OBSERVATIONS[name].encode.__module__.startswith("taichi_ants.")


def get(name: str) -> Observation:
    """The observation of that name; AntsError, which lists those that exist, if there is none."""
    if not isinstance(name, str) or name not in _OBSERVATIONS:
        raise AntsError(
            f"there is no observation {shown(name)}; choose one of {', '.join(names())}, or name "
            "the file that registers it with --plugin."
        )
    return _OBSERVATIONS[name]


def names() -> tuple[str, ...]:
    """The names of all registered observations, in the order of registration."""
    return tuple(_OBSERVATIONS)


def _try_functions(observation: Observation) -> None:
    """Compute and name many states, in Python: a kernel would not notice what is wrong."""
    import numpy as np  # not above: command lines show their help without it

    function, last = "encode", observation.n_states - 1
    try:
        (source,) = ast.parse(dedent(inspect.getsource(observation.encode))).body
        returns = [one for one in ast.walk(source) if isinstance(one, ast.Return)]
        if not isinstance(source, ast.FunctionDef) or returns != source.body[-1:]:
            raise ValueError("it needs one return, as its last line")
        with np.errstate(all="raise"):
            for view in _drawn_views(observation):
                state = observation.encode(view)
                if not 0 <= index(state) <= last:
                    raise ValueError(f"it gives {state}, but it must lie between 0 and {last}")
        function = "name_of"
        for state in np.linspace(0, last, min(last + 1, _VIEWS), dtype=int).tolist():
            expect(f"the name of state {state}", observation.name_of(state), str)
    except Exception as error:
        raise unusable(observation, f"{function} fails ({error})") from error


def _drawn_views(observation: Observation) -> Iterator[SimpleNamespace]:
    """Views of ants, in numbers of the types that kernels have."""
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
        yield SimpleNamespace(
            carries=carries[n],
            percept=carries[n] << 6 | left << 4 | forward << 2 | right,
            codes=_Vector(codes),
            levels=_Vector(levels),
            strongest=strongest,
            ants=_Vector(ants[n]),
            nearer=_Vector(nearer[n]),
            own_level=trail[0],
        )


class _Vector(tuple):
    """A vector that does not count from its end, as in kernels."""

    def __getitem__(self, k: Any) -> Any:
        if k < 0:
            raise IndexError(f"there is no entry {k}")
        return super().__getitem__(k)
