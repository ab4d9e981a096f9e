"""Random edits, and their application to the plain reference."""

from __future__ import annotations

from typing import Any

import numpy as np

from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.live import edits
from taichi_ants.reference.geometry import Cell
from taichi_ants.reference.interventions import Interventions as PlainInterventions
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE

KINDS = (
    *("place", "place", "place", "clear", "trail", "add_ants", "remove_ants", "queen"),
    *("set", "set", "set", "episode"),
)


def random_edit(rng: np.random.Generator, interventions: Interventions) -> dict[str, Any]:
    """Return a random valid edit, which the world may not allow."""
    grid, ground = interventions.colony.grid, interventions.colony.arrays["ground"]
    there = np.flatnonzero(grid.exists)
    some = rng.choice(there, rng.integers(1, min(9, len(there)) + 1)).tolist()
    kind = str(rng.choice(KINDS))
    if kind == "place":
        return {kind: {"what": str(rng.choice(["rock", "food"])), "cells": some}}
    if kind == "trail":
        return {kind: {"level": int(rng.choice([0, 1, 20, 250, 9999])), "cells": some}}
    if kind == "add_ants":
        heading = int(rng.integers(6)) if rng.random() < 0.5 else None
        return {kind: {"cells": some, "heading": heading}}
    if kind in ("clear", "remove_ants"):
        return {kind: {"cells": some}}
    if kind == "queen":
        free = there[ground[there] == EMPTY] if rng.random() < 0.8 else there
        cell = int(rng.choice(free if len(free) else there))
        return {"place": {"what": "queen", "cells": [cell]}}
    if kind == "set":
        known = edits.values(interventions)
        name = str(rng.choice(list(known)))
        value, least, most, step, path, switch = known[name]
        drawn = float(rng.choice([value, least, most, rng.uniform(least, most)]))
        if name == "ants":
            drawn = float(rng.integers(1, interventions.ants + 4))
        if switch:
            return switch[str(int(drawn))]
        new = int(drawn) if isinstance(step, int) else drawn
        name, _, setting = path.partition(".")
        return {name: {setting: new} if setting else new}
    return {kind: {}}


def apply_to_both(
    edit: dict[str, Any], interventions: Interventions, plain: PlainInterventions
) -> None:
    """Apply an edit to a colony and to its twin; raises AntsError if the world forbids it."""
    grid = interventions.colony.grid
    edits.checked(edit, interventions).apply(interventions)
    ((kind, settings),) = edit.items()
    cells: list[Cell] = []
    for cell in dict.fromkeys(settings.get("cells", ()) if isinstance(settings, dict) else ()):
        x, y, z = grid.cells(cell).tolist()
        cells.append((x, y, z))
    if kind == "clear":
        plain.put(cells, EMPTY)
    elif kind == "place" and settings["what"] == "queen":
        plain.move_queen(*cells)
    elif kind == "place":
        plain.put(cells, {"rock": OBSTACLE, "food": FOOD}[settings["what"]])
    elif kind == "trail":
        plain.lay_trail(cells, settings["level"])
    elif kind == "add_ants":
        plain.add_ants(cells, settings["heading"])
    elif kind == "remove_ants":
        plain.remove_ants(cells)
    elif kind == "episode":
        plain.begin_episode()
    elif kind == "task":
        _set_task(settings, plain)
    else:
        getattr(plain, f"set_{kind}")(settings)


def _set_task(settings: dict[str, Any], plain: PlainInterventions) -> None:
    for name, value in settings.items():
        if name in ("evaporation_in_training", "evaporation_in_evaluation"):
            plain.set_evaporation(value)
        elif name != "pheromone.evaporation":  # set_evaporation has set it
            plain.set_pheromone(**{name.removeprefix("pheromone."): value})
