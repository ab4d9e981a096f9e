"""The study in a terminal: the deliveries of all arenas, and the findings."""

from __future__ import annotations

import io
import textwrap
from typing import Any

from taichi_ants.analysis import tables as markdown
from taichi_ants.analysis.colony.findings import Finding
from taichi_ants.analysis.colony.study import PHEROMONES, WAYS, Arena, ColonyStudy

WIDTH = 100


def report_text(study: ColonyStudy, rows: list[dict[str, Any]], findings: list[Finding]) -> str:
    """The report as plain text, `WIDTH` columns wide.

    Args:
        study: The study.
        rows: Its conditions, from `tables.condition_rows`.
        findings: From `findings.find`.
    """
    from rich.console import Console

    text = io.StringIO()
    console = Console(file=text, width=WIDTH, highlight=False, markup=False, color_system=None)
    for arena in study.arenas:
        console.print(_table(arena, [row for row in rows if row["arena"] == arena.name]))
    for question in dict.fromkeys(finding.question for finding in findings):
        text.write(f"\n{question}\n")
        for finding in findings:
            if finding.question == question:
                text.write(_item(finding.sentence))
    text.write(
        "\nThe intervals behind the answers to one question in one kind of world hold at once"
    )
    text.write(" with 95 %.\n")
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines()) + "\n"


def _item(sentence: str) -> str:
    return textwrap.fill(sentence, WIDTH, initial_indent="- ", subsequent_indent="  ") + "\n"


def _table(arena: Arena, rows: list[dict[str, Any]]) -> Any:
    """Mean deliveries per 1000 ticks: conditions down, numbers of ants across."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(
        title=(
            f"{arena.words[0].upper()}{arena.words[1:]}, {markdown.count(arena.seeds, 'seed')}: "
            "deliveries per 1000 ticks"
        ),
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        title_justify="left",
        title_style="bold",
    )
    table.add_column("ants")
    for ants in arena.sizes:
        table.add_column(str(ants), justify="right")
    found = {(row["pheromone"], row["way"], row["ants"]): row for row in rows}
    for pheromone, trails in PHEROMONES.items():
        for way, words in WAYS.items():
            cells = [found.get((pheromone, way, ants)) for ants in arena.sizes]
            if any(cells):
                numbers = (_number(cell["deliveries_mean"] if cell else None) for cell in cells)
                table.add_row(f"{words}; {trails}", *numbers)
    limits = [sum(limit.deliveries(n) for limit in arena.limits) for n in arena.sizes]
    if arena.limits:
        table.add_row("limit", *(_number(limit / len(arena.limits)) for limit in limits))
    return table


def _number(value: float | None) -> str:
    if value is None:
        return markdown.MISSING
    return markdown.number(value, 0 if value >= 100 else 1)
