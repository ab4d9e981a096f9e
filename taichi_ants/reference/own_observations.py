"""Your own observations in the reference: the view of an ant, from which they compute its state."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.errors import check_one_of
from taichi_ants.reference.ants import Ant
from taichi_ants.reference.geometry import distance
from taichi_ants.reference.observations import (
    OBSERVATIONS,
    cells_in_view,
    codes_seen,
    levels_in_view,
    strongest_in_view,
)
from taichi_ants.reference.world_state import Trail, WorldState
from taichi_ants.rules.inputs import Vector

if TYPE_CHECKING:
    from taichi_ants.task import Observation


def state_by(observation: Observation) -> Callable[[WorldState, Ant], int]:
    """Return a function of a world and an ant that returns the ant's state index.

    AntsError for an observation of the package, which must have a function in `OBSERVATIONS`.
    """
    if observation.encode.__module__.startswith("taichi_ants."):
        check_one_of("observation", observation.name, tuple(OBSERVATIONS))
    return lambda world, ant: int(observation.encode(view_of(world, ant, observation)))


def view_of(world: WorldState, ant: Ant, observation: Observation) -> SimpleNamespace:
    """Return the view of an ant, see `Observation`.

    A misread cell has no ant, no level, and is not nearer.
    """
    turns, cells = observation.cells, cells_in_view(ant, observation.cells)
    is_seen = [turn not in ant.misread for turn in turns]
    cue, queen = world.cue(ant), world.queens[ant.nest]
    # All levels of cues are float32 if those of one cue are.
    cues = {name for pair in world.cues for name in pair if name != "compass"}
    dense = any(world.pheromones[name].rule.dense for name in cues)

    def levels(trail: Trail, dense: bool) -> tuple[Vector, Any]:
        """Return the levels of the cells, and that of the ant's cell."""
        kind: type = np.float32 if dense else np.int32
        in_view = levels_in_view(world, ant, trail, turns, ant.misread)
        return Vector(map(kind, in_view)), kind(trail.level(ant.cell))

    ahead, own_level = levels(cue, dense)
    if world.cues[ant.caste][1] == "compass":
        far = distance(ant.cell, queen)
        nearer = [distance(cell, queen) < far for cell in cells]
    else:
        nearer = [bool(level > own_level) for level in ahead]
    others = [
        world.ants.get(cell) if seen else None for cell, seen in zip(cells, is_seen, strict=True)
    ]
    codes = codes_seen(world, ant, turns)
    left, forward, right = (codes[turns.index(turn)] for turn in (-1, 0, 1))
    view: dict[str, Any] = {
        "carries": int(ant.carries),
        "paper_state": 64 * ant.carries + 16 * left + 4 * forward + right,
        "codes": Vector(codes),
        "levels": ahead,
        "ants": Vector(
            1 + other.carries if other is not None and other.nest == ant.nest else 0
            for other in others
        ),
        "other_nest_ants": Vector(
            int(other is not None and other.nest != ant.nest) for other in others
        ),
        "nearer": Vector(
            int(is_nearer and seen) for is_nearer, seen in zip(nearer, is_seen, strict=True)
        ),
        "strongest": type(own_level)(strongest_in_view(world, ant)),
        "own_level": own_level,
    }
    for name in observation.reads:
        trail = world.pheromones[name]
        view[name], view[f"own_{name}"] = levels(trail, trail.rule.dense)
    return SimpleNamespace(**view)
