"""Life: births, deaths of old age, food that grows back, and piles of food that wander.

The queen and the food of a world change in the phases of the engine, `engines/colony/life.py`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from taichi_ants.features.feature import ANT, Array, Feature
from taichi_ants.grid.constants import MAX_STEPS
from taichi_ants.kernel_functions import ti
from taichi_ants.settings import Setting, Settings

Ticks = Annotated[int | None, Setting(unit="ticks", least=1, most=MAX_STEPS)]


@dataclass(frozen=True)
class Life(Settings, path="task.life"):
    """Births, deaths, and changes of food, for colonies only; by default, there are none.

    None means that ants do not die, food does not grow back, or food does not move. With `regrowth`
    0, food grows back in the same tick.

    >>> Task(life=Life(births=True, lifespan=2000)).life.lifespan
    2000
    """

    sentences: ClassVar[dict[str, str]] = {
        "births": "The queen turns each food item that she receives into an ant on a free cell "
        "next to her.",
        "lifespan": "An ant dies at the age of {lifespan} ticks and leaves its food on its cell.",
        "regrowth": "Food grows back in its cell {regrowth} ticks after it was taken, once the "
        "cell is empty.",
        "pile_move_interval": "Each pile of food moves by one cell every {pile_move_interval} "
        "ticks.",
    }

    births: Annotated[bool, Setting("turn each food item given to the queen into an ant")] = False
    lifespan: Annotated[Ticks, Setting("age at which an ant dies")] = None
    regrowth: Annotated[Ticks, Setting("time until taken food grows back", least=0)] = None
    pile_move_interval: Annotated[Ticks, Setting("time between moves of each pile of food")] = None


AGE = Feature(
    Life,
    switch="lifespan",
    uses=lambda task: any(one.lifespan is not None for one in (task.life, *task.castes.values())),
    arrays=(Array("age", ANT, "i4", "ages", "i4", "age", unit="ticks"),),
    of_castes={"lifespan": lambda task, caste: caste.lifespan or task.life.lifespan or -1},
)


@AGE.at("born")
def begin_young(a):
    a.age = 0


@AGE.at("aged")
def grow_old(a):
    lifespan, dies = ti.cast(a.lifespan, ti.i32), False
    if lifespan > 0:
        a.age = a.age + 1
        dies = a.age >= lifespan
    return dies
