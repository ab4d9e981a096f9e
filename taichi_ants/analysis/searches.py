"""Report and figure of a search for the best settings."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants.analysis import designs, style
from taichi_ants.analysis.designs import COLUMNS
from taichi_ants.analysis.statistics import bootstrap_interval
from taichi_ants.analysis.sweeps import Settings, are_numbers, short
from taichi_ants.analysis.tables import MISSING, Table, plain_text, sentence, tally

_WIDTH = 120


def summary(rows: Sequence[Settings], seeds: int, wanted: str, best: int) -> str:
    """Return how the trials ended, and the best one; `wanted` describes it."""
    ends = tally(row["state"] for row in rows)
    return (
        f"{len(rows)} trials of up to {seeds} seeds ({ends}). Trial {best} has the {wanted} of all "
        "complete trials."
    )


def report(
    head: str,
    choices: Sequence[tuple[str, Any, Any]],
    held_out: Mapping[str, np.ndarray],
    measure: str,
    difference: tuple[float, float, float],
    verdict: str,
) -> str:
    """Return the report: best settings against the default, and both with held-out seeds.

    `choices` are names of settings, with their default (None if unknown) and best value. `held_out`
    has each measure of both, float64 (2, seeds), and `difference` that of the deciding `measure`.
    """
    names = [name for name, *_ in choices]
    lines = [[short(name, names), _shown(usual), _shown(best)] for name, usual, best in choices]
    results = []
    for name, array in held_out.items():
        ends = zip(array.mean(axis=1), *bootstrap_interval(array), strict=True)
        results.append([name, *(f"{mean:.4g} [{low:.4g}, {high:.4g}]" for mean, low, high in ends)])
    seeds = next(iter(held_out.values())).shape[1]
    mean, low, high = difference
    end = (
        f"Means over {seeds} held-out seeds with 95 % intervals. Best minus default of {measure}, "
        f"paired by seed: {mean:.4g} [{low:.4g}, {high:.4g}]. Finding: {verdict}."
    )
    blocks: list[str | Table] = [
        head,
        Table("", ["setting", "default", "best"], lines),
        Table("", ["held-out seeds", "default", "best"], results),
        end,
    ]
    return plain_text(blocks, _WIDTH)


def draw(
    path: Path,
    rows: Sequence[Settings],
    names: Sequence[str],
    logarithmic: Container[str],
    measure: tuple[str, str],
    maximises: bool,
) -> None:
    """Draw the history of a search, and its trials against each setting.

    `rows` are those of the table of trials, `names` the settings, `logarithmic` those with such an
    axis, and `measure` the measure's column and words.

    Raises:
        AntsError: The file (.png) cannot be written.
    """
    column, words = measure
    done = [row for row in rows if row["state"] == "complete"]
    pruned = [row for row in rows if row["state"] == "pruned"]
    means = np.array([row[column] for row in done])
    best = np.maximum.accumulate(means) if maximises else np.minimum.accumulate(means)
    lines = -(-len(names) // COLUMNS)
    with style.styled():
        figure = style.new_figure(3.4 + 2.0 * lines)
        heights = [1.3] + [1.0] * lines
        grid = figure.add_gridspec(1 + lines, min(COLUMNS, len(names)), height_ratios=heights)
        history = figure.add_subplot(grid[0, :])
        history.scatter(
            *_places(pruned, column), marker="x", s=14, color=style.GREY, label="Pruned trial"
        )
        history.scatter(*_places(done, column), s=14, color=style.BLUE, label="Complete trial")
        numbers = [*(row["trial"] for row in done), rows[-1]["trial"]]
        history.step(
            numbers, [*best, best[-1]], where="post", color=style.ORANGE, label="Best so far"
        )
        history.set(xlabel="trial", ylabel=words)
        chosen = done[int(np.argmax(means) if maximises else np.argmin(means))]
        for number, name in enumerate(names):
            axes = figure.add_subplot(grid[1 + number // COLUMNS, number % COLUMNS])
            places = [row[name] for row in done]
            if are_numbers(places):
                left_out = [row[name] for row in pruned], [row[column] for row in pruned]
                axes.scatter(*left_out, marker="x", s=14, color=style.GREY, linewidths=0.8)
                axes.scatter(places, means, s=14, color=style.BLUE)
                axes.axvline(chosen[name], color=style.ORANGE, linestyle="--", label="Best setting")
                if name in logarithmic:
                    style.logarithmic(axes.xaxis, (1,))
            else:
                designs.panel(axes, places, means, False)
            axes.set_xlabel(short(name, names))
            if number % COLUMNS == 0:
                axes.set_ylabel(words)
        caption = (
            "Below: the same trials against each setting. A pruned trial has run with fewer seeds."
        )
        title = f"{sentence(words)} of each trial, {'higher' if maximises else 'lower'} is better"
        style.frame(figure, title, caption, style.legend_entries(figure.axes))
    style.save(figure, path)


def _places(rows: Sequence[Settings], column: str) -> tuple[list[float], list[float]]:
    return [row["trial"] for row in rows], [row[column] for row in rows]


def _shown(value: Any) -> str:
    return MISSING if value is None else f"{value:.5g}" if isinstance(value, float) else str(value)
