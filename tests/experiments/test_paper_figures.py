"""Figures show the data: what is on their axes, not only that files appear."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from paper.baselines import Baseline
from paper.comparison import DYNA_P5, FIGURE_1, VARIANTS
from paper.figures import BEHAVIOUR_LOOKS, learning_curves, return_against_deliveries
from synthetic_comparison import Made, build, change, unchanged

from taichi_ants.analysis.behaviour import BEHAVIOURS, CIRCLES, OTHER
from taichi_ants.analysis.statistics import interquartile_mean

SETTINGS = ("truncates", "terminates")
BASELINES = [
    Baseline(name, discount, figure, None if figure is None else 34.0, deliveries)
    for name, discount, figure, deliveries in (
        ("shortest delivery", None, 45.0, 1.0),
        ("optimal policy", 0.9, 45.0, 1.0),
        ("optimal policy", 0.99, 476.0, 0.0),
        ("random policy", None, -200.0, 0.1),
        ("exact bounds", None, None, None),
    )
]


@pytest.fixture(scope="module")
def comparison() -> Made:
    amounts = {"late_return": 200, "deliveries": -1, "greedy_deliveries": -1}
    circles = change(DYNA_P5, lambda point: point.discount == 0.99, **amounts)
    return build({"truncates": unchanged, "terminates": circles}, seeds=6, noise=5.0)


def panels(figure: Figure) -> list[Axes]:
    return [axis for axis in figure.axes if axis.get_visible()]


def labelled(axis: Axes) -> dict[str, Line2D]:
    return {line.get_label(): line for line in axis.lines}


def spans(episodes: int) -> list[range]:
    """Runs of episodes, from 0, whose lengths grow evenly on a logarithmic scale."""
    n = round(12 * np.log10(episodes + 1)) + 1
    edges = sorted({round(edge) for edge in np.geomspace(1, episodes + 1, n)})
    return [range(low - 1, high - 1) for low, high in itertools.pairwise(edges)]


def words_of(figure: Figure) -> str:
    return f"{figure.legends[0].get_title().get_text()} {figure.get_supxlabel()}"


def test_learning_curves_are_interquartile_means_of_growing_spans(comparison: Made) -> None:
    figure = learning_curves(comparison, BASELINES)
    axes = np.array(panels(figure)).reshape(3, 2)
    parts = spans(120)
    assert (parts[0], parts[1], parts[-1][-1]) == (range(1), range(1, 2), 119)
    names = ("returns", "steps", "deliveries")
    for row, name in zip(axes, names, strict=True):
        for axis, setting in zip(row, SETTINGS, strict=True):
            for place, variant in enumerate(VARIANTS):
                runs = comparison.arrays[name][comparison.position(setting, variant, FIGURE_1)]
                means = np.array([runs[:, part].mean(axis=1) for part in parts])
                line = labelled(axis)[variant.label]
                middle = means.mean(axis=1) if name == "deliveries" else interquartile_mean(means)
                np.testing.assert_allclose(line.get_ydata(), middle)
                middles = [np.sqrt((part[0] + 1) * (part[-1] + 1)) for part in parts]
                np.testing.assert_allclose(line.get_xdata(), middles)
                if name != "deliveries":
                    band = axis.collections[place].get_paths()[0].vertices
                    low, high = np.percentile(means, (25, 75), axis=1)
                    assert band[:, 1].min() == pytest.approx(low.min())
                    assert band[:, 1].max() == pytest.approx(high.max())
            assert axis.get_xscale() == "log"
            assert axis.get_yscale() == ("log" if name == "steps" else "linear")
            shortest = {"returns": [45, 45], "steps": [34, 34]}.get(name)
            found = labelled(axis).get("shortest delivery")
            assert (list(found.get_ydata()) if found else None) == shortest
    titles = [axis.get_title(loc="left") for axis in axes[0]]
    assert titles == ["Delivery truncates", "Delivery terminates"]
    words = " ".join(words_of(figure).split())
    assert "the learning rate is 0.01, the discount 0.9, epsilon 0.3 and its decay 0.995" in words


def test_returns_against_deliveries_shows_what_runs_do_and_baselines(comparison: Made) -> None:
    behaviours = comparison.behaviours.copy()
    behaviours[-1, :2], behaviours[3, 4] = CIRCLES, OTHER
    comparison = replace(comparison, behaviours=behaviours)
    axes = panels(return_against_deliveries(comparison, BASELINES))
    returns = comparison.measures["return_last50"]
    deliveries = comparison.measures["deliveries_last50"]
    for axis, setting in zip(axes, SETTINGS, strict=True):
        lines = labelled(axis)
        of_setting = np.array([row.delivery == setting for row in comparison.rows])[:, None]
        for code, name in enumerate(BEHAVIOURS):
            marks, runs = lines[name], of_setting & (behaviours == code)
            # One mark for each run, and none for a mean over runs.
            assert sorted(zip(*marks.get_data(), strict=True)) == sorted(
                zip(deliveries[runs], returns[runs], strict=True)
            )
            assert (marks.get_color(), marks.get_marker()) == BEHAVIOUR_LOOKS[code]
        # Optimal policies are optimal where delivery is the end.
        optimal = {name for name in lines if name.startswith("optimal")}
        both = {"optimal policy, discount 0.9", "optimal policy, discount 0.99"}
        assert optimal == (both if setting == "terminates" else set())
        shortest = lines["shortest delivery"]
        assert (shortest.get_xdata()[0], shortest.get_ydata()[0]) == (1.0, 45.0)
        assert lines["delivers"].get_markersize() < shortest.get_markersize()
        assert lines["random policy"].get_ydata()[0] == -200.0
        assert "exact bounds" not in lines
    # A baseline has the same mark in all panels.
    shared = labelled(axes[0]).keys() & labelled(axes[1]).keys()
    for name in shared:
        assert labelled(axes[0])[name].get_marker() == labelled(axes[1])[name].get_marker()
