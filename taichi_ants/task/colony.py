"""What a colony needs to know besides its world, its learner and its seed."""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from taichi_ants.errors import AntsError, check_one_of, checked_flag, shown
from taichi_ants.task.constants import DEPOSIT_LEVEL, MAX_STEPS

Evaporation = Literal["linear", "exponential", "none"]
Deposit = Literal["set", "add", "none"]
Sharing = Literal["shared", "own", "fixed"]
Start = Literal["nest", "spread"]
EVAPORATIONS: tuple[str, ...] = get_args(Evaporation)
DEPOSITS: tuple[str, ...] = get_args(Deposit)
# "shared": one table for all ants of a world. "own": one for each slot. "fixed": none learns.
SHARINGS: tuple[str, ...] = get_args(Sharing)
# "nest": on the free cells nearest to the queen. "spread": on any free cells.
STARTS: tuple[str, ...] = get_args(Start)

MAX_ANTS = 1 << 24
MAX_DEPOSIT = 1_000_000


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
            up to `cap`. "none": it lays nothing.
        level: What a deposit sets or adds, in ticks of linear evaporation, 1 .. 1 000 000.
        cap: No deposit that adds leaves a trail above this, 1 .. 1 000 000; of "add" only, there
            1000 if None.

    Raises:
        AntsError: A value is outside its range, or would change nothing.
    """

    evaporation: Evaporation = "linear"
    half_life: float | None = None
    diffusion: float = 0.0
    deposit: Deposit = "set"
    level: int = DEPOSIT_LEVEL
    cap: int | None = None

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
        _check_whole("level", self.level, 1, MAX_DEPOSIT)
        if self.cap is not None:
            _check_whole("cap", self.cap, 1, MAX_DEPOSIT)
        self._settle("half_life", 50.0, "evaporation", "exponential")
        self._settle("cap", 1000, "deposit", "add")

    def _settle(self, name: str, usual: float, other: str, needed: str) -> None:
        """Refuse an option where another one makes it mean nothing; fill it in where it is not."""
        chosen = getattr(self, other)
        if getattr(self, name) is None:
            object.__setattr__(self, name, usual if chosen == needed else None)
        elif chosen != needed:
            raise AntsError(
                f"{name} is {shown(getattr(self, name))}, but {other} is {chosen!r}; give "
                f"{other}={needed!r} with it, or leave it out."
            )

    @property
    def dense(self) -> bool:
        """Whether levels are float32 and change in every cell each tick; else they are integers."""
        return self.evaporation == "exponential" or self.diffusion > 0

    @property
    def decay(self) -> np.float32:
        """The factor on every level per tick of exponential evaporation, else 1."""
        return np.float32(0.5 ** (1.0 / float(self.half_life)) if self.half_life else 1.0)

    @property
    def share(self) -> np.float32:
        """The part of its level that a cell gives to one neighbour per tick of diffusion."""
        return np.float32(float(self.diffusion) / 6.0)


@dataclass(frozen=True)
class ColonyConfig:
    """The life of a colony: how many ants, and what comes and goes.

    Attributes:
        ants: How many start each episode: the listed ants of the World first, then others on free
            cells, see `start`. 1 .. `MAX_ANTS`.
        capacity: How many ants can live at once, at least `ants`. None: `ants` if none are born,
            else 2 * `ants` + 64. See `slots`.
        pheromone: How trails are laid, fall and spread.
        births: Whether the queen turns each food that she is given into an ant.
        lifespan: Ticks after which an ant dies, at least 1. None: ants do not die.
        regrowth: Ticks after which a food that was taken grows back at its place, at least 0 (in
            the same tick). None: it does not.
        wander: Each pile of food moves by one cell every so many ticks, at least 1. None: food
            stays.
        ends_at_delivery: Whether an episode ends at its first delivery, as when an ant trains
            alone. Only for one ant, without births.
        start: Where ants start that the World does not list: "nest", on the free cells nearest to
            the queen; "spread", on free cells anywhere. The seed decides which, and the headings.

    Raises:
        AntsError: A value is outside its range, or does not fit the others.
    """

    ants: int = 1
    capacity: int | None = None
    pheromone: Pheromone = field(default_factory=Pheromone)
    births: bool = False
    lifespan: int | None = None
    regrowth: int | None = None
    wander: int | None = None
    ends_at_delivery: bool = False
    start: Start = "nest"

    def __post_init__(self) -> None:
        _check_whole("ants", self.ants, 1, MAX_ANTS)
        if self.capacity is not None:
            _check_whole("capacity", self.capacity, 1, MAX_ANTS)
            if self.capacity < self.ants:
                raise AntsError(
                    f"capacity is {self.capacity}, but {self.ants} ants start; give a capacity of "
                    f"at least {self.ants}, or None."
                )
        if not isinstance(self.pheromone, Pheromone):
            raise AntsError(f"pheromone is {shown(self.pheromone)}; it must be a Pheromone.")
        checked_flag("births", self.births)
        for name, least in (("lifespan", 1), ("regrowth", 0), ("wander", 1)):
            ticks = getattr(self, name)
            if ticks is not None:
                _check_whole(name, ticks, least, MAX_STEPS, ", or None")
        check_one_of("start", self.start, STARTS)
        checked_flag("ends_at_delivery", self.ends_at_delivery)
        if self.ends_at_delivery and (self.ants != 1 or self.births):
            raise AntsError(
                f"ends_at_delivery is set with {self.ants} ants and births {self.births}; it is "
                "for one ant without births, so leave it out."
            )

    @property
    def slots(self) -> int:
        """How many ants can live at once: the capacity, or what stands for None."""
        if self.capacity is not None:
            return self.capacity
        return min(2 * self.ants + 64, MAX_ANTS) if self.births else self.ants


def update_weights(alpha: float, most: int) -> np.ndarray:
    """How far the mean of n TD errors moves a shared value: 1 - (1 - alpha)^n.

    So far n updates in turn, each with learning rate alpha, go towards one target. Kernels and
    reference take these numbers from here, since powers differ in the last bit between libraries.

    Args:
        alpha: The learning rate, in (0, 1]; taken as float32.
        most: The largest n.

    Returns:
        float32 (most + 1,), by n; at 0 it is 0, at 1 alpha itself.
    """
    rate = np.float32(alpha)
    weights = (1.0 - (1.0 - np.float64(rate)) ** np.arange(most + 1)).astype(np.float32)
    # In float64 1 - (1 - alpha) may differ from alpha by a rounding.
    weights[1:2] = rate
    return weights


def _number(value: object) -> float:
    """A number as float; nan for what is none."""
    if isinstance(value, (bool, str)):
        return math.nan
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return math.nan


def _check_whole(name: str, value: object, least: int, most: int, otherwise: str = "") -> None:
    try:
        if isinstance(value, (bool, np.bool_)):
            raise TypeError
        number = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise AntsError(
            f"{name} is {shown(value)}; it must be a whole number{otherwise}."
        ) from None
    if not least <= number <= most:
        raise AntsError(
            f"{name} is {shown(value)}; it must lie between {least} and {most}{otherwise}."
        )
