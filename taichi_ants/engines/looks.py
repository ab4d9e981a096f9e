"""What an ant can look at, as observations read it, in kernels."""

from collections.abc import Callable
from functools import cache
from typing import Any

import taichi as ti

from taichi_ants import runtime
from taichi_ants.engines.trial import last_line
from taichi_ants.errors import unusable
from taichi_ants.task.constants import EMPTY
from taichi_ants.task.observations import Observation
from taichi_ants.task.rules.vision import see_carrying, see_foraging, state_index


@cache
def look_type(observation: Observation, dense: bool) -> Any:
    """The struct that `row` reads, levels as f32 if dense; vectors go by the cells in view."""
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


@ti.func
def judge(half: ti.template(), look: ti.template(), observation: ti.template()):
    """Complete a look, whose codes say what the cells hold so far."""
    left, forward, right = ti.static(observation.ahead)
    for k in ti.static(range(len(observation.cells))):
        # No branch: Taichi cannot compile one that is of no use, where a row reads no codes.
        look.codes[k] = ti.select(
            look.carries == 1,
            see_carrying(look.codes[k], look.nearer[k]),
            see_foraging(
                half,
                look.codes[k],
                ti.select(look.codes[k] == EMPTY, look.levels[k], 0),
                look.strongest,
            ),
        )
    look.percept = state_index(
        look.carries, look.codes[left], look.codes[forward], look.codes[right]
    )


def is_percept(observation: Observation) -> bool:
    """Whether the row is the percept itself, so that no look is needed: the paper's."""
    return observation.name == "paper"


@cache
def row_function(observation: Observation) -> Callable[..., Any]:
    """`row` of an observation for kernels.

    Raises:
        AntsError: Taichi cannot compile it; the message says why.
    """
    row, look_of = ti.func(observation.row), look_type(observation, False)

    @ti.kernel
    def row_of_nothing() -> ti.i32:
        return row(look_of(strongest=1))

    if not observation.row.__module__.startswith("taichi_ants."):
        try:
            with runtime.quiet():
                row_of_nothing()
        except Exception as error:
            raise unusable(observation, last_line(error)) from None
    return row
