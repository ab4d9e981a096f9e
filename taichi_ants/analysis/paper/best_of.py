"""What choosing the best of several configurations does to a reported figure.

The paper trains each configuration once, and reports for each algorithm the best of 16 by return.
`best_of` repeats that with every seed: how far would the figures have varied by luck?
"""

from __future__ import annotations

import numpy as np

from taichi_ants.analysis.behaviour import NAMES, counts
from taichi_ants.analysis.paper.comparison import Comparison, Variant
from taichi_ants.analysis.paper.published import TABLE_2, PaperRow
from taichi_ants.analysis.statistics import RANDOM_SEED, interquartile_mean

DRAWS = 20_000
# What is reported of a run. The paper has one figure of steps, we have two readings of it.
FIGURES = ("return_last50", "steps_all", "steps_last50", "deliveries_last50")


def best_of(
    comparison: Comparison, delivery: str, variant: Variant, draws: int = DRAWS
) -> dict[str, np.ndarray]:
    """The winner's `FIGURES`, float64 (draws,) each: each configuration runs once, on any seed."""
    rows = np.array(comparison.positions(delivery, variant))
    random = np.random.default_rng(RANDOM_SEED)
    seeds = random.integers(0, len(comparison.seeds), size=(draws, len(rows)))
    winner = comparison.measures["return_last50"][rows, seeds].argmax(axis=1)
    won = rows[winner], seeds[np.arange(draws), winner]
    return {name: comparison.measures[name][won] for name in FIGURES}


def percentile_of(figure: float, values: np.ndarray) -> float:
    """The percentage of values below a figure, equal ones counted by half."""
    return float(50 * ((values < figure).mean() + (values <= figure).mean()))


def paper_row(comparison: Comparison, variant: Variant) -> PaperRow | None:
    """The paper's table 2 for a learner; None where it has none, and in other worlds."""
    return TABLE_2.get(variant) if comparison.in_paper_world else None


def shown_position(comparison: Comparison, delivery: str, variant: Variant) -> int:
    """The row that stands for a learner: the paper's configuration.

    Where there is none, its best one by the interquartile mean of the return, which a run that is
    far off does not decide. It is chosen and reported on the same seeds, which flatters it.
    """
    paper = paper_row(comparison, variant)
    same = comparison.position(delivery, variant, paper.point) if paper else None
    if same is not None:
        return same
    positions = comparison.positions(delivery, variant)
    returns = interquartile_mean(comparison.measures["return_last50"][positions])
    return positions[int(returns.argmax())]


def examples(comparison: Comparison) -> list[tuple[int, int]]:
    """Return runs to look at, as row and place of the seed: one of each behaviour of each learner.

    They are of the configuration that stands for the learner, else of the one in which the
    behaviour is most frequent; of the runs that behave alike, the one of median return.
    """
    codes = comparison.behaviours
    shown = [shown_position(comparison, *learner) for learner in comparison.learners]
    kinds = [(row, code) for row in shown for code in counts(codes[row])]
    others = counts(codes).keys() - {code for _, code in kinds}
    kinds += [(int((codes == code).sum(axis=1).argmax()), code) for code in sorted(others)]
    return [(row, _median_run(comparison, row, code)) for row, code in kinds]


def example_name(comparison: Comparison, row: int, run: int) -> str:
    """The name of the files of an example: its delivery setting, learner and behaviour."""
    delivery, variant, _ = comparison.rows[row]
    own = "".join(f"_{part}" for part in variant.short)
    return f"{delivery}_{variant.learner}{own}_{NAMES[comparison.behaviours[row, run]]}"


def _median_run(comparison: Comparison, row: int, behaviour: int) -> int:
    """The seed, by its position, of the median return among the runs that behave so."""
    runs = np.flatnonzero(comparison.behaviours[row] == behaviour)
    order = np.argsort(comparison.measures["return_last50"][row, runs], kind="stable")
    return int(runs[order[(len(runs) - 1) // 2]])
