"""Noise in plain Python: actions that slip, and cells that ants misread."""

from __future__ import annotations

from typing import Any

from taichi_ants.reference.ants import Ant
from taichi_ants.reference.random_stream import WORDS, pick
from taichi_ants.task.constants import N_ACTIONS


def execute(colony: Any, ant: Ant, action: int) -> int:
    if (slip := colony.task.noise.slip) == 0:
        return action
    high, low = ant.stream.draw()
    return pick(low, N_ACTIONS) if high < int(slip * WORDS) else action


def see(colony: Any, ant: Ant, code: int) -> int:
    if (misread := colony.task.noise.misread) == 0:
        return code
    high, low = ant.stream.draw()
    others = [other for other in range(4) if other != code]
    return others[pick(low, 3)] if high < int(misread * WORDS) else code
