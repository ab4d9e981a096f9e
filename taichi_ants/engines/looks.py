"""What an ant can look at, as observations read it, in kernels."""

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np
import taichi as ti

from taichi_ants.engines.trial import refuse_what_fails
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN
from taichi_ants.task.observations import Observation
from taichi_ants.task.observations.registry import AHEAD
from taichi_ants.task.rules.vision import see_carrying, see_foraging, state_index

_LOOKS = 20_000  # of a trial


@cache
def look_type(observation: Observation, dense: bool) -> Any:
    """The struct that `row` of an observation reads; vectors have an entry for each cell in view.

    Args:
        observation: The observation.
        dense: Whether trail levels are f32, not i32.
    """
    n = len(observation.cells)
    level = ti.f32 if dense else ti.i32
    of_cells = ti.types.vector(n, ti.i32)
    return ti.types.struct(
        carries=ti.i32,
        percept=ti.i32,
        codes=of_cells,
        levels=ti.types.vector(n, level),
        strongest=level,
        ants=of_cells,
        nearer=of_cells,
        own_level=level,
    )


def positions_ahead(observation: Observation) -> tuple[int, ...]:
    """Where the cells left, forward and right stand among the cells in view."""
    return tuple(observation.cells.index(cell) for cell in AHEAD)


def is_percept(observation: Observation) -> bool:
    """Whether the row is the percept itself, so that no look is needed: the paper's."""
    return observation.name == "paper"


@cache
def row_function(observation: Observation) -> Callable[..., Any]:
    """`row` of an observation for kernels; one from outside of the package has passed a trial.

    Raises:
        AntsError: It cannot be used; the message says why.
    """
    row = ti.func(observation.row)
    if not observation.row.__module__.startswith("taichi_ants."):
        refuse_what_fails(
            f"observation {observation.name!r}",
            partial(_fault_of, observation, row),
            "taichi_ants.task.Observation",
        )
    return row


def _fault_of(observation: Observation, row: Callable[..., Any], dense: bool) -> str:
    """Compute the rows of many looks, which must lie in the table."""
    cells = len(observation.cells)
    left, forward, right = positions_ahead(observation)
    look_of = look_type(observation, dense)
    level_type = ti.f32 if dense else ti.i32
    table = ti.types.ndarray(dtype=ti.i32, ndim=2)

    @ti.kernel
    def look_at(
        carries: table, grounds: table, ants: table, nearer: table, trails: table, rows: table
    ):
        ti.loop_config(serialize=True)
        for i in range(rows.shape[0]):
            look = look_of(carries=carries[i, 0], own_level=ti.cast(trails[i, cells], level_type))
            for k in ti.static(range(cells)):
                if grounds[i, k] == EMPTY:
                    look.levels[k] = ti.cast(trails[i, k], level_type)
                look.ants[k] = ants[i, k]
                look.nearer[k] = nearer[i, k]
            ahead = ti.max(look.levels[left], look.levels[forward])
            look.strongest = ti.max(ahead, look.levels[right])
            for k in ti.static(range(cells)):
                look.codes[k] = ti.select(
                    look.carries == 1,
                    see_carrying(grounds[i, k], nearer[i, k]),
                    see_foraging(True, grounds[i, k], look.levels[k], look.strongest),
                )
            look.percept = state_index(
                look.carries, look.codes[left], look.codes[forward], look.codes[right]
            )
            rows[i, 0] = row(look)

    rng = np.random.default_rng(0)
    shape = (_LOOKS, cells)
    ants = np.where(rng.random(shape) < 0.3, rng.integers(0, 3, shape), 0)
    grounds = np.where(
        ants == 0, rng.choice([EMPTY, EMPTY, OBSTACLE, FOOD, QUEEN], shape), OBSTACLE
    )
    trails = 10.0 ** rng.uniform(-1, 6, (_LOOKS, cells + 1)) * rng.integers(
        0, 2, (_LOOKS, cells + 1)
    )
    carries = rng.integers(0, 2, (_LOOKS, 1))
    nearer = rng.integers(0, 2, shape)
    rows = np.zeros((_LOOKS, 1), np.int32)
    look_at(*(np.int32(array) for array in (carries, grounds, ants, nearer, trails)), rows)
    for outside in rows[(rows < 0) | (rows >= observation.n_states)]:
        return f"row gives {outside}, but it must lie between 0 and {observation.n_states - 1}"
    return ""
