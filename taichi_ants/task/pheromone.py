"""How trails are laid, fall and spread: the numbers, which kernels in `engines` read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal, get_args

from taichi_ants.settings import Is, Settings
from taichi_ants.task.constants import DEPOSIT_LEVEL

if TYPE_CHECKING:
    import numpy as np

Evaporation = Literal["linear", "exponential", "none"]
Deposit = Literal["set", "add", "fading", "none"]
View = Literal["half", "strongest", "strongest_under_carriers"]
EVAPORATIONS: tuple[str, ...] = get_args(Evaporation)
DEPOSITS: tuple[str, ...] = get_args(Deposit)
VIEWS: tuple[str, ...] = get_args(View)
MAX_DEPOSIT = 1_000_000
LINEAR = -1.0  # stands for linear evaporation where kernels read a decay factor

Level = Annotated[int | None, Is(unit="ticks of linear evaporation", least=1, most=MAX_DEPOSIT)]


@dataclass(frozen=True)
class Pheromone(Settings, path="task.pheromone"):
    """The rules by which trails are laid, evaporate and spread.

    Evaporation is "linear": a trail loses 1 per tick; "exponential": it halves every `half_life`
    ticks, and what is below 1 becomes 0; or "none". Of the share `diffusion`, each neighbour gets a
    sixth; what is aimed at an obstacle or out of the world stays. A deposit is "set": an ant with
    food sets the trail of a cell to `level`; "add": it adds `level`, up to `cap`; "fading": it
    raises the trail to `level` less `slope` for each tick that it has carried its food, so that
    trails rise towards food if `slope` is above what evaporates; or "none". By `view`, an ant
    without food sees as T, of the trails of at least 1 on the empty cells in view, "half": those of
    at least half the strongest; "strongest": the strongest ones; "strongest_under_carriers": the
    same, but a trail on the cell of an ant with food counts for the strongest too.
    """

    evaporation: Annotated[Evaporation, Is("how trails evaporate")] = "linear"
    half_life: Annotated[
        float | None,
        Is("time in which a trail halves", unit="ticks", above=0, usual=50.0),
        Is(only=("evaporation", "exponential")),
    ] = None
    diffusion: Annotated[
        float, Is("share of a trail that spreads to the six neighbours per tick", least=0, most=1)
    ] = 0.0
    deposit: Annotated[Deposit, Is("how ants with food lay trails")] = "set"
    level: Annotated[
        int,
        Is("trail that a deposit sets or adds, or from which it fades", least=1, most=MAX_DEPOSIT),
        Is(unit="ticks of linear evaporation", only=("deposit", "set", "add", "fading")),
    ] = DEPOSIT_LEVEL
    cap: Annotated[
        Level, Is("largest trail that deposits add up to", usual=1000, only=("deposit", "add"))
    ] = None
    slope: Annotated[
        Level, Is("how much less is laid per tick with food", usual=10, only=("deposit", "fading"))
    ] = None
    view: Annotated[View, Is("which trails ants without food see as T")] = "half"

    @property
    def dense(self) -> bool:
        """Whether levels are float32 and change in every cell each tick; else they are integers."""
        return self.evaporation == "exponential" or self.diffusion > 0

    @property
    def fades_after(self) -> int:
        """Ticks with food after which an ant lays nothing, if deposits fade, else 0."""
        return -(-int(self.level) // self.slope) if self.slope else 0

    @property
    def lasting(self) -> Pheromone:
        """The same without evaporation."""
        return self.but(evaporation="none")

    @property
    def decay(self) -> np.float32:
        """The factor on every level per tick of exponential evaporation, else 1."""
        import numpy as np

        return np.float32(0.5 ** (1.0 / float(self.half_life)) if self.half_life else 1.0)

    @property
    def numbers(self) -> dict[str, int | float]:
        """The numbers by which kernels lay, evaporate and spread trails, by name."""
        level = float if self.dense else int
        return {
            "deposits": DEPOSITS.index(self.deposit),
            "deposit_level": level(self.level),
            "cap": level(self.cap or 0),
            "slope": level(self.slope or 0),
            "fades_after": self.fades_after,
            # By how much the clock of trails that are stored as expiry clocks advances per tick.
            "evaporates": int(self.evaporation == "linear"),
            "decay": LINEAR if self.evaporation == "linear" else float(self.decay),
            "share": float(self.share),
        }

    @property
    def share(self) -> np.float32:
        """The part of its level that a cell gives to one neighbour per tick of diffusion."""
        import numpy as np

        return np.float32(float(self.diffusion) / 6.0)
