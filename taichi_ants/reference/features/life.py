"""Death of old age in plain Python."""

from __future__ import annotations

from typing import Any

from taichi_ants.reference.ants import Ant
from taichi_ants.reference.features.castes import caste_of


def born(colony: Any, ant: Ant) -> None:
    ant.own["age"] = 0


def aged(colony: Any, ant: Ant) -> bool:
    """Let an ant grow old, if ants die; return whether it reaches its lifespan."""
    lifespan = caste_of(colony.task, ant).lifespan or colony.task.life.lifespan
    if lifespan is None:
        return False
    ant.own["age"] += 1
    return ant.own["age"] >= lifespan
