"""Observations, which determine the state index of an ant, and their registry.

Actions and rewards do not depend on the observation, but on the paper's state.
"""

from __future__ import annotations

import ast
import inspect
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from textwrap import dedent
from types import SimpleNamespace
from typing import Any

from taichi_ants.errors import AntsError, checked_whole, expect, shown, unusable, whole
from taichi_ants.registry import Registry
from taichi_ants.rules.inputs import Vector
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN, SEES_CUE
from taichi_ants.task.states import CELL_LETTERS, name_of_codes

AHEAD = (-1, 0, 1)
# Tables of this many rows have 5 * 2**20 values; kernels index several tables with 32 bits.
MAX_STATES = 1 << 20
# Names of a view, and of the methods of a view in kernels.
_OF_VIEWS = (
    *("carries", "paper_state", "codes", "levels", "ants", "other_nest_ants", "nearer"),
    *("strongest", "own_level", "entries", "keys", "items"),
)
_VIEWS = 3000  # the number of views, and of names of states, that a check tries


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

    >>> task.observations.get("ants").parts
    (2, 6, 6, 6)
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
        return (_registered, (self.name,)) if registered else object.__reduce_ex__(self, 2)

    @property
    def parts(self) -> tuple[int, ...]:
        """The number of values of each part of a state index, `shape` or (n_states,)."""
        return self.shape or (self.n_states,)

    @property
    def ahead(self) -> tuple[int, ...]:
        """The indices in `cells` of the cells left, forward and right."""
        return tuple(self.cells.index(cell) for cell in AHEAD)


def of_codes(
    encode: Callable[[Any], int],
    names: tuple[str, str] = CELL_LETTERS,
    cells: tuple[int, ...] = AHEAD,
    **more: Any,
) -> Observation:
    """Return an observation whose state is the load, then a code of each cell, as digits.

    `names` has a letter for each code, for an ant without food and with food.
    """
    base, n, name = len(names[0]), len(cells), encode.__name__
    name_of, shape = name_of_codes(n, *names), (2, *[base] * n)
    return Observation(name, 2 * base**n, encode, cells, name_of, shape=shape, **more)


# The package's `__init__` adds the built-in ones.
OBSERVATIONS: Registry[Observation] = Registry(
    "observation", "taichi_ants.task.observations.register", {}
)


def _registered(name: str) -> Observation:
    """Return an observation for a pickle, which would otherwise hold the registry."""
    return OBSERVATIONS.get(name)


def register(observation: Observation) -> Observation:
    """Return an observation after registering it; it replaces your own one of the same name.

    Raises AntsError if the name is not an identifier or belongs to a built-in observation, a field
    does not have the right form, or a state index is outside its range.

    >>> def loads(view):
    ...     return view.carries
    >>> task.observations.register(Observation("loads", 2, loads)).name
    'loads'
    """
    expect("observation", observation, Observation)
    name, encode = observation.name, observation.encode
    cells, shape = observation.cells, observation.shape
    OBSERVATIONS.check_new(name)
    n_states = checked_whole(f"n_states of {name!r}", observation.n_states, 1, MAX_STATES)
    # Kernels cannot compile lambdas.
    is_function = inspect.isfunction(encode) and encode.__name__ != "<lambda>"
    has_encode = is_function and len(inspect.signature(encode).parameters) == 1
    has_cells = isinstance(cells, tuple) and len({*cells}) == len(cells)
    has_cells = has_cells and {*AHEAD} <= {*cells} <= {*range(-2, 4)}
    reads = observation.reads if isinstance(observation.reads, tuple) else ("",)
    in_view = [*map(str, reads), *(f"own_{read}" for read in reads)]
    has_reads = len({*in_view, *_OF_VIEWS}) == len(in_view) + len(_OF_VIEWS)
    has_reads = has_reads and all(map(str.isidentifier, in_view))
    has_shape = isinstance(shape, tuple) and (not shape or math.prod(shape) == n_states)
    for field, fits, form in (
        ("encode", has_encode, "a function of one argument, defined with def"),
        ("cells", has_cells, "a tuple of -1, 0, 1, and optionally -2, 2 and 3, each once"),
        ("reads", has_reads, "a tuple of names of fields, each once, unlike other names in a view"),
        ("shape", has_shape, f"a tuple of whole numbers whose product is n_states, {n_states}"),
    ):
        if not fits:
            raise AntsError(
                f"{field} of {name!r} is {shown(getattr(observation, field))}; it must be {form}; "
                "see taichi_ants.task.Observation."
            )
    _try_in_python(observation)
    return OBSERVATIONS.add(name, observation)


def _try_in_python(observation: Observation) -> None:
    """Compute and name many states; AntsError if a function fails or leaves its range."""
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
            shows_cue, codes = (ground[n] == EMPTY) & (nearer[n] == 1), ground[n] >> 2
        else:
            shows_cue, codes = 2 * visible >= max(strongest, 2), ground[n] & 3
        codes[shows_cue] = SEES_CUE
        left, forward, right = codes[ahead]
        yield _View(
            carries=carries[n],
            paper_state=carries[n] << 6 | left << 4 | forward << 2 | right,
            codes=Vector(codes),
            levels=Vector(levels),
            strongest=strongest,
            ants=Vector(ants[n]),
            other_nest_ants=Vector((ants[n] == 0) & (ground[n] == OBSTACLE) & (trails[n] > 1)),
            nearer=Vector(nearer[n]),
            own_level=trail[0],
            **{name: Vector(np.roll(levels, 1 + r)) for r, name in enumerate(observation.reads)},
            **{f"own_{name}": trail[-1] for name in observation.reads},
        )
