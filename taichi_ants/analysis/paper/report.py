"""The comparison in a terminal: the paper's table 2 beside ours, and what became of its claims.

A learner without the paper's configuration, or in another world, is shown at its best one.
"""

from __future__ import annotations

import io
import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import IO, TYPE_CHECKING, Literal

import numpy as np

from taichi_ants.analysis.behaviour import BEHAVIOURS, DEFINITIONS, MIXED, counts, mixture
from taichi_ants.analysis.claims.assess import OTHER_WORLD, SIMULTANEOUS_LEVEL
from taichi_ants.analysis.claims.model import WITHIN_MARGIN, Finding, Verdict
from taichi_ants.analysis.claims.tables import by_claim, tally
from taichi_ants.analysis.paper.best_of import Choice, Chosen, choice
from taichi_ants.analysis.paper.comparison import Comparison, Variant
from taichi_ants.analysis.paper.measures import MEASURES
from taichi_ants.analysis.paper.published import GREEDY_RETURN, GREEDY_STEPS, VARIANTS
from taichi_ants.analysis.paper.summary import mean_returns
from taichi_ants.analysis.paper.table2 import APART, apart, means, nearer_steps
from taichi_ants.analysis.statistics import centres
from taichi_ants.analysis.tables import MISSING, baseline_name, count, interval, number

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

# Delivery setting and learner -> the configuration that is shown.
Choices = Mapping[tuple[str, Variant], Choice]
# A table and the lines below it.
Section = tuple["Table", str]

# Columns where the output is no terminal: what the narrowest common terminal shows.
WIDTH = 79

# Below, the report warns that means have too few seeds; what intervals cover is measured in
# docs/statistics.md.
FEW_SEEDS = 50

_LEVEL = round(100 * SIMULTANEOUS_LEVEL)
_GREEDY = {"greedy_return": 1, "greedy_steps": 1, "greedy_deliveries": 2}  # measure -> digits
_STYLES = {
    Verdict.SUPPORTED: "green",
    Verdict.CONTRADICTED: "red",
    Verdict.EQUIVALENT: "cyan",
    Verdict.UNDECIDED: "yellow",
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
    """Prints the report: in colours and as wide as the terminal, or as `render` has it elsewhere.

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
    if console.is_terminal:
        console.width = max(console.width, WIDTH)  # a narrower one breaks lines, but no number
        _print(console, comparison, lines, findings, baselines, costs)
    else:
        print(render(comparison, lines, findings, baselines, costs), end="", file=file)


def render(
    comparison: Comparison,
    lines: Sequence[Mapping],
    findings: Sequence[Finding],
    baselines: Sequence[Mapping] = (),
    costs: Sequence[Mapping] = (),
) -> str:
    """The report as plain text of at most `WIDTH` columns; arguments as for `print_report`."""
    from rich.console import Console

    text = io.StringIO()
    console = Console(file=text, highlight=False, markup=False, width=WIDTH, color_system=None)
    _print(console, comparison, lines, findings, baselines, costs)
    return "".join(f"{line.rstrip()}\n" for line in text.getvalue().splitlines())


def _print(
    console: Console,
    comparison: Comparison,
    lines: Sequence[Mapping],
    findings: Sequence[Finding],
    baselines: Sequence[Mapping],
    costs: Sequence[Mapping],
) -> None:
    console.print(f"World: {comparison.world}.")
    console.print(
        f"{count(len(comparison.rows), 'configuration')}, {count(len(comparison.seeds), 'seed')}, "
        f"{count(comparison.episodes, 'episode')} of at most {comparison.max_steps} steps, "
        f"{count(comparison.rollouts, 'greedy rollout')} a run."
    )
    console.print(comparison.conditions)
    choices = {
        (setting, variant): chosen
        for setting in comparison.delivery_settings
        for variant in comparison.variants
        if (chosen := choice(comparison, setting, variant)) is not None
    }
    sections = (
        *_table2(comparison, lines, choices),
        _greedy(comparison, choices),
        *_behaviours(comparison, choices),
        _claims(findings) if comparison.in_paper_world else _no_claims(),
        _costs(costs),
        _baselines(baselines),
    )
    for table, notes in sections:
        if table.row_count or notes:
            console.print()
        if table.row_count:
            console.print(table)
        if notes:
            console.print(notes)


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
        least = len("Q-learning") if column == "Learner" else None  # no name breaks within a word
        table.add_column(column, justify=justify, overflow="fold", min_width=least)
    return table


def _table2(comparison: Comparison, lines: Sequence[Mapping], choices: Choices) -> list[Section]:
    """Two tables for each delivery setting, returns and steps, explained after the last."""
    of_paper, late = comparison.in_paper_world, comparison.late
    headers: tuple[str, ...] = ("Learner", "Return\npaper", "mean", "IQM", "best run", "below")
    headers += ("Food\npaper", "mean")
    steps_headers: tuple[str, ...] = ("Learner", "Steps\npaper", "all\nmean", "IQM")
    steps_headers += (f"{late}\nmean", "IQM")
    if not of_paper:
        headers = ("Learner", "Return\nmean", "IQM", "best run", "Deliveries")
        steps_headers = tuple(name for name in steps_headers if "paper" not in name)
    name = "Table 2" if of_paper else "Training"
    tables = []
    for setting in dict.fromkeys(line["delivery"] for line in lines):
        title = f"{name}, {setting} delivery"
        returns = _table(f"{title}: {late} episodes", headers, gap=1)
        steps = _table(f"{title}: steps of an episode", steps_headers, gap=1)
        tables += [returns, steps]
        for line in lines:
            variant = Variant(line["learner"], line["planning_steps"])
            chosen = choices.get((setting, variant))
            if line["delivery"] == setting and chosen is not None:
                cells = _table2_cells(comparison, line, chosen)
                for table, figures in zip((returns, steps), cells, strict=True):
                    shown = (
                        text for name, text in figures.items() if of_paper or "paper" not in name
                    )
                    table.add_row(_marked(comparison, variant, chosen), *shown)
    notes = _table2_notes(comparison, lines, choices) + _mixed_note(comparison, choices)
    return [(table, notes if table is tables[-1] else "") for table in tables]


def _table2_cells(
    comparison: Comparison, line: Mapping, chosen: Choice
) -> tuple[dict[str, str], dict[str, str]]:
    """The cells of returns and of steps; those of the paper are named so."""
    ours = means(comparison, "ours", chosen.position, chosen.seeds)
    returns = {
        "paper": number(line["paper_return"]),
        "mean": _centre(ours, "ours_return"),
        "IQM": _with_range(ours, "ours_return", "iqm", "iqm_ci_low", "iqm_ci_high"),
        "best run": _with_range(line, "best_run_return", "median", "low", "high"),
        "below paper": _percent(line["best_run_return_paper_percentile"]),
        "deliveries, paper": number(line["paper_deliveries"], 2),
        "deliveries": number(ours["ours_deliveries_mean"], 2),
    }
    steps = {"paper": number(line["paper_steps"])}
    for name in ("ours_steps_all", "ours_steps_last50"):
        steps[name] = _centre(ours, name)
        steps[f"{name}_iqm"] = _with_range(ours, name, "iqm", "iqm_ci_low", "iqm_ci_high")
    return returns, steps


def _table2_notes(comparison: Comparison, lines: Sequence[Mapping], choices: Choices) -> str:
    of_paper, seeds = comparison.in_paper_world, len(comparison.seeds)
    whose = "at the paper's configuration, " if of_paper else ""
    notes = [
        f"mean, IQM: over seeds, {whose}intervals at 95 %",
        "IQM: interquartile mean, of the middle half of the runs: the typical run",
        f"{APART} the mean lies outside of the IQM's interval: a few far runs have moved it",
        "best run: best by return of all configurations, one run each: median [95 %]",
    ]
    if of_paper:
        notes += [
            "below: percentage of these below the paper's figure",
            f"food: deliveries per episode, {comparison.late}",
            f"steps: {nearer_steps(lines)}",
        ]
    if 1 < seeds < FEW_SEEDS:
        notes += [
            f"Few seeds ({seeds}): where one run in a hundred is far off, the interval of the mean",
            "misses it more often than not. The IQM's holds from 10 seeds on (docs/statistics.md).",
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


def _marked(comparison: Comparison, variant: Variant, *chosen: Choice | None) -> str:
    """The learner's name, with a star if a configuration is not the paper's, a + if it is mixed."""
    star = any(one is not None and one.why is not Chosen.PAPER for one in chosen)
    plus = any(_mixed(comparison, one) for one in chosen)
    return variant.label + (" *" if star else "") + (" +" if plus else "")


def _mixed(comparison: Comparison, chosen: Choice | None) -> bool:
    """Whether the runs that are shown do different things."""
    return chosen is not None and bool(
        mixture(comparison.behaviours[chosen.position, chosen.seeds])
    )


def _mixed_note(comparison: Comparison, choices: Choices) -> str:
    mixed = any(_mixed(comparison, chosen) for chosen in choices.values())
    return f"\n+ {MIXED}: see what the ants do" if mixed else ""


def _centre(line: Mapping, stem: str) -> str:
    """A mean with its interval, marked where the IQM's excludes it."""
    text = _with_range(line, stem, "mean", "ci_low", "ci_high")
    first, *rest = text.split("\n")
    return "\n".join([f"{first} {APART}" if apart(line, f"{stem}_") else first, *rest])


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
    headers = ("Learner", "Delivery", "Return\nmean", "IQM", "Steps\nmean", "IQM", "Food\nmean")
    table = _table("Greedy evaluation", headers, text_columns=2, gap=1)
    order = _order(comparison)
    settings = list(comparison.delivery_settings)
    # Learners in the order of the tables above.
    places = sorted(choices, key=lambda place: (order(place[1]), settings.index(place[0])))
    for setting, variant in places if comparison.rollouts else ():
        chosen = choices[setting, variant]
        cells = []
        for measure, digits in _GREEDY.items():
            values = comparison.measure(measure)[[chosen.position], chosen.seeds]
            columns = centres(values, MEASURES[measure].typical)
            line = {name: float(column[0]) for name, column in columns.items()}
            off = MEASURES[measure].typical and apart(line)
            cells.append(number(line["mean"], digits) + (f" {APART}" if off else ""))
            if MEASURES[measure].typical:
                cells.append(number(line["iqm"], digits))
        table.add_row(_marked(comparison, variant, chosen), setting, *cells)
    if not table.row_count:
        return table, ""
    notes = "Configurations and seeds as in the tables above."
    if comparison.in_paper_world:
        low, high = GREEDY_STEPS
        notes += f"\nThe paper: about {GREEDY_RETURN:g} reward in {low:g} to {high:g} steps."
    return table, notes + _mixed_note(comparison, choices)


def _behaviours(comparison: Comparison, choices: Choices) -> list[Section]:
    """What the final policies do, one table for each delivery setting, explained after the last."""
    headers = ("Learner", "Behaviour", "Runs", "Return\ntraining", "followed", "greedy", "All")
    tables = []
    for setting in comparison.delivery_settings:
        title = f"What the ants do, {setting} delivery"
        tables.append(_table(title, headers, text_columns=2, gap=1))
        for variant in sorted(comparison.variants, key=_order(comparison)):
            chosen = choices.get((setting, variant))
            if chosen is None:
                continue
            label = _marked(comparison, variant, chosen)
            positions = comparison.positions(setting, variant)
            for code, number_of in counts(comparison.behaviours[positions]).items():
                cells = _behaviour_cells(comparison, chosen, code)
                tables[-1].add_row(label, BEHAVIOURS[code], *cells, str(number_of))
                label = ""
    notes = (
        f"Each policy is followed greedily once, {comparison.as_trained}.",
        *(f"{BEHAVIOURS[code]}: {DEFINITIONS[code]}" for code in counts(comparison.behaviours)),
        "An episode without delivery is told by its second half.",
        "runs and their mean returns: configurations and seeds as in the tables above",
        f"training: {comparison.late} episodes; followed: the episode that tells the behaviour",
        "greedy: the greedy evaluation above; all: runs in all configurations",
    )
    return [(table, "\n".join(notes) if table is tables[-1] else "") for table in tables]


def _behaviour_cells(comparison: Comparison, chosen: Choice, code: int) -> list[str]:
    """How many of the runs that are shown behave so, and what these return."""
    shown = np.arange(len(comparison.seeds))[chosen.seeds]
    alike = shown[comparison.behaviours[chosen.position, shown] == code]
    if not alike.size:
        return ["0", *[MISSING] * 3]
    means = mean_returns(comparison, chosen.position, alike)
    names = ("return_last50_mean", "policy_return_mean", "greedy_return_mean")
    return [str(alike.size), *(number(means[name]) for name in names)]


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
        column.max_width = len("mean: contradicted")
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
    if any(finding.verdict is Verdict.EQUIVALENT for finding in shown):
        notes.append("equivalent: what the claim says differs, differs by less than matters")
    if any(finding.note == WITHIN_MARGIN for finding in shown):
        notes.append("~ the effect may be too small to matter (within the margin)")
    if any(finding.disagrees for finding in shown):
        notes.append("mean: the verdict by the mean, where it is not that on the typical run (IQM)")
    if shown:
        notes.append(
            f"All intervals behind the verdicts hold at once with {_LEVEL} % (docs/statistics.md)."
        )
        notes.append("claims.md holds effects, intervals and what each claim was tested on.")
    return table, "\n".join([*notes, *_untested(findings)])


def _untested(findings: Sequence[Finding]) -> list[str]:
    """Why claims were not tested, the three most frequent reasons and a count of the others."""
    reasons = Counter(f.note for f in findings if f.verdict is Verdict.NOT_TESTED)
    settings = {finding.delivery for finding in findings}
    notes = ["Why not tested, both settings together:"] if reasons and len(settings) > 1 else []
    notes += [f"not tested ({times}): {reason}" for reason, times in reasons.most_common(3)]
    others = [times for _, times in reasons.most_common()[3:]]
    if others:
        notes.append(
            f"not tested ({sum(others)}): {count(len(others), 'other reason')}, see claims.md"
        )
    return notes


def _verdict(finding: Finding) -> str:
    text = finding.verdict.value + (" ~" if finding.note == WITHIN_MARGIN else "")
    if finding.by_mean is not None and finding.disagrees:
        text += f"\nmean: {finding.by_mean.verdict.value}"
    return text


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
