"""The built-in measures of `taichi_ants.measures` in plain Python, from the state of a colony."""

import math
from collections import Counter
from collections.abc import Callable
from functools import partial

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.reference.ants import Ant
from taichi_ants.reference.colony import ReferenceColony
from taichi_ants.reference.features import TWINS
from taichi_ants.reference.geometry import Cell, distance, listed_cells, neighbour
from taichi_ants.task.constants import OBSTACLE, Event

NONE = math.nan


def ratio(part: float, whole: float) -> float:
    """Return a share; nan of nothing."""
    return part / whole if whole else NONE


def path_length(colony: ReferenceColony) -> float:
    """Return the mean ticks from pick-up to delivery."""
    return ratio(colony.record.carried, colony.record.deliveries)


def path_ratio(colony: ReferenceColony) -> float:
    """Return the path length divided by the fewest ticks for the nearest food of the start."""
    world = colony.start_world
    walls, foods = set(listed_cells(world.obstacles)), set(listed_cells(world.foods))
    steps: dict[Cell, int] = {world.queen: 0}
    waiting = [world.queen]
    for cell in waiting:  # the list grows during this loop
        if cell in foods:
            return path_length(colony) / max(1, steps[cell] - 1)
        for heading in range(N_HEADINGS):
            there = neighbour(cell, heading)
            if there in colony.world.ground and there not in walls and there not in steps:
                steps[there] = steps[cell] + 1
                waiting.append(there)
    return NONE


def entropy(colony: ReferenceColony) -> float:
    """Return the entropy of the trail, divided by that of equal levels; nan without a trail."""
    cells = [cell for cell, ground in colony.world.ground.items() if ground != OBSTACLE]
    levels = Counter(float(colony.world.trail.level(cell)) for cell in cells)
    del levels[0.0]
    if len(cells) < 2 or not levels:
        return NONE
    total = math.fsum(level * n for level, n in levels.items())
    shares = [(level / total, n) for level, n in levels.items()]
    terms = [n * (share * math.log(share)) for share, n in shares if share > 0]
    return max(0.0, -math.fsum(terms) / math.log(len(cells)))


def mean(colony: ReferenceColony, value: Callable[[Ant], float]) -> float:
    """Return the mean of a value of the living ants."""
    return ratio(sum(value(ant) for ant in colony.ants.values()), len(colony.ants))


def measured(colony: ReferenceColony, name: str) -> float:
    """Return the value of a measure of `MEASURES`, or of a part of "regions" or "deliveries_by"."""
    before, _, part = name.partition(".")
    if before == "deliveries_by":
        owner, _, number = part.partition("_")
        if owner == "caste":
            return colony.record.by_caste[int(number)]
        column, of_pairs = ("nest", "food").index(owner), colony.record.delivered.items()
        return sum(n for key, n in of_pairs if key[column] == int(number))
    if before == "regions":
        cells = listed_cells(colony.start_world.regions[part])
        return mean(colony, lambda ant: ant.cell in cells)
    return MEASURES[name](colony)


MEASURES: dict[str, Callable[[ReferenceColony], float]] = {
    "deliveries": lambda colony: colony.record.deliveries,
    "first_delivery": lambda colony: (  # the ticks so far if there is none
        colony.record.ticks if colony.record.first_delivery < 0 else colony.record.first_delivery
    ),
    "efficiency": lambda colony: ratio(
        colony.record.deliveries, colony.record.ticks * len(colony.ants)
    ),
    "path_length": path_length,
    "path_ratio": path_ratio,
    "entropy.trail": entropy,
    "waiting_births": lambda colony: sum(colony.stores),
    "blocked_share": lambda colony: ratio(colony.record.blocked, colony.record.moves),
    "activity": lambda colony: mean(
        colony, lambda ant: ant.event in (Event.ENTERED_EMPTY, Event.ENTERED_CUE)
    ),
    "living": lambda colony: len(colony.ants),
    "carriers": lambda colony: mean(colony, lambda ant: ant.carries),
    "distance": lambda colony: mean(
        colony, lambda ant: min(distance(ant.cell, queen) for queen in colony.world.queens)
    ),
    **{
        name: lambda colony, of_ant=of_ant: mean(colony, partial(of_ant, colony))  # type: ignore[misc]
        for twin in TWINS.values()
        for name, of_ant in getattr(twin, "MEASURES", {}).items()
    },
}
