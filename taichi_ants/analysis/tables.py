"""Numbers as text, and tables for terminals and for Markdown."""

from __future__ import annotations

import io
import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from rich.table import Table as RichTable

MISSING = "-"


def number(value: float | None, digits: int = 1) -> str:
    """Return a number with fixed digits, "-" for nan and None; never "-0.0"."""
    if value is None or math.isnan(value):
        return MISSING
    text = f"{value:.{digits}f}"
    return text.lstrip("-") if float(text) == 0 else text


def figure(value: float | None) -> str:
    """Return a number as text with about three digits; "-" if it is None or not finite."""
    if value is None or not math.isfinite(value):
        return MISSING
    whole = abs(value) >= 99.95 or value == int(value)
    return number(value, 0 if whole else 1 if abs(value) >= 9.995 else 2)


def interval(low: float, high: float, digits: int = 1) -> str:
    """Return an interval as "[low, high]", "-" if an end is nan."""
    if math.isnan(low) or math.isnan(high):
        return MISSING
    return f"[{number(low, digits)}, {number(high, digits)}]"


def percent(share: float) -> str:
    """Return a share as a percentage, small ones with a decimal place, "-" for nan."""
    if math.isnan(share):
        return MISSING
    return f"{100 * share:.{0 if share >= 0.0995 or share == 0 else 1}f} %"


def thousands(number_of: int) -> str:
    """Return a large count in the form "12 800"."""
    return f"{number_of:,}".replace(",", " ")


def tally(words: Iterable[str]) -> str:
    """Return how often each word occurs, the most frequent first, for example "3 yes, 1 no"."""
    return ", ".join(f"{n} {word}" for word, n in Counter(words).most_common())


def sentence(words: str) -> str:
    """Return text with its first letter in upper case."""
    return words[:1].upper() + words[1:]


@dataclass(frozen=True)
class Table:
    """A table of text with notes below it; headers and cells may have several lines.

    The first `text_columns` columns are aligned left, the others right.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    notes: Sequence[str] = ()
    text_columns: int = 1

    def markdown(self) -> str:
        """Return title, table and notes as Markdown, a row of the table on each line."""
        left = self.text_columns
        rule = [*["---"] * left, *["---:"] * (len(self.columns) - left)]
        lines = [
            f"| {' | '.join('<br>'.join(cell.splitlines()) for cell in cells)} |"
            for cells in (self.columns, rule, *self.rows)
        ]
        parts = [f"**{self.title}**\n"] if self.title else []
        parts += ["\n".join(lines) + "\n"] if self.rows else []
        parts += ["  \n".join(self.notes) + "\n"] if self.notes else []  # two blanks break a line
        return "\n".join(parts)


# A paragraph or a table.
Block = str | Table


def plain_text(blocks: Sequence[Block], width: int) -> str:
    """Return blocks as plain text of at most `width` columns, with empty lines between them."""
    from rich.console import Console

    text = io.StringIO()
    console = Console(file=text, width=width, highlight=False, markup=False, color_system=None)
    for block in blocks:
        table = Table("", (), (), [block]) if isinstance(block, str) else block
        if table.rows:
            console.print(_drawn(table))
        if table.notes:
            console.print("\n".join(table.notes))
        if table.rows or table.notes:
            console.print()
    return "".join(f"{line.rstrip()}\n" for line in text.getvalue().rstrip().splitlines())


def _drawn(table: Table) -> RichTable:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table as RichTable

    drawn = RichTable(
        title=table.title, title_justify="left", box=SIMPLE_HEAD, show_edge=False, padding=0
    )
    for position, header in enumerate(table.columns):
        justify: Literal["left", "right"] = "left" if position < table.text_columns else "right"
        # Without this, rich may break the name of a learner within a word.
        least = len("Q-learning") if header == "Learner" else None
        drawn.add_column(header, justify=justify, overflow="fold", min_width=least)
    for row in table.rows:
        drawn.add_row(*row)
    return drawn
