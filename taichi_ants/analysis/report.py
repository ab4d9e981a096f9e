"""The comparison in a terminal: the paper's table 2 beside ours, and what became of its claims.

A learner without the paper's configuration, or in another world, is shown at its best one.
"""

from __future__ import annotations

import io
import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import IO, TYPE_CHECKING, Any, Literal

from taichi_ants.analysis.best_of import Choice, Chosen, choice
from taichi_ants.analysis.claims.assess import OTHER_WORLD, SIMULTANEOUS_LEVEL
from taichi_ants.analysis.claims.model import WITHIN_MARGIN, Finding, Verdict
from taichi_ants.analysis.claims.tables import by_claim, tally
from taichi_ants.analysis.comparison import Comparison, Variant
from taichi_ants.analysis.markdown import MISSING, baseline_name, count, interval, number
from taichi_ants.analysis.paper import GREEDY_RETURN, GREEDY_STEPS, VARIANTS
from taichi_ants.analysis.table2 import means

if TYPE_CHECKING:
    from rich.table import Table

# Delivery setting and learner -> the configuration that is shown.
Choices = Mapping[tuple[str, Variant], Choice]
# A table and the lines below it.
Section = tuple["Table", str]

# Columns where the output is no terminal: what the narrowest common terminal shows.
WIDTH = 79

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
    console.print(f"World: {comparison.world}.")
    console.print(
        f"{count(len(comparison.rows), 'configuration')}, {count(len(comparison.seeds), 'seed')}, "
        f"{count(comparison.episodes, 'episode')} of at most {comparison.max_steps} steps, "
        f"{count(comparison.rollouts, 'greedy rollout')} a run."
    )
    choices = {
        (setting, variant): chosen
        for setting in comparison.delivery_settings
        for variant in comparison.variants
        if (chosen := choice(comparison, setting, variant)) is not None
    }
    sections = (
        *_table2(comparison, lines, choices),
        _greedy(comparison, choices),
        _claims(findings) if comparison.in_paper_world else _no_claims(),
        _costs(costs),
        _baselines(baselines),
    )
    for table, notes in sections:
        if table.row_count:
            console.print()
            console.print(table)
        if notes:
            console.print(notes)


def render(*arguments: Any, **options: Any) -> str:
    """The report as plain text of at most `WIDTH` columns; arguments as for `print_report`."""
    text = io.StringIO()
    print_report(*arguments, **{**options, "file": text})
    return "".join(f"{line.rstrip()}\n" for line in text.getvalue().splitlines())


def _table(title: str, columns: Iterable[str], text_columns: int = 1, gap: int = 2) -> Table:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(
        title=title,
        box=SIMPLE_HEAD,
        show_edge=False,
        padding=(0, gap - 1, 0, 0),  # the box adds one
        title_justify="left",
        title_style="bold",
    )
    for position, column in enumerate(columns):
        justify: Literal["left", "right"] = "left" if position < text_columns else "right"
        table.add_column(column, justify=justify, overflow="fold")
    return table


def _table2(comparison: Comparison, lines: Sequence[Mapping], choices: Choices) -> list[Section]:
    """One table for each delivery setting, explained after the last."""
    of_paper = comparison.in_paper_world
    headers: tuple[str, ...] = (
        "Learner",
        "Return\npaper",
        "ours",
        "best run",
        "below",
        "Steps\npaper",
        "ours",
    )
    headers += ("Food\npaper", "ours")
    if not of_paper:
        headers = ("Learner", "Return", "best run", "Steps", "Deliveries")
    tables = []
    for setting in dict.fromkeys(line["delivery"] for line in lines):
        name = "Table 2" if of_paper else "Training"
        tables.append(_table(f"{name}, {setting} delivery", headers, gap=1))
        for line in lines:
            variant = Variant(line["learner"], line["planning_steps"])
            chosen = choices.get((setting, variant))
            if line["delivery"] == setting and chosen is not None:
                cells = _table2_cells(comparison, line, chosen, of_paper)
                tables[-1].add_row(_marked(variant, chosen), *cells)
    notes = _table2_notes(of_paper, choices)
    return [(table, notes if table is tables[-1] else "") for table in tables]


def _table2_cells(
    comparison: Comparison, line: Mapping, chosen: Choice, of_paper: bool
) -> Iterable[str]:
    ours = means(comparison, "ours", chosen.position, chosen.seeds)
    cells = {
        "paper return": number(line["paper_return"]),
        "return": _with_range(ours, "ours_return", "mean", "ci_low", "ci_high"),
        "best run": _with_range(line, "best_run_return", "median", "low", "high"),
        "paper below": _percent(line["best_run_return_paper_percentile"]),
        "paper steps": number(line["paper_steps"]),
        "steps": number(ours["ours_steps_mean"]),
        "paper deliveries": number(line["paper_deliveries"], 2),
        "deliveries": number(ours["ours_deliveries_mean"], 2),
    }
    return (cell for name, cell in cells.items() if of_paper or not name.startswith("paper"))


def _table2_notes(of_paper: bool, choices: Choices) -> str:
    notes = ["best run: best by return of all configurations, one run each: median [95 %]"]
    if of_paper:
        notes.insert(0, "ours: the paper's configuration, mean over seeds; intervals at 95 %")
        notes += [
            "below: percentage of these below the paper's figure",
            "food: deliveries per episode, last 50",
        ]
    # Why -> the choices made so, as lines.
    starred: dict[Chosen, list[str]] = {}
    for (setting, variant), chosen in choices.items():
        if chosen.why is not Chosen.PAPER:
            text = f"  {variant.label}, {setting}: {chosen.hyperparameters.label}"
            starred.setdefault(chosen.why, []).append(text)
    for why, texts in starred.items():
        notes += [f"* {why.value}", "  (learning rate / discount / epsilon / decay):", *texts]
    return "\n".join(notes)


def _marked(variant: Variant, chosen: Choice) -> str:
    """The learner's name, with a star if its configuration is not the paper's."""
    return variant.label + ("" if chosen.why is Chosen.PAPER else " *")


def _with_range(line: Mapping, stem: str, *names: str) -> str:
    middle, low, high = (line[f"{stem}_{name}"] for name in names)
    digits = 0 if max(abs(middle), abs(high)) >= 100 else 1
    text = number(middle, digits)
    # One seed has no range.
    return text if math.isnan(low) or low == high else f"{text}\n{interval(low, high, digits)}"


def _percent(value: float) -> str:
    return MISSING if math.isnan(value) else f"{value:.0f} %"


def _greedy(comparison: Comparison, choices: Choices) -> Section:
    """Greedy rollouts at the configurations of the tables above."""
    settings = comparison.delivery_settings
    headers = [f"{setting}\n{name}" for setting in settings for name in _GREEDY]
    table = _table("Greedy evaluation", ("Learner", *headers), gap=1)
    # Learners in the order of the tables above.
    variants = sorted({variant for _, variant in choices}, key=_order(comparison))
    for variant in variants if comparison.rollouts else ():
        chosen = [choices.get((setting, variant)) for setting in settings]
        cells = []
        for one in chosen:
            for measure, digits in _GREEDY.values():
                value = math.nan
                if one is not None:
                    value = float(comparison.measure(measure)[one.position, one.seeds].mean())
                cells.append(number(value, digits))
        star = any(one is not None and one.why is not Chosen.PAPER for one in chosen)
        table.add_row(variant.label + (" *" if star else ""), *cells)
    if not table.row_count:
        return table, ""
    notes = "Configurations and seeds as in the tables above, means over seeds."
    if comparison.in_paper_world:
        low, high = GREEDY_STEPS
        notes += f"\nThe paper: about {GREEDY_RETURN:g} reward in {low:g} to {high:g} steps."
    return table, notes


def _order(comparison: Comparison) -> Callable[[Variant], int]:
    """The paper's learners first, then the others in order of appearance."""
    order = list(dict.fromkeys((*VARIANTS, *comparison.variants)))
    return order.index


def _claims(findings: Sequence[Finding]) -> Section:
    """The verdicts on all claims that could be tested, and a count of all."""
    from rich.text import Text

    settings = list(dict.fromkeys(finding.delivery for finding in findings))
    headers = ("Section", "In our words (tested on)", *settings)
    table = _table("The paper's claims", headers, text_columns=len(headers))
    for column in table.columns[2:]:
        column.max_width = len("distinguishable")
    shown = []
    for group in by_claim(findings):
        tested = [finding for finding in group if finding.verdict is not Verdict.NOT_TESTED]
        if not tested:
            continue
        shown += tested
        verdicts = {
            finding.delivery: Text(_verdict(finding), style=_STYLES[finding.verdict])
            for finding in group
        }
        claim = group[0].claim
        words = f"{claim.statement.removesuffix('.')} ({tested[0].scope})"
        cells = (verdicts.get(setting, "") for setting in settings)
        table.add_row(claim.section.split(",")[0], words, *cells)
    notes = [
        f"{setting}: {tally([f for f in findings if f.delivery == setting])}"
        for setting in settings
    ]
    if any(finding.note == WITHIN_MARGIN for finding in shown):
        notes.append("~ the effect may be too small to matter (within the margin)")
    if shown:
        notes.append(f"All intervals behind the verdicts hold at once with {_LEVEL} %.")
        notes.append("claims.md holds effects, intervals and what each claim was tested on.")
    reasons = Counter(f.note for f in findings if f.verdict is Verdict.NOT_TESTED)
    notes += [f"not tested ({times}): {reason}" for reason, times in reasons.most_common(3)]
    return table, "\n".join(notes)


def _verdict(finding: Finding) -> str:
    return finding.verdict.value + (" ~" if finding.note == WITHIN_MARGIN else "")


def _no_claims() -> Section:
    """One line where the world is not the paper's."""
    return _table("", ()), f"The paper's claims: not tested, {OTHER_WORLD}."


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
    table = _table("Baselines", headers, text_columns=2, gap=1)
    for row in baselines:
        figures = (row["return_mean"], row["steps_mean"], row["deliveries_mean"])
        cells = (
            MISSING if figure is None else number(figure, digits)
            for figure, digits in zip(figures, (1, 1, 2), strict=True)
        )
        table.add_row(baseline_name(row), row["setting"], *cells)
    notes = [
        f"{baseline_name(row)}: {row['note']}"
        for row in baselines
        if row["return_mean"] is None and row.get("note")
    ]
    return table, "\n".join(notes)
