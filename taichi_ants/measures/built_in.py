"""The measures of the package of the state of a colony, and of its counts.

Measures of `counts` take numbers or arrays, so they also measure lone ants and finished runs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.errors import AntsError
from taichi_ants.features import FEATURES
from taichi_ants.measures.measure import COUNTS, MEASURES, Measure
from taichi_ants.task.constants import FOOD, OBSTACLE, QUEEN, Event

if TYPE_CHECKING:
    from taichi_ants.records import Snapshot
    from taichi_ants.worlds.world import World

Counts = Mapping[str, Any]


def ratio(part: Any, whole: Any) -> Any:
    """Return part / whole of numbers or arrays; nan where the whole is 0."""
    return part / np.where(np.asarray(whole) > 0, whole, math.nan)


def share_of(which: np.ndarray) -> float:
    """Return the share of true entries; nan for an empty array."""
    return int(np.count_nonzero(which)) / len(which) if len(which) else math.nan


def _deliveries_by(snapshot: Snapshot) -> dict[str, Any]:
    parts: dict[str, Any] = {}
    for owner in ("nest", "food", "caste"):
        numbers = snapshot.counts[f"{owner}_deliveries"]
        names = snapshot.names.get(f"{owner}s") or range(len(numbers))
        parts |= {f"{owner}_{n}": number for n, number in zip(names, numbers, strict=True)}
    return parts


def first_delivery(counts: Counts) -> Any:
    """Return the first passage time: the ticks up to the first delivery of the episode.

    Before the first delivery it is the number of ticks so far. Means over episodes are therefore
    restricted means (of survival analysis), which are at most the true ones.
    """
    first = counts["first_delivery"]
    return np.where(np.asarray(first) < 0, counts["ticks"], first)


def path_length(counts: Counts) -> Any:
    """Return the mean ticks from pick-up to delivery, of all loads delivered in the episode.

    An ant that walks straight to the queen from a pick-up k moves away from her needs k + 1 ticks.
    """
    return ratio(counts["carried"], counts["deliveries"])


@lru_cache(maxsize=256)
def shortest_path(world: World) -> float:
    """Return the fewest ticks from pick-up to delivery for the nearest food item of a world.

    It is d - 1, at least 1, where d is the number of steps from the food to the queen around
    obstacles, through cells that are empty or hold food. An ant picks up food from a neighbour
    cell and delivers it to a neighbour cell. Turns and other ants can make the path longer. The
    value is nan if the queen has no path to food.

    >>> measures.shortest_path(worlds.paper())
    17.0
    """
    ground, offsets = world.ground(), world.grid.offsets.astype(np.int64)
    seen, steps = ground == OBSTACLE, 0
    reached = np.flatnonzero(ground == QUEEN)
    while len(reached) and not (ground[reached] == FOOD).any():
        seen[reached] = True
        reached = np.unique(reached[:, None] + offsets)
        reached = reached[~seen[reached]]
        steps += 1
    return max(1.0, float(steps - 1)) if len(reached) else math.nan


def _path_ratio(snapshot: Snapshot) -> float:
    shortest = math.nan if snapshot.world is None else shortest_path(snapshot.world)
    return path_length(snapshot.counts) / shortest


def entropy(snapshot: Snapshot) -> dict[str, float]:
    """Return the normalised entropy of the levels of each pheromone field, by its name.

    It is -(sum of p log p) / log N. N is the number of cells that are not obstacles, and p is the
    level of each of them, divided by the sum of their levels. This is Shannon's entropy [1]_
    divided by its largest value, which is called Pielou's evenness [2]_. All of the pheromone in
    one cell gives 0, equal levels in all cells give 1. The value is nan for a field without
    pheromone, and in a world with one cell.

    .. [1] C. E. Shannon (1948), A mathematical theory of communication, Bell System Technical
       Journal 27, 379-423.
    .. [2] E. C. Pielou (1966), The measurement of diversity in different types of biological
       collections, Journal of Theoretical Biology 13, 131-144.
    """
    is_open = snapshot.ground != OBSTACLE
    return {name: _evenness(levels[is_open]) for name, levels in snapshot.fields.items()}


def _evenness(levels: np.ndarray) -> float:
    """Return the entropy of levels (n,) divided by the logarithm of n; nan if all are 0."""
    # Few levels differ, and exact sums do not depend on the order of cells.
    different, times = np.unique(levels[levels > 0].astype(float), return_counts=True)
    if len(levels) < 2 or not len(different):
        return math.nan
    pairs = list(zip(different.tolist(), times.tolist(), strict=True))
    total = math.fsum(n * level for level, n in pairs)
    shares = [(level / total, n) for level, n in pairs]
    summed = math.fsum(n * (p * math.log(p)) for p, n in shares if p > 0)
    return max(0.0, -summed / math.log(len(levels)))


def activity(snapshot: Snapshot) -> float:
    """Return the share of the ants that entered a cell by their own move in the last tick."""
    events = snapshot.ant_events
    return share_of((events == Event.ENTERED_EMPTY) | (events == Event.ENTERED_CUE))


def _distance(snapshot: Snapshot) -> float:
    if not len(snapshot.ant_cells):
        return math.nan
    return int(snapshot.distances[snapshot.ant_cells].sum(dtype=np.int64)) / len(snapshot.ant_cells)


def _regions(snapshot: Snapshot) -> dict[str, float]:
    if snapshot.world is None or not snapshot.world.regions:
        raise AntsError(
            "the measure 'regions' needs a world with regions; add them with World.with_regions, "
            "or with a table [world.regions] in a sweep file."
        )
    return {
        name: share_of(np.isin(snapshot.ant_cells, snapshot.grid.index(cells)))
        for name, cells in snapshot.world.regions.items()
    }


_LISTED = (
    Measure("deliveries", lambda c: c["deliveries"], "food items",
            "deliveries since the start of the episode", COUNTS),
    Measure("deliveries_by", _deliveries_by, "food items",
            "deliveries by nest, kind of food and caste"),
    Measure("first_delivery", first_delivery, "ticks",
            "first passage time; if there is none, ticks so far", COUNTS),
    Measure("efficiency", lambda c: ratio(c["deliveries"], c["ticks"] * c["living"]),
            "per ant and tick", "deliveries per living ant and tick", COUNTS),
    Measure("path_length", path_length, "ticks", "mean ticks with food of a delivered load",
            COUNTS),
    Measure("path_ratio", _path_ratio, "", "path length divided by that of the shortest path"),
    Measure("entropy", entropy, "",
            "entropy of each pheromone field, 0 (one cell) to 1 (equal levels)"),
    Measure("blocked_share", lambda c: ratio(c["blocked"], c["moves"]), "",
            "share of the moves that failed", COUNTS),
    Measure("activity", activity, "", "share of the ants that moved in the last tick"),
    Measure("living", lambda c: c["living"], "ants", "number of living ants", COUNTS),
    Measure("waiting_births", lambda c: c["waiting_births"], "ants",
            "births that wait for a free cell or slot", COUNTS),
    Measure("carriers", lambda s: share_of(s.ant_carries), "",
            "share of the ants that carry food"),
    *(Measure(name, *measured) for feature in FEATURES
      for name, measured in feature.measures.items()),
    Measure("distance", _distance, "steps", "mean distance of the ants to the nearest queen"),
    Measure("regions", _regions, "", "share of the ants in each region of the world"),
)  # fmt: skip
BUILT_IN: dict[str, Measure] = {measure.name: measure for measure in _LISTED}
MEASURES.built_in = BUILT_IN
