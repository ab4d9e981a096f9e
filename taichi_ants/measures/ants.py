"""The ants of a colony: their number, loads and places."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.errors import AntsError, array_of, expect, shown
from taichi_ants.grid.hexgrid import normal_form

if TYPE_CHECKING:
    from taichi_ants.engines.records import Snapshot
    from taichi_ants.worlds.world import World


def living(snapshot: Snapshot) -> int:
    """Return the number of living ants."""
    return len(snapshot.ant_cells)


def waiting_births(snapshot: Snapshot) -> int:
    """Return the number of food items that wait at the queens to become ants."""
    return snapshot.counts["waiting_births"]


def carriers(snapshot: Snapshot) -> float:
    """Return the share of the living ants that carry food; nan without ants."""
    return share_of(snapshot.ant_carries)


def foraging(snapshot: Snapshot) -> float:
    """Return the share of the living ants that are not idle; nan without ants."""
    return share_of(~snapshot.ant_idle)


def distance(snapshot: Snapshot) -> float:
    """Return the mean distance of the ants to the nearest queen in steps; nan without ants."""
    if not len(snapshot.ant_cells):
        return math.nan
    return int(snapshot.distances[snapshot.ant_cells].sum(dtype=np.int64)) / len(snapshot.ant_cells)


def occupancy(snapshot: Snapshot) -> np.ndarray:
    """Return the number of ants on each cell, int32 (grid.size,)."""
    return np.bincount(snapshot.ant_cells, minlength=snapshot.grid.size).astype(np.int32)


def regions(snapshot: Snapshot) -> dict[str, float]:
    """Return the share of the living ants in each region of the world, by its name.

    The shares refer to the living ants on any cell, and are nan without ants. AntsError if the
    world has no regions.
    """
    return {
        name: share_of(np.isin(snapshot.ant_cells, snapshot.grid.index(cells)))
        for name, cells in regions_of(snapshot.world).items()
    }


def regions_of(world: World | None) -> Mapping[str, np.ndarray]:
    """Return the cells of the regions of a world by name; AntsError if it has none."""
    if world is None or not world.regions:
        raise AntsError(
            "the measure 'regions' needs a world with regions; add them with World.with_regions, "
            "or with a table [world.regions] in a sweep file."
        )
    return world.regions


def share_in(regions: Mapping[str, Any]) -> Callable[[Snapshot], dict[str, float]]:
    """Return a function for `register`: the share of the ants in each region, by its name.

    Args:
        regions: The cells of each region, (n, 3) in cube coordinates, by name.

    The shares refer to the living ants on any cell, and are nan without ants. Regions can share
    cells.

        measures.register("near", measures.share_in({"left": [(3, 0, 0)], "right": [(0, 3, 0)]}))

    Raises:
        AntsError: A region does not have cells of this form. The first use raises it if a cell is
            outside the world.
    """
    expect("regions", regions, Mapping)
    listed = {str(name): _checked_cells(str(name), cells) for name, cells in regions.items()}
    if not listed:
        raise AntsError("regions is empty; give the cells of at least one region by its name.")

    def share_in_regions(snapshot: Snapshot) -> dict[str, float]:
        return {
            name: share_of(np.isin(snapshot.ant_cells, snapshot.grid.index(cells)))
            for name, cells in listed.items()
        }

    return share_in_regions


def _checked_cells(name: str, cells: Any) -> np.ndarray:
    given = array_of(f"the region {shown(name)}", cells)
    if given.ndim != 2 or given.shape[-1] != 3 or given.dtype.kind not in "iu" or not len(given):
        raise AntsError(
            f"the region {shown(name)} is {shown(cells)}; give cells (x, y, z) in whole numbers, "
            "an array of shape (n, 3)."
        )
    return normal_form(given)


def share_of(which: np.ndarray) -> float:
    """Return the share of true entries; nan for an empty array."""
    return int(np.count_nonzero(which)) / len(which) if len(which) else math.nan
