"""What an observation of the reference is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from taichi_ants.reference.records import Ant
from taichi_ants.reference.registry import Registry
from taichi_ants.reference.world_state import WorldState


@dataclass(frozen=True)
class Observation:
    """A way to number what an ant sees.

    Attributes:
        n_states: How many rows a table has.
        row: (world, ant) -> the row that the ant looks at, 0 .. n_states - 1.
    """

    n_states: int
    row: Callable[[WorldState, Ant], int]


OBSERVATIONS: Registry[Observation] = Registry("observation")


def number(digits: list[int], base: int) -> int:
    """Return the number of these digits, the first one the most significant."""
    value = 0
    for digit in digits:
        value = base * value + digit
    return value
