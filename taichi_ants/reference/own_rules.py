"""Your own rules and observations in the reference: the inputs of their Python functions."""

from __future__ import annotations

from collections.abc import Container
from types import SimpleNamespace
from typing import Any

import numpy as np

from taichi_ants.reference.ants import Ant
from taichi_ants.reference.choice import ways
from taichi_ants.reference.features import inputs_of
from taichi_ants.reference.geometry import distance
from taichi_ants.reference.observations import (
    AHEAD,
    ants_in_view,
    cells_in_view,
    codes_seen,
    levels_in_view,
    more_cells,
    nestmate,
    strongest_in_view,
)
from taichi_ants.reference.random_stream import WORDS
from taichi_ants.reference.world_state import Trail, WorldState, computed
from taichi_ants.rules import Rule
from taichi_ants.rules.inputs import Vector
from taichi_ants.task import Observation, Task


def choose_by_rule(
    world: WorldState, ant: Ant, task: Task, values: Any, epsilon: float, tick: int
) -> int:
    """Return the action of an ant by your rule of choice; it draws once."""
    rule = task.choice.own_rule
    assert rule is not None
    high, low = ant.stream.draw()
    seen = ant.state if task.observation == "paper" else ant.paper_state
    codes = [seen >> 4 & 3, seen >> 2 & 3, seen & 3]
    is_open, nearer = ways(world, ant, codes, task.traffic)
    inputs: dict[str, Any] = {"values": list(values), "codes": codes, "is_open": is_open}
    inputs |= {"nearer": nearer, "paper_state": seen, "epsilon": int(epsilon * WORDS) / WORDS}
    inputs |= {"random": low / WORDS, "random_2": high / WORDS}
    inputs |= _of_ant(world, ant, task, tick, ant.misread)
    return int(computed(rule, task.rules, inputs))


def pay(world: WorldState, was: Ant, ant: Ant, rule: Rule, task: Task, tick: int) -> int:
    """Return the reward of an ant by your rule, after the tick; `was` is the ant before it."""
    inputs = {"paper_state": was.paper_state, "next_paper_state": ant.paper_state}
    inputs |= {"reward": ant.reward, "event": ant.event, **_of_ant(world, ant, task, tick, ())}
    return int(computed(rule, task.rules, inputs))


def _of_ant(
    world: WorldState, ant: Ant, task: Task, tick: int, hidden: Container[int]
) -> dict[str, Any]:
    """Return the inputs of all kinds of rules that ants follow; `hidden` turns show no levels."""
    inputs: dict[str, Any] = {"carries": ant.carries, "trait": ant.trait, "tick": tick}
    inputs |= inputs_of(world, ant, task)
    named = {f"_{name}": trail for name, trail in world.pheromones.items()}
    for name, trail in {"": world.cue(ant), **named}.items():
        inputs[f"levels{name}"] = levels_in_view(world, ant, trail, AHEAD, hidden)
        inputs[f"level{name}"] = trail.level(ant.cell)
    return inputs


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
    nestmates = ants_in_view(world, ant, turns)
    view: dict[str, Any] = {
        "carries": int(ant.carries),
        "paper_state": more_cells(AHEAD, world, ant),
        "codes": Vector(codes_seen(world, ant, turns)),
        "levels": ahead,
        "ants": Vector(0 if other is None else 1 + other.carries for other in nestmates),
        "other_nest_ants": Vector(
            int(seen and cell in world.ants and nestmate(world, ant, cell) is None)
            for cell, seen in zip(cells, is_seen, strict=True)
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
