"""Quantities of each seed, on which the claims of the paper are tested.

For claims about best configurations, we take the paper's: chosen on its data, they are not selected
for luck on our seeds. For claims about a learner in general, we take the mean over all 16
configurations. For claims about a peak, we choose the configuration on one half of the seeds and
measure it on the other. The effect of a hyperparameter is the mean difference over the 8 pairs of
configurations that differ only in it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np

from paper import comparison as paper
from paper.comparison import FACTORS, GRID, TABLE_2, Comparison, GridPoint, Variant
from taichi_ants.analysis.findings import UNBOUNDED, Contrast, Criterion
from taichi_ants.analysis.statistics import interquartile_values
from taichi_ants.measures.finished import LONE, WINDOW

SHARE, DIFFERENCE = (0.0, 1.0), (-1.0, 1.0)
ALL = f"all {len(GRID)}"
EVERY_CONFIGURATION = (0, 1, 2, 3)  # the axes of a grid except that of the seeds

# (measure, learner) -> the measure in its 16 configurations, float64 (2, 2, 2, 2, seeds), axes in
# the order of `FACTORS`; see `grids_of`.
Grids = Callable[[str, Variant], np.ndarray]
Effect = Callable[[Grids], np.ndarray]  # grids -> a number for each seed, float64 (seeds,)


def grids_of(comparison: Comparison, delivery: str) -> Grids:
    """Return a function that returns the grids of one delivery setting.

    Missing configurations and measures that need more episodes are nan. In worlds other than the
    paper's, and with fewer than 50 episodes, all numbers are nan.
    """
    is_papers = comparison.in_paper_world and comparison.episodes >= WINDOW
    missing = np.full(len(comparison.seeds), np.nan)

    @cache
    def grid(measure: str, variant: Variant) -> np.ndarray:
        rows = [comparison.position(delivery, variant, point) for point in GRID]
        values = comparison.measures[measure]
        several = [values[row] if is_papers and row is not None else missing for row in rows]
        return np.reshape(several, [*[2] * len(FACTORS), -1])

    return grid


def pairs(grid: np.ndarray, factor: str) -> np.ndarray:
    """Return differences between the two values of a hyperparameter, upper - lower, (8, seeds)."""
    lower, upper = np.moveaxis(grid, list(FACTORS).index(factor), 0)
    return (upper - lower).reshape(-1, grid.shape[-1])


class Read(NamedTuple):
    """A function `values(grids, measure, learner)` of a value per seed, and its name in tables."""

    words: str
    values: Callable[[Grids, str, Variant], np.ndarray]


def _at(grid: np.ndarray, point: GridPoint) -> np.ndarray:
    return grid.reshape(len(GRID), -1)[GRID.index(point)]


def _held_out(grids: Grids, measure: str, variant: Variant) -> np.ndarray:
    """Return a measure on odd seeds, where even seeds return most, float64 (seeds / 2,)."""
    choosing = grids("return_last50", variant)[..., ::2].mean(axis=-1)
    best = np.unravel_index(choosing.argmax(), choosing.shape)  # argmax prefers nan
    return grids(measure, variant)[best][1::2]


def _epsilon_at_table_2(grids: Grids, measure: str, variant: Variant) -> np.ndarray:
    points = (TABLE_2[variant].point._replace(epsilon=epsilon) for epsilon in FACTORS["epsilon"])
    low, high = (_at(grids(measure, variant), point) for point in points)
    return high - low


def _effect_of(factor: str, sign: int = 1) -> Read:
    lower, upper = FACTORS[factor][::sign]
    return Read(
        f"{factor.replace('_', ' ')} {upper:g} minus {lower:g}, mean of 8 pairs",
        lambda grids, *of: sign * pairs(grids(*of), factor).mean(axis=0),
    )


def _less_exploration(epsilon: int, decay: int) -> Read:
    """Return epsilon 0.3 with decay 0.99 minus the combination with these indices of values."""

    def values(grids: Grids, *of: Any) -> np.ndarray:
        grid = grids(*of)
        return (grid[:, :, 0, 0] - grid[:, :, epsilon, decay]).mean(axis=(0, 1))

    other = f"{FACTORS['epsilon'][epsilon]:g} / {FACTORS['epsilon_decay'][decay]:g}"
    return Read(f"epsilon / decay 0.3 / 0.99 minus {other}, mean of 4 pairs", values)


READS: dict[str, Read] = {  # by their names in `claims.toml`
    "at table 2": Read(
        "at the configuration of table 2",
        lambda grids, measure, variant: _at(grids(measure, variant), TABLE_2[variant].point),
    ),
    "at figure 1": Read(
        f"at {paper.FIGURE_1.label}, our choice for figure 1",
        lambda grids, *of: _at(grids(*of), paper.FIGURE_1),
    ),
    "mean of all": Read(
        f"mean of {ALL}", lambda grids, *of: grids(*of).mean(axis=EVERY_CONFIGURATION)
    ),
    "least of all": Read(
        f"least of {ALL}", lambda grids, *of: grids(*of).min(axis=EVERY_CONFIGURATION)
    ),
    "best on held-out seeds": Read("best on half of the seeds, measured on the others", _held_out),
    "epsilon at table 2": Read(
        "epsilon 0.5 minus 0.3, all else as in table 2", _epsilon_at_table_2
    ),
    **{f"effect of {name}": _effect_of(name) for name in FACTORS},
    **{f"reversed effect of {name}": _effect_of(name, sign=-1) for name in FACTORS},
    **{f"less exploration {e} {d}": _less_exploration(e, d) for e in (0, 1) for d in (0, 1)},
}


@dataclass(frozen=True, eq=False)
class ContrastOfEstimates(Contrast):
    """A contrast by a smooth function of k estimates, float (k, ...) -> float (...).

    It is for questions such as whether 8 effects are unequal: in the values of a single seed, noise
    would make them unequal. Values are float64 (k, seeds).
    """

    of_estimates: Callable[[np.ndarray], np.ndarray] = field(kw_only=True)

    def reading(self, uses_iqm: bool) -> tuple[np.ndarray, bool]:
        values = interquartile_values(self.values) if uses_iqm else self.values
        return jackknife_values(self.of_estimates, values), False


def jackknife_values(
    statistic: Callable[[np.ndarray], np.ndarray], values: np.ndarray
) -> np.ndarray:
    """Return a pseudo-value for each seed, of a smooth function of means over seeds.

    Their mean is the statistic, float (..., k) -> float (k,), without its bias of order 1/n, and
    their spread is that of the statistic. With a single seed they are nan.
    """
    n = values.shape[-1]
    if n < 2:
        return np.full(n, np.nan)
    total = values.sum(axis=-1, keepdims=True)
    return n * statistic(total / n) - (n - 1) * statistic((total - values) / (n - 1))


@dataclass(frozen=True)
class Quantity:
    """One or more numbers for each seed, in one unit, on which a claim is tested.

    `effects` compute them, by label, for example "Q-learning minus SARSA". `possible` is that of a
    `Contrast`. With `of_estimates`, effects are float64 (k, seeds); see `ContrastOfEstimates`.
    """

    words: str
    unit: str
    effects: Mapping[str, Effect]
    possible: tuple[float, float] = UNBOUNDED
    of_estimates: Callable[[np.ndarray], np.ndarray] | None = None

    @property
    def uses_iqm(self) -> bool:
        """Whether it is judged by the IQM over seeds.

        Quantities in reward or steps are, because outliers, one run in hundreds, pull their mean.
        Shares, counts of deliveries and correlations are bounded, so no run can outweigh the
        others, and an IQM would hide failures of a quarter of all runs.
        """
        return self.possible == UNBOUNDED

    def contrast(self, label: str, values: np.ndarray, criterion: Criterion) -> Contrast:
        """Return the contrast of an effect."""
        facts = (label, values, criterion, self.uses_iqm, self.possible)
        if self.of_estimates is None:
            return Contrast(*facts)
        return ContrastOfEstimates(*facts, of_estimates=self.of_estimates)


def of(read: Read, measure: str, *variants: Variant) -> Quantity:
    """Return the measure of each learner."""
    effects = {one.label: partial(_value, read, measure, one) for one in variants}
    return _quantity(read.words, measure, effects, SHARE)


def of_each(measure: str, variant: Variant, *reads: Read) -> Quantity:
    """Return the measure of a learner, computed in several ways."""
    effects = {
        f"{variant.label}, {one.words}": partial(_value, one, measure, variant) for one in reads
    }
    return _quantity(ALL, measure, effects)


def minus(read: Read, measure: str, *both: tuple[Variant, Variant]) -> Quantity:
    """Return the measure of the first minus that of the second learner of each pair, by seed."""
    effects = {
        f"{one.label} minus {other.label}": partial(_value, read, measure, one, less=other)
        for one, other in both
    }
    return _quantity(read.words, measure, effects, DIFFERENCE)


def _value(
    read: Read, measure: str, variant: Variant, grids: Grids, less: Variant | None = None
) -> np.ndarray:
    values = read.values(grids, measure, variant)
    return values - read.values(grids, measure, less) if less else values


def _quantity(
    scope: str, measure: str, effects: Mapping[str, Effect], bounds: tuple[float, float] = UNBOUNDED
) -> Quantity:
    """Return a quantity in the unit of a measure; `bounds` apply to shares and counts."""
    one = LONE[measure]
    possible = UNBOUNDED if one.uses_iqm else bounds
    return Quantity(f"{one.label}, {scope}", one.unit, effects, possible)


def share_above(measure: str, first: Variant, second: Variant, sign: int = 1) -> Quantity:
    """Return the share of configurations in which the first learner is above the second.

    With `sign` -1, it is the share in which it is below. Ties count by half.
    """

    def share(grids: Grids) -> np.ndarray:
        signs = np.sign(grids(measure, first) - grids(measure, second))
        return (0.5 + 0.5 * sign * signs).mean(axis=EVERY_CONFIGURATION)

    label = f"{first.label} {'above' if sign > 0 else 'below'} {second.label}"
    words = f"{LONE[measure].label}, in which share of 16 matched configurations of a seed"
    return Quantity(words, "share of 16 pairs", {label: share}, SHARE)


share_below = partial(share_above, sign=-1)


def growth(later: str, earlier: str, *variants: Variant) -> Quantity:
    """Return one measure minus another of each learner, as the mean over all configurations."""
    words, mean = READS["mean of all"]
    both = Read(
        f"minus {LONE[earlier].label}, {words}",
        lambda grids, _, variant: mean(grids, later, variant) - mean(grids, earlier, variant),
    )
    return of(both, later, *variants)


def rank_correlation(first: str, second: str, variant: Variant) -> Quantity:
    """Return Spearman's correlation of two measures over a learner's 16 runs of each seed.

    It is 0 if one of them is constant.
    """

    def correlation(grids: Grids) -> np.ndarray:
        both = (grids(measure, variant).reshape(len(GRID), -1) for measure in (first, second))
        # Ranks minus their mean. (`scipy.stats` takes over a second to import.)
        one, other = (np.sign(v[:, None] - v).sum(axis=1) / 2 for v in both)
        scale = np.sqrt((one**2).sum(axis=0) * (other**2).sum(axis=0))
        return (one * other).sum(axis=0) / np.where(scale > 0, scale, 1.0)

    pair = f"{LONE[first].label} and {LONE[second].label}"
    words = f"rank correlation of {pair} over the 16 configurations of a seed"
    return Quantity(words, "correlation", {variant.label: correlation}, DIFFERENCE)


def stronger(measure: str, factor: str) -> Quantity:
    """Return the absolute effect of a hyperparameter minus that of each of the others."""

    def effects(other: str) -> Effect:
        reads = [READS[f"effect of {name}"].values for name in (factor, other)]
        return lambda grids: np.stack(
            [read(grids, measure, v) for read in reads for v in paper.VARIANTS]
        )

    others = [other for other in FACTORS if other != factor]
    return Quantity(
        f"{LONE[measure].label}, absolute effect of a hyperparameter, mean of the learners",
        LONE[measure].unit,
        {f"{factor} minus {other}".replace("_", " "): effects(other) for other in others},
        of_estimates=lambda estimates: _first_minus_second(np.abs(estimates), np.mean),
    )


def more_dependent(measure: str, factor: str, *both: tuple[Variant, Variant]) -> Quantity:
    """Return how much more an effect varies over configurations for the first learner of a pair."""

    def effects(*variants: Variant) -> Effect:
        return lambda grids: np.concatenate([pairs(grids(measure, v), factor) for v in variants])

    return Quantity(
        f"{LONE[measure].label}, standard deviation of the effect of {factor} over 8 pairs of "
        "configurations (jackknife over seeds)",
        LONE[measure].unit,
        {f"{one.label} minus {other.label}": effects(one, other) for one, other in both},
        of_estimates=lambda estimates: _first_minus_second(estimates, partial(np.std, ddof=1)),
    )


def _first_minus_second(estimates: np.ndarray, statistic: Callable[..., Any]) -> np.ndarray:
    first, second = np.split(estimates, 2)
    return statistic(first, axis=0) - statistic(second, axis=0)
