"""Your own rules in the reference: the inputs of their Python functions."""

from __future__ import annotations

from collections.abc import Container, Mapping
from typing import TYPE_CHECKING, Any

from taichi_ants.reference.ants import Ant
from taichi_ants.reference.observations import (
    AHEAD,
    cells_in_view,
    is_better,
    levels_in_view,
    nestmate,
)
from taichi_ants.reference.world_state import WorldState
from taichi_ants.rules.inputs import Vector
from taichi_ants.task.constants import SEES_CUE, SEES_EMPTY

if TYPE_CHECKING:
    from taichi_ants.rules import Rule
    from taichi_ants.task import Task

_WORDS = 4294967296.0


def computed(rule: Rule, task: Task, inputs: Mapping[str, Any]) -> float:
    """Return the result of a rule; `inputs` are all that rules of its kind can read."""
    numbers = {
        name: Vector(map(float, value)) if isinstance(value, list) else float(value)
        for name, value in ((name, inputs[name]) for name in rule.inputs)
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
    is_open = [code in (SEES_EMPTY, SEES_CUE) for code in codes]
    nearer = [code == SEES_CUE and world.has_compass(ant) for code in codes]
    for side, cell in enumerate(cells_in_view(ant)):
        if cell in world.ants and side - 1 not in ant.misread:
            nearer[side] = world.has_compass(ant) and is_better(world, ant, cell)
            if task.traffic.shared and nestmate(world, ant, cell):
                is_open[side] = ant.carries or task.traffic.follow
    inputs = {
        "values": list(values),
        "codes": codes,
        "is_open": is_open,
        "nearer": nearer,
        "paper_state": seen,
        "epsilon": int(epsilon * _WORDS) / _WORDS,
        "random": low / _WORDS,
        "random_2": high / _WORDS,
    }
    return int(computed(rule, task, {**inputs, **_of_ant(world, ant, tick, ant.misread)}))


def pay(world: WorldState, was: Ant, ant: Ant, rule: Rule, task: Task, tick: int) -> int:
    """Return the reward of an ant by your rule, after the tick; `was` is the ant before it."""
    inputs = {
        "reward": ant.reward,
        "event": ant.event,
        "paper_state": was.paper_state,
        "next_paper_state": ant.paper_state,
    }
    return int(computed(rule, task, {**inputs, **_of_ant(world, ant, tick, ())}))


def _of_ant(world: WorldState, ant: Ant, tick: int, hidden: Container[int]) -> dict[str, Any]:
    """Return the inputs of all kinds of rules that ants follow; `hidden` turns show no levels."""
    inputs: dict[str, Any] = {
        name: getattr(ant, name) for name in ("carries", "trait", "threshold")
    }
    inputs |= {"stimulus": world.stimuli[ant.nest], "tick": tick}
    named = {f"_{name}": trail for name, trail in world.pheromones.items()}
    for name, trail in {"": world.cue(ant), **named}.items():
        inputs[f"levels{name}"] = levels_in_view(world, ant, trail, AHEAD, hidden)
        inputs[f"level{name}"] = trail.level(ant.cell)
    return inputs
