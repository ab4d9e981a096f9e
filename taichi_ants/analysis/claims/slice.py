"""The part of a comparison that a claim is tested on: one delivery setting."""

from __future__ import annotations

import numpy as np

from taichi_ants.analysis.paper.best_of import held_out
from taichi_ants.analysis.paper.comparison import Comparison, Hyperparameters, Variant
from taichi_ants.analysis.paper.measures import MEASURES
from taichi_ants.analysis.paper.published import FACTORS, FIGURE_1, GRID, TABLE_2


class NotTestedError(Exception):
    """The comparison lacks what a claim needs; the message says what."""


class Slice:
    """Reads per-seed values of one delivery setting, and notes which rows were read.

    Every method takes the name of a measure (see `measures.MEASURES`) and a learner, and raises
    `NotTestedError` where a configuration, episodes or rollouts are missing.

    Attributes:
        used: The rows read so far.
        scope: Which configurations these are, in a few words.
    """

    def __init__(self, comparison: Comparison, delivery: str) -> None:
        self._comparison = comparison
        self._delivery = delivery
        self.used: set[int] = set()
        self.scope = "single configurations"

    def at(self, measure: str, variant: Variant, hyperparameters: Hyperparameters) -> np.ndarray:
        """The values of one configuration, float64 (seeds,)."""
        position = self._comparison.position(self._delivery, variant, hyperparameters)
        if position is None:
            raise NotTestedError(f"no {variant.label} at {hyperparameters.label}")
        return self._read(measure, [position])[0]

    def table2(self, measure: str, variant: Variant) -> np.ndarray:
        """The values at the learner's configuration in the paper's table 2, float64 (seeds,)."""
        self.scope = "table 2 configurations"
        return self.at(measure, variant, TABLE_2[variant].hyperparameters)

    def figure1(self, measure: str, variant: Variant) -> np.ndarray:
        """The values at the shared configuration of the paper's figure 1, float64 (seeds,)."""
        self.scope = "figure 1 configuration"
        return self.at(measure, variant, FIGURE_1)

    def grid(self, measure: str, variant: Variant) -> np.ndarray:
        """All 16 configurations, float64 (2, 2, 2, 2, seeds), axes in the order of `FACTORS`."""
        self.scope = f"all {len(GRID)}"
        return self._read(measure, self._grid(variant)).reshape(*[2] * len(FACTORS), -1)

    def mean(self, measure: str, variant: Variant) -> np.ndarray:
        """The mean over all 16 configurations, float64 (seeds,)."""
        return self.grid(measure, variant).mean(axis=(0, 1, 2, 3))

    def pairs(self, measure: str, variant: Variant, factor: str) -> np.ndarray:
        """Upper minus lower value of a factor, all else equal, float64 (8, seeds)."""
        lower, upper = np.moveaxis(self.grid(measure, variant), list(FACTORS).index(factor), 0)
        return (upper - lower).reshape(-1, lower.shape[-1])

    def held_out(self, measure: str, variant: Variant) -> np.ndarray:
        """The values of the learner's best configuration, on seeds that did not choose it.

        Float64 (half of the seeds,).
        """
        self.scope = "best, on other seeds"
        best = held_out(self._comparison, self._grid(variant))
        if best is None:
            raise NotTestedError("needs a second seed")
        return self._read(measure, [best.position])[0][best.seeds]

    def _grid(self, variant: Variant) -> list[int]:
        positions = [
            self._comparison.position(self._delivery, variant, hyperparameters)
            for hyperparameters in GRID
        ]
        found = [position for position in positions if position is not None]
        missing = len(positions) - len(found)
        if missing:
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
