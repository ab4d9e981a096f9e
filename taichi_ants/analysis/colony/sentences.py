"""Small parts of sentences: numbers, numbers of ants, comparisons."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from taichi_ants.analysis.colony.differences import Difference

UNTOLD = "no difference can be told from chance"


def figure(value: float) -> str:
    """A number with about three digits."""
    if not math.isfinite(value):
        return "-"
    digits = 0 if abs(value) >= 99.95 or value == int(value) else 1 if abs(value) >= 9.995 else 2
    text = f"{value:.{digits}f}"
    return text.lstrip("-") if float(text) == 0 else text


def percent(share: float) -> str:
    """A share as a percentage; small ones with a decimal place."""
    digits = 0 if share >= 0.0995 or share == 0 else 1
    return f"{100 * share:.{digits}f} %"


def change(new: float, old: float) -> str:
    """How much a number changed: a percentage, or a factor from 3 on."""
    if old <= 0:
        return "instead of none"
    ratio = new / old
    return f"{figure(ratio)} times as many" if ratio >= 3 else f"{100 * (ratio - 1):+.0f} %"


def ants(number: int) -> str:
    """For example "1 ant", "64 ants"."""
    return f"{number} ant" + ("" if number == 1 else "s")


def listed(sizes: Sequence[int], among: Sequence[int]) -> str:
    """Numbers of ants in words: "2, 8 and 16 ants", or "4 to 64 ants" for three in a row."""
    runs: list[list[int]] = []
    for size in sizes:
        place = list(among).index(size)
        if runs and list(among).index(runs[-1][-1]) == place - 1:
            runs[-1].append(size)
        else:
            runs.append([size])
    words: list[str] = []
    for run in runs:
        words += [f"{run[0]} to {run[-1]}"] if len(run) > 2 else [str(size) for size in run]
    text = words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
    return text + (" ant" if list(sizes) == [1] else " ants")


def comparison(
    first: str,
    second: str,
    judged: Mapping[int, Difference],
    firsts: Mapping[int, float],
    seconds: Mapping[int, float],
) -> str:
    """Who delivers more than whom with how many ants, with the clearest example.

    Args:
        first, second: Who, in the plural.
        judged: First minus second, by number of ants.
        firsts, seconds: Their deliveries per 1000 ticks.
    """
    sizes = list(judged)
    parts: list[str] = []
    for sign, word in ((1, "more"), (-1, "less")):
        those = [n for n in sizes if judged[n].sign == sign]
        if those:
            than = "" if parts else f" than {second}"
            example = _clearest(those, firsts, seconds)
            parts.append(f"{word}{than} {_where(those, sizes)} ({example})")
    same = [n for n in sizes if judged[n].sign == 0]
    if parts:
        rest = f"; with {listed(same, sizes)} {UNTOLD}" if same else ""
        return f"{first} deliver {' and '.join(parts)}{rest}"
    last = sizes[-1]
    where = f"with {ants(last)}" if len(sizes) == 1 else "at any size"
    numbers = f"{figure(firsts[last])} against {figure(seconds[last])} per 1000 ticks"
    return f"between {first} and {second} {UNTOLD} {where} ({numbers} with {last})"


def _where(those: Sequence[int], sizes: Sequence[int]) -> str:
    if len(those) == len(sizes) > 1:
        return f"at every size from {sizes[0]} to {ants(sizes[-1])}"
    return f"with {listed(those, sizes)}"


def _clearest(
    those: Sequence[int], firsts: Mapping[int, float], seconds: Mapping[int, float]
) -> str:
    """The example with the greatest ratio."""
    n = max(those, key=lambda n: abs(math.log((firsts[n] + 1e-9) / (seconds[n] + 1e-9))))
    which = "" if len(those) == 1 else f"clearest with {n}: "
    numbers = f"{figure(firsts[n])} against {figure(seconds[n])} per 1000 ticks"
    return f"{which}{numbers}, {change(firsts[n], seconds[n])}"
