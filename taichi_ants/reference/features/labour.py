"""Division of labour in plain Python: response thresholds and idle ants."""

from __future__ import annotations

from typing import Any

import numpy as np

from taichi_ants.grid.constants import STREAM_TRAIT
from taichi_ants.reference.ants import Ant
from taichi_ants.reference.features.castes import caste_of
from taichi_ants.reference.geometry import distance
from taichi_ants.reference.random_stream import WORDS, RandomStream, stream_state
from taichi_ants.reference.world_state import WorldState
from taichi_ants.rules.functions import exp, log, power
from taichi_ants.task import Threshold


def born(colony: Any, ant: Ant) -> None:
    threshold = caste_of(colony.task, ant).threshold
    ant.own["threshold"] = draw_threshold(threshold, colony.seed, ant.number)
    ant.own["idle"] = threshold.distribution != "none"


def draw_threshold(threshold: Threshold, seed: int, number: int) -> np.float32:
    """Return the threshold of the ant with a number, 0 without one."""
    if threshold.distribution == "none":
        return np.float32(0)
    assert threshold.value is not None
    value, spread = threshold.value, threshold.spread or 0.0
    stream = RandomStream(stream_state(seed, STREAM_TRAIT, number))
    if threshold.distribution == "fixed":
        return np.float32(value)
    if threshold.distribution == "uniform":
        high, _ = stream.draw()
        return np.float32(value + spread * (2.0 * ((high + 0.5) / WORDS) - 1.0))
    while True:
        high, low = stream.draw()
        a, b = ((word + 0.5) / 2147483648.0 - 1.0 for word in (high, low))
        q = a * a + b * b
        if q >= 1.0:
            continue
        z = a * power(-2.0 * log(q) / q, 0.5)
        if threshold.distribution == "lognormal":
            return np.float32(value * exp(spread * z))
        if value + spread * z >= 0.0:
            return np.float32(value + spread * z)


def choose(colony: Any, ant: Ant) -> bool:
    """Let an idle ant start to forage, by a draw; return whether it stays idle."""
    if not ant.own["idle"]:
        return False
    stimulus = colony.world.of_nests[ant.nest]["stimulus"]
    high, _ = ant.stream.draw()
    if stimulus > 0.0:
        ratio = float(ant.own["threshold"]) / stimulus
        raised = power(ratio, colony.task.labour.exponent) if ratio > 0.0 else 0.0
        ant.own["idle"] = high >= int(1.0 / (1.0 + raised) * WORDS)
    return ant.own["idle"]


def delivered(colony: Any, nest: int, n: int) -> None:
    values, relief = colony.world.of_nests[nest], (colony.task.labour.relief or 0.0) * n
    values["stimulus"] = max(0.0, values["stimulus"] - relief)


def acted(colony: Any, ant: Ant) -> bool:
    """Return whether a forager becomes idle, by a draw if it can."""
    caste, chance = caste_of(colony.task, ant), colony.task.labour.stop_probability
    queen = colony.world.queens[ant.nest]
    can_stop = chance and caste.threshold.distribution != "none" and not ant.carries
    if not can_stop or distance(ant.cell, queen) != 1:
        return False
    high, _ = ant.stream.draw()
    return high < int(chance * WORDS)


def stopped(colony: Any, ant: Ant) -> None:
    ant.own["idle"] = True


def tick_ended(colony: Any, nest: int) -> None:
    colony.world.of_nests[nest]["stimulus"] += colony.task.labour.demand or 0.0


def inputs(world: WorldState, ant: Ant) -> dict[str, Any]:
    """Return the inputs of your rules: the threshold of an ant, and the stimulus of its nest."""
    stimulus = world.of_nests[ant.nest]["stimulus"]
    return {"threshold": ant.own["threshold"], "stimulus": stimulus}


MEASURES = {"foraging": lambda colony, ant: not ant.own.get("idle", False)}  # shares of ants
