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
    strongest_in_view,
)
from taichi_ants.reference.world_state import Trail, WorldState
from taichi_ants.rules.inputs import Vector
from taichi_ants.task.constants import EMPTY

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
    dense = any(world.pheromone_named(name).rule.dense for name in cues)
    kind: type = np.float32 if dense else np.int32

    def levels(trail: Trail, kind: type) -> Vector:
        return Vector(
            kind(trail.level(cell) if shows and world.ground.get(cell) == EMPTY else 0)
            for cell, shows in zip(cells, is_seen, strict=True)
        )

    ahead, own_level = levels(cue, kind), kind(cue.level(ant.cell))
    if world.cues[ant.caste][1] == "compass":
        far = distance(ant.cell, queen)
        nearer = [distance(cell, queen) < far for cell in cells]
    else:
        nearer = [bool(level > own_level) for level in ahead]
    others = [world.ants.get(cell) for cell in cells]
    codes = codes_seen(world, ant, turns)
    left, forward, right = (codes[turns.index(turn)] for turn in (-1, 0, 1))
    view: dict[str, Any] = {
        "carries": int(ant.carries),
        "paper_state": 64 * ant.carries + 16 * left + 4 * forward + right,
        "codes": Vector(codes),
        "levels": ahead,
        "ants": Vector(
            1 + other.carries if shows and other is not None and other.nest == ant.nest else 0
            for other, shows in zip(others, is_seen, strict=True)
        ),
        "other_nest_ants": Vector(
            int(shows and other is not None and other.nest != ant.nest)
            for other, shows in zip(others, is_seen, strict=True)
        ),
        "nearer": Vector(
            int(is_nearer and shows) for is_nearer, shows in zip(nearer, is_seen, strict=True)
        ),
        "strongest": kind(strongest_in_view(world, ant)),
        "own_level": own_level,
    }
    for name in observation.reads:
        trail = world.pheromone_named(name)
        kind_read: type = np.float32 if trail.rule.dense else np.int32
        view[name] = levels(trail, kind_read)
        view[f"own_{name}"] = kind_read(trail.level(ant.cell))
    return SimpleNamespace(**view)
