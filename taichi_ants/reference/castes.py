"""Castes, response thresholds and idle ants in plain Python."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.grid.constants import N_HEADINGS, STREAM_INDIVIDUAL, STREAM_TRAIT
from taichi_ants.reference.ants import Ant
from taichi_ants.reference.geometry import Cell, neighbour
from taichi_ants.reference.random_stream import RandomStream, stream_state
from taichi_ants.rules.functions import exp, log, power
from taichi_ants.task import Caste

if TYPE_CHECKING:
    from taichi_ants.task import Labour, Task, Threshold

_WORDS = 4294967296.0


def caste_of(task: Task, ant: Ant) -> Caste:
    """Return the caste of an ant, one without settings if there are no castes."""
    return [*task.castes.values()][ant.caste] if task.castes else Caste()


def parts_of(castes: Sequence[Caste], nest: int) -> list[tuple[int, float]]:
    """Return the ants that `ants` gives to each caste of a nest, and its share of all others.

    Castes with neither divide the remaining share equally.
    """
    of_nest = [caste for caste in castes if caste.nest in (None, nest)]
    taken = sum([caste.share for caste in of_nest if caste.share is not None])
    neither = [caste for caste in of_nest if caste.share is None and caste.ants is None]
    rest = max(1.0 - taken, 0.0) / max(len(neither), 1)
    shares = [rest if caste.share is None else caste.share for caste in castes]
    return [
        (0, 0.0)
        if caste.nest not in (None, nest)
        else ((0, share) if caste.ants is None else (caste.ants, 0.0))
        for caste, share in zip(castes, shares, strict=True)
    ]


def castes_at_start(castes: Sequence[Caste], nest: int, n: int) -> list[int]:
    """Return the castes of the n ants of a nest, in the order of their numbers."""
    parts = parts_of(castes, nest)
    rest = n - sum(fixed for fixed, _ in parts)
    quotas = [round(share * rest, 9) for _, share in parts]
    assert rest >= 0  # the castes fit
    assert not rest or any(share for _, share in parts)
    numbers = [fixed + int(quota) for (fixed, _), quota in zip(parts, quotas, strict=True)]
    while sum(numbers) < n:
        remainders = [quota - int(quota) for quota in quotas]
        largest = remainders.index(max(remainders))
        numbers[largest] += 1
        quotas[largest] = 0.0
    return [caste for caste, number in enumerate(numbers) for _ in range(number)]


def draw_caste(castes: Sequence[Caste], nest: int, n: int, stream: RandomStream) -> int:
    """Return the caste of an ant that is born in a nest in which n ants started."""
    if len(castes) < 2:
        return 0
    high, _ = stream.draw()
    parts = parts_of(castes, nest)
    rest = (n - sum(fixed for fixed, _ in parts)) / n if n else 1.0
    cumulative = 0.0
    for caste, (fixed, share) in enumerate(parts[:-1]):
        cumulative += fixed / max(n, 1) + share * rest
        if cumulative > high / _WORDS:
            return caste
    return len(castes) - 1


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


def draw_trait(seed: int, number: int) -> float:
    """Return the trait of the ant with a number, from 0 to less than 1."""
    high, _ = RandomStream(stream_state(seed, STREAM_INDIVIDUAL, number)).draw()
    return high / _WORDS


def epsilon_of(caste: Caste, ant: Ant, default: float) -> float:
    """Return the exploration rate of an ant, whose caste can have another one than `default`."""
    if caste.epsilon is None:
        return default
    if not caste.epsilon_spread:
        return caste.epsilon
    return caste.epsilon + caste.epsilon_spread * (2.0 * ant.trait - 1.0)


def starts_foraging(ant: Ant, stimulus: float, labour: Labour) -> bool:
    """Return whether an idle ant starts to forage, by a draw."""
    assert labour.exponent is not None
    high, _ = ant.stream.draw()
    if stimulus <= 0.0:
        return False
    ratio = float(ant.threshold) / stimulus
    raised = power(ratio, labour.exponent) if ratio > 0.0 else 0.0
    return high < int(1.0 / (1.0 + raised) * _WORDS)


def stops_foraging(ant: Ant, queen: Cell, task: Task) -> bool:
    """Return whether a forager becomes idle, by a draw if it can."""
    caste, chance = caste_of(task, ant), task.labour.stop_probability
    at_nest = queen in [neighbour(ant.cell, heading) for heading in range(N_HEADINGS)]
    if not chance or caste.threshold.distribution == "none" or ant.carries or not at_nest:
        return False
    high, _ = ant.stream.draw()
    return high < int(chance * _WORDS)


def lays(task: Task, ant: Ant, name: str) -> bool:
    """Return whether an ant lays a pheromone."""
    names = [name.strip() for name in caste_of(task, ant).lays.split(",")]
    return names == ["all"] or name in names
