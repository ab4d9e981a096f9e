"""Pages of synthetic studies, for tests of their text and in a browser."""

from functools import cache
from typing import NamedTuple

import numpy as np
from colony import colony_page
from colony_figures import draw_all as draw_study
from colony_findings import Measured, condition_rows, judge_all
from paper.baselines import Baseline
from paper.claims import Audit, assess
from paper.comparison import DYNA_P5, Comparison
from paper.figures import draw_all
from paper.page import Seen, comparison_page
from paper.table2 import Line, summarise, table2
from synthetic_colony_study import build as build_study
from synthetic_comparison import build, change, unchanged

from taichi_ants import Colony, Task, TrainingConfig, rollout, worlds
from taichi_ants.analysis.drawings import drawings
from taichi_ants.learners.policies import trail_follower
from taichi_ants.report.page import Picture, Player
from taichi_ants.viewer import record_colony, record_trace

FACTS = {"World": "the <paper's>", "Command": "compare.py --out 'a & b'"}
BASELINES = [Baseline("shortest delivery", None, 45.0, 34.0, 1.0)]


class Results(NamedTuple):
    """A comparison, our table 2 of it, and the findings on the claims."""

    comparison: Comparison
    lines: list[Line]
    audit: Audit

    @classmethod
    def of(cls, comparison: Comparison):
        """Return the results of a comparison."""
        return cls(comparison, table2(comparison, summarise(comparison)), assess(comparison))


@cache
def results() -> Results:
    """Return a comparison in which all claims hold if delivery truncates, but not otherwise."""
    edits = {"truncates": unchanged, "terminates": change(DYNA_P5, late_return=200)}
    return Results.of(build(edits, seeds=6))


@cache
def comparison_html() -> str:
    """Return the page of `results`."""
    recording = record_trace(rollout(worlds.paper(), trail_follower()))
    sheet = Picture.of("a <policy>", np.full((20, 30, 3), 200, np.uint8))
    comparison, lines, audit = results()
    return comparison_page(
        *(comparison, BASELINES, lines, audit),
        Seen(
            drawings(draw_all(comparison, BASELINES)),
            [Player(f"Delivers {n}", "As it <should>", recording) for n in (1, 2)],
            sheet,
        ),
        facts=FACTS,
        files=["claims.csv", "manifest.json", "mine.txt"],
    )


@cache
def study_measures() -> Measured:
    """Return a study in which the three rules double the deliveries."""

    def truth(rules: str, regime: str, ants: int) -> float:
        return 20.0 * ants * (2 if rules in ("foraging", "queueing") and ants > 1 else 1)

    return build_study(truth, seeds=12, world_kinds=("paper", "open", "small"))


@cache
def colony_html() -> str:
    """Return the page of `study_measures`."""
    steady = TrainingConfig("sarsa", 0.1, 0.9, 0.01, 1.0)
    colony = Colony(
        worlds.paper(), Task(), steady, 3, ants=9, sharing="frozen", q_values=trail_follower()
    )
    colony.begin_episode()
    rows = condition_rows(study_measures())
    return colony_page(
        *(rows, judge_all(study_measures())),
        drawings=drawings(draw_study(rows)),
        players=[Player("Paper's rules", "Nine ants", record_colony(colony, 30))],
        facts=FACTS,
        files=["seeds.csv"],
    )
