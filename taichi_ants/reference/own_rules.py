"""Your rules of choice and of rewards, and what they read; those of pheromones are in `Trail`."""

from __future__ import annotations

from collections.abc import Container
from typing import Any

from taichi_ants.reference.ants import Ant
from taichi_ants.reference.features import inputs_of
from taichi_ants.reference.observations import AHEAD, levels_in_view, ways
from taichi_ants.reference.random_stream import WORDS
from taichi_ants.reference.world_state import WorldState, computed
from taichi_ants.rules import Rule
from taichi_ants.task import Task


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
    inputs |= facts_of(world, ant, task, tick, ant.misread)
    return int(computed(rule, task.rules, inputs))


def pay(world: WorldState, was: Ant, ant: Ant, rule: Rule, task: Task, tick: int) -> int:
    """Return the reward of an ant by your rule, after the tick; `was` is the ant before it."""
    inputs = {"paper_state": was.paper_state, "next_paper_state": ant.paper_state}
    inputs |= {"reward": ant.reward, "event": ant.event, **facts_of(world, ant, task, tick, ())}
    return int(computed(rule, task.rules, inputs))


def facts_of(
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
