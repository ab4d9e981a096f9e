"""What a picture shows: a world with its ants at one moment, as `Colony.snapshot` gives it."""

from __future__ import annotations

import numpy as np

from taichi_ants.engines.colony.colony import ColonySnapshot as Snapshot
from taichi_ants.errors import AntsError, expect
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.worlds.world import World


def at_start(world: World, seed: int = 0, n: int = 1) -> Snapshot:
    """A world with n ants as an episode starts; raises as `World.start` does."""
    expect("world", world, World)
    cells, headings = world.start(seed, n)
    nothing = np.zeros(n, dtype=bool)
    return Snapshot(world.grid, world.ground(), world.trail_levels(), cells, headings, nothing)


def check_snapshot(snapshot: Snapshot) -> None:
    """Refuse what the kernels could not bear.

    Raises:
        AntsError: It is no snapshot, an array has the wrong shape or type, or an ant a place or
            heading that does not exist.
    """
    expect("the snapshot", snapshot, Snapshot)
    expect("grid", snapshot.grid, AxialGrid)
    expect("ant_cells", snapshot.ant_cells, np.ndarray)
    size, n = snapshot.grid.size, len(snapshot.ant_cells)
    for name, shape, kinds, words in (
        ("ground", (size,), "u", "unsigned whole numbers"),
        ("trail", (size,), "iuf", "numbers"),
        ("ant_cells", (n,), "iu", "whole numbers"),
        ("ant_headings", (n,), "iu", "whole numbers"),
        ("ant_carries", (n,), "b", "bool"),
    ):
        array = getattr(snapshot, name)
        expect(name, array, np.ndarray)
        if array.shape != shape or array.dtype.kind not in kinds:
            raise AntsError(
                f"{name} is {array.dtype} {array.shape}; it must be an array of {words} of shape "
                f"{shape}."
            )
    for name, limit in (("ant_cells", size), ("ant_headings", N_HEADINGS)):
        values = getattr(snapshot, name)
        if n and not 0 <= values.min() <= values.max() < limit:
            raise AntsError(
                f"{name} holds values from {values.min()} to {values.max()}; they must lie between "
                f"0 and {limit - 1}."
            )
    if not snapshot.grid.exists[snapshot.ant_cells].all():
        raise AntsError("ant_cells holds a cell outside the world; ants must stand in it.")
