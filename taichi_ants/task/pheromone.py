"""How trails are laid, fall and spread: the numbers, which kernels in `engines` read."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from taichi_ants.errors import AntsError, check_one_of, checked_whole, shown
from taichi_ants.task.constants import DEPOSIT_LEVEL

Evaporation = Literal["linear", "exponential", "none"]
Deposit = Literal["set", "add", "fading", "none"]
View = Literal["half", "strongest", "strongest_under_carriers"]
EVAPORATIONS: tuple[str, ...] = get_args(Evaporation)
DEPOSITS: tuple[str, ...] = get_args(Deposit)
VIEWS: tuple[str, ...] = get_args(View)
MAX_DEPOSIT = 1_000_000
LINEAR = -1.0  # stands for linear evaporation where kernels read a decay factor


@dataclass(frozen=True)
class Pheromone:
    """How trails are laid, fall and spread.

    Attributes:
        evaporation: "linear": a trail falls by 1 per tick, not below 0. "exponential": it halves
            every `half_life` ticks, and what falls below 1 becomes 0. "none": it stays.
        half_life: In ticks, above 0; of exponential evaporation only, there 50 if None.
        diffusion: Share of a cell's trail that it gives to its six neighbours per tick, a sixth
            of it to each, in [0, 1]. The share aimed at an obstacle or out of the world stays.
        deposit: "set": a carrying ant sets the trail of a cell to `level`. "add": it adds `level`,
            up to `cap`. "fading": it raises the trail to `level` less `slope` for each tick that it
            has carried its food, so that trails rise towards food. "none": it lays nothing.
        level: What a deposit sets or adds, in ticks of linear evaporation, 1 .. 1 000 000; where
            nothing is laid, the usual one.
        slope: How much less an ant lays after each tick with food, 1 .. 1 000 000; of "fading"
            only, there 10 if None. Trails rise towards food if it is above what evaporates.
        cap: No deposit that adds leaves a trail above this, 1 .. 1 000 000; of "add" only, there
            1000 if None.
        view: Which trails an ant without food sees as T, of those of at least 1 on the empty cells
            in view. "half": those of at least half the strongest. "strongest": the strongest, all
            of them if several are. "strongest_under_carriers": the same, but a trail on the cell of
            an ant with food counts for the strongest too.

    Raises:
        AntsError: A value is outside its range, or would change nothing.
    """

    evaporation: Evaporation = "linear"
    half_life: float | None = None
    diffusion: float = 0.0
    deposit: Deposit = "set"
    level: int = DEPOSIT_LEVEL
    cap: int | None = None
    slope: int | None = None
    view: View = "half"

    def __post_init__(self) -> None:
        check_one_of("evaporation", self.evaporation, EVAPORATIONS)
        if self.half_life is not None and not 0 < _number(self.half_life) < math.inf:
            raise AntsError(
                f"half_life is {shown(self.half_life)}; it must be a number of ticks above 0."
            )
        if not 0 <= _number(self.diffusion) <= 1:
            raise AntsError(
                f"diffusion is {shown(self.diffusion)}; it must be a number from 0 to 1."
            )
        check_one_of("deposit", self.deposit, DEPOSITS)
        checked_whole("level", self.level, 1, MAX_DEPOSIT)
        if self.cap is not None:
            checked_whole("cap", self.cap, 1, MAX_DEPOSIT)
        if self.slope is not None:
            checked_whole("slope", self.slope, 1, MAX_DEPOSIT)
        check_one_of("view", self.view, VIEWS)
        if self.deposit == "none" and self.level != DEPOSIT_LEVEL:
            raise AntsError(
                f"level is {shown(self.level)}, but deposit is 'none'; make deposit another one, "
                "or leave it out."
            )
        self._settle("half_life", 50.0, "evaporation", "exponential")
        self._settle("cap", 1000, "deposit", "add")
        self._settle("slope", 10, "deposit", "fading")

    def _settle(self, name: str, usual: float, other: str, needed: str) -> None:
        """Refuse an option where another one makes it mean nothing; fill it in where it is not."""
        chosen = getattr(self, other)
        if getattr(self, name) is None:
            object.__setattr__(self, name, usual if chosen == needed else None)
        elif chosen != needed:
            raise AntsError(
                f"{name} is {shown(getattr(self, name))}, but {other} is {chosen!r}; make "
                f"{other} {needed!r}, or leave it out."
            )

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
        return replace(self, evaporation="none", half_life=None)

    @property
    def decay(self) -> np.float32:
        """The factor on every level per tick of exponential evaporation, else 1."""
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
        return np.float32(float(self.diffusion) / 6.0)


def _number(value: object) -> float:
    """A number as float; nan for what is none."""
    if isinstance(value, (bool, str)):
        return math.nan
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return math.nan
