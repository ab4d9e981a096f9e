"""Trials of an observation on drawn views in Python, because kernels do not check its indices."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator
from textwrap import dedent
from types import SimpleNamespace
from typing import Any

from taichi_ants.errors import expect, unusable, whole
from taichi_ants.rules.inputs import Vector
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN, SEES_CUE
from taichi_ants.task.observations.observation import Observation

_VIEWS = 3000  # the number of views, and of names of states, that a check tries


def try_in_python(observation: Observation) -> None:
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
