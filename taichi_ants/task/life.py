"""What comes and goes in a world: ants and food."""

from __future__ import annotations

from dataclasses import dataclass

from taichi_ants.errors import checked_flag, checked_whole
from taichi_ants.task.constants import MAX_STEPS


@dataclass(frozen=True)
class Life:
    """What comes and goes; by default nothing does. Colonies only.

    Attributes:
        births: Whether the queen turns each food that she is given into an ant.
        lifespan: Ticks after which an ant dies, at least 1. None: ants do not die.
        regrowth: Ticks after which a food that was taken grows back at its place, at least 0 (in
            the same tick). None: it does not.
        wander: Each pile of food moves by one cell every so many ticks, at least 1. None: food
            stays.

    Raises:
        AntsError: A value is outside its range.
    """

    births: bool = False
    lifespan: int | None = None
    regrowth: int | None = None
    wander: int | None = None

    def __post_init__(self) -> None:
        checked_flag("births", self.births)
        for name, least in (("lifespan", 1), ("regrowth", 0), ("wander", 1)):
            ticks = getattr(self, name)
            if ticks is not None:
                checked_whole(name, ticks, least, MAX_STEPS, ", or be left out")

    @property
    def changes(self) -> bool:
        """Whether anything comes or goes."""
        return self != Life()
