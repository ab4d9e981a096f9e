"""The view of an ant in kernels, from which observations compute state indices."""

from collections.abc import Callable
from functools import cache
from typing import Any

import taichi as ti

from taichi_ants import runtime
from taichi_ants.engines.plugin_check import last_line
from taichi_ants.errors import unusable
from taichi_ants.task.constants import EMPTY
from taichi_ants.task.observations import Observation
from taichi_ants.task.rules.vision import see_carrying, see_foraging, state_index


@cache
def view_type(observation: Observation, dense: bool) -> Any:
    """Return the struct type for `encode`: vectors over cells in view, levels f32 if dense."""
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
        strangers=of_cells,
        nearer=of_cells,
        own_level=level,
    )


@ti.func
def judge(half: ti.template(), view: ti.template(), observation: ti.template()):
    """Complete a view: replace the ground in `codes` by the paper's codes, and set the percept."""
    left, forward, right = ti.static(observation.ahead)
    for k in ti.static(range(len(observation.cells))):
        # Not a branch: Taichi cannot compile an unused one, if an observation reads no codes.
        view.codes[k] = ti.select(
            view.carries == 1,
            see_carrying(view.codes[k], view.nearer[k]),
            see_foraging(
                half,
                view.codes[k],
                ti.select(view.codes[k] == EMPTY, view.levels[k], 0),
                view.strongest,
            ),
        )
    view.percept = state_index(
        view.carries, view.codes[left], view.codes[forward], view.codes[right]
    )


@cache
def encode_function(observation: Observation) -> Callable[..., Any]:
    """Return an observation's `encode` for kernels; AntsError if Taichi cannot compile it."""
    encode, view_of = ti.func(observation.encode), view_type(observation, False)

    @ti.kernel
    def encode_nothing() -> ti.i32:
        return encode(view_of(strongest=1))

    if not observation.encode.__module__.startswith("taichi_ants."):
        try:
            with runtime.quiet():
                encode_nothing()
        except Exception as error:
            raise unusable(observation, last_line(error)) from None
    return encode
