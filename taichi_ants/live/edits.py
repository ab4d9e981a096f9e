"""Edits: interventions in a running colony, in the form in which pages send them.

Each edit is a JSON-compatible dict::

    {"kind": "ground", "what": "empty", "rock" or "food", "cells": [...]}
    {"kind": "trail", "level": number, "cells": [...]}
    {"kind": "add_ants", "cells": [...], "heading": 0 to 5, or None for random headings}
    {"kind": "remove_ants", "cells": [...]}
    {"kind": "queen", "cell": cell}
    {"kind": "set", "name": one of `values`, "value": number}
    {"kind": "episode"}, which ends the episode and begins the next one

Cells are flat indices. An edit has no effect on cells that do not allow it: the queen's cell for
ground, rock for trails, and all but empty cells for ants. Rock and food move ants aside. See
`taichi_ants.engines.colony.interventions` for details, and for changes that last.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.errors import AntsError, check_one_of, checked_whole, expect, shown
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task import Pheromone
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE
from taichi_ants.task.pheromone import MAX_DEPOSIT

Edit = dict[str, Any]

_GROUNDS = {"empty": EMPTY, "rock": OBSTACLE, "food": FOOD}
_FIELDS = {
    "ground": ("what", "cells"),
    "trail": ("level", "cells"),
    "add_ants": ("cells", "heading"),
    "remove_ants": ("cells",),
    "queen": ("cell",),
    "set": ("name", "value"),
    "episode": (),
}


class Value(NamedTuple):
    """A number that the edit "set" can change."""

    value: float  # at present
    least: float
    most: float
    step: float  # of a slider; if it is an int, only whole numbers are allowed


def values(interventions: Interventions) -> dict[str, Value]:
    """Return the values that "set" can change in a colony, by name, if they have an effect there.

    - ants: the number of living ants; if set, also the number at the start of later episodes.
    - epsilon, learning_rate: if set, they no longer decay.
    - deposit: the `level` of `Pheromone`; slope, cap, half_life, diffusion: as in `Pheromone`.
    - evaporation: 1 if trails evaporate, else 0.
    """
    colony, pheromone = interventions.colony, interventions.colony.pheromone
    found = {
        "ants": Value(max(interventions.living, 1), 1, colony.capacity, 1),
        "epsilon": Value(colony.epsilon, 0.0, 1.0, 0.01),
    }
    if colony.sharing != "frozen":
        found["learning_rate"] = Value(colony.learning_rate, 0.0, 1.0, 0.001)
    if pheromone.deposit != "none":
        found["deposit"] = Value(int(pheromone.level), 1, max(1000, int(pheromone.level)), 1)
    for name, usual in (("slope", 100), ("cap", 10_000)):
        if (number := getattr(pheromone, name)) is not None:
            found[name] = Value(int(number), 1, max(usual, int(number)), 1)
    falls = pheromone.evaporation != "none"
    if _with_evaporation(interventions, not falls)[0].dense == pheromone.dense:
        found["evaporation"] = Value(int(falls), 0, 1, 1)
    if pheromone.half_life is not None:
        half_life = float(pheromone.half_life)
        found["half_life"] = Value(half_life, min(1.0, half_life), max(1000.0, half_life), 0.5)
    if pheromone.dense:  # integer trails cannot diffuse, and dense trails cannot become integers
        least = 0.0 if pheromone.evaporation == "exponential" else min(0.01, pheromone.diffusion)
        found["diffusion"] = Value(float(pheromone.diffusion), float(least), 1.0, 0.01)
    return found


def _with_evaporation(interventions: Interventions, falls: bool) -> tuple[Pheromone, Pheromone]:
    """Return pheromones with or without evaporation: that of the colony, and that of its task."""
    pheromone = interventions.colony.task.pheromone
    if falls and pheromone.evaporation == "none":
        pheromone = replace(pheromone, evaporation="linear")
    return (pheromone if falls else pheromone.lasting), pheromone


def checked(edit: object, interventions: Interventions) -> Edit:
    """Return a validated copy of an edit; `apply` checks whether the world allows it.

    Raises:
        AntsError: The edit is not valid; the message says why.
    """
    expect("an edit", edit, Mapping)
    assert isinstance(edit, Mapping)
    kind: Any = edit.get("kind")
    check_one_of("the kind of an edit", kind, tuple(_FIELDS))
    wanted, given = {"kind", *_FIELDS[kind]}, set(edit)
    if given != wanted:
        raise AntsError(
            f"an edit of kind {kind!r} has the fields {shown(sorted(map(str, given)))}; it must "
            f"have exactly {', '.join(sorted(wanted))}."
        )
    fields = {name: _checked(name, edit, interventions) for name in _FIELDS[kind]}
    return {"kind": kind, **fields}


def apply(edit: Edit, interventions: Interventions, length: int | None) -> None:
    """Apply an edit that `checked` returned; if it begins an episode, `length` is its length.

    Raises:
        AntsError: The world does not allow the edit; nothing has changed.
    """
    cells = np.array(edit.get("cells"))
    match edit["kind"]:
        case "ground":
            interventions.put(cells, _GROUNDS[edit["what"]])
        case "trail":
            interventions.lay_trail(cells, edit["level"])
        case "add_ants":
            interventions.add_ants(cells, edit["heading"])
        case "remove_ants":
            interventions.remove_ants(cells)
        case "queen":
            interventions.move_queen(edit["cell"])
        case "set":
            _set(edit["name"], edit["value"], interventions)
        case "episode":
            interventions.begin_episode(length)


def _set(name: str, value: Any, interventions: Interventions) -> None:
    if name in ("ants", "epsilon", "learning_rate"):
        getattr(interventions, f"set_{name}")(value)
        return
    task = interventions.colony.task
    pheromone = task.pheromone
    if name == "evaporation":
        _, pheromone = _with_evaporation(interventions, value == 1)
        learns = interventions.colony.sharing != "frozen"
        flag = "evaporation_in_training" if learns else "evaporation_in_evaluation"
        flags: dict[str, Any] = {flag: value == 1}
        task = replace(task, **flags)
    else:
        numbers: dict[str, Any] = {"level" if name == "deposit" else name: value}
        pheromone = replace(pheromone, **numbers)
    interventions.set_task(replace(task, pheromone=pheromone))


def _checked(name: str, edit: Mapping, interventions: Interventions) -> Any:
    given = edit[name]
    match name:
        case "cells":
            return _checked_cells(given, interventions)
        case "cell":
            return _checked_cells([given], interventions)[0]
        case "level":
            return checked_whole(name, given, 0, MAX_DEPOSIT)
        case "heading" if given is not None:
            return checked_whole(name, given, 0, N_HEADINGS - 1, ", or None")
        case "value":  # the name has already been checked
            return _number(edit["name"], given, values(interventions)[edit["name"]])
        case "what":
            check_one_of(name, given, tuple(_GROUNDS))
        case "name":
            check_one_of("the name of a value", given, tuple(values(interventions)))
    return given


def _checked_cells(cells: Any, interventions: Interventions) -> list[int]:
    """Return cells of the world, in the given order and without duplicates."""
    most, exists = interventions.colony.grid.count, interventions.colony.grid.exists
    if not isinstance(cells, list) or not 1 <= len(cells) <= most:
        raise AntsError(f"cells is {shown(cells)}; it must be a list of 1 to {most} cells.")
    for cell in cells:
        if type(cell) is not int or not 0 <= cell < len(exists) or not exists[cell]:
            raise AntsError(
                f"cells holds {shown(cell)}; each must be the flat index of a cell of this world."
            )
    return list(dict.fromkeys(cells))


def _number(name: str, value: Any, allowed: Value) -> float:
    if isinstance(allowed.step, int):
        return checked_whole(name, value, int(allowed.least), int(allowed.most))
    if type(value) not in (int, float) or not allowed.least <= value <= allowed.most:
        least, most = f"{allowed.least:g}", f"{allowed.most:g}"
        raise AntsError(f"{name} is {shown(value)}; it must be a number from {least} to {most}.")
    return float(value)
