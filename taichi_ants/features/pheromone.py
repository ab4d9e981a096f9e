"""The settings by which trails are laid, evaporate and spread."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from taichi_ants.features.rule import WORDS, Rule, registered, words
from taichi_ants.settings import Setting, Settings, Share

if TYPE_CHECKING:
    import numpy as np

View = Literal["half", "strongest", "strongest_under_carriers"]
DEPOSITS = WORDS["deposit"]
DEPOSIT_LEVEL = 250
MAX_DEPOSIT = 1_000_000
LINEAR = -1.0  # marks linear evaporation in place of a decay factor

Level = Annotated[
    int | None, Setting(unit="ticks of linear evaporation", least=1, most=MAX_DEPOSIT)
]


@dataclass(frozen=True)
class Pheromone(Settings, path="task.pheromone"):
    """The rules by which trails are laid, evaporate and spread.

    Other names of `evaporation` and `deposit` are those of your rules, see `taichi_ants.rules`.
    Trails that fade rise towards food if `slope` exceeds the evaporation.

    >>> Pheromone("exponential", half_life=30).half_life
    30.0
    """

    sentences: ClassVar[dict[str, str]] = {
        "evaporation=linear": "In each tick, the level c of each cell becomes `max(c - 1, 0)`.",
        "evaporation=exponential": "In each tick, the level of each cell is multiplied by `2^(-1 / "
        "{half_life})`; a level below 1 becomes 0.",
        "evaporation=none": "Levels do not evaporate.",
        "diffusion": "Then a cell gives the share {diffusion} / 6 of its level to each neighbour; "
        "the parts for rock and for the outside stay.",
        "deposit=set": "A deposit sets the level of a cell: `c = {level}`.",
        "deposit=add": "A deposit adds to the level of a cell: `c = min(c + {level}, {cap})`.",
        "deposit=fading": "A deposit raises the level of a cell: `c = max(c, {level} - {slope} "
        "t)`, t ticks after the load of the ant changed.",
        "deposit=none": "Ants make no deposits.",
        "view=half": "As a cue, an empty cell shows if its level is at least 1 and half of the "
        "highest level among the empty cells in view.",
        "view=strongest": "As a cue, an empty cell shows if its level is at least 1 and the "
        "highest among the empty cells in view.",
        "view=strongest_under_carriers": "As a cue, an empty cell shows if its level is at least 1 "
        "and the highest in view, where cells under ants with food count too.",
    }

    evaporation: Annotated[
        str,
        Setting("decrease of trails per tick: by 1 (linear) or by a factor (exponential)"),
        Setting(choices=partial(words, "evaporation")),
    ] = "linear"
    half_life: Annotated[
        float | None,
        Setting("time in which a trail halves", unit="ticks", above=0, usual=50.0),
        Setting(only=("evaporation", "exponential")),
    ] = None
    diffusion: Annotated[Share, Setting("share of a trail that spreads to neighbours per tick")] = (
        0.0
    )
    deposit: Annotated[
        str,
        Setting(
            "level of a cell with a new deposit: level (set), level more (add), or at least level "
            "minus slope per tick since the ant's load changed (fading)",
            choices=partial(words, "deposit"),
        ),
    ] = "set"
    level: Annotated[
        int,
        Setting("trail level of a new deposit", least=1, most=MAX_DEPOSIT),
        Setting(unit="ticks of linear evaporation", only=("deposit", "set", "add", "fading")),
    ] = DEPOSIT_LEVEL
    cap: Annotated[
        Level, Setting("largest level that deposits add up to", usual=1000, only=("deposit", "add"))
    ] = None
    slope: Annotated[
        Level,
        Setting("decrease per tick since the load changed", usual=10, only=("deposit", "fading")),
    ] = None
    view: Annotated[
        View,
        Setting(
            "lowest level seen as a cue: half of the highest in view (half), or the highest "
            "(strongest), also of those under ants with food (strongest_under_carriers)"
        ),
    ] = "half"

    @property
    def dense(self) -> bool:
        """Whether levels are float32 that change in every cell each tick, rather than integers."""
        return self.evaporation not in ("linear", "none") or self.diffusion > 0

    @property
    def own_deposit(self) -> Rule | None:
        """Your rule of deposits, if it is one."""
        return registered("deposit", self.deposit)

    @property
    def own_evaporation(self) -> Rule | None:
        """Your rule of evaporation, if it is one."""
        return registered("evaporation", self.evaporation)

    @property
    def darkest(self) -> int:
        """The level that pictures show in the darkest colour: a deposit, or ten if they add up."""
        return min(self.cap or 0, 10 * self.level) if self.deposit == "add" else self.level

    @property
    def fades_after(self) -> int:
        """Ticks with food after which the deposits of an ant are 0, if they fade, else 0."""
        return -(-int(self.level) // self.slope) if self.slope else 0

    @property
    def lasting(self) -> Pheromone:
        """This pheromone without evaporation."""
        return self.replace(evaporation="none")

    @property
    def decay(self) -> np.float32:
        """The factor on levels per tick of exponential evaporation, else 1."""
        import numpy as np

        return np.float32(0.5 ** (1.0 / float(self.half_life)) if self.half_life else 1.0)

    @property
    def numbers(self) -> dict[str, int | float]:
        """The settings as numbers for kernels, by name."""
        level = float if self.dense else int
        return {
            "deposits": (*DEPOSITS, self.deposit).index(self.deposit),  # the last is your rule
            "deposit_level": level(self.level),
            "cap": level(self.cap or 0),
            "slope": level(self.slope or 0),
            "fades_after": self.fades_after,
            # The ticks by which the clock of trails that are stored as expiry clocks advances.
            "evaporates": int(self.evaporation == "linear"),
            "decay": LINEAR if self.evaporation == "linear" else float(self.decay),
            "share": float(self.share),
        }

    @property
    def share(self) -> np.float32:
        """The share of its level that a cell gives to each neighbour per tick."""
        import numpy as np

        return np.float32(float(self.diffusion) / 6.0)
