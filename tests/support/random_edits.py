"""Random edits."""

from typing import Any

import numpy as np

from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.live.choices import sliders
from taichi_ants.task.constants import EMPTY

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
    if kind in ("clear", "add_ants", "remove_ants"):
        return {kind: {"cells": some}}
    if kind == "queen":
        free = there[ground[there] == EMPTY] if rng.random() < 0.8 else there
        cell = int(rng.choice(free if len(free) else there))
        return {"place": {"what": "queen", "cells": [cell]}}
    if kind == "set":
        known = sliders(interventions)
        name = str(rng.choice(list(known)))
        value, least, most, step, path, switch, _ = known[name]
        drawn = float(rng.choice([value, least, most, rng.uniform(least, most)]))
        if name == "ants":
            drawn = float(rng.integers(1, interventions.ants + 4))
        if switch:
            return switch[str(int(drawn))]
        new = int(drawn) if isinstance(step, int) else drawn
        name, _, setting = path.partition(".")
        return {name: {setting: new} if setting else new}
    return {kind: {}}
