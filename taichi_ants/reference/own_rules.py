"""Your own rules in the reference: the inputs of their Python functions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.reference.ants import Ant
from taichi_ants.reference.geometry import Cell, neighbour
from taichi_ants.reference.observations import is_better, nestmate
from taichi_ants.reference.world_state import Level, WorldState
from taichi_ants.rules.inputs import Vector
from taichi_ants.task.constants import EMPTY, SEES_CUE, SEES_EMPTY

if TYPE_CHECKING:
    from taichi_ants.rules import Rule
    from taichi_ants.task import Task

_WORDS = 4294967296.0
Inputs = Mapping[str, Callable[[], Any]]


def computed(rule: Rule, task: Task, inputs: Inputs) -> float:
    """Return the result of a rule; only the inputs that it reads are computed."""
    values = {name: inputs[name]() for name in rule.inputs}
    numbers = {
        name: Vector(map(float, value)) if isinstance(value, list) else float(value)
        for name, value in values.items()
    }
    return rule.result(numbers, vars(task.rules[rule.name]))


def choose_by_rule(
    world: WorldState, ant: Ant, task: Task, values: Any, epsilon: float, tick: int
) -> int:
    """Return the action of an ant by your rule of choice; it draws once."""
    rule = task.choice.own_rule
    assert rule is not None
    high, low = ant.stream.draw()
    seen = ant.state if task.observation == "paper" else ant.paper_state
    codes = [seen >> 4 & 3, seen >> 2 & 3, seen & 3]
    cells = _ahead(ant)
    is_open = [code in (SEES_EMPTY, SEES_CUE) for code in codes]
    nearer = [code == SEES_CUE and world.has_compass(ant) for code in codes]
    for side, cell in enumerate(cells):
        if cell in world.ants and side - 1 not in ant.misread:
            nearer[side] = world.has_compass(ant) and is_better(world, ant, cell)
            if task.traffic.shared and nestmate(world, ant, cell):
                is_open[side] = ant.carries or task.traffic.follow
    inputs = {
        "values": lambda: list(values),
        "codes": lambda: codes,
        "is_open": lambda: is_open,
        "nearer": lambda: nearer,
        "carries": lambda: ant.carries,
        "paper_state": lambda: seen,
        "epsilon": lambda: int(epsilon * _WORDS) / _WORDS,
        "random": lambda: low / _WORDS,
        "random_2": lambda: high / _WORDS,
        **_of_ants(world, ant, tick),
        **_levels(world, ant, rule, misreads=True),
    }
    return int(computed(rule, task, inputs))


def pay(world: WorldState, was: Ant, ant: Ant, rule: Rule, task: Task, tick: int) -> int:
    """Return the reward of an ant by your rule, after the tick; `was` is the ant before it."""
    inputs = {
        "reward": lambda: ant.reward,
        "event": lambda: ant.event,
        "carries": lambda: ant.carries,
        "paper_state": lambda: was.paper_state,
        "next_paper_state": lambda: ant.paper_state,
        **_of_ants(world, ant, tick),
        **_levels(world, ant, rule, misreads=False),
    }
    return int(computed(rule, task, inputs))


def _of_ants(world: WorldState, ant: Ant, tick: int) -> Inputs:
    """Return the inputs of all kinds of rules that ants follow."""
    return {
        "trait": lambda: ant.trait,
        "threshold": lambda: ant.threshold,
        "stimulus": lambda: world.stimuli[ant.nest],
        "tick": lambda: tick,
    }


def _ahead(ant: Ant) -> list[Cell]:
    return [neighbour(ant.cell, (ant.heading + turn) % N_HEADINGS) for turn in (-1, 0, 1)]


def _levels(world: WorldState, ant: Ant, rule: Rule, misreads: bool) -> Inputs:
    """Return the inputs that read levels: of the ant's cue, and of each field that a rule reads."""

    def ahead(name: str | None) -> list[Level]:
        trail = world.cue(ant) if name is None else world.pheromone_named(name)
        hidden = ant.misread if misreads else {}
        return [
            trail.level(cell) if world.ground.get(cell) == EMPTY and turn not in hidden else 0
            for turn, cell in zip((-1, 0, 1), _ahead(ant), strict=True)
        ]

    inputs: dict[str, Callable[[], Any]] = {
        "levels": lambda: ahead(None),
        "level": lambda: world.cue(ant).level(ant.cell),
    }
    for name in rule.fields:
        inputs[f"levels_{name}"] = lambda name=name: ahead(name)  # type: ignore[misc]
        inputs[f"level_{name}"] = lambda name=name: (  # type: ignore[misc]
            world.pheromone_named(name).level(ant.cell)
        )
    return inputs
