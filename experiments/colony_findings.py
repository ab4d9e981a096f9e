"""The conditions and contrasts of the study of colonies, and its tables.

A condition is a design (rules and a training regime), a number of ants, and a kind of world. A
seed gives all conditions of a kind of world the same world, so they are paired. Except for the
paper's world, ants have not been trained in the worlds in which they are evaluated.
`colony_series.toml` lists the contrasts.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from taichi_ants.analysis import findings as judging
from taichi_ants.analysis import tables as printing
from taichi_ants.analysis.findings import LEAST_SEEDS, Contrast, Finding, Verdict, above, judge
from taichi_ants.analysis.statistics import Estimator
from taichi_ants.analysis.sweeps import centre_columns, centres_of
from taichi_ants.analysis.tables import MISSING, Block, Table, figure, interval, percent, sentence
from taichi_ants.errors import count
from taichi_ants.files import tomllib
from taichi_ants.measures.finished import COLONY

_FILE = tomllib.loads(Path(__file__).with_name("colony_series.toml").read_text(encoding="utf-8"))
# Kinds of world for training and evaluation, and others for the evaluation of ants that were
# trained in open worlds; rules, and training regimes: their names in tables and figures.
WORLD_KINDS: dict[str, str] = _FILE["world_kinds"]
ELSEWHERES: dict[str, str] = _FILE["elsewheres"]
WORLDS = {**WORLD_KINDS, **ELSEWHERES}
RULES: dict[str, str] = _FILE["rules"]
PAPER, SILENT, A, BC, ABC, ABC_SILENT, QUEUES = RULES
REGIMES: dict[str, str] = _FILE["regimes"]
JOINT, ALONE, FEW, SOME, ABROAD = REGIMES


class Trained(NamedTuple):
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
# Measures of the study, which also evaluates without exploration and computes bounds.
OF_STUDY: dict[str, str] = {
    **{name: measure.label for name, measure in COLONY.items()},
    "greedy": "deliveries per 1000 ticks without exploration",
    "bound": "most deliveries per 1000 ticks that are possible in the world of the seed",
    "bound_share": "deliveries as a share of that bound",
}
# Measures of each seed, float64 (seeds,), by their names in `OF_STUDY`.
Measured = Mapping[Condition, Mapping[str, np.ndarray]]
# The numbers of ants of the first and the second condition of a difference.
Sizes = tuple[int, int]


@dataclass(frozen=True)
class Contrasts:
    """Differences between two designs, first minus second, for several numbers of ants.

    Attributes:
        question: The question that the series helps to answer.
        statement: A statement that is true if the differences are above 0.
        measure: A name in `COLONY`.
        against: "same" compares equal numbers of ants, "smaller" each number with all smaller ones.
        least: The fewest ants for "same". With one ant, all regimes and some rules are the same.
        main: Whether it is one of the main findings.
    """

    question: str
    statement: str
    first: Trained
    second: Trained
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


SERIES = tuple(
    Contrasts(**{**one, "first": Trained(*one["first"]), "second": Trained(*one["second"])})
    for one in _FILE["series"]
)
QUESTIONS: tuple[str, ...] = tuple(dict.fromkeys(series.question for series in SERIES))
# By the name of the kind of world and the series.
Judged = dict[tuple[str, Contrasts], dict[Sizes, Finding]]


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


class ConditionRow(NamedTuple):
    """A row of conditions.csv: a condition over all seeds.

    `estimates` has the measures of `OF_STUDY`, `ranges` the minimum and maximum of deliveries and
    bounds.
    """

    condition: Condition
    seeds: int
    estimates: Mapping[str, Estimator]
    ranges: Mapping[str, tuple[float, float]]

    @property
    def design(self) -> Trained:
        """Its rules and training regime."""
        return Trained(self.condition.rules, self.condition.regime)

    def columns(self) -> dict[str, Any]:
        """Return the columns of conditions.csv."""
        ends = {
            f"{name}_{end}": value
            for name, pair in self.ranges.items()
            for end, value in zip(("min", "max"), pair, strict=True)
        }
        estimates = centre_columns(self.estimates)
        return {**self.condition._asdict(), "seeds": self.seeds, **estimates, **ends}


def rows_of_seeds(measured: Measured, seeds: Sequence[int]) -> list[dict[str, Any]]:
    """Return the rows of seeds.csv: all measures of each seed under each condition."""
    return [
        {**condition._asdict(), "seed": seed, **{name: float(one[name][s]) for name in OF_STUDY}}
        for condition, one in measured.items()
        for s, seed in enumerate(seeds)
    ]


def condition_rows(measured: Measured) -> list[ConditionRow]:
    """Return a row with 95 % intervals for each condition."""
    rows = []
    stacked = {name: np.stack([one[name] for one in measured.values()]) for name in OF_STUDY}
    for (condition, one), estimates in zip(measured.items(), centres_of(stacked), strict=True):
        ranges = {n: (float(one[n].min()), float(one[n].max())) for n in ("deliveries", "bound")}
        rows.append(ConditionRow(condition, len(one["deliveries"]), estimates, ranges))
    return rows


def difference_rows(judged: Judged) -> list[dict[str, Any]]:
    """Return the rows of differences.csv, with the intervals of `judge_all`."""
    return [
        {
            "world_kind": world_kind,
            **{name: getattr(series, name) for name in ("question", "statement", "measure")},
            **{"ants": ants, "against": against},
            **{"mean": finding.effect, "low": finding.low, "high": finding.high},
            "verdict": finding.verdict.value,
        }
        for (world_kind, series), findings in judged.items()
        for (ants, against), finding in findings.items()
    ]


def means(rows: Sequence[ConditionRow]) -> list[Table]:
    """Return tables of mean deliveries, one per kind of world: designs down, ants across.

    The last table has policies from open worlds in other worlds, with intervals and worst seeds.
    """
    seeds = f"{_basis(rows)}: {COLONY['deliveries'].label}"
    trained = [one for one in rows if one.condition.regime != ABROAD]
    abroad = [one for one in rows if one.condition.regime == ABROAD]
    tables = []
    for world_kind in WORLD_KINDS:
        by_design: dict[Trained, dict[int, ConditionRow]] = {}
        for one in trained:
            if one.condition.world_kind == world_kind:
                by_design.setdefault(one.design, {})[one.condition.ants] = one
        sizes = sorted({n for by_size in by_design.values() for n in by_size})
        cells = []
        for design, by_size in by_design.items():
            mean_of = {n: one.estimates["deliveries"].mean for n, one in by_size.items()}
            delivered = (figure(mean_of.get(n)) for n in sizes)
            *_, largest = by_size.values()
            share, bound = (largest.estimates[name].mean for name in ("bound_share", "bound"))
            cells.append([design.words, *delivered, percent(share), figure(bound)])
        if cells:
            headers = ("ants", *map(str, sizes), "share of\nbound", "mean\nbound")
            note = (
                f"Last columns, for {count(sizes[-1], 'ant')}: the mean share of each world's "
                "bound, and the mean of the bounds."
            )
            title = f"{sentence(WORLD_KINDS[world_kind])}, {seeds}"
            tables.append(Table(title, headers, cells, [note]))
    if abroad:
        by_world: dict[str, dict[str, str]] = {}
        for one in abroad:
            mean, low, high, *_ = one.estimates["deliveries"]
            cell = f"{figure(mean)} {interval(low, high, 0)}, {figure(one.ranges['deliveries'][0])}"
            by_world.setdefault(one.condition.world_kind, {})[one.condition.rules] = cell
        rules = list(dict.fromkeys(one.condition.rules for one in abroad))
        cells = [[WORLDS[a], *(by[name] for name in rules)] for a, by in by_world.items()]
        headers = ("world", *(RULES[name] for name in rules))
        ants = count(abroad[0].condition.ants, "ant")
        title = f"{sentence(REGIMES[ABROAD])}, {ants}, {seeds}"
        note = "Mean, its 95 % interval, and the worst seed."
        tables.append(Table(title, headers, cells, [note]))
    return tables


def seeds_in_words(seeds: int) -> str:
    """Return "20 seeds", for example, with a warning if they are fewer than `LEAST_SEEDS`."""
    return count(seeds, "seed") + (", too few for a verdict" if seeds < LEAST_SEEDS else "")


def _basis(rows: Sequence[ConditionRow]) -> str:
    return f"{seeds_in_words(rows[0].seeds)}, exploration rate {EVALUATION_EPSILON:g}"


def glance(rows: Sequence[ConditionRow]) -> Table:
    """Return deliveries of the largest colonies: a row per design, a column per kind of world."""
    sizes = [one.condition.ants for one in rows if one.condition.regime != ABROAD]
    largest = max(sizes, default=0)
    shown: dict[str, dict[Trained, ConditionRow]] = {name: {} for name in WORLD_KINDS}
    for one in rows:
        if one.condition.ants == largest and one.condition.world_kind in shown:
            shown[one.condition.world_kind][one.design] = one
    shown = {world_kind: by_design for world_kind, by_design in shown.items() if by_design}
    every = [one.estimates["deliveries"].mean for by in shown.values() for one in by.values()]
    digits = 0 if max(every, default=0) >= 100 else 1

    def cell(row: ConditionRow | None) -> str:
        if row is None:
            return MISSING
        with_, without = (
            printing.number(row.estimates[n].mean, digits) for n in ("deliveries", "greedy")
        )
        return f"{with_} ({without}), {percent(row.estimates['bound_share'].mean)}"

    alone = [Trained(rules, ALONE) for rules in (PAPER, ABC)]
    designs = [alone[0], *map(Trained, RULES), alone[1]]
    cells = [
        [sentence(one.words), *(cell(by_design.get(one)) for by_design in shown.values())]
        for one in designs
        if any(one in by_design for by_design in shown.values())
    ]
    if cells:  # the bounds are highest if ants with food have right of way
        line = []
        for by_design in shown.values():
            best = max(by_design.values(), key=lambda one: one.estimates["bound"].mean)
            low, high = best.ranges["bound"]
            range_ = "" if low == high else f" {interval(low, high, 0)}"
            line.append(figure(best.estimates["bound"].mean) + range_)
        cells.append(["Mean bound, right of way [range]", *line])
    title = f"{sentence(COLONY['deliveries'].label)} of {count(largest, 'ant')}"
    note = f"{_basis(rows)}; in brackets: without exploration; %: share of the world's bound."
    return Table(title, ("", *_headers(shown)), cells, [note] if cells else [])


def _headers(world_kinds: Iterable[str]) -> list[str]:
    return [sentence(WORLD_KINDS[one]).replace(" (", "\n(") for one in world_kinds]


def headlines(rows: Sequence[ConditionRow], judged: Judged) -> Table:
    """Return a table of the main findings on the largest colonies, a column per kind of world."""
    by_condition = {one.condition: one for one in rows}
    found_in = {world_kind for world_kind, series in judged if series.main}
    world_kinds = [one for one in WORLD_KINDS if one in found_in]
    cells = []
    for series in [one for one in SERIES if one.main]:
        line = []
        for world_kind in world_kinds:
            n = max((ants for ants, _ in judged.get((world_kind, series), {})), default=1)
            if n > 1:
                first, second = (
                    by_condition[Condition(world_kind, *design, n)].estimates[series.measure].mean
                    for design in (series.first, series.second)
                )
                verdict = judged[world_kind, series][n, n].verdict.value
                line.append(f"{verdict}\n{n}: {figure(first)} against {figure(second)}")
        if len(line) == len(world_kinds) > 0:
            cells.append([sentence(series.statement), *line])
    headers = ("Statement", *_headers(world_kinds))
    note = (
        "Below the verdict: the number of ants, and the means compared, in "
        f"{COLONY['deliveries'].label}. {_basis(rows)}."
    )
    return Table("", headers, cells, [note] if cells else [], text_columns=len(headers))


def on_one_screen(rows: Sequence[ConditionRow], judged: Judged) -> list[Block]:
    """Return tables of deliveries and of the main findings, and the number of each verdict."""
    seen = glance(rows)
    world_kinds = {one.condition.world_kind for one in rows}
    conditions = f"{count(len(rows), 'condition')} in {count(len(world_kinds), 'kind')} of world"
    lines = ["Statements about the largest colonies"]
    for question in QUESTIONS:
        verdicts = printing.tally(
            of_largest(findings).verdict.value
            for (_, series), findings in judged.items()
            if series.question == question
        )
        lines += [f"  {question} {verdicts}"] if verdicts else []
    return [
        f"{conditions}, {seeds_in_words(rows[0].seeds)}.",
        *([seen] if seen.rows else means(rows)),
        headlines(rows, judged),
        "\n".join(lines),
    ]


def of_largest(findings: Mapping[Sizes, Finding]) -> Finding:
    """Return the finding on the largest colony; of several, that with the strongest objection."""
    largest = max(ants for ants, _ in findings)
    return judging.weakest([one for (ants, _), one in findings.items() if ants == largest])
