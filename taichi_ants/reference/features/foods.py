"""Kinds of food and loads in plain Python."""

from __future__ import annotations

from typing import Any

from taichi_ants.reference.ants import Ant
from taichi_ants.reference.geometry import Cell
from taichi_ants.task.constants import Event


def born(colony: Any, ant: Ant) -> None:
    ant.own["kind"] = 0


def filled(colony: Any, cell: Cell, kind: int, n: int) -> int:
    """Put food of a kind in a cell; return its number of loads."""
    foods = [*colony.task.foods.values()]
    loads = foods[kind].loads if foods else n
    colony.world.of_cells[cell] |= {"kind_of": kind, "loads": loads}
    return loads


def took(colony: Any, ant: Ant, cell: Cell, left: int) -> int:
    food = colony.world.of_cells[cell]
    ant.own["kind"] = food["kind_of"]
    food["loads"] -= 1
    return food["loads"]


def dropped(colony: Any, ant: Ant, cell: Cell) -> None:
    colony.world.of_cells[cell] |= {"kind_of": ant.own["kind"], "loads": 1}


def waits(colony: Any, cell: Cell, kind: int, ticks: int | None) -> int | None:
    """Return after how many ticks food of a kind grows back; None: never."""
    foods = [*colony.task.foods.values()]
    return foods[kind].regrowth if foods else ticks


def pays(colony: Any, ant: Ant, event: Event, reward: int) -> int:
    foods = [*colony.task.foods.values()]
    if foods and event is Event.PICKED_UP:
        return foods[ant.own["kind"]].pick_up
    if foods and event is Event.DELIVERED:
        return foods[ant.own["kind"]].deliver
    return reward
