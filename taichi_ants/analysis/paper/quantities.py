"""What the claims of the paper are tested on: quantities of each seed, and their words.

Where the paper speaks of best configurations, its own are used: they were chosen by its data, so
that on our seeds they are free of the luck of having been chosen. Where it speaks of a learner in
general, the mean over all 16 configurations is. Where it speaks of a peak, the configuration is
chosen anew on one half of the seeds and measured on the other. The effect of a hyperparameter is
the mean difference over the 8 pairs of configurations that differ in it alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from taichi_ants.analysis.findings import UNBOUNDED
from taichi_ants.analysis.paper.comparison import Comparison, GridPoint, Variant
from taichi_ants.analysis.paper.measures import MEASURES, WINDOW
from taichi_ants.analysis.paper.published import FACTORS, FIGURE_1, GRID, TABLE_2, VARIANTS

SHARE, DIFFERENCE = (0.0, 1.0), (-1.0, 1.0)
ALL = f"all {len(GRID)}"
EVERY_CONFIGURATION = (0, 1, 2, 3)  # the axes of `Slice.grid` without that of the seeds


class Slice(NamedTuple):
    """Reads the values of one delivery setting, by the name of a measure and a learner.

    What is not there is nan: a configuration that is missing, a measure that needs more episodes,
    and all of another world than the paper's or of runs with fewer than 50 episodes.
    """

    comparison: Comparison
    delivery: str

    def at(self, measure: str, variant: Variant, point: GridPoint) -> np.ndarray:
        """The values of one configuration, float64 (seeds,)."""
        runs = self.comparison
        row = runs.position(self.delivery, variant, point)
        if row is None or not runs.in_paper_world or runs.episodes < WINDOW:
            return np.full(len(runs.seeds), np.nan)
        return runs.measures[measure][row]

    def grid(self, measure: str, variant: Variant) -> np.ndarray:
        """All 16 configurations, float64 (2, 2, 2, 2, seeds), axes in the order of `FACTORS`."""
        values = np.stack([self.at(measure, variant, point) for point in GRID])
        return values.reshape(*[2] * len(FACTORS), -1)

    def pairs(self, measure: str, variant: Variant, factor: str) -> np.ndarray:
        """Upper minus lower value of a hyperparameter, all else equal, float64 (8, seeds)."""
        lower, upper = np.moveaxis(self.grid(measure, variant), list(FACTORS).index(factor), 0)
        return (upper - lower).reshape(-1, lower.shape[-1])

    def held_out(self, measure: str, variant: Variant) -> np.ndarray:
        """The best by mean return of even seeds, on odd ones, float64 (seeds / 2,)."""
        choosing = self.grid("return_last50", variant)[..., ::2].mean(axis=-1)
        best = np.unravel_index(choosing.argmax(), choosing.shape)  # of a missing one, if there is
        return self.grid(measure, variant)[best][1::2]


class Read(NamedTuple):
    """A learner's number, (slice, measure, learner) -> float64 (seeds,), and its words."""

    words: str
    values: Callable[[Slice, str, Variant], np.ndarray]


AT_TABLE_2 = Read(
    "at the configuration of table 2",
    lambda part, measure, variant: part.at(measure, variant, TABLE_2[variant].point),
)
AT_FIGURE_1 = Read(
    f"at {FIGURE_1.label}, our choice for figure 1",
    lambda part, measure, variant: part.at(measure, variant, FIGURE_1),
)
MEAN_OF_ALL = Read(
    f"mean of {ALL}", lambda part, *what: part.grid(*what).mean(axis=EVERY_CONFIGURATION)
)
LEAST_OF_ALL = Read(
    f"least of {ALL}", lambda part, *what: part.grid(*what).min(axis=EVERY_CONFIGURATION)
)
BEST = Read("best on half of the seeds, measured on the others", Slice.held_out)


def effect_of(factor: str, sign: int = 1) -> Read:
    """The effect of a hyperparameter: its upper minus its lower value, or the reverse."""
    lower, upper = FACTORS[factor][::sign]
    return Read(
        f"{factor.replace('_', ' ')} {upper:g} minus {lower:g}, mean of 8 pairs",
        lambda part, measure, variant: sign * part.pairs(measure, variant, factor).mean(axis=0),
    )


def _epsilon_at_table_2(part: Slice, measure: str, variant: Variant) -> np.ndarray:
    points = (TABLE_2[variant].point._replace(epsilon=epsilon) for epsilon in FACTORS["epsilon"])
    low, high = (part.at(measure, variant, point) for point in points)
    return high - low


EPSILON_AT_TABLE_2 = Read("epsilon 0.5 minus 0.3, all else as in table 2", _epsilon_at_table_2)


def less_exploration(epsilon: int, decay: int) -> Read:
    """Epsilon 0.3 with decay 0.99 minus another combination, by the places of its two values."""

    def values(part: Slice, measure: str, variant: Variant) -> np.ndarray:
        grid = part.grid(measure, variant)
        return (grid[:, :, 0, 0] - grid[:, :, epsilon, decay]).mean(axis=(0, 1))

    other = f"{FACTORS['epsilon'][epsilon]:g} / {FACTORS['epsilon_decay'][decay]:g}"
    return Read(f"epsilon / decay 0.3 / 0.99 minus {other}, mean of 4 pairs", values)


# What reads a number of each seed, float64 (seeds,).
Effect = Callable[[Slice], np.ndarray]


@dataclass(frozen=True)
class Quantity:
    """What a claim is tested on: one or more numbers of each seed, in one unit.

    Attributes:
        words: What is computed, without what is subtracted from what, from which configurations.
        effects: What reads them, by label, such as "Q-learning minus SARSA".
        possible: The range that the numbers cannot leave.
        of_estimates: As of a `Contrast`; then `effects` read float64 (k, seeds).
    """

    words: str
    unit: str
    effects: dict[str, Effect]
    possible: tuple[float, float] = UNBOUNDED
    of_estimates: Callable[[np.ndarray], np.ndarray] | None = None

    @property
    def uses_iqm(self) -> bool:
        """Whether it rests on the IQM over seeds.

        Quantities in reward or steps do: the paper speaks of what a learner does, and there the
        mean hangs on a run in hundreds that does something else. Shares, counts of deliveries and
        correlations rest on the mean: they are bounded, so that no run can outweigh the others,
        and an IQM would hide that a quarter of all runs fails.
        """
        return self.possible == UNBOUNDED


def of(read: Read, measure: str, *variants: Variant) -> Quantity:
    """The measure of each learner."""
    effects = {variant.label: _reader(read, measure, variant) for variant in variants}
    return _quantity(read.words, measure, effects, SHARE)


def minus(read: Read, measure: str, *pairs: tuple[Variant, Variant]) -> Quantity:
    """The measure of the first minus that of the second learner of each pair, seed by seed."""

    def difference(first: Variant, second: Variant) -> Effect:
        one, other = _reader(read, measure, first), _reader(read, measure, second)
        return lambda part: one(part) - other(part)

    effects = {f"{one.label} minus {other.label}": difference(one, other) for one, other in pairs}
    return _quantity(read.words, measure, effects, DIFFERENCE)


def of_each(measure: str, variant: Variant, *reads: Read) -> Quantity:
    """The measure of a learner, read in several ways."""
    effects = {f"{variant.label}, {one.words}": _reader(one, measure, variant) for one in reads}
    return _quantity(ALL, measure, effects)


def _reader(read: Read, measure: str, variant: Variant) -> Effect:
    return lambda part: read.values(part, measure, variant)


def _quantity(
    scope: str, measure: str, effects: dict[str, Effect], bounds: tuple[float, float] = UNBOUNDED
) -> Quantity:
    """A quantity in the unit of a measure; the bounds are those of a share or a count."""
    one = MEASURES[measure]
    possible = UNBOUNDED if one.uses_iqm else bounds
    return Quantity(f"{one.words}, {scope}", one.unit, effects, possible)


def share_above(measure: str, first: Variant, second: Variant, below: bool = False) -> Quantity:
    """In which share of matched configurations the first is above (or below); ties by half."""

    def share(part: Slice) -> np.ndarray:
        signs = np.sign(part.grid(measure, first) - part.grid(measure, second))
        return (0.5 + (-0.5 if below else 0.5) * signs).mean(axis=EVERY_CONFIGURATION)

    label = f"{first.label} {'below' if below else 'above'} {second.label}"
    words = f"{MEASURES[measure].words}, in which share of 16 matched configurations of a seed"
    return Quantity(words, "share of 16 pairs", {label: share}, SHARE)


share_below = partial(share_above, below=True)


def growth(later: str, earlier: str, *variants: Variant) -> Quantity:
    """One measure minus another of each learner, mean over all configurations."""

    def values(part: Slice, _: str, variant: Variant) -> np.ndarray:
        return MEAN_OF_ALL.values(part, later, variant) - MEAN_OF_ALL.values(part, earlier, variant)

    words = f"minus {MEASURES[earlier].words}, {MEAN_OF_ALL.words}"
    return of(Read(words, values), later, *variants)


def rank_correlation(first: str, second: str, variant: Variant) -> Quantity:
    """Spearman's, of two measures over a learner's 16 runs of a seed; 0 where one is constant."""

    def correlation(part: Slice) -> np.ndarray:
        one, other = (
            _centred_ranks(part.grid(measure, variant).reshape(len(GRID), -1))
            for measure in (first, second)
        )
        scale = np.sqrt((one**2).sum(axis=0) * (other**2).sum(axis=0))
        return (one * other).sum(axis=0) / np.where(scale > 0, scale, 1.0)

    pair = f"{MEASURES[first].words} and {MEASURES[second].words}"
    words = f"rank correlation of {pair} over the 16 configurations of a seed"
    return Quantity(words, "correlation", {variant.label: correlation}, DIFFERENCE)


def _centred_ranks(values: np.ndarray) -> np.ndarray:
    """Ranks in each column of (n, columns), less their mean; equal values share the middle one."""
    return np.sign(values[:, None] - values).sum(axis=1) / 2


def stronger(measure: str, factor: str) -> Quantity:
    """The absolute effect of a hyperparameter minus that of each other one."""

    def effects(other: str) -> Effect:
        reads = [effect_of(name).values for name in (factor, other)]
        return lambda part: np.stack(
            [values(part, measure, variant) for values in reads for variant in VARIANTS]
        )

    others = [other for other in FACTORS if other != factor]
    return Quantity(
        f"{MEASURES[measure].words}, absolute effect of a hyperparameter, mean of the learners",
        MEASURES[measure].unit,
        {f"{factor} minus {other}".replace("_", " "): effects(other) for other in others},
        of_estimates=lambda estimates: _first_minus_second(np.abs(estimates), np.mean),
    )


def more_dependent(measure: str, factor: str, *pairs: tuple[Variant, Variant]) -> Quantity:
    """How much more a hyperparameter's effect varies over configurations for the first learner."""

    def effects(*variants: Variant) -> Effect:
        return lambda part: np.concatenate(
            [part.pairs(measure, variant, factor) for variant in variants]
        )

    return Quantity(
        f"{MEASURES[measure].words}, standard deviation of the effect of {factor} over 8 pairs of "
        "configurations (jackknife over seeds)",
        MEASURES[measure].unit,
        {f"{one.label} minus {other.label}": effects(one, other) for one, other in pairs},
        of_estimates=lambda estimates: _first_minus_second(estimates, partial(np.std, ddof=1)),
    )


def _first_minus_second(estimates: np.ndarray, statistic: Callable[..., Any]) -> np.ndarray:
    """A statistic of the first half of the rows minus that of the second."""
    first, second = np.split(estimates, 2)
    return statistic(first, axis=0) - statistic(second, axis=0)
