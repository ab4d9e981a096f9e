"""Figures of the study of colonies, from the rows of conditions.csv."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import TYPE_CHECKING

import colony_findings as study

from taichi_ants.analysis import style
from taichi_ants.analysis.findings import means_in_words
from taichi_ants.analysis.sweeps import draw_lines
from taichi_ants.analysis.tables import sentence
from taichi_ants.measures.finished import COLONY

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Rows = Sequence[study.ConditionRow]


def draw_all(rows: Rows) -> dict[str, Figure]:
    """Return all figures that have rows, by name."""
    drawn = {name: draw(rows) for name, draw in FIGURES.items()}
    return {name: figure for name, figure in drawn.items() if figure is not None}


def _dots(title: str, designs: Sequence[study.Trained], rows: Rows) -> Figure | None:
    panels: dict[str, dict[study.Trained, study.ConditionRow]] = {}
    for row in sorted(rows, key=lambda row: row.condition.ants):
        if row.design in designs:  # larger colonies replace smaller ones
            panels.setdefault(row.condition.world_kind, {})[row.design] = row
    if not panels:
        return None
    across = min(3, len(panels))
    down = -(-len(panels) // across)
    alike = len({one.regime for one in designs}) == 1  # then labels need not name the regime
    names = [study.RULES[one.rules] if alike else one.words for one in designs]
    with style.styled():
        figure = style.new_figure(1.3 + down * (0.9 + 0.28 * len(designs)))
        axes = figure.subplots(down, across, sharey=True, squeeze=False)
        for axis, (world_kind, lines) in zip(axes.flat, panels.items(), strict=False):
            axis.set_title(textwrap.fill(sentence(study.WORLDS[world_kind]), 32), fontsize=9)
            for design, row in lines.items():
                _dot(axis, designs.index(design), row)
            axis.set_xlim(left=0)
        axes[0, 0].set_ylim(len(designs) - 0.5, -0.7)
        for axis in axes[:, 0]:
            axis.set_yticks(range(len(designs)), names)
        for axis in axes.flat[len(panels) :]:
            axis.set_axis_off()
        ants = sorted({row.condition.ants for lines in panels.values() for row in lines.values()})
        sizes = f"{' or '.join(map(str, ants))} {'ant' if ants == [1] else 'ants'}"
        caption = (
            f"{sizes}. {_spread(rows)} Thin line: from the worst to the best seed. Grey: the "
            "bounds of the worlds, from the lowest to the highest; bar: their mean."
        )
        title = f"{title}: {COLONY['deliveries'].label}"
        style.frame(figure, title, textwrap.fill(caption, 120), {})
    return figure


def _dot(axis: Axes, place: int, row: study.ConditionRow) -> None:
    """Draw a mean with its number, interval and range over seeds, and the bounds if known."""
    mean, low, high, *_ = row.estimates["deliveries"]
    colour = style.COLOURS[place % len(style.COLOURS)]
    axis.hlines(place, low, high, color=colour, lw=3)
    axis.plot(mean, place, "o", color=colour)
    axis.hlines(place, *row.ranges["deliveries"], color=colour, lw=0.8)
    axis.hlines(place, *row.ranges["bound"], color=style.GREY, lw=3, alpha=0.5)
    axis.plot(row.estimates["bound"].mean, place, "|", color=style.GREY, ms=12, mew=2)
    axis.annotate(
        f"{mean:.0f}", (mean, place), (0, 5), textcoords="offset points", ha="center", fontsize=8
    )


def _lines(title: str, designs: Sequence[study.Trained], rows: Rows) -> Figure | None:
    measures = "deliveries", "per_ant"
    world_kinds = [
        one for one in study.WORLD_KINDS if any(row.condition.world_kind == one for row in rows)
    ]
    if not world_kinds:
        return None
    with style.styled():
        figure = style.new_figure(5.6)
        shape = len(measures), len(world_kinds)
        axes = figure.subplots(*shape, sharex="col", sharey="row", squeeze=False)
        for line_of_axes, measure in zip(axes, measures, strict=True):
            line_of_axes[0].set_ylabel(textwrap.fill(sentence(COLONY[measure].label), 30))
            points: dict[str, dict[str, list[tuple[float, ...]]]] = {
                world_kind: {one.words: [] for one in designs} for world_kind in world_kinds
            }
            for row in rows:
                if row.condition.world_kind in points and row.design in designs:
                    point = row.condition.ants, *row.estimates[measure][:3]
                    points[row.condition.world_kind][row.design.words].append(point)
            for axis, world_kind in zip(line_of_axes, world_kinds, strict=True):
                draw_lines(axis, points[world_kind], [*points.values()])
        for column, world_kind in zip(axes.T, world_kinds, strict=True):
            column[0].set_title(sentence(study.WORLD_KINDS[world_kind]), fontsize=9)
            column[-1].set_xlabel("Ants")
        style.frame(figure, title, _spread(rows), style.legend_entries(axes.flat))
    return figure


def _spread(rows: Rows) -> str:
    return f"{means_in_words(rows[0].seeds)}. Exploration rate {study.EVALUATION_EPSILON:g}."


def _each(rules: Iterable[str], *regimes: str) -> list[study.Trained]:
    return [study.Trained(one, regime) for one in rules for regime in regimes]


_LEARNED = study.ALONE, study.FEW, study.SOME, study.JOINT
_RISING = study.PAPER, study.A, study.BC, study.ABC, study.QUEUES
_MAIN = study.PAPER, study.ABC, study.QUEUES
FIGURES: dict[str, Callable[[Rows], Figure | None]] = {
    "rules": partial(_dots, "Effect of each rule", _each(study.RULES, study.JOINT)),
    "scaling": partial(_lines, "Deliveries by the number of ants", _each(_RISING, study.JOINT)),
    "training": partial(_dots, "Number of ants in training", _each(_MAIN[:2], *_LEARNED)),
    "elsewhere": partial(
        _dots, "Trained in open worlds, evaluated in others", _each(_MAIN, study.ABROAD)
    ),
}
