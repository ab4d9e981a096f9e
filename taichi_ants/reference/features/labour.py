"""Division of labour in plain Python: response thresholds and idle ants."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.grid.constants import N_HEADINGS, STREAM_TRAIT
from taichi_ants.reference.ants import Ant
from taichi_ants.reference.features.castes import caste_of
from taichi_ants.reference.geometry import neighbour
from taichi_ants.reference.random_stream import RandomStream, stream_state
from taichi_ants.rules.functions import exp, log, power

if TYPE_CHECKING:
    from taichi_ants.reference.world_state import WorldState
    from taichi_ants.task import Threshold

ReferenceColony = Any  # which imports this file
_WORDS = 4294967296.0


def born(colony: ReferenceColony, ant: Ant) -> None:
    """Draw the threshold of an ant, which is idle if it has one."""
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
        return np.float32(value + spread * (2.0 * ((high + 0.5) / _WORDS) - 1.0))
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


def choose(colony: ReferenceColony, ant: Ant) -> bool:
    """Let an idle ant start to forage, by a draw; return whether it stays idle."""
    if ant.own["idle"]:
        ant.own["idle"] = not _starts_foraging(colony, ant)
    return ant.own["idle"]


def _starts_foraging(colony: ReferenceColony, ant: Ant) -> bool:
    exponent, stimulus = colony.task.labour.exponent, _stimulus(colony.world, ant)
    assert exponent is not None
    high, _ = ant.stream.draw()
    if stimulus <= 0.0:
        return False
    ratio = float(ant.own["threshold"]) / stimulus
    raised = power(ratio, exponent) if ratio > 0.0 else 0.0
    return high < int(1.0 / (1.0 + raised) * _WORDS)


def delivered(colony: ReferenceColony, nest: int, n: int) -> None:
    """Lower the stimulus of a nest."""
    values, relief = colony.world.of_nests[nest], (colony.task.labour.relief or 0.0) * n
    values["stimulus"] = max(0.0, values.get("stimulus", 0.0) - relief)


def acted(colony: ReferenceColony, ant: Ant) -> bool:
    """Return whether a forager becomes idle, by a draw if it can."""
    caste, chance = caste_of(colony.task, ant), colony.task.labour.stop_probability
    queen = colony.world.queens[ant.nest]
    at_nest = queen in [neighbour(ant.cell, heading) for heading in range(N_HEADINGS)]
    if not chance or caste.threshold.distribution == "none" or ant.carries or not at_nest:
        return False
    high, _ = ant.stream.draw()
    return high < int(chance * _WORDS)


def stopped(colony: ReferenceColony, ant: Ant) -> None:
    """Make an ant idle."""
    ant.own["idle"] = True


def tick_ended(colony: ReferenceColony, nest: int) -> None:
    """Raise the stimulus of a nest."""
    values = colony.world.of_nests[nest]
    values["stimulus"] = values.get("stimulus", 0.0) + (colony.task.labour.demand or 0.0)


def inputs(world: WorldState, ant: Ant) -> dict[str, Any]:
    """Return the inputs of your rules: the threshold of an ant, and the stimulus of its nest."""
    return {"threshold": ant.own["threshold"], "stimulus": _stimulus(world, ant)}


def _stimulus(world: WorldState, ant: Ant) -> float:
    return world.of_nests[ant.nest].get("stimulus", 0.0)


def foraging(colony: ReferenceColony, ant: Ant) -> bool:
    """Return whether an ant forages, so that it is not idle."""
    return not ant.own.get("idle", False)


MEASURES = {"foraging": foraging}  # shares of ants
