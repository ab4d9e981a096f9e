"""Random protocols for small worlds."""

from typing import Any

import numpy as np

from taichi_ants import AntsError, World
from taichi_ants.protocol import EVENTS, ProtocolEvent
from taichi_ants.task import Task
from taichi_ants.task.constants import EMPTY

KINDS = (
    *("remove_ants", "add_ants", "ants", "clear", "move", "place", "place", "trail"),
    *("task", "epsilon"),
)
SHARED = ("task", "epsilon", "learning_rate")  # by the worlds of a colony


def random_protocol(
    rng: np.random.Generator,
    world: World,
    task: Task,
    capacity: int,
    ticks: int,
    worlds: int,
    learns: bool,
) -> list[ProtocolEvent]:
    """Return random events that are valid by themselves; a world may still not allow them."""
    events: list[ProtocolEvent] = []
    kinds = [*KINDS, *(["learning_rate"] if learns else [])]
    while len(events) < 4:
        kind = str(rng.choice(list(EVENTS)))
        when: dict[str, Any] = {"tick": int(rng.integers(ticks))}
        if kind == "every":
            when = {"ticks": int(rng.integers(1, 6)), "start": int(rng.integers(ticks))}
            when |= {"stop": when["start"] + 5} if rng.random() < 0.5 else {}
        elif kind == "when":
            bound = str(rng.choice(["above", "below"]))
            measure = str(rng.choice(["deliveries", "living", "carriers", "distance"]))
            when = {"measure": measure, bound: float(rng.integers(-1, 7))}
            when |= {"interval": int(rng.integers(1, 5)), "once": bool(rng.random() < 0.5)}
        names = rng.choice(kinds, int(rng.integers(1, 3)), replace=False).tolist()
        if kind == "when" and worlds > 1:
            names = [name for name in names if name not in SHARED]
        try:
            changes = {name: _intervention(rng, name, world, task, capacity) for name in names}
            events.append(EVENTS[kind].from_dict({**when, **changes}))
        except AntsError:
            continue
    return events


def _intervention(
    rng: np.random.Generator, name: str, world: World, task: Task, capacity: int
) -> Any:
    ground, grid = world.ground(), world.grid
    there = grid.cells(np.flatnonzero(grid.exists))
    some: Any = rng.permutation(there)[: rng.integers(1, 5)].tolist()
    if world.regions and some[0][1] % 2 and name != "move":
        some = "ab"[some[0][0] % 2]  # without a draw, so that other protocols stay the same
    free = grid.cells(np.flatnonzero((ground == EMPTY) & grid.exists)).tolist()
    full = grid.cells(np.flatnonzero((ground != EMPTY) & grid.exists)).tolist()
    if name in ("remove_ants", "add_ants"):
        most = 1.0 if name == "remove_ants" else 0.3
        amounts = [int(rng.integers(0, 4)), float(rng.uniform(0, most)), {"cells": some}]
        amount = amounts[int(rng.integers(3))]
        if world.n_nests > 1 and rng.random() < 0.5:
            short = "share" if isinstance(amount, float) else "number"
            amount = dict(amount) if isinstance(amount, dict) else {short: amount}
            amount["nest"] = int(rng.integers(world.n_nests))
        return amount
    if name == "ants":
        return int(rng.integers(1, capacity + 1))
    if name == "move":
        return [full[rng.integers(len(full))], free[rng.integers(len(free))]]
    if name == "place":
        what = str(rng.choice(["rock", "food", "food", "queen"]))
        placed: dict[str, Any] = {"what": what, "cells": some}
        if what == "queen":
            placed["cells"] = [free[rng.integers(len(free))]]
        if what == "queen" and world.n_nests > 1:
            placed["nest"] = int(rng.integers(world.n_nests))
        if what == "food" and task.foods:
            placed["kind"] = str(rng.choice(list(task.foods)))
        return placed
    if name == "trail":
        level = int(rng.choice([0, 1, 20, 250]))
        if rng.random() < 0.3:
            return level
        return {"level": level, "cells": some, "field": str(rng.choice(["trail", *task.fields]))}
    if name == "task":
        return _change(rng, task)
    return some if name == "clear" else float(rng.random())


def _change(rng: np.random.Generator, task: Task) -> dict[str, Any]:
    """Return new numbers of a task, with the same kernels."""
    trail, life = task.pheromone, task.life
    able: list[tuple[str, Any]] = [
        ("rewards.empty", int(rng.integers(-3, 4))),
        ("turns_at_queen", bool(rng.random() < 0.5)),
        ("delivery", str(rng.choice(["terminates", "truncates"]))),
        ("pheromone.deposit", "none" if trail.deposit == "none" else "set"),
    ]
    if trail.deposit != "none":
        able.append(("pheromone.level", int(rng.integers(1, 100))))
    if not trail.dense:
        able += [("evaporation_in_training", False), ("evaporation_in_evaluation", True)]
    if trail.diffusion:
        able.append(("pheromone.diffusion", float(rng.uniform(0.1, 1))))
    if trail.half_life:
        able.append(("pheromone.half_life", float(rng.uniform(0.5, 20))))
    if life.lifespan:
        able.append(("life.lifespan", int(rng.integers(1, 40))))
    if task.noise.slip:
        able += [("noise.slip", 0.5), ("noise.misread", 0.25)]
    if task.choice.temperature:
        able.append(("choice.temperature", float(rng.uniform(0.1, 5))))
    for name, one in task.fields.items():
        able.append((f"fields.{name}.deposited_when", str(rng.choice(["always", "without_food"]))))
        if one.deposit != "none":
            able.append((f"fields.{name}.level", int(rng.integers(1, 100))))
        if one.half_life:
            able.append((f"fields.{name}.half_life", float(rng.uniform(0.5, 20))))
    for name in task.foods:
        able.append((f"foods.{name}.deliver", int(rng.integers(-2, 30))))
    for name, caste in task.castes.items():
        able.append((f"castes.{name}.epsilon", float(rng.random())))
        able.append((f"castes.{name}.lays", str(rng.choice(["all", "none", "trail"]))))
        if caste.threshold.value is not None:
            able.append((f"castes.{name}.threshold.value", float(rng.uniform(3, 9))))
    if task.labour.rule != "none":
        able.append(("labour.demand", float(rng.uniform(0, 4))))
    if life.pile_move_interval:
        able += [("life.pile_move_interval", int(rng.integers(1, 9))), ("life.regrowth", 2)]
    return dict([able[int(rng.integers(len(able)))]])
