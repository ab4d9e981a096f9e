"""Castes in plain Python."""

from __future__ import annotations

from collections.abc import Sequence

from taichi_ants.grid.constants import STREAM_INDIVIDUAL
from taichi_ants.reference.ants import Ant
from taichi_ants.reference.random_stream import WORDS, RandomStream, stream_state
from taichi_ants.task import Caste, Task

ONE = Caste()  # without settings; made once, because it takes long


def caste_of(task: Task, ant: Ant) -> Caste:
    """Return the caste of an ant, one without settings if there are no castes."""
    return [*task.castes.values()][ant.caste] if task.castes else ONE


def parts_of(castes: Sequence[Caste], nest: int) -> list[tuple[int, float]]:
    """Return the ants that `ants` gives to each caste of a nest, and its share of all others.

    Castes with neither divide the remaining share equally.
    """
    of_nest = [caste for caste in castes if caste.nest in (None, nest)]
    taken = sum([caste.share for caste in of_nest if caste.share is not None])
    neither = [caste for caste in of_nest if caste.share is None and caste.ants is None]
    rest = max(1.0 - taken, 0.0) / max(len(neither), 1)
    parts: list[tuple[int, float]] = []
    for caste in castes:
        share = rest if caste.share is None else caste.share
        part = (0, share) if caste.ants is None else (caste.ants, 0.0)
        parts.append(part if caste.nest in (None, nest) else (0, 0.0))
    return parts


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
        if cumulative > high / WORDS:
            return caste
    return len(castes) - 1


def draw_trait(seed: int, number: int) -> float:
    """Return the trait of the ant with a number, from 0 to less than 1."""
    high, _ = RandomStream(stream_state(seed, STREAM_INDIVIDUAL, number)).draw()
    return high / WORDS


def epsilon_of(caste: Caste, ant: Ant, default: float) -> float:
    """Return the exploration rate of an ant, whose caste can have another one than `default`."""
    if caste.epsilon is None:
        return default
    if not caste.epsilon_spread:
        return caste.epsilon
    return caste.epsilon + caste.epsilon_spread * (2.0 * ant.trait - 1.0)


def lays(task: Task, ant: Ant, name: str) -> bool:
    names = [name.strip() for name in caste_of(task, ant).lays.split(",")]
    return names == ["all"] or name in names
