"""The study as tables: all conditions, all differences, deliveries and findings at a glance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from taichi_ants.analysis.colony.contrasts import (
    FIRST,
    QUESTIONS,
    SERIES,
    Judged,
    Series,
    Sizes,
    decline,
    peak,
    with_smaller,
)
from taichi_ants.analysis.colony.study import (
    COPIED,
    MEASURES,
    ON,
    PHEROMONES,
    WAYS,
    Arena,
    ColonyStudy,
)
from taichi_ants.analysis.findings import Finding, Verdict
from taichi_ants.analysis.statistics import bootstrap_interval
from taichi_ants.analysis.tables import (
    MISSING,
    Block,
    Table,
    figure,
    interval,
    markdown,
    number,
    percent,
    plain_text,
    sentence,
)
from taichi_ants.errors import count

CONDITION_COLUMNS: tuple[str, ...] = (
    *("arena", "pheromone", "way", "ants", "seeds"),
    *(f"{name}{end}" for name in MEASURES for end in ("_mean", "_ci_low", "_ci_high")),
    "deliveries_limit",
)
DIFFERENCE_COLUMNS: tuple[str, ...] = (
    *("arena", "question", "difference", "ants", "against", "mean", "low", "high"),
    *("criterion", "verdict"),
)
WIDTH = 100  # of the report, in columns
POSSIBLE = "How far is this from what is possible?"


def condition_rows(study: ColonyStudy) -> list[dict[str, Any]]:
    """The rows of conditions.csv: means over seeds with 95 % intervals (`bootstrap_interval`)."""
    rows = []
    for arena in study.arenas:
        named = sorted(
            (c for c in study.records if c.arena == arena.name),
            key=lambda c: (list(PHEROMONES).index(c.pheromone), list(WAYS).index(c.way), c.ants),
        )
        columns: dict[str, np.ndarray] = {}
        for measure in MEASURES:
            values = np.stack(
                [study.values(arena, c.pheromone, c.way, c.ants, measure) for c in named]
            )
            low, high = bootstrap_interval(values)
            columns |= {f"{measure}_mean": values.mean(axis=1), f"{measure}_ci_low": low}
            columns[f"{measure}_ci_high"] = high
        for place, condition in enumerate(named):
            rows.append(
                {
                    **vars(condition),
                    "seeds": arena.seeds,
                    **{name: float(values[place]) for name, values in columns.items()},
                    "deliveries_limit": arena.limit(condition.ants),
                }
            )
    return rows


def difference_rows(judged: Judged) -> list[dict[str, Any]]:
    """The rows of differences.csv; the intervals of one question in one arena hold all at once."""
    return [
        {
            "arena": arena,
            "question": series.question,
            "difference": series.words,
            "ants": ants,
            "against": against,
            "mean": finding.effect,
            "low": finding.low,
            "high": finding.high,
            "criterion": finding.contrast.criterion.words,
            "verdict": finding.verdict.value,
        }
        for (arena, series), findings in judged.items()
        for (ants, against), finding in findings.items()
    ]


def table_markdown(study: ColonyStudy, rows: list[dict[str, Any]]) -> str:
    """Deliveries per 1000 ticks with 95 % intervals, a table for each arena; evaporating trails."""
    blocks: list[Block] = []
    for arena in study.arenas:
        ways = [way for way in WAYS if study.sizes(arena, ON, way)]
        found = {
            (row["way"], row["ants"]): row
            for row in rows
            if row["arena"] == arena.name and row["pheromone"] == ON
        }
        names = [
            WAYS[way].replace("for long", f"{arena.long_factor} times as long") for way in ways
        ]
        lines = [
            [
                str(ants),
                *(_cell(found.get((way, ants))) for way in ways),
                _blocked([found[way, ants] for way in ways if (way, ants) in found]),
                _number(arena.limit(ants)),
            ]
            for ants in arena.sizes
        ]
        headers = ("ants", *names, "blocked moves", "limit")
        blocks.append(Table(sentence(arena.words), headers, lines, text_columns=0))
    return markdown(blocks)


def _cell(row: dict[str, Any] | None) -> str:
    if row is None:
        return MISSING
    mean, low, high = (row[f"deliveries_{end}"] for end in ("mean", "ci_low", "ci_high"))
    span = interval(low, high, 0 if mean >= 100 else 1)
    return _number(mean) + ("" if span == MISSING else f" {span}")


def _number(value: float | None) -> str:
    return MISSING if value is None else number(value, 0 if value >= 100 else 1)


def _blocked(rows: list[dict[str, Any]]) -> str:
    """The smallest and the largest share of the ways."""
    shares = [100 * row["blocked_mean"] for row in rows]
    low, high = (f"{share:.0f}" for share in (min(shares), max(shares)))
    return f"{low} %" if low == high else f"{low} to {high} %"


def report_text(study: ColonyStudy, rows: list[dict[str, Any]], judged: Judged) -> str:
    """The report as plain text: mean deliveries of all conditions, then the findings.

    Args:
        study: The study.
        rows: Its conditions, from `condition_rows`.
        judged: Its findings, from `judge_all`.
    """
    return plain_text(
        [*(_means(arena, rows) for arena in study.arenas), *found(study, judged)], WIDTH
    )


def _means(arena: Arena, rows: list[dict[str, Any]]) -> Table:
    """Mean deliveries per 1000 ticks: conditions down, numbers of ants across."""
    means = {
        (row["pheromone"], row["way"], row["ants"]): row["deliveries_mean"]
        for row in rows
        if row["arena"] == arena.name
    }
    lines = []
    for pheromone, trails in PHEROMONES.items():
        for way, words in WAYS.items():
            cells = [means.get((pheromone, way, ants)) for ants in arena.sizes]
            if any(cell is not None for cell in cells):
                lines.append([f"{words}; {trails}", *map(_number, cells)])
    if arena.limits:
        lines.append(["limit", *(_number(arena.limit(ants)) for ants in arena.sizes)])
    seeds = count(arena.seeds, "seed")
    title = f"{sentence(arena.words)}, {seeds}: deliveries per 1000 ticks"
    return Table(title, ("ants", *map(str, arena.sizes)), lines)


def findings_markdown(study: ColonyStudy, judged: Judged) -> str:
    """The findings as Markdown, a table for each question."""
    return markdown(found(study, judged))


def found(study: ColonyStudy, judged: Judged) -> list[Block]:
    """The findings: a table for each question, and one of what is possible."""
    blocks: list[Block] = [_answer(study, question, judged) for question in QUESTIONS]
    if any(arena.limits for arena in study.arenas):
        blocks.append(_possible(study))
    return [
        *blocks,
        "The intervals behind the answers to one question in one kind of world hold at once with "
        "95 %.",
    ]


def _answer(study: ColonyStudy, question: str, judged: Judged) -> Table:
    """A line for each series in each arena."""
    several = [series for series in SERIES if series.question == question]
    growth = several[0].choose is with_smaller
    line, headers = (_growth, _GROWTH) if growth else (_verdicts, _VERDICTS)
    rows = []
    for arena in study.arenas:
        world = sentence(arena.words)
        for series in several:
            if findings := judged.get((arena.name, series)):
                rows.append(
                    [world, sentence(series.statement), *line(study, arena, series, findings)]
                )
                world = ""
    units = " or ".join(dict.fromkeys(MEASURES[series.measure].words for series in several))
    notes = [sentence(units) + ("." if growth else ", as the statement says.")]
    if question == FIRST:
        notes.append("An episode without a delivery counts with all its ticks.")
    return Table(question, headers, rows, notes, text_columns=len(headers))


_GROWTH = ("World", "Who", "With one", "Grows up to", "Falls from", "With most", "Blocked moves")


def _growth(
    study: ColonyStudy, arena: Arena, series: Series, findings: Mapping[Sizes, Finding]
) -> list[str]:
    """How a measure changes with the number of ants, beyond chance."""
    way, pheromone = series.first
    sizes = study.sizes(arena, pheromone, way)

    def at(n: int, measure: str = series.measure) -> float:
        return study.mean(arena, pheromone, way, n, measure)

    top, falls, last = peak(findings), decline(findings), sizes[-1]
    begin = falls[0] if falls else last
    return [
        figure(at(sizes[0])),
        MISSING if top == sizes[0] else f"{count(top, 'ant')}: {figure(at(top))}",
        f"{count(begin, 'ant')}: {figure(at(begin))} (with {falls[1]}: {figure(at(falls[1]))})"
        if falls
        else MISSING,
        f"{count(last, 'ant')}: {figure(at(last))}",
        " and ".join(f"{percent(at(n, 'blocked'))} with {n}" for n in dict.fromkeys((begin, last))),
    ]


_VERDICTS = (
    "World",
    "Statement",
    "Supported\nwith",
    "Contradicted\nwith",
    "Undecided\nwith",
    "Clearest",
)


def _verdicts(
    study: ColonyStudy, arena: Arena, series: Series, findings: Mapping[Sizes, Finding]
) -> list[str]:
    """With how many ants a statement holds, and the two means that differ most."""
    by_verdict: dict[Verdict, list[int]] = {verdict: [] for verdict in Verdict}
    for (n, _), finding in findings.items():
        by_verdict[finding.verdict].append(n)
    by_verdict[Verdict.UNDECIDED] += by_verdict[Verdict.EQUIVALENT]
    columns = (Verdict.SUPPORTED, Verdict.CONTRADICTED, Verdict.UNDECIDED)
    sizes = max(findings, key=lambda sizes: _ratio(*_pair(study, arena, series, sizes)))
    one, other = _pair(study, arena, series, sizes)
    example = f"{sizes[0]}: {figure(one)} against {figure(other)}"
    example += "" if sizes[1] == sizes[0] else " with 1"
    example += f" ({100 * (one / other - 1):+.0f} %)" if min(one, other) > 0 else ""
    cells = (", ".join(map(str, sorted(by_verdict[verdict]))) for verdict in columns)
    return [*(cell or MISSING for cell in cells), example]


def _pair(study: ColonyStudy, arena: Arena, series: Series, sizes: Sizes) -> list[float]:
    """The two means of a contrast."""
    return [
        study.mean(arena, pheromone, way, n, series.measure)
        for (way, pheromone), n in zip((series.first, series.second), sizes, strict=True)
    ]


def _ratio(one: float, other: float) -> float:
    return abs(np.log((one + 1e-9) / (other + 1e-9))) if min(one, other) >= 0 else abs(one - other)


def _possible(study: ColonyStudy) -> Table:
    """What one ant and the busiest colony of each arena deliver, of what can be delivered."""
    rows = [
        [sentence(arena.words), *_of_possible(study, arena)]
        for arena in study.arenas
        if arena.limits
    ]
    headers = (
        "World",
        "Shortest cycle",
        "One ant",
        "Food",
        "Queen",
        "Best single ant",
        "Busiest colony",
    )
    notes = (
        "Shortest cycle from the queen to food and back, in ticks. Then the most that one ant can "
        "deliver, all food can give and the queen can take, per 1000 ticks.",
        "Best single ant, busiest colony: what they deliver, and its share of what so many can.",
    )
    return Table(POSSIBLE, headers, rows, notes, text_columns=1)


def _of_possible(study: ColonyStudy, arena: Arena) -> list[str]:
    cycles = sorted({limit.cycle for limit in arena.limits})
    means = {
        condition: study.mean(arena, condition.pheromone, condition.way, condition.ants)
        for condition in study.records
        if condition.arena == arena.name
    }
    single = {one: mean for one, mean in means.items() if one.ants == 1 and one.way == COPIED}
    best = []
    for those in (single, means):
        mean, top = max(((mean, one) for one, mean in those.items()), default=(0.0, None))
        if top is None:
            best.append(MISSING)
            continue
        share = percent(mean / (arena.limit(top.ants) or np.nan))
        who = f"{WAYS[top.way]}, {PHEROMONES[top.pheromone]}"
        best.append(f"{figure(mean)}, {share}\n({count(top.ants, 'ant')}, {who})")
    return [
        " to ".join(dict.fromkeys(map(figure, (cycles[0], cycles[-1])))),
        figure(arena.limit(1) or np.nan),
        figure(float(np.mean([limit.food for limit in arena.limits]))),
        figure(float(np.mean([limit.queen for limit in arena.limits]))),
        *best,
    ]
