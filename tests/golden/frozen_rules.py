"""Rules for golden hashes: those of the tests, and two that other tests do not see."""

import importlib
from collections.abc import Iterator
from contextlib import contextmanager

import own_rules

from taichi_ants import rules
from taichi_ants.features.rule import RULES
from taichi_ants.task.constants import Event


def golden_alarm(level, level_trail, threshold, stimulus, carries, amount=30.0):
    """Return a level that depends on another pheromone and on the division of labour."""
    found = level
    if level_trail < 5 * amount and stimulus > threshold / 4:
        found = amount + level_trail / 2 + 7 * carries
    return min(found, 1000)


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


@contextmanager
def registered() -> Iterator[None]:
    """Register the rules until the end of the `with` block."""
    before = dict(RULES.yours)
    RULES.yours.clear()
    importlib.reload(own_rules)
    rules.register("deposit")(golden_alarm)
    rules.register("reward")(golden_shaped)
    try:
        yield
    finally:
        RULES.yours.clear()
        RULES.yours.update(before)
