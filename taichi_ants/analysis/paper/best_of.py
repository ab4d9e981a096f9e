"""What choosing the best of several configurations does to a reported figure.

The paper trains each configuration once and reports, for each algorithm, the one of its 16 with
the highest return. `best_of` repeats exactly that with every seed we have: how far would the
reported figures have varied by luck? `held_out` chooses on one half of the seeds and reports on
the other, which removes the luck from the report. `choice` is what stands for a learner in the
report: the paper's configuration where there is one, else the best.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from taichi_ants.analysis.behaviour import counts
from taichi_ants.analysis.paper.comparison import Comparison, Hyperparameters, Variant
from taichi_ants.analysis.paper.published import TABLE_2, VARIANTS
from taichi_ants.analysis.statistics import RANDOM_SEED

DRAWS = 20_000
# What is reported of a run -> its measure. The paper has one figure of steps, we have two readings
# of it.
FIGURES = {
    "return": "return_last50",
    "steps_all": "steps_all",
    "steps_last50": "steps_last50",
    "deliveries": "deliveries_last50",
}


def best_of(
    comparison: Comparison, delivery: str, variant: Variant, draws: int = DRAWS
) -> dict[str, np.ndarray]:
    """Draws an independent random seed for each configuration and reports the best of them.

    Returns:
        The winner's figures by their names in `FIGURES`, float64 (draws,) each; none where the
        comparison has no configuration of the learner.
    """
    positions = comparison.positions(delivery, variant)
    if not positions:
        return {}
    random = np.random.default_rng(RANDOM_SEED)
    seeds = random.integers(0, len(comparison.seeds), size=(draws, len(positions)))
    rows = np.array(positions)
    winner = comparison.measure("return_last50")[rows, seeds].argmax(axis=1)
    won = rows[winner], seeds[np.arange(draws), winner]
    return {name: comparison.measure(measure)[won] for name, measure in FIGURES.items()}


def percentile_of(figure: float, values: np.ndarray) -> float:
    """The percentage of values below a figure, equal ones counted by half."""
    return float(50 * ((values < figure).mean() + (values <= figure).mean()))


class Chosen(Enum):
    """Why a configuration stands for its learner."""

    PAPER = "its configuration in the paper's table 2"
    HELD_OUT = "best by return on half of the seeds, reported on the other half"
    BEST = "best by return on the one seed there is, which flatters it"


@dataclass(frozen=True)
class Choice:
    """The configuration that stands for a learner.

    Attributes:
        why: How it was chosen.
        hyperparameters: The configuration.
        position: Its row in the comparison.
        seeds: Positions of the seeds on which it is reported.
    """

    why: Chosen
    hyperparameters: Hyperparameters
    position: int
    seeds: slice


def held_out(comparison: Comparison, positions: Sequence[int]) -> Choice | None:
    """Chooses by mean return on the seeds at even positions; those at odd ones are for the report.

    Args:
        comparison: The comparison.
        positions: Rows of it that compete.

    Returns:
        None where none competes, or there is no second seed.
    """
    if not positions or len(comparison.seeds) < 2:
        return None
    best = best_position(comparison, positions, slice(0, None, 2))
    point = comparison.rows[best].hyperparameters
    return Choice(Chosen.HELD_OUT, point, best, slice(1, None, 2))


def choice(comparison: Comparison, delivery: str, variant: Variant) -> Choice | None:
    """The paper's configuration of a learner, or its best one outside of the paper's table.

    Returns None where the comparison has no configuration of the learner.
    """
    same = paper_position(comparison, delivery, variant)
    if same is not None:
        return Choice(Chosen.PAPER, TABLE_2[variant].hyperparameters, same, slice(None))
    positions = comparison.positions(delivery, variant)
    if not positions or len(comparison.seeds) > 1:
        return held_out(comparison, positions)
    best = best_position(comparison, positions)
    return Choice(Chosen.BEST, comparison.rows[best].hyperparameters, best, slice(None))


def choices(comparison: Comparison) -> dict[tuple[str, Variant], Choice]:
    """What stands for each learner in each delivery setting, the paper's learners first."""
    variants = dict.fromkeys((*VARIANTS, *comparison.variants))
    found = {
        (setting, variant): choice(comparison, setting, variant)
        for setting in comparison.delivery_settings
        for variant in variants
    }
    return {key: chosen for key, chosen in found.items() if chosen is not None}


def paper_position(comparison: Comparison, delivery: str, variant: Variant) -> int | None:
    """The row at the learner's configuration in the paper's table 2.

    None where the comparison does not have it, or its world is not the paper's.
    """
    if variant not in TABLE_2 or not comparison.in_paper_world:
        return None
    return comparison.position(delivery, variant, TABLE_2[variant].hyperparameters)


def best_position(
    comparison: Comparison, positions: Sequence[int], seeds: slice = slice(None)
) -> int:
    """The row with the highest mean return over all seeds, or some; the first of equals."""
    returns = comparison.measure("return_last50")[list(positions), seeds].mean(axis=1)
    return positions[int(returns.argmax())]


def examples(comparison: Comparison) -> list[tuple[int, int]]:
    """Runs to look at: for each delivery setting and learner one of each behaviour.

    They are of the learner's configuration in the paper's table 2, or its best one. A behaviour
    that occurs in other configurations only is shown once, by the configuration with most such
    runs. Of the runs that behave alike, the one of median return is taken.

    Returns:
        Row and position of the seed of each.
    """
    cells: list[tuple[int, int]] = []  # of the configurations: row and behaviour
    for setting in comparison.delivery_settings:
        rows: list[int] = []
        shown: set[int] = set()
        for variant in comparison.variants:
            if positions := comparison.positions(setting, variant):
                rows += positions
                row = paper_position(comparison, setting, variant)
                row = best_position(comparison, positions) if row is None else row
                found = counts(comparison.behaviours[row])
                cells += [(row, code) for code in found]
                shown |= found.keys()
        all_of_them = comparison.behaviours[rows]
        for code in counts(all_of_them).keys() - shown:
            cells.append((rows[int((all_of_them == code).sum(axis=1).argmax())], code))
    return [(row, _median_run(comparison, row, code)) for row, code in cells]


def _median_run(comparison: Comparison, row: int, behaviour: int) -> int:
    """The seed, by its position, of the median return among the runs that behave so."""
    runs = np.flatnonzero(comparison.behaviours[row] == behaviour)
    order = np.argsort(comparison.measure("return_last50")[row, runs], kind="stable")
    return int(runs[order[(len(runs) - 1) // 2]])
