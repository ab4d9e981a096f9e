"""The built-in measures of `taichi_ants.measures` in plain Python, from the state of a colony."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Sequence

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.reference.colony import ReferenceColony
from taichi_ants.reference.geometry import Cell, distance, listed_cells, neighbour
from taichi_ants.task.constants import OBSTACLE
from taichi_ants.task.events import Event

NONE = math.nan


def first_delivery(colony: ReferenceColony) -> float:
    """Return the ticks up to the first delivery, or the ticks so far."""
    record = colony.record
    return record.ticks if record.first_delivery == -1 else record.first_delivery


def efficiency(colony: ReferenceColony) -> float:
    """Return the deliveries per living ant and tick."""
    if not colony.ants or not colony.record.ticks:
        return NONE
    return colony.record.deliveries / (colony.record.ticks * len(colony.ants))


def path_length(colony: ReferenceColony) -> float:
    """Return the mean ticks from pick-up to delivery."""
    record = colony.record
    return record.carried / record.deliveries if record.deliveries else NONE


def path_ratio(colony: ReferenceColony) -> float:
    """Return the path length divided by the fewest ticks for the nearest food of the start."""
    world = colony.start_world
    walls, foods = set(listed_cells(world.obstacles)), set(listed_cells(world.foods))
    inside, fewest = set(colony.world.ground), NONE
    steps: dict[Cell, int] = {world.queen: 0}
    waiting = deque([world.queen])
    while waiting:
        cell = waiting.popleft()
        if cell in foods:
            fewest = max(1, steps[cell] - 1)
            break
        for heading in range(N_HEADINGS):
            there = neighbour(cell, heading)
            if there in inside and there not in walls and there not in steps:
                steps[there] = steps[cell] + 1
                waiting.append(there)
    return path_length(colony) / fewest


def entropy(colony: ReferenceColony) -> float:
    """Return the entropy of the trail, divided by that of equal levels; nan without a trail."""
    cells = [cell for cell, ground in colony.world.ground.items() if ground != OBSTACLE]
    levels = Counter(float(colony.world.trail.level(cell)) for cell in cells)
    del levels[0.0]
    if len(cells) < 2 or not levels:
        return NONE
    total = math.fsum(level * n for level, n in levels.items())
    terms = []
    for level, n in levels.items():
        share = level / total
        if share > 0:
            terms.append(n * (share * math.log(share)))
    return max(0.0, -math.fsum(terms) / math.log(len(cells)))


def blocked_share(colony: ReferenceColony) -> float:
    """Return the share of moves that failed; nan before the first move."""
    return colony.record.blocked / colony.record.moves if colony.record.moves else NONE


def activity(colony: ReferenceColony) -> float:
    """Return the share of the living ants that entered a cell in the last tick."""
    entered = [a.event in (Event.ENTERED_EMPTY, Event.ENTERED_CUE) for a in colony.ants.values()]
    return entered.count(True) / len(entered) if entered else NONE


def carriers(colony: ReferenceColony) -> float:
    """Return the share of the living ants with food."""
    loads = [ant.carries for ant in colony.ants.values()]
    return sum(loads) / len(loads) if loads else NONE


def foraging(colony: ReferenceColony) -> float:
    """Return the share of the living ants that are not idle."""
    forage = [not ant.idle for ant in colony.ants.values()]
    return sum(forage) / len(forage) if forage else NONE


def mean_distance(colony: ReferenceColony) -> float:
    """Return the mean distance of the ants to the nearest queen."""
    queens = colony.world.queens
    far = [min(distance(ant.cell, queen) for queen in queens) for ant in colony.ants.values()]
    return sum(far) / len(far) if far else NONE


def share_in_region(colony: ReferenceColony, name: str) -> float:
    """Return the share of the ants in a region of the world."""
    cells = set(listed_cells(colony.start_world.regions[name]))
    inside = [ant.cell in cells for ant in colony.ants.values()]
    return sum(inside) / len(inside) if inside else NONE


def deliveries_by(colony: ReferenceColony, part: str) -> int:
    """Return the deliveries of a nest, a kind of food or a caste, such as "nest_0"."""
    owner, _, number = part.partition("_")
    if owner == "caste":
        return colony.record.by_caste[int(number)]
    column = ("nest", "food").index(owner)
    return sum(n for key, n in colony.record.delivered.items() if key[column] == int(number))


def measured(colony: ReferenceColony, name: str) -> float:
    """Return the value of a measure of `MEASURES`, or of a part of "regions" or "deliveries_by"."""
    before, _, part = name.partition(".")
    if before == "deliveries_by":
        return deliveries_by(colony, part)
    return share_in_region(colony, part) if before == "regions" else MEASURES[name](colony)


MEASURES: dict[str, Callable[[ReferenceColony], float]] = {
    "deliveries": lambda colony: colony.record.deliveries,
    "first_delivery": first_delivery,
    "efficiency": efficiency,
    "path_length": path_length,
    "path_ratio": path_ratio,
    "entropy.trail": entropy,
    "waiting_births": lambda colony: sum(colony.stores),
    "blocked_share": blocked_share,
    "activity": activity,
    "living": lambda colony: len(colony.ants),
    "carriers": carriers,
    "foraging": foraging,
    "distance": mean_distance,
}


def occupancy(colony: ReferenceColony) -> dict[Cell, int]:
    """Return the number of ants on each cell with ants."""
    return dict(Counter(ant.cell for ant in colony.ants.values()))


def new_deliveries(rows: Sequence[float]) -> float:
    """Return the growth of the deliveries since the last row."""
    return rows[-1] - (rows[-2] if len(rows) > 1 else 0)


def synchrony(rows: Sequence[float], ants: int) -> float:
    """Return the variance of the activity in the rows, relative to that of independent ants."""
    known = [row for row in rows if row == row]
    mean = math.fsum(known) / len(known) if known else 0
    if len(known) < 2 or ants == 0 or mean in (0, 1):
        return NONE
    squares = math.fsum((row - mean) * (row - mean) for row in known)
    return ants * (squares / len(known)) / (mean * (1 - mean))
