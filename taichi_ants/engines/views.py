"""The view of an ant in kernels, from which observations compute state indices."""

from functools import cache
from typing import Any

import taichi as ti

from taichi_ants.task.constants import EMPTY
from taichi_ants.task.observations import Observation
from taichi_ants.task.rules.vision import see_by_level, see_carrying, state_index


@cache
def view_type(observation: Observation, dense: bool, reads_dense: tuple[bool, ...] = ()) -> Any:
    """Return the struct type of views: vectors over the cells in view, levels f32 if dense.

    `reads_dense` says so for each pheromone that the observation reads; by default, none is.
    """
    n = len(observation.cells)
    level = ti.f32 if dense else ti.i32
    of_cells = ti.types.vector(n, ti.i32)
    read: dict[str, Any] = {}
    for i, name in enumerate(observation.reads):
        kind = ti.f32 if reads_dense and reads_dense[i] else ti.i32
        read |= {name: ti.types.vector(n, kind), f"own_{name}": kind}
    return ti.types.struct(
        carries=ti.i32,
        paper_state=ti.i32,
        codes=of_cells,
        levels=ti.types.vector(n, level),
        strongest=level,
        ants=of_cells,
        other_nest_ants=of_cells,
        nearer=of_cells,
        own_level=level,
        **read,
    )


@ti.func
def fill_codes(
    half: ti.template(), homing: ti.template(), view: ti.template(), observation: ti.template()
):
    """Complete a view: replace the ground in `codes` by the paper's codes, and set `paper_state`.

    `half` says whether the view of the outbound cue is "half"; `homing` is the view of the homing
    cue, or "" for the compass.
    """
    left, forward, right = ti.static(observation.ahead)
    for k in ti.static(range(len(observation.cells))):
        # Not a branch: Taichi cannot compile an unused one, if an observation reads no codes.
        level = ti.select(view.codes[k] == EMPTY, view.levels[k], 0)
        carrying = 0
        if ti.static(homing == ""):
            carrying = see_carrying(view.codes[k], view.nearer[k])
        else:
            carrying = see_by_level(homing == "half", view.codes[k] >> 2, level, view.strongest)
        foraging = see_by_level(half, view.codes[k] & 3, level, view.strongest)
        view.codes[k] = ti.select(view.carries == 1, carrying, foraging)
    view.paper_state = state_index(
        view.carries, view.codes[left], view.codes[forward], view.codes[right]
    )
