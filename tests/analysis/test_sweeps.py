"""What tables and figures of sweeps show."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from taichi_ants.analysis import style, sweeps

VALUES = np.random.default_rng(0).normal(size=(24, 10))


@pytest.fixture
def drawn(monkeypatch):
    """Draws 3 places by 8 lines, and returns the axes."""
    figures = []
    monkeypatch.setattr(style, "save", lambda figure, path: figures.append(figure))

    def axes(places):
        settings = [{"a.x": place, "a.y": line} for place in places for line in range(8)]
        sweeps.draw(Path("none.png"), settings, VALUES, "words")
        return figures[0].axes[0]

    return axes


def test_eight_lines_look_different(drawn):
    lines = drawn([1, 2, 5]).get_lines()
    assert {line.get_linestyle() for line in lines} == {"-"}
    assert len({(line.get_color(), line.get_marker()) for line in lines}) == 8
    assert list(lines[0].get_xdata()) == [1, 2, 5]


def test_names_are_not_joined_and_their_points_stand_apart(drawn):
    axes = drawn(["paper", "open", "large"])
    lines = axes.get_lines()
    assert {line.get_linestyle() for line in lines} == {"None"}
    assert len({x for line in lines for x in line.get_xdata()}) == 3 * 8
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["paper", "open", "large"]


@pytest.mark.parametrize(("factor", "scale"), [(2, "linear"), (100, "log")])
def test_axes_are_logarithmic_where_numbers_lie_far_apart(factor, scale):
    axes = Figure().subplots()
    points = [(place, place, place, place) for place in (1, factor)]
    sweeps.draw_lines(axes, {"line": points, "without points": []})
    assert (axes.get_xscale(), axes.get_yscale()) == (scale, scale)


@pytest.mark.parametrize(("seeds", "few"), [(1, False), (2, True), (9, True), (10, False)])
def test_intervals_of_few_seeds_are_warned_of(seeds, few):
    report = sweeps.report([{"a.x": 1}], {"deliveries": VALUES[:1, :seeds]})
    assert ("too few" in " ".join(report.split())) == few


@pytest.mark.parametrize("zero", [0, 1, 2])
def test_zeros_are_not_on_a_logarithmic_axis(zero):
    high = {"line": [(1, 5, 4, 6), (2, 500, 400, 600)]}
    low = {"line": [(1, *(0 if n == zero else 7 for n in range(3)))]}
    for lines, shared in ((high, [high, low]), ({**high, "other": low["line"]}, [])):
        axes = Figure().subplots()
        sweeps.draw_lines(axes, lines, shared)
        assert axes.get_yscale() == "linear"
