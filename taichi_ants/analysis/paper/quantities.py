"""What the claims of the paper are tested on: quantities of each seed, and their words.

Where the paper speaks of best configurations, its own are used: they were chosen by its data, so
that on our seeds they are free of the luck of having been chosen. Where it speaks of a learner in
general, the mean over all 16 configurations is. Where it speaks of a peak, the configuration is
chosen anew on one half of the seeds and measured on the other. The effect of a hyperparameter is
the mean difference over the 8 pairs of configurations that differ in it alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from taichi_ants.analysis.findings import UNBOUNDED
from taichi_ants.analysis.paper.best_of import held_out
from taichi_ants.analysis.paper.comparison import Comparison, Hyperparameters, Variant
from taichi_ants.analysis.paper.measures import MEASURES
from taichi_ants.analysis.paper.published import (
    FACTORS,
    FIGURE_1,
    GRID,
    TABLE_2,
    VARIANTS,
)

SHARE, DIFFERENCE = (0.0, 1.0), (-1.0, 1.0)
EVERY_CONFIGURATION = (0, 1, 2, 3)  # the axes of `Slice.grid` without that of the seeds


class NotTestedError(Exception):
    """The comparison lacks what a claim needs; the message says what."""


class Slice:
    """Reads the values of one delivery setting, and notes which rows were read.

    Every method takes the name of a measure (see `measures.MEASURES`) and a learner, and raises
    `NotTestedError` where a configuration, episodes or rollouts are missing.

    Attributes:
        used: The rows read so far.
    """

    def __init__(self, comparison: Comparison, delivery: str) -> None:
        self._comparison = comparison
        self._delivery = delivery
        self.used: set[int] = set()

    def at(self, measure: str, variant: Variant, hyperparameters: Hyperparameters) -> np.ndarray:
        """The values of one configuration, float64 (seeds,)."""
        position = self._comparison.position(self._delivery, variant, hyperparameters)
        if position is None:
            raise NotTestedError(f"no {variant.label} at {hyperparameters.label}")
        return self._read(measure, [position])[0]

    def grid(self, measure: str, variant: Variant) -> np.ndarray:
        """All 16 configurations, float64 (2, 2, 2, 2, seeds), axes in the order of `FACTORS`."""
        return self._read(measure, self._grid(variant)).reshape(*[2] * len(FACTORS), -1)

    def pairs(self, measure: str, variant: Variant, factor: str) -> np.ndarray:
        """Upper minus lower value of a hyperparameter, all else equal, float64 (8, seeds)."""
        lower, upper = np.moveaxis(self.grid(measure, variant), list(FACTORS).index(factor), 0)
        return (upper - lower).reshape(-1, lower.shape[-1])

    def held_out(self, measure: str, variant: Variant) -> np.ndarray:
        """The best configuration on the seeds that did not choose it, float64 (seeds / 2,)."""
        best = held_out(self._comparison, self._grid(variant))
        if best is None:
            raise NotTestedError("needs a second seed")
        return self._read(measure, [best.position])[0][best.seeds]

    def _grid(self, variant: Variant) -> list[int]:
        positions = [self._comparison.position(self._delivery, variant, one) for one in GRID]
        found = [position for position in positions if position is not None]
        if missing := len(positions) - len(found):
            raise NotTestedError(
                f"{missing} of the paper's {len(GRID)} configurations of {variant.label} missing"
            )
        self.used.update(found)
        return found

    def _read(self, measure: str, positions: list[int]) -> np.ndarray:
        lacks = MEASURES[measure].lacks(self._comparison)
        if lacks:
            raise NotTestedError(f"{MEASURES[measure].words} {lacks}")
        self.used.update(positions)
        return self._comparison.measure(measure)[positions]


@dataclass(frozen=True)
class Read:
    """How a learner's number is read.

    Attributes:
        words: From which configurations, for sentences.
        scope: The same in a few words.
        values: (slice, measure, learner) -> float64 (seeds,).
        change: What is subtracted from what, where it is the effect of a hyperparameter.
    """

    words: str
    scope: str
    values: Callable[[Slice, str, Variant], np.ndarray]
    change: str = ""


AT_TABLE_2 = Read(
    "at the learner's configuration in the paper's table 2",
    "table 2 configurations",
    lambda part, measure, variant: part.at(measure, variant, TABLE_2[variant].hyperparameters),
)
AT_FIGURE_1 = Read(
    f"at {FIGURE_1.label}, shared by all learners (our choice, the paper names none)",
    "figure 1 configuration",
    lambda part, measure, variant: part.at(measure, variant, FIGURE_1),
)
ALL = f"all {len(GRID)}"
MEAN_OF_ALL = Read(
    "mean over 16 configurations",
    ALL,
    lambda part, *what: part.grid(*what).mean(axis=EVERY_CONFIGURATION),
)
LEAST_OF_ALL = Read(
    "smallest of 16 configurations within each seed",
    ALL,
    lambda part, *what: part.grid(*what).min(axis=EVERY_CONFIGURATION),
)
BEST = Read(
    "at the best of the learner's 16 configurations, chosen on half of the seeds and measured on "
    "the others",
    "best, on other seeds",
    Slice.held_out,
)


def effect_of(factor: str, sign: int = 1) -> Read:
    """The effect of a hyperparameter: its upper minus its lower value, or the reverse."""
    lower, upper = FACTORS[factor][::sign]
    change = f"{upper:g} minus {lower:g}"
    return Read(
        f"{factor.replace('_', ' ')} {change}, mean over 8 pairs of configurations",
        ALL,
        lambda part, measure, variant: sign * part.pairs(measure, variant, factor).mean(axis=0),
        change,
    )


def _epsilon_at_table_2(part: Slice, measure: str, variant: Variant) -> np.ndarray:
    point = TABLE_2[variant].hyperparameters
    low, high = (
        part.at(measure, variant, point._replace(epsilon=epsilon)) for epsilon in FACTORS["epsilon"]
    )
    return high - low


EPSILON_AT_TABLE_2 = Read(
    "epsilon 0.5 minus 0.3, all else as in the paper's table 2",
    "single configurations",
    _epsilon_at_table_2,
    "0.5 minus 0.3",
)


# What reads a number of each seed, float64 (seeds,).
Effect = Callable[[Slice], np.ndarray]


@dataclass(frozen=True)
class Quantity:
    """What a claim is tested on: one or more numbers of each seed, in one unit.

    Attributes:
        words: What is computed, without what is subtracted from what.
        unit: The unit.
        scope: Which configurations are used, in a few words.
        effects: What reads them, by label, such as "Q-learning minus SARSA".
        possible: The range that the numbers cannot leave.
        of_centres: As of a `Contrast`; then `effects` read float64 (k, seeds).
    """

    words: str
    unit: str
    scope: str
    effects: dict[str, Effect]
    possible: tuple[float, float] = UNBOUNDED
    of_centres: Callable[[np.ndarray], np.ndarray] | None = None

    @property
    def text(self) -> str:
        """What is computed, for readers."""
        return f"{self.words}: {'; '.join(self.effects)}"

    @property
    def typical(self) -> bool:
        """Whether it rests on the typical run, that is on the IQM over seeds.

        Quantities in reward or steps do: the paper speaks of what a learner does, and there the
        mean hangs on a run in hundreds that does something else. Shares, counts of deliveries and
        correlations rest on the mean: they are bounded, so that no run can outweigh the others,
        and an IQM would hide that a quarter of all runs fails.
        """
        return self.possible == UNBOUNDED

    def __add__(self, other: Quantity) -> Quantity:
        """The numbers of both, which differ in where they are read."""
        words = f"{self.words}, and {other.words}"
        return replace(self, words=words, effects=self.effects | other.effects)


def of(read: Read, measure: str, *variants: Variant) -> Quantity:
    """The measure of each learner."""
    change = f", {read.change}" if read.change else ""
    effects = {f"{one.label}{change}": _reader(read, measure, one) for one in variants}
    possible = UNBOUNDED if MEASURES[measure].typical else SHARE
    return Quantity(*_what(read, measure), effects, possible)


def minus(read: Read, measure: str, *pairs: tuple[Variant, Variant]) -> Quantity:
    """The measure of the first minus that of the second learner of each pair, seed by seed."""

    def difference(first: Variant, second: Variant) -> Effect:
        one, other = _reader(read, measure, first), _reader(read, measure, second)
        return lambda part: one(part) - other(part)

    effects = {f"{one.label} minus {other.label}": difference(one, other) for one, other in pairs}
    possible = UNBOUNDED if MEASURES[measure].typical else DIFFERENCE
    return Quantity(*_what(read, measure), effects, possible)


def _reader(read: Read, measure: str, variant: Variant) -> Effect:
    return lambda part: read.values(part, measure, variant)


def _what(read: Read, measure: str) -> tuple[str, str, str]:
    return f"{MEASURES[measure].words}, {read.words}", MEASURES[measure].unit, read.scope


def share_above(measure: str, first: Variant, second: Variant, below: bool = False) -> Quantity:
    """In which share of matched configurations the first is above (or below); ties by half."""

    def share(part: Slice) -> np.ndarray:
        one, other = part.grid(measure, first), part.grid(measure, second)
        above = (other > one if below else one > other) + 0.5 * (one == other)
        return above.mean(axis=EVERY_CONFIGURATION)

    label = f"{first.label} {'below' if below else 'above'} {second.label}"
    words = f"{MEASURES[measure].words}, in which share of 16 matched configurations of a seed"
    return Quantity(words, "share of 16 pairs", ALL, {label: share}, SHARE)


def growth(later: str, earlier: str, *variants: Variant) -> Quantity:
    """One measure minus another of each learner, mean over all configurations."""

    def difference(variant: Variant) -> Effect:
        values = MEAN_OF_ALL.values
        return lambda part: values(part, later, variant) - values(part, earlier, variant)

    _, unit, scope = _what(MEAN_OF_ALL, later)
    words = f"{MEASURES[later].words} minus {MEASURES[earlier].words}, {MEAN_OF_ALL.words}"
    return Quantity(words, unit, scope, {one.label: difference(one) for one in variants})


def rank_correlation(first: str, second: str, variant: Variant) -> Quantity:
    """Spearman's, of two measures over a learner's 16 runs of a seed; 0 where one is constant."""

    def correlation(part: Slice) -> np.ndarray:
        from scipy.stats import rankdata

        ranks = (
            rankdata(part.grid(measure, variant).reshape(len(GRID), -1), axis=0)
            for measure in (first, second)
        )
        one, other = (rank - (len(GRID) + 1) / 2 for rank in ranks)
        scale = np.sqrt((one**2).sum(axis=0) * (other**2).sum(axis=0))
        return (one * other).sum(axis=0) / np.where(scale > 0, scale, 1.0)

    words = f"rank correlation of {MEASURES[first].words} and {MEASURES[second].words}"
    words += " over 16 configurations of a seed"
    return Quantity(words, "correlation", ALL, {variant.label: correlation}, DIFFERENCE)


def stronger(measure: str, factor: str) -> Quantity:
    """The absolute effect of a hyperparameter minus that of each other one."""

    def effects(other: str) -> Effect:
        reads = [effect_of(name).values for name in (factor, other)]
        return lambda part: np.stack(
            [values(part, measure, variant) for values in reads for variant in VARIANTS]
        )

    others = [other for other in FACTORS if other != factor]
    labels = (f"{factor} minus {other}".replace("_", " ") for other in others)
    return Quantity(
        f"{MEASURES[measure].words}, absolute effect of a hyperparameter, mean over the learners",
        MEASURES[measure].unit,
        ALL,
        dict(zip(labels, map(effects, others), strict=True)),
        of_centres=lambda centres: _first_minus_second(np.abs(centres), np.mean),
    )


def more_dependent(measure: str, factor: str, *pairs: tuple[Variant, Variant]) -> Quantity:
    """How much more a hyperparameter's effect varies over configurations for the first learner."""

    def effects(*variants: Variant) -> Effect:
        return lambda part: np.concatenate(
            [part.pairs(measure, variant, factor) for variant in variants]
        )

    return Quantity(
        f"{MEASURES[measure].words}, standard deviation over 8 pairs of configurations of the "
        f"mean effect of {factor} (jackknife over seeds)",
        MEASURES[measure].unit,
        ALL,
        {f"{one.label} minus {other.label}": effects(one, other) for one, other in pairs},
        of_centres=lambda centres: _first_minus_second(centres, partial(np.std, ddof=1)),
    )


def _first_minus_second(centres: np.ndarray, statistic: Callable[..., Any]) -> np.ndarray:
    """A statistic of the first half of the rows minus that of the second."""
    first, second = np.split(centres, 2)
    return statistic(first, axis=0) - statistic(second, axis=0)


def moderate_exploration(measure: str, variant: Variant) -> Quantity:
    """Epsilon 0.3 with decay 0.99 minus each other combination of the two."""

    def difference(epsilon: int, decay: int) -> Effect:
        def values(part: Slice) -> np.ndarray:
            grid = part.grid(measure, variant)
            return (grid[:, :, 0, 0] - grid[:, :, epsilon, decay]).mean(axis=(0, 1))

        return values

    names = {
        (k, m): f"{epsilon:g} / {decay:g}"
        for k, epsilon in enumerate(FACTORS["epsilon"])
        for m, decay in enumerate(FACTORS["epsilon_decay"])
    }
    first, *others = names
    return Quantity(
        f"{MEASURES[measure].words} of {variant.label} by epsilon / decay, mean over 4 matched "
        "configurations",
        MEASURES[measure].unit,
        ALL,
        {f"{names[first]} minus {names[other]}": difference(*other) for other in others},
    )
