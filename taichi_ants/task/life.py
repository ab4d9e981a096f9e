"""What comes and goes in a world: ants and food."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from taichi_ants.settings import Is, Settings
from taichi_ants.task.constants import MAX_STEPS

Ticks = Annotated[int | None, Is(unit="ticks", least=1, most=MAX_STEPS)]


@dataclass(frozen=True)
class Life(Settings, path="task.life"):
    """The ants and food that come and go; by default none do. Colonies only.

    None means that ants do not die, food does not grow back, or food stays. With `regrowth` 0, food
    grows back in the same tick.

    Raises:
        AntsError: A value is outside its range.
    """

    births: Annotated[bool, Is("turn each food item that the queen is given into an ant")] = False
    lifespan: Annotated[Ticks, Is("age at which an ant dies")] = None
    regrowth: Annotated[Ticks, Is("time until food grows back where it was taken", least=0)] = None
    wander: Annotated[Ticks, Is("interval at which each pile of food moves by one cell")] = None

    @property
    def changes(self) -> bool:
        """Whether anything comes or goes."""
        return self != Life()
