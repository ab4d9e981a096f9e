"""Own rules of each kind for golden hashes, frozen like `drawing`; other tests do not see them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from taichi_ants import rules
from taichi_ants.rules import exp, log, power
from taichi_ants.rules.rule import RULES
from taichi_ants.task.events import Event


@rules.register("evaporation")
def golden_power_law(level, tick, exponent=1.1):
    """Return the level after a loss that grows faster than the level."""
    return max(level - 0.001 * power(level, exponent) - (tick % 2), 0) if level > 1 else 0


@rules.register("deposit")
def golden_weaker(level, carried, carries, event, paper_state, trait, tick, amount=100.0):
    """Return a level that depends on all inputs."""
    found = level
    if event == Event.PICKED_UP or (paper_state % 4 == 2 and not carries):
        found = max(level, 3 * amount)
    elif 0 < tick < 5:
        pass
    else:
        found += amount * exp(-carried / 20) + log(1 + level) + 9 * trait
    return min(found, 1000)


@rules.register("deposit")
def golden_alarm(level, level_trail, threshold, stimulus, carries, amount=30.0):
    """Return a level that depends on another pheromone and on the division of labour."""
    found = level
    if level_trail < 5 * amount and stimulus > threshold / 4:
        found = amount + level_trail / 2 + 7 * carries
    return min(found, 1000)


@rules.register("choice")
def golden_restless(values, epsilon, random, random_2, levels, level, paper_state, trait, tick):
    """Return an action by action values and levels."""
    best = 0
    top = values[0]
    for a in range(1, 5):
        value = values[a]
        if a == 3:
            value += levels[0] > level
        if value > top:
            top = value
            best = a
    if random < epsilon + 0.2 * trait:
        best = (random_2 * 5 + tick + paper_state) // 1 % 5
    return best


@rules.register("choice")
def golden_hungry(codes, carries, threshold, stimulus, trait, random, random_2):
    """Return an action that depends on the division of labour."""
    action = random * 3 // 1
    if random_2 + stimulus > threshold or trait < 0.5:
        for i in range(3):
            if codes[i] == 3:
                action = 3 + carries
            elif codes[i] == 2:
                action = i
    return min(action, 4)


@rules.register("reward")
def golden_shaped(reward, event, carries, next_paper_state, levels, level, trait, tick, scale=2.0):
    """Return a reward that depends on the trails."""
    more = 0
    if levels[1] > level and not carries:
        more = scale
    if event == Event.DELIVERED:
        more += 5 + tick % 3
    if next_paper_state % 3 == 1:
        more -= 1 + (trait < 0.3)
    return min(max((reward + more) // 1, -1000), 1000)


@rules.register("reward")
def golden_demanded(reward, event, threshold, stimulus):
    """Return a reward that depends on the division of labour."""
    more = 0
    if event == Event.DELIVERED and stimulus > threshold:
        more = 4
    return min(max(reward + more + min(stimulus, 9) // 1, -1000), 1000)


FROZEN = {name: RULES.yours.pop(name) for name in rules.names() if name.startswith("golden_")}


@contextmanager
def registered() -> Iterator[None]:
    """Register the rules until the end of the `with` block."""
    RULES.yours.update(FROZEN)
    try:
        yield
    finally:
        for name in FROZEN:
            del RULES.yours[name]
