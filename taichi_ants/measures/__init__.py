"""Measures: numbers of a snapshot of a colony, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from taichi_ants.errors import check_one_of

_MEASURES: dict[str, Callable[[Any], float]] = {
    "deliveries": lambda snapshot: float(snapshot.counts["deliveries"]),
    "living": lambda snapshot: float(len(snapshot.ant_cells)),
}


def get(name: str) -> Callable[[Any], float]:
    """Return the measure of a name, a function of a `Snapshot`; AntsError if there is none."""
    check_one_of("measure", name, tuple(_MEASURES))
    return _MEASURES[name]
