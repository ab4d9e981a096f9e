"""The choice of actions.

Every choice, every action that may slip and every cell that may be misread takes one draw. Its high
word decides whether the ant explores, slips or misreads; its low word decides everything else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from taichi_ants.reference.ants import Ant
from taichi_ants.reference.cues import sense
from taichi_ants.reference.features.castes import caste_of
from taichi_ants.reference.observations import cells_in_view, ways
from taichi_ants.reference.random_stream import WORDS, RandomStream, pick
from taichi_ants.reference.world_state import WorldState
from taichi_ants.rules.functions import exp, power
from taichi_ants.task import Choice, Task, Traffic
from taichi_ants.task.constants import GIVE, LEFT, N_ACTIONS, PICK_UP, RIGHT, SEES_GOAL


def choose(
    world: WorldState, ant: Ant, task: Task, values: Sequence[np.float32], epsilon: float
) -> int:
    """Return the action of an ant by a built-in rule, with the numbers of its caste."""
    choice, caste = task.choice, caste_of(task, ant)
    for name in ("temperature", "k", "exponent"):
        if (number := getattr(caste, name)) is not None:
            choice = replace(choice, **{name: number})
    if choice.rule == "deneubourg":
        return choose_cell(world, ant, choice, task.traffic)
    return choose_action(values, epsilon, ant.stream, choice)


def choose_action(
    values: Sequence[np.float32], epsilon: float, stream: RandomStream, choice: Choice | None = None
) -> int:
    """Return an action: any with probability epsilon, else one by these 5 values.

    That is one with the largest value or, by the rule "softmax", action a with a probability
    proportional to exp(values[a] / temperature).
    """
    high, low = stream.draw()
    if high < int(epsilon * WORDS):
        return pick(low, N_ACTIONS)
    best_value = max(values)
    if choice is not None and choice.rule == "softmax":
        assert choice.temperature is not None
        weights = [exp((float(value) - float(best_value)) / choice.temperature) for value in values]
        return weighted(weights, low)
    best = [action for action in range(N_ACTIONS) if values[action] == best_value]
    return best[pick(low, len(best))]


def weighted(weights: Sequence[float], word: int) -> int:
    """Return the index of a weight, with probabilities proportional to the weights."""
    total = 0.0
    for weight in weights:
        total = total + weight
    drawn = word / WORDS * total
    cumulative = 0.0
    for index, weight in enumerate(weights[:-1]):
        cumulative = cumulative + weight
        if cumulative > drawn:
            return index
    return len(weights) - 1


def choose_cell(world: WorldState, ant: Ant, choice: Choice, traffic: Traffic) -> int:
    """Return an action by the rule of Deneubourg et al. (1990), which needs no action values."""
    assert choice.k is not None
    assert choice.exponent is not None
    _, low = ant.stream.draw()
    seen = [ant.state >> 4 & 3, ant.state >> 2 & 3, ant.state & 3]
    if SEES_GOAL in seen:
        return GIVE if ant.carries else PICK_UP
    weights, cue = [0.0, 0.0, 0.0], world.cue(ant)
    if sense(world, ant) and choice.carriers_follow is not None:
        cue = world.pheromones[choice.carriers_follow]
    is_open, nearer = ways(world, ant, seen, traffic)
    for side, cell in enumerate(cells_in_view(ant)):
        if is_open[side]:
            level = 0.0 if side - 1 in ant.misread else float(cue.level(cell))
            weights[side] = power(choice.k + level, choice.exponent)
    if not any(weights):
        return (LEFT, RIGHT)[pick(low, 2)]
    best = [weights[side] if nearer[side] else 0.0 for side in range(3)]
    weights = best if any(best) else weights
    return weighted(weights, low)
