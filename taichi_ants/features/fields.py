"""Further pheromones: their settings, and the occasions on which ants lay them.

Their levels and the trail are arrays of the engine, `engines/colony/trail.py`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntFlag
from typing import Annotated, ClassVar, Literal

from taichi_ants.features.castes import ALL, NOTHING
from taichi_ants.features.cues import CUES
from taichi_ants.features.feature import Feature, Task
from taichi_ants.features.pheromone import Pheromone
from taichi_ants.grid.constants import TRAIL as TRAIL
from taichi_ants.settings import Setting

Laid = Literal["with_food", "without_food", "always", "dead_end", "failed_pick_up", "never"]


class Occasion(IntFlag):
    """Occasions of an ant in a tick: it enters a cell, picks up, delivers, or is stuck."""

    MOVED_WITH_FOOD = 1
    PICKED_UP = 2
    MOVED_WITHOUT_FOOD = 4
    DELIVERED = 8
    DEAD_END = 16
    FAILED_PICK_UP = 32


_WITH_FOOD = Occasion.MOVED_WITH_FOOD | Occasion.PICKED_UP
_WITHOUT_FOOD = Occasion.MOVED_WITHOUT_FOOD | Occasion.DELIVERED
OCCASIONS: dict[str, Occasion] = {
    "with_food": _WITH_FOOD,
    "without_food": _WITHOUT_FOOD,
    "always": _WITH_FOOD | _WITHOUT_FOOD,
    "dead_end": Occasion.DEAD_END,
    "failed_pick_up": Occasion.FAILED_PICK_UP,
    "never": Occasion(0),
}


@dataclass(frozen=True)
class Field(Pheromone, path="task.fields.NAME"):
    """The rules of a further pheromone, which has a level in each cell, 0 at the start.

    All settings of `Pheromone` apply; `view` has an effect only if the field is a cue. Deposits
    that fade count ticks since the ant's last pick-up, delivery or birth, or since the start.

    >>> home = Field(deposited_when="without_food")
    >>> Task(observation="ants", fields={"home": home}, homing_cue="home").homing_cue
    'home'
    """

    sentences: ClassVar[dict[str, str]] = {
        "deposited_when=with_food": "Ants deposit on each cell that they enter with food and, when "
        "they pick up food, on its cell and on their own.",
        "deposited_when=without_food": "Ants deposit on each cell that they enter without food "
        "and, when they deliver, on their own cell.",
        "deposited_when=always": "Ants deposit on each cell that they enter, and when they pick up "
        "or deliver.",
        "deposited_when=dead_end": "An ant without food that sees three obstacles deposits on its "
        "cell.",
        "deposited_when=failed_pick_up": "An ant that fails to pick up food deposits on its cell.",
        "deposited_when=never": "Ants never deposit.",
        **Pheromone.sentences,
    }

    deposited_when: Annotated[Laid, Setting("occasions on which ants deposit")] = "with_food"

    @property
    def counts_without_food(self) -> bool:
        """Whether deposits depend on the time for which an ant has been without food."""
        without = ~_WITH_FOOD & OCCASIONS[self.deposited_when]
        rule = self.own_deposit
        reads = self.deposit == "fading" if rule is None else "carried" in rule.inputs
        return reads and bool(without)

    @property
    def numbers(self) -> dict[str, int | float]:
        """The settings as numbers for kernels, by name."""
        return {**super().numbers, "deposited_when": int(OCCASIONS[self.deposited_when])}


def _faults(task: Task) -> Iterator[str]:
    for name in (TRAIL, *CUES, ALL, NOTHING):  # the last two have a meaning in `lays`
        if name in task.fields:
            yield f"`task.fields` has a field {name!r}, a name that is taken; choose another name."


FIELDS = Feature(Field, uses=lambda task: bool(task.fields), faults=_faults)
