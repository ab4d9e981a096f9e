"""Numbers and tables as text."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

MISSING = "-"


def number(value: float, digits: int = 1) -> str:
    """A number with fixed digits, "-" for nan; never "-0.0"."""
    if math.isnan(value):
        return MISSING
    text = f"{value:.{digits}f}"
    return text.lstrip("-") if float(text) == 0 else text


def interval(low: float, high: float, digits: int = 1) -> str:
    """An interval as "[low, high]", "-" where an end is nan."""
    if math.isnan(low) or math.isnan(high):
        return MISSING
    return f"[{number(low, digits)}, {number(high, digits)}]"


def table(headers: Sequence[str], lines: Sequence[Sequence[str]], text_columns: int = 1) -> str:
    """A Markdown table; the first `text_columns` columns to the left, the others to the right."""
    rule = ["---" if column < text_columns else "---:" for column in range(len(headers))]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (headers, rule, *lines)) + "\n"


def count(number_of: int, noun: str) -> str:
    """How many of something: "1 seed", "2 seeds", "3 deliveries"."""
    if number_of == 1:
        return f"1 {noun}"
    return f"{number_of} {noun[:-1]}ies" if noun.endswith("y") else f"{number_of} {noun}s"


def baseline_name(row: Mapping) -> str:
    """A row of baselines.csv by name, for example "optimal policy, discount 0.9"."""
    discount = row["discount"]
    return row["baseline"] + ("" if discount is None else f", discount {discount:g}")
