"""The tables of sweeps: what a row of each stands for, and each of their columns.

docs/reference/files.md shows them, and those of the studies in `experiments/columns.py`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

# In names of columns: what stands for several names, and their form.
NAMES = {
    "MEASURE": (r"[A-Za-z]\w*(\.\w+)?", "the name of a measure, and of its part if it has several"),
    "SETTING": (r"[a-z]\w*(\.\w+)*", "the full name of a setting that varies"),
    "BEHAVIOUR": (r"[a-z_]+", "delivers, walks_the_trail, circles_with_food or other"),
}
CENTRE = {
    "MEASURE_mean": "mean over seeds",
    "MEASURE_ci_low": "lower end of its 95 % interval (bootstrap, BCa); empty for one seed",
    "MEASURE_ci_high": "upper end of this interval",
}
IQM = {  # only of measures that have one
    "MEASURE_iqm": "interquartile mean over seeds, for returns and lengths",
    "MEASURE_iqm_ci_low": "lower end of its 95 % interval (bootstrap, percentiles)",
    "MEASURE_iqm_ci_high": "upper end of this interval",
}


class Table(NamedTuple):
    """A table: what a row stands for, and the meanings of its columns by name."""

    row: str
    columns: Mapping[str, str]


SWEEP = {
    "runs.csv": Table(
        "combination and seed",
        {
            "SETTING": "value of the setting",
            "seed": "the seed",
            "MEASURE": "value of the measure; empty if there is none",
        },
    ),
    "summary.csv": Table(
        "combination",
        {
            "SETTING": "value of the setting",
            "seeds": "number of seeds",
            **CENTRE,
            **IQM,
            "MEASURE_left_out": "number of seeds without a value, which the estimates leave out; "
            "only if any run has no value",
        },
    ),
    "series.csv": Table(
        "value of a measure over time, with `measure_every`",
        {
            "SETTING": "value of the setting",
            "seed": "the seed",
            "episode": "number of the evaluation rollout, from 0",
            "tick": "ticks since it began",
            "measure": "name of the measure",
            "value": "its value",
        },
    ),
    "findings.csv": Table(
        "difference from the baseline, with `against`",
        {
            "SETTING": "value of the setting",
            "finding": "`more`, `less`, `equal` or `undecided`",
            "difference": "mean difference of the first measure, paired by seed",
            "low": "lower end of its interval; `-inf` if seeds agree but are too few",
            "high": "upper end of this interval; `inf` likewise",
            "left_out": "number of seeds that the difference leaves out; only if any run has no "
            "value",
        },
    ),
    "sensitivity.csv": Table(
        "measure and setting, with `sensitivity`",
        {
            "measure": "name of the measure",
            "setting": "full name of the setting",
            "first_order": "first-order index: share of the variance due to this setting alone",
            "first_order_low": "lower end of its 95 % interval (bootstrap over points)",
            "first_order_high": "upper end of this interval",
            "total": "total index: the same with all interactions",
            "total_low": "lower end of its 95 % interval",
            "total_high": "upper end of this interval",
        },
    ),
}
