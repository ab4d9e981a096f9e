"""The arguments of the kernel of independent runs: each number and each array once.

n runs of one learner with tables of n_states rows. Arrays of runs are flat, one run behind the
other. Each has so many tables, and so many times 8 floats and integers: then compilers know that
addresses in a row differ in their last bits alone, which saves Dyna-Q a tenth of its time.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import taichi as ti
from taichi.types.ndarray_type import NdarrayType

_I32 = ti.types.ndarray(dtype=ti.i32, ndim=1)
_U8 = ti.types.ndarray(dtype=ti.u8, ndim=1)
_U64 = ti.types.ndarray(dtype=ti.u64, ndim=1)
_F32 = ti.types.ndarray(dtype=ti.f32, ndim=1)
_F64 = ti.types.ndarray(dtype=ti.f64, ndim=1)
_DTYPES = {ti.i32: np.int32, ti.u8: np.uint8, ti.u64: np.uint64, ti.f32: np.float32, ti.f64: float}

FIELDS = {
    "n_runs": ti.i32,
    "n_episodes": ti.i32,
    "max_steps": ti.i32,
    "size": ti.i32,  # cells of the world
    # The task.
    "falls": ti.i32,  # by how much a trail falls per tick: 1, or 0 without evaporation
    "level": ti.i32,  # of a deposit
    "cap": ti.i32,  # of deposits that add
    "continuing": ti.i32,  # 1 if a delivery is no terminal state
    "rewards": _I32,  # (5,) by event
    # The world.
    "world": _I32,  # (size,) packed cells at the start of an episode, see `packing`
    "trails": _I32,  # (size,) trails at the start, under food too
    "closer": _U8,  # (size,) a bit for each heading that leads nearer to the queen
    "compass": _I32,  # see `rules.actions`
    # The runs.
    "start_cells": _I32,  # (n,)
    "start_headings": _I32,  # (n,)
    "settings": _F64,  # (n * columns,): `layout.SETTINGS`, then the hyperparameters
    "epsilon": _F64,  # (n,) of the next episode
    "random_states": _U64,  # (n,)
    "streams": _U64,  # (n * n_episodes,): the stream of each episode without learning
    "tables": ti.i32,
    "floats_by_8": ti.i32,
    "integers_by_8": ti.i32,
    "q": _F32,
    "floats": _F32,
    "integers": _I32,
    "cells": _I32,  # (n * (size + EXTRA_CELLS),) the packed cells of each run
    # What comes out.
    "outcomes": ti.types.ndarray(dtype=ti.i32, ndim=3),  # (3, n, n_episodes): `layout.OUTCOMES`
    "trace": ti.types.ndarray(dtype=ti.i32, ndim=2),  # (n * n_episodes * max_steps, 12)
    "trace_errors": _F32,  # a TD error for each step
    "trace_tables": _F32,  # a table for each step
}

RunArguments = ti.types.argpack(**FIELDS)


class Job:
    """A kernel and its arguments. At first it does nothing, which is how a kernel compiles."""

    def __init__(self, kernel: Callable[[Any], None]) -> None:
        self._kernel = kernel
        nothing = {
            name: np.zeros((1,) * kind.ndim, _DTYPES[kind.dtype])
            if isinstance(kind, NdarrayType)
            else 0
            for name, kind in FIELDS.items()
        }
        self._arguments = RunArguments(**nothing)

    def put(self, **values: Any) -> None:
        """Set arguments by name. Flat arrays are views of what is given; empty ones stay out."""
        for name, value in values.items():
            if isinstance(value, np.ndarray) and FIELDS[name].ndim == 1:
                value = value.reshape(-1)
            if not isinstance(value, np.ndarray) or value.size:
                setattr(self._arguments, name, value)

    def launch(self) -> None:
        """Run the kernel."""
        self._kernel(self._arguments)
