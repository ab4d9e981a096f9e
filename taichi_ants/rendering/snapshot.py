"""What a picture shows: a world with its ants at one moment, as `Colony.snapshot` gives it."""

from __future__ import annotations

import numpy as np

from taichi_ants.engines.records import Snapshot
from taichi_ants.errors import expect
from taichi_ants.worlds.world import World


def at_start(world: World, seed: int = 0, n: int = 1) -> Snapshot:
    """A world with n ants as an episode starts; raises as `World.start` does."""
    expect("world", world, World)
    cells, headings = world.start(seed, n)
    nothing = np.zeros(n, dtype=bool)
    return Snapshot(world.grid, world.ground(), world.trail_levels(), cells, headings, nothing)
