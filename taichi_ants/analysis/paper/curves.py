"""Learning curves: what runs bring while they learn, for the configuration that is shown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from taichi_ants.analysis.paper.best_of import shown_position
from taichi_ants.analysis.paper.comparison import Comparison, Variant
from taichi_ants.analysis.paper.published import FIGURE_1
from taichi_ants.analysis.statistics import interquartile_mean

CURVES = ("returns", "steps", "deliveries")
_PER_DECADE = 12  # points of a learning curve between two powers of ten


def curve_row(comparison: Comparison, delivery: str, variant: Variant) -> int:
    """Return the row of a learner in figure 1; where it lacks that one, the row of its table 2."""
    row = comparison.position(delivery, variant, FIGURE_1)
    return shown_position(comparison, delivery, variant) if row is None else row


def spans(episodes: int) -> np.ndarray:
    """Return the first episodes of spans, from 0, and the end of the last one, int64 (spans + 1,).

    Spans grow so that points are evenly spaced on a logarithmic axis; the first ones are single
    episodes.
    """
    n, end = max(2, round(_PER_DECADE * np.log10(episodes + 1)) + 1), episodes + 1
    return np.unique(np.geomspace(1, end, n).round().astype(int)) - 1


def learning_curves(
    comparison: Comparison, outcomes: Iterable[tuple[int, Mapping[str, np.ndarray]]]
) -> dict[str, np.ndarray]:
    """Return the curves of all `comparison.learners`, float64 (learners, 3, spans) by name.

    The second axis is the interquartile mean over seeds and the ends of the middle half of the
    seeds; of deliveries the mean, as a run of an episode delivers or does not. `outcomes` are rows
    with arrays (seeds, episodes) by name, those of `curve_row` among them.
    """
    places = [curve_row(comparison, *learner) for learner in comparison.learners]
    edges = spans(comparison.episodes)
    curves = {name: np.empty((len(places), 3, len(edges) - 1)) for name in CURVES}
    for row, outcome in outcomes:
        for name in CURVES if row in places else ():
            sums = np.add.reduceat(outcome[name], edges[:-1], axis=1, dtype=float)
            means = sums / np.diff(edges)
            middle = means.mean(axis=0) if name == "deliveries" else interquartile_mean(means.T)
            curves[name][places.index(row)] = middle, *np.percentile(means, (25, 75), axis=0)
    return curves
