"""The features of the model in plain Python: a file for each, with the points of its hooks.

A file has functions by the names of `taichi_ants.features.points`, whose first argument is the
`ReferenceColony`; `inputs` of an ant for your rules; and `MEASURES` of a colony. The values of a
feature are in `Ant.own` and in `WorldState.of_nests`, by the names of its arrays.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from taichi_ants.features import FEATURES, used_by
from taichi_ants.reference.ants import Ant
from taichi_ants.reference.world_state import WorldState
from taichi_ants.task import Task

# In the order of the features, which is the order of random draws.
TWINS = {
    feature.group: import_module(f"{__name__}.{feature.group}")
    for feature in FEATURES
    if feature.hooks
}


def hooks(task: Task, point: str) -> list[Callable[..., Any]]:
    """Return the functions of the features that a task uses at a point."""
    used = dict.fromkeys(TWINS[one.group] for one in used_by(task) if one.group in TWINS)
    return [getattr(twin, point) for twin in used if hasattr(twin, point)]


def inputs_of(world: WorldState, ant: Ant, task: Task) -> dict[str, Any]:
    """Return the inputs of your rules that the features of a task have for an ant."""
    of_features = [inputs(world, ant) for inputs in hooks(task, "inputs")]
    return {name: value for inputs in of_features for name, value in inputs.items()}
