"""The conditions, measures and contrasts of the colony's study; `series.toml` lists the contrasts.

A condition is a design (rules and a training regime), a number of ants, and a kind of world. A
seed gives all conditions of a kind of world the same world, so they are paired. Except for the
paper's world, ants have not been trained in the worlds in which they are evaluated.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib import resources
from itertools import combinations
from typing import Literal, NamedTuple

import numpy as np

from taichi_ants.analysis.findings import LEAST_SEEDS, Contrast, Finding, Verdict, above, judge
from taichi_ants.files import tomllib

# Kinds of world for training and evaluation, with their names in tables and figures.
WORLD_KINDS: dict[str, str] = {
    "paper": "the paper's world",
    "open": "open worlds (30, 30, 30)",
    "piles": "three far piles (30, 30, 30)",
}
# Kinds of world for the evaluation of ants that were trained in open worlds.
ELSEWHERES: dict[str, str] = {
    "rocks": "twice the rocks",
    "one_pile": "one far pile",
    "moving": "piles that move every 100 ticks",
    "slow": "food that grows back after 100 ticks",
    "small": "small worlds (15, 15, 15)",
    "wide": "wide worlds (60, 60, 60)",
    "large": "large worlds (100, 100, 100), 1000 ants",
}
WORLDS = {**WORLD_KINDS, **ELSEWHERES}

# Rules: A, trails that rise towards food; B, right of way; C, ants in view.
PAPER, SILENT, A, BC, ABC, ABC_SILENT, QUEUES = (
    *("paper", "paper_no_trails", "direction", "right_of_way"),
    *("foraging", "foraging_no_trails", "queueing"),
)
RULES: dict[str, str] = {
    PAPER: "paper's rules",
    SILENT: "paper's rules, no trails laid",
    A: "A",
    BC: "B + C",
    ABC: "A + B + C",
    ABC_SILENT: "B + C, no trails laid",
    QUEUES: "queues",
}
# Training regimes.
JOINT, ALONE, FEW, SOME, ABROAD = "joint", "alone", "with_4", "with_16", "open"
REGIMES: dict[str, str] = {
    JOINT: "trained jointly",
    ALONE: "trained alone, copied",
    FEW: "trained with 4",
    SOME: "trained with 16",
    ABROAD: "trained in open worlds",
}


class Design(NamedTuple):
    """Rules and a training regime, by their names in `RULES` and `REGIMES`."""

    rules: str
    regime: str = JOINT

    @property
    def words(self) -> str:
        """The name of the design in tables."""
        rules = RULES[self.rules]
        return rules if self.regime == JOINT else f"{rules}, {REGIMES[self.regime]}"


class Condition(NamedTuple):
    """An evaluated combination: a name in `WORLDS`, a design, and the number of ants."""

    world_kind: str
    rules: str
    regime: str
    ants: int


EVALUATION_EPSILON = 0.01  # the exploration rate of the evaluation
# Measures of a colony, with their names in tables.
MEASURES: dict[str, str] = {
    "deliveries": "deliveries per 1000 ticks",
    "per_ant": "deliveries per ant and 1000 ticks",
    "first_delivery": "ticks to the first delivery",
    "no_delivery_rate": "share of episodes without a delivery",
    "blocked": "share of blocked moves",
    "reward": "reward per ant and 1000 ticks",
}
# Measures of the study, which also evaluates without exploration and computes bounds.
OF_STUDY: dict[str, str] = {
    **MEASURES,
    "greedy": "deliveries per 1000 ticks without exploration",
    "bound": "most deliveries per 1000 ticks that are possible in the world of the seed",
    "bound_share": "deliveries as a share of that bound",
}
# Measures of each seed, float64 (seeds,), by their names in `OF_STUDY`.
Measured = Mapping[Condition, Mapping[str, np.ndarray]]


def measures_of(outcome: Mapping[str, np.ndarray], ants: int, ticks: int) -> dict[str, np.ndarray]:
    """Return the `MEASURES` of each seed, float64 (seeds,), from the outcome of a `ColonyPoint`.

    For `first_delivery`, an episode without a delivery counts with all its ticks. This restricted
    mean (of survival analysis) is at most the true one; `no_delivery_rate` is the share of such
    episodes. `blocked` is nan if no ant tried to move.
    """
    deliveries, rewards = (
        outcome[name].mean(axis=1, dtype=float) * 1000 / ticks for name in ("deliveries", "returns")
    )
    first = outcome["first_delivery"].astype(int)
    moves = outcome["moves"].sum(axis=1, dtype=float)
    return {
        "deliveries": deliveries,
        "per_ant": deliveries / ants,
        "first_delivery": np.where(first < 0, ticks, first).mean(axis=1),
        "no_delivery_rate": (first < 0).mean(axis=1),
        "blocked": outcome["blocked"].sum(axis=1) / np.where(moves > 0, moves, np.nan),
        "reward": rewards / ants,
    }


# The numbers of ants of the first and the second condition of a difference.
Sizes = tuple[int, int]


@dataclass(frozen=True)
class Series:
    """Differences between two designs, first minus second, for several numbers of ants.

    Attributes:
        question: The question that the series helps to answer.
        statement: A statement that is true if the differences are above 0.
        measure: A name in `MEASURES`.
        against: "same" compares equal numbers of ants, "smaller" each number with all smaller ones.
        least: The fewest ants for "same". With one ant, all regimes and some rules are the same.
        main: Whether it is one of the main findings.
    """

    question: str
    statement: str
    first: Design
    second: Design
    measure: str = "deliveries"
    against: Literal["same", "smaller"] = "same"
    least: int = 2
    main: bool = False

    def contrasts(self, measured: Measured, world_kind: str) -> dict[Sizes, Contrast]:
        """Return the contrasts of a kind of world for which both conditions were measured."""
        found = {}
        for n, other in self._sizes(measured, world_kind):
            values = measured[Condition(world_kind, *self.first, n)][self.measure]
            subtracted = measured[Condition(world_kind, *self.second, other)][self.measure]
            found[n, other] = Contrast(self.statement, values - subtracted, above())
        return found

    def _sizes(self, measured: Measured, world_kind: str) -> list[Sizes]:
        sizes, others = (
            sorted(one.ants for one in measured if one[:3] == (world_kind, *design))
            for design in (self.first, self.second)
        )
        if self.against == "smaller":
            return [(n, less) for less, n in combinations(sizes, 2) if less in others]
        return [(n, n) for n in sizes if n >= self.least and n in others]


_TEXT = resources.files(__package__).joinpath("series.toml").read_text(encoding="utf-8")
SERIES = tuple(
    Series(**{**one, "first": Design(*one["first"]), "second": Design(*one["second"])})
    for one in tomllib.loads(_TEXT)["series"]
)
QUESTIONS: tuple[str, ...] = tuple(dict.fromkeys(series.question for series in SERIES))
# By the name of the kind of world and the series.
Judged = dict[tuple[str, Series], dict[Sizes, Finding]]


def judge_all(measured: Measured) -> Judged:
    """Return the findings on all contrasts.

    All intervals of a question and a kind of world hold at the same time. With fewer than
    `LEAST_SEEDS` seeds, the verdict is "too few seeds".
    """
    judged: Judged = {}
    for world_kind in dict.fromkeys(one.world_kind for one in measured):
        for question in QUESTIONS:
            contrasts = {
                (series, sizes): contrast
                for series in SERIES
                if series.question == question
                for sizes, contrast in series.contrasts(measured, world_kind).items()
            }
            findings = judge(list(contrasts.values()))
            for (series, sizes), finding in zip(contrasts, findings, strict=True):
                if finding.contrast.seeds < LEAST_SEEDS:
                    finding = replace(finding, verdict=Verdict.TOO_FEW)
                judged.setdefault((world_kind, series), {})[sizes] = finding
    return judged
