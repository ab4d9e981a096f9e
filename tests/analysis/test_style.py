"""Figures look the same whatever matplotlib's settings are, and show names as they are."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib import rc_context

from taichi_ants.analysis import style, sweeps
from taichi_ants.analysis.drawings import drawing

NAMES = ["a$1_$b", "_hidden", "c^2", "$\\frac$", "_child0"]
SETTINGS = [{"rate": rate, "world": name} for rate in (0.1, 0.2) for name in NAMES]
VALUES = np.random.default_rng(0).normal(size=(10, 3))


def figure_of(names):
    with style.styled():
        figure = style.new_figure(2)
        axes = figure.subplots()
        sweeps.draw_lines(axes, {name: [(1, 0, -1, 1), (2, 3, 2, 4)] for name in names})
        style.frame(figure, "Title of $\\frac$", "caption $", style.legend_entries([axes]))
    return figure


@pytest.mark.parametrize(
    "settings",
    [
        {"text.usetex": True},
        {"font.family": "serif", "axes.formatter.limits": (-1, 1), "lines.linestyle": "--"},
        {"font.size": 30, "axes.grid": False, "savefig.bbox": "tight"},
    ],
)
def test_settings_of_the_user_do_not_reach_figures(settings, tmp_path):
    sweeps.draw(tmp_path / "usual.png", SETTINGS, VALUES, "return")
    with rc_context(settings):
        sweeps.draw(tmp_path / "user.png", SETTINGS, VALUES, "return")
        svg = drawing("one", figure_of(["a"]))
    assert (tmp_path / "user.png").read_bytes() == (tmp_path / "usual.png").read_bytes()
    assert svg == drawing("one", figure_of(["a"]))


def test_names_are_text(tmp_path):
    figure = figure_of(NAMES)
    [legend] = figure.legends
    found = [text.get_text().lstrip("\u200b") for text in legend.get_texts()]
    assert found == NAMES
    assert not any(text.get_parse_math() for text in [*legend.get_texts(), legend.get_title()])
    style.save(figure, tmp_path / "a.png")
    svg = drawing("one", figure_of(NAMES)).svg
    assert all(name in svg for name in NAMES)
