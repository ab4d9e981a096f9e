"""The comparison in a terminal: the paper's table 2 beside ours, and what became of its claims."""

from __future__ import annotations

import io
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import IO, TYPE_CHECKING, Any

from taichi_ants.analysis.claims.assess import SIMULTANEOUS_LEVEL
from taichi_ants.analysis.claims.model import Finding, Verdict
from taichi_ants.analysis.claims.tables import by_claim, tally
from taichi_ants.analysis.comparison import Comparison, Variant
from taichi_ants.analysis.markdown import MISSING, baseline_name, count, interval, number
from taichi_ants.analysis.paper import GREEDY_RETURN, GREEDY_STEPS, TABLE_2, VARIANTS

if TYPE_CHECKING:
    from rich.table import Table

# A table and the lines below it.
Section = tuple["Table", str]

# Columns where the output is no terminal.
WIDTH = 100

_LEVEL = round(100 * SIMULTANEOUS_LEVEL)
_GREEDY = {
    "return": ("greedy_return", 1),
    "steps": ("greedy_steps", 1),
    "deliveries": ("greedy_deliveries", 2),
}
_STYLES = {
    Verdict.SUPPORTED: "green",
    Verdict.CONTRADICTED: "red",
    Verdict.UNDISTINGUISHED: "yellow",
    Verdict.NOT_TESTED: "dim",
}


def print_report(
    comparison: Comparison,
    lines: Sequence[Mapping],
    findings: Sequence[Finding],
    baselines: Sequence[Mapping] = (),
    costs: Sequence[Mapping] = (),
    file: IO[str] | None = None,
) -> None:
    """Prints the report; without colours and `WIDTH` columns wide where there is no terminal.

    Args:
        comparison: The comparison.
        lines: Its table 2, from `table2.table2`.
        findings: Its claims, from `claims.assess`.
        baselines: Rows of baselines.csv, see `baselines.baseline_rows`.
        costs: Time per step of learners, each with "learner", "planning_steps" and
            "nanoseconds_per_step".
        file: Where to; standard output by default.
    """
    from rich.console import Console

    console = Console(file=file, highlight=False, markup=False)
    if not console.is_terminal:
        console = Console(file=file, highlight=False, markup=False, width=WIDTH)
    console.print(
        f"{count(len(comparison.rows), 'configuration')}, {count(len(comparison.seeds), 'seed')}, "
        f"{count(comparison.episodes, 'episode')} of at most {comparison.max_steps} steps, "
        f"{count(comparison.rollouts, 'greedy rollout')} a run."
    )
    sections = (
        *_table2(lines),
        _greedy(comparison),
        _claims(findings),
        _costs(costs),
        _baselines(baselines),
    )
    for table, notes in sections:
        if table.row_count:
            console.print()
            console.print(table)
        if notes and (table.row_count or findings):
            console.print(notes)


def render(*arguments: Any, **options: Any) -> str:
    """The report as plain text, `WIDTH` columns wide; arguments as for `print_report`."""
    text = io.StringIO()
    print_report(*arguments, **options, file=text)
    return text.getvalue()


def _table(title: str, columns: Iterable[str], text_columns: int = 1) -> Table:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(
        title=title,
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        title_justify="left",
        title_style="bold",
    )
    for position, column in enumerate(columns):
        justify = "left" if position < text_columns else "right"
        table.add_column(column, justify=justify, overflow="fold")
    return table


def _table2(lines: Sequence[Mapping]) -> list[Section]:
    """One table for each delivery setting, explained after the last."""
    headers = ("Learner", "Return\npaper", "ours", "best run", "below")
    headers += ("Steps\npaper", "ours", "Deliveries\npaper", "ours")
    tables = []
    for setting in dict.fromkeys(line["delivery"] for line in lines):
        tables.append(_table(f"Table 2, {setting} delivery", headers))
        for line in lines:
            if line["delivery"] == setting and (line["seeds"] or line["best_run_of"]):
                tables[-1].add_row(*_table2_cells(line))
    notes = (
        "ours: the paper's configuration, mean over seeds [95 % interval]\n"
        "best run: best by return of all configurations, one run each, repeated: median "
        "[95 % range]\n"
        "below: percentage of these below the paper's figure"
    )
    return [(table, notes if table is tables[-1] else "") for table in tables]


def _table2_cells(line: Mapping) -> list[str]:
    return [
        Variant(line["learner"], line["planning_steps"]).label,
        number(line["paper_return"]),
        _with_range(line, "same_return_mean", "same_return_ci_low", "same_return_ci_high"),
        _with_range(line, "best_run_return_median", "best_run_return_low", "best_run_return_high"),
        _percent(line["best_run_return_paper_percentile"]),
        number(line["paper_steps"]),
        number(line["same_steps_mean"]),
        number(line["paper_deliveries"], 2),
        number(line["same_deliveries_mean"], 2),
    ]


def _with_range(line: Mapping, middle: str, low: str, high: str) -> str:
    digits = 0 if max(abs(line[middle]), abs(line[high])) >= 100 else 1
    span = interval(line[low], line[high], digits)
    return number(line[middle], digits) + ("" if span == MISSING else f" {span}")


def _percent(value: float) -> str:
    return MISSING if math.isnan(value) else f"{value:.0f} %"


def _greedy(comparison: Comparison) -> Section:
    """Greedy rollouts at the paper's configurations."""
    settings = comparison.delivery_settings
    headers = [f"{setting}\n{name}" for setting in settings for name in _GREEDY]
    table = _table("Greedy evaluation", ("Learner", *headers))
    for variant in VARIANTS:
        cells = []
        for setting in settings:
            position = comparison.position(setting, variant, TABLE_2[variant].hyperparameters)
            for measure, digits in _GREEDY.values():
                value = math.nan
                if position is not None:
                    value = float(comparison.measure(measure)[position].mean())
                cells.append(number(value, digits))
        if set(cells) != {MISSING}:
            table.add_row(variant.label, *cells)
    notes = (
        f"The paper: about {GREEDY_RETURN:g} reward in {GREEDY_STEPS[0]:g} to {GREEDY_STEPS[1]:g} "
        "steps. Configurations of table 2, means over seeds."
    )
    return table, notes if table.row_count else ""


def _claims(findings: Sequence[Finding]) -> Section:
    """The verdicts on all claims that could be tested, and a count of all."""
    from rich.text import Text

    settings = list(dict.fromkeys(finding.delivery for finding in findings))
    headers = ("Section", "In our words", *settings)
    table = _table("The paper's claims", headers, text_columns=len(headers))
    for group in by_claim(findings):
        if all(finding.verdict is Verdict.NOT_TESTED for finding in group):
            continue
        verdicts = {
            finding.delivery: Text(finding.verdict.value, style=_STYLES[finding.verdict])
            for finding in group
        }
        claim = group[0].claim
        cells = (verdicts.get(setting, "") for setting in settings)
        table.add_row(claim.section.split(",")[0], claim.statement, *cells)
    notes = [
        f"{setting}: {tally([f for f in findings if f.delivery == setting])}"
        for setting in settings
    ]
    if table.row_count:
        notes.append(f"All intervals behind the verdicts hold at once with {_LEVEL} %.")
    reasons = Counter(f.note for f in findings if f.verdict is Verdict.NOT_TESTED)
    notes += [f"not tested ({times}): {reason}" for reason, times in reasons.most_common(3)]
    return table, "\n".join(notes)


def _costs(costs: Sequence[Mapping]) -> Section:
    table = _table("Cost per step", ("Learner", "Nanoseconds", "Relative"))
    times = [cost["nanoseconds_per_step"] for cost in costs]
    fastest = min((time for time in times if time > 0), default=math.nan)
    for cost, time in zip(costs, times, strict=True):
        label = Variant(cost["learner"], cost["planning_steps"]).label
        table.add_row(label, number(time), number(time / fastest, 2))
    return table, ""


def _baselines(baselines: Sequence[Mapping]) -> Section:
    headers = ("Behaviour", "Setting", "Return", "Steps", "Deliveries")
    table = _table("Baselines", headers, text_columns=2)
    for row in baselines:
        figures = (row["return_mean"], row["steps_mean"], row["deliveries_mean"])
        cells = (
            MISSING if figure is None else number(figure, digits)
            for figure, digits in zip(figures, (1, 1, 2), strict=True)
        )
        table.add_row(baseline_name(row), row["setting"], *cells)
    return table, ""
