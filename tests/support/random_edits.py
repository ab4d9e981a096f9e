"""Random edits, and their application to the plain reference."""

from __future__ import annotations

from typing import Any

import numpy as np

from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.live import edits
from taichi_ants.reference.geometry import Cell
from taichi_ants.reference.interventions import Interventions as PlainInterventions
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE

KINDS = (*("ground",) * 4, "trail", "add_ants", "remove_ants", "queen", *("set",) * 3, "episode")


def random_edit(rng: np.random.Generator, interventions: Interventions) -> dict[str, Any]:
    """Return a random valid edit, which the world may not allow."""
    grid, ground = interventions.colony.grid, interventions.colony.arrays["ground"]
    there = np.flatnonzero(grid.exists)
    some = rng.choice(there, rng.integers(1, min(9, len(there)) + 1)).tolist()
    kind = str(rng.choice(KINDS))
    if kind == "ground":
        return {"kind": kind, "what": str(rng.choice(["empty", "rock", "food"])), "cells": some}
    if kind == "trail":
        return {"kind": kind, "level": int(rng.choice([0, 1, 20, 250, 9999])), "cells": some}
    if kind == "add_ants":
        heading = int(rng.integers(6)) if rng.random() < 0.5 else None
        return {"kind": kind, "cells": some, "heading": heading}
    if kind == "remove_ants":
        return {"kind": kind, "cells": some}
    if kind == "queen":
        free = there[ground[there] == EMPTY] if rng.random() < 0.8 else there
        return {"kind": kind, "cell": int(rng.choice(free if len(free) else there))}
    if kind == "set":
        known = edits.values(interventions)
        name = str(rng.choice(list(known)))
        value, least, most, step = known[name]
        drawn = float(rng.choice([value, least, most, rng.uniform(least, most)]))
        if name == "ants":
            drawn = float(rng.integers(1, interventions.ants + 4))
        return {"kind": kind, "name": name, "value": int(drawn) if isinstance(step, int) else drawn}
    return {"kind": kind}


def apply_to_both(
    edit: dict[str, Any], interventions: Interventions, plain: PlainInterventions
) -> None:
    """Apply an edit to a colony and to its twin; raises AntsError if the world forbids it."""
    grid = interventions.colony.grid
    edits.apply(edits.checked(edit, interventions), interventions, None)
    cells: list[Cell] = []
    for cell in dict.fromkeys(edit.get("cells", ())):
        x, y, z = grid.cells(cell).tolist()
        cells.append((x, y, z))
    kind = edit["kind"]
    if kind == "ground":
        plain.put(cells, {"empty": EMPTY, "rock": OBSTACLE, "food": FOOD}[edit["what"]])
    elif kind == "trail":
        plain.lay_trail(cells, edit["level"])
    elif kind == "add_ants":
        plain.add_ants(cells, edit["heading"])
    elif kind == "remove_ants":
        plain.remove_ants(cells)
    elif kind == "queen":
        plain.move_queen(tuple(grid.cells(edit["cell"]).tolist()))
    elif kind == "set":
        _set(edit["name"], edit["value"], plain)
    else:
        plain.begin_episode()


def _set(name: str, value: float, plain: PlainInterventions) -> None:
    if name == "ants":
        plain.set_ants(int(value))
    elif name == "epsilon":
        plain.set_epsilon(value)
    elif name == "learning_rate":
        plain.set_learning_rate(value)
    elif name == "evaporation":
        plain.set_evaporation(value == 1)
    else:
        plain.set_pheromone(**{"level" if name == "deposit" else name: value})
