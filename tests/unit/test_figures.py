"""Figures show the data: what is on their axes, not only that files appear."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from PIL import Image
from synthetic_comparison import build, change, level_truth, subset, unchanged

from taichi_ants.analysis.baselines import GREEDY_SETTING, TRAINING_SETTING
from taichi_ants.analysis.behaviour import BEHAVIOURS, CIRCLES, OTHER
from taichi_ants.analysis.best_of import best_of
from taichi_ants.analysis.comparison import Comparison, Variant
from taichi_ants.analysis.figures import (
    SMOOTHING,
    best_runs,
    learning_curves,
    return_against_deliveries,
    save_all,
)
from taichi_ants.analysis.paper import DYNA_P5, FIGURE_1, SARSA, TABLE_2, VARIANTS
from taichi_ants.analysis.sensitivity import sensitivity
from taichi_ants.analysis.statistics import bootstrap_interval, student_interval
from taichi_ants.analysis.style import BEHAVIOUR_LOOKS, in_training, looks

BASELINES = [
    {
        "baseline": name,
        "setting": setting,
        "discount": discount,
        "return_mean": figure,
        "deliveries_mean": deliveries,
    }
    for name, setting, discount, figure, deliveries in (
        ("shortest delivery", TRAINING_SETTING, None, 45.0, 1.0),
        ("optimal policy", TRAINING_SETTING, 0.9, 45.0, 1.0),
        ("optimal policy", TRAINING_SETTING, 0.99, 476.0, 0.0),
        ("random policy", GREEDY_SETTING, None, -200.0, 0.1),
        ("exact bounds", TRAINING_SETTING, None, None, None),
    )
]


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    amounts = {"late_return": 200, "deliveries": -1, "greedy_deliveries": -1}
    circles = change(DYNA_P5, lambda point: point.discount == 0.99, **amounts)
    return build({"continuing": unchanged, "absorbing": circles}, seeds=6, noise=5.0)


def panels(figure: Figure) -> list[Axes]:
    return [axis for axis in figure.axes if axis.get_visible()]


def labelled(axis: Axes) -> dict[str, Line2D]:
    return {line.get_label(): line for line in axis.lines}


def test_learning_curves_are_moving_averages_over_seeds(comparison: Comparison) -> None:
    axes = np.array(panels(learning_curves(comparison))).reshape(3, 2)
    arrays = (comparison.returns, comparison.steps, comparison.deliveries)
    for row, values in zip(axes, arrays, strict=True):
        for axis, setting in zip(row, ("continuing", "absorbing"), strict=True):
            lines = labelled(axis)
            assert list(lines) == [variant.label for variant in VARIANTS]
            runs = values[comparison.position(setting, SARSA, FIGURE_1)].astype(float)
            smooth = np.array([np.convolve(run, np.full(10, 0.1), "valid") for run in runs])
            np.testing.assert_allclose(lines["SARSA"].get_ydata(), smooth.mean(axis=0))
            assert lines["SARSA"].get_xdata().tolist() == list(range(SMOOTHING, 121))
            low, high = student_interval(smooth.T)
            band = axis.collections[1].get_paths()[0].vertices
            assert band[:, 1].min() == pytest.approx(low.min())
            assert band[:, 1].max() == pytest.approx(high.max())
    assert [axis.get_title(loc="left") for axis in axes[0]] == [
        "Continuing delivery",
        "Absorbing delivery",
    ]
    assert "steps" in axes[1, 0].get_ylabel()
    assert axes[2, 0].get_xlabel() == "Episode"


def test_one_seed_has_lines_without_bands(comparison: Comparison) -> None:
    single = subset(comparison, range(len(comparison.rows)), 1, 5)
    for axis in panels(learning_curves(single)):
        assert len(axis.lines) == 4
        assert not axis.collections
        assert axis.lines[0].get_xdata().tolist() == [1, 2, 3, 4, 5]


def words_of(figure: Figure) -> str:
    return f"{figure.legends[0].get_title().get_text()} {figure.get_supxlabel()}"


def test_without_the_shared_configuration_each_learner_is_shown_at_its_best(
    comparison: Comparison,
) -> None:
    """Already if one learner lacks it; a curve for everyone, and the words name what is shown."""
    rows = [
        number
        for number, row in enumerate(comparison.rows)
        if row.variant != SARSA or row.hyperparameters != FIGURE_1
    ]
    some = subset(comparison, rows, 6, 120)
    figure = learning_curves(some)
    means = some.measure("return_last50").mean(axis=1)
    words = words_of(figure)
    assert "figure 1" not in words
    for axis, setting in zip(panels(figure)[:2], ("continuing", "absorbing"), strict=True):
        assert list(labelled(axis)) == [variant.label for variant in VARIANTS]
        best = max(some.positions(setting, SARSA), key=lambda row: means[row])
        runs = some.returns[best].astype(float).mean(axis=0)
        smooth = np.convolve(runs, np.full(10, 0.1), "valid")
        np.testing.assert_allclose(labelled(axis)["SARSA"].get_ydata(), smooth)
        assert f"{some.rows[best].hyperparameters.label} ({setting})" in words
    assert FIGURE_1.label in words_of(learning_curves(comparison))
    assert "figure 1" not in words_of(learning_curves(replace(comparison, world="garden.txt")))


def test_the_captions_say_only_what_is_true(comparison: Comparison) -> None:
    assert "oving average over 10 episodes" in words_of(learning_curves(comparison))
    short = subset(comparison, range(128), 2, 5)
    assert "average" not in words_of(learning_curves(short))
    words = words_of(return_against_deliveries(comparison, BASELINES))
    assert "do not deliver, continuing delivery: none." in words
    assert "do not deliver, absorbing delivery: Dyna-Q (p5) 48 of 96." in words
    assert "greedily, without evaporation, as in training." in words
    falling = replace(comparison, train_evaporation=True)
    assert "greedily, with evaporation, as in training." in words_of(
        return_against_deliveries(falling)
    )


def test_other_worlds_have_none_of_the_papers_figures(comparison: Comparison) -> None:
    for axis in panels(best_runs(replace(comparison, world="garden.txt"))):
        assert not [line for line in axis.lines if line.get_marker() == "D"]


def test_axes_that_are_not_linear_say_so(comparison: Comparison) -> None:
    negative = replace(comparison, returns=comparison.returns - 500)
    for data, scale in ((comparison, "log"), (negative, "linear")):
        axis = panels(best_runs(data))[0]
        assert axis.get_xscale() == scale
        assert axis.get_xlabel().endswith("logarithmic") == (scale == "log")


def test_bands_of_deliveries_stay_where_means_can_be(comparison: Comparison) -> None:
    varied = replace(comparison, deliveries=comparison.deliveries.copy())
    varied.deliveries[:, ::2, ::3] = 0
    for axis in panels(learning_curves(varied))[4:]:
        for band in axis.collections:
            heights = band.get_paths()[0].vertices[:, 1]
            assert heights.min() >= 0
            assert heights.max() <= 1


def test_sensitivity_shows_every_configuration(comparison: Comparison) -> None:
    figure = sensitivity(comparison, BASELINES)
    axes = panels(figure)
    assert [axis.get_title(loc="left") for axis in axes] == [v.label for v in VARIANTS]
    names = [label.get_text() for label in axes[0].get_yticklabels()]
    assert names[:2] == ["0.001 / 0.9 / 0.3 / 0.99", "0.001 / 0.9 / 0.3 / 0.995"]
    means = comparison.measure("return_last50").mean(axis=1)
    low, high = bootstrap_interval(comparison.measure("return_last50"))
    left, right = axes[0].get_xlim()
    for axis, variant in zip(axes, VARIANTS, strict=True):
        marks = [line for line in axis.lines if line.get_marker() not in ("", "None", None)]
        spans = [c.get_segments() for c in axis.collections if isinstance(c, LineCollection)]
        beyond = []
        for setting, line, segments in zip(("continuing", "absorbing"), marks, spans, strict=True):
            rows = np.array(comparison.positions(setting, variant))
            np.testing.assert_allclose(line.get_xdata(), means[rows].clip(left, right))
            heights = np.rint(line.get_ydata()).astype(int)
            shown = [names[height] for height in heights]
            assert shown == [comparison.rows[row].hyperparameters.label for row in rows]
            near = rows[(left <= means[rows]) & (means[rows] <= right)]
            ends = [(segment[0][0], segment[1][0]) for segment in segments]
            np.testing.assert_allclose(ends, np.transpose([low[near], high[near]]))
            beyond += [f"{means[row]:.0f}" for row in rows if row not in near]
        assert [text.get_text() for text in axis.texts] == beyond
    assert len(axes[3].texts) == 8  # the walkers in circles
    lines = labelled(axes[0])
    assert lines["shortest delivery; optimal policy, discount 0.9 (45)"].get_xdata()[0] == 45
    assert not any("0.99" in name for name in lines)
    continuing = sensitivity(subset(comparison, range(64), 6, 120), BASELINES)
    assert not any("optimal" in name for name in labelled(panels(continuing)[0]))


def test_best_runs_shows_the_distribution_and_the_papers_figures(comparison: Comparison) -> None:
    axes = np.array(panels(best_runs(comparison))).reshape(2, 2)
    for row, setting in zip(axes, ("continuing", "absorbing"), strict=True):
        labels = [label.get_text() for label in row[0].get_yticklabels()]
        for axis, name in zip(row, ("returns", "steps"), strict=True):
            bars = [line for line in axis.lines if len(line.get_xdata()) == 2]
            dots = [line for line in axis.lines if line.get_marker() == "o"]
            paper = [line for line in axis.lines if line.get_marker() == "D"]
            assert len(bars) == len(dots) == len(paper) == 4
            for bar, dot, mark, label in zip(bars, dots, paper, labels, strict=True):
                variant = next(one for one in VARIANTS if one.label == label)
                values = getattr(best_of(comparison, setting, variant), name)
                np.testing.assert_allclose(bar.get_xdata(), np.percentile(values, (2.5, 97.5)))
                assert dot.get_xdata()[0] == np.median(values)
                figures = TABLE_2[variant]
                figure = figures.return_last50 if name == "returns" else figures.steps_all
                assert mark.get_xdata()[0] == figure
                left, right = axis.get_xlim()
                assert left < min(bar.get_xdata()[0], figure)
                assert max(bar.get_xdata()[1], figure) < right


def test_returns_against_deliveries_shows_what_runs_do_and_baselines(
    comparison: Comparison,
) -> None:
    behaviours = comparison.behaviours.copy()
    behaviours[-1, :2], behaviours[3, 4] = CIRCLES, OTHER
    comparison = replace(comparison, behaviours=behaviours)
    axes = panels(return_against_deliveries(comparison, BASELINES))
    returns = comparison.measure("return_last50")
    deliveries = comparison.measure("deliveries_last50")
    for axis, setting in zip(axes, ("continuing", "absorbing"), strict=True):
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
        absorbing = setting == "absorbing"
        name = "shortest delivery; optimal policy, discount 0.9"
        assert (lines[name].get_xdata()[0], lines[name].get_ydata()[0]) == (1.0, 45.0)
        assert any(line.startswith("optimal") for line in lines) == absorbing
        assert lines["delivers"].get_markersize() < lines[name].get_markersize()
        if absorbing:
            assert lines["optimal policy, discount 0.99"].get_ydata()[0] == 476.0
        assert "random policy" not in lines
        assert "exact bounds" not in lines
    # A place has the same mark in all panels.
    shared = labelled(axes[0]).keys() & labelled(axes[1]).keys()
    assert len(shared) > 4
    for name in shared:
        assert labelled(axes[0])[name].get_marker() == labelled(axes[1])[name].get_marker()


def test_baselines_at_one_place_share_a_name() -> None:
    assert in_training(BASELINES, ["return_mean"]) == {
        "shortest delivery; optimal policy, discount 0.9": (45.0,),
        "optimal policy, discount 0.99": (476.0,),
    }


def test_behaviours_look_different() -> None:
    assert len(BEHAVIOUR_LOOKS) == len(BEHAVIOURS)
    for looks_of in zip(*BEHAVIOUR_LOOKS, strict=True):  # colours, and marks without colours
        assert len(set(looks_of)) == len(BEHAVIOURS)


def test_learners_look_different() -> None:
    variants = [*VARIANTS, *(Variant("mine", depth) for depth in range(12))]
    chosen = looks(variants)
    assert len(set(chosen.values())) == len(variants)
    assert looks(variants[:2]) == {variant: chosen[variant] for variant in variants[:2]}
    # Lines have no markers: up to ten learners have colours of their own.
    for compared in (variants[:10], [VARIANTS[2], *variants[4:13]]):
        assert len({colour for colour, _ in looks(compared).values()}) == 10


def test_bands_of_two_seeds_do_not_flatten_the_lines(comparison: Comparison) -> None:
    few = subset(comparison, range(len(comparison.rows)), 2, 60)
    few.returns[:, 0] += 4000  # a band far beyond all lines
    few.steps[:, 0] += 3
    for number, axis in enumerate(panels(learning_curves(few))):
        low, high = axis.get_ylim()
        lines = np.concatenate([line.get_ydata() for line in axis.lines])
        assert low <= lines.min() <= lines.max() <= high
        row = panels(learning_curves(few))[2 * (number // 2) : 2 * (number // 2) + 2]
        both = np.concatenate([line.get_ydata() for other in row for line in other.lines])
        assert high - low <= 1.51 * np.ptp(both) + 2
        for band in axis.collections if number in (2, 3) else ():
            heights = band.get_paths()[0].vertices[:, 1]
            assert 0 <= heights.min() <= heights.max() <= few.max_steps


def test_few_values_are_dots_not_hills(comparison: Comparison) -> None:
    for seeds, hills in ((1, 0), (2, 0), (12, 1)):
        axis = panels(best_runs(subset(comparison, range(len(comparison.rows)), seeds, 60)))[0]
        assert len(axis.collections) == hills * len(VARIANTS), seeds


def test_all_figures_are_files(comparison: Comparison, tmp_path: Path) -> None:
    small = subset(comparison, range(64, 128, 8), 3, 60)
    paths = save_all(small, BASELINES, tmp_path / "new" / "folder")
    assert [path.name for path in paths] == [
        "learning_curves.png",
        "sensitivity.png",
        "best_runs.png",
        "return_against_deliveries.png",
    ]
    for path in paths:
        with Image.open(path) as image:
            assert image.format == "PNG"
            assert image.width == 1620
            assert len(np.unique(np.asarray(image.convert("L")))) > 50


@pytest.mark.parametrize(
    "draw", [learning_curves, sensitivity, best_runs, return_against_deliveries]
)
def test_words_stand_apart(draw: Callable[..., Figure], comparison: Comparison) -> None:
    with_baselines = draw in (sensitivity, return_against_deliveries)
    assert_words_stand_apart(draw(comparison, *([BASELINES] if with_baselines else [])))


def assert_words_stand_apart(figure: Figure) -> None:
    figure.draw_without_rendering()
    whole = figure.bbox.padded(1)
    boxes = {}
    for legend in figure.legends:
        for text in (legend.get_title(), *legend.get_texts()):
            boxes[f"legend {text.get_text()}"] = text.get_window_extent()
    for number, axis in enumerate(panels(figure)):
        texts = [*axis.get_xticklabels(), *axis.get_yticklabels(), axis.xaxis.label]
        texts += [axis.yaxis.label, axis._left_title, *axis.texts]
        for text in texts:
            # Tick labels beyond the limits exist, but are not drawn.
            if text.get_text() and text.get_visible() and _drawn(axis, text):
                place = f"{number} {text.get_text()} {text.get_position()}"
                boxes[place] = text.get_window_extent()
    assert len(boxes) > 20
    for name, box in boxes.items():
        assert whole.x0 <= box.x0, name
        assert box.x1 <= whole.x1, name
        assert whole.y0 <= box.y0, name
        assert box.y1 <= whole.y1, name
    for (one, first), (other, second) in itertools.combinations(boxes.items(), 2):
        assert not first.padded(-1).overlaps(second.padded(-1)), (one, other)


def _drawn(axis: Axes, text) -> bool:
    ticks = [(axis.xaxis, 0, axis.get_xlim()), (axis.yaxis, 1, axis.get_ylim())]
    for side, coordinate, limits in ticks:
        if text in side.get_ticklabels():
            shown = side.get_tick_params().get("labelbottom" if coordinate == 0 else "labelleft")
            low, high = min(limits), max(limits)
            return shown is not False and low <= text.get_position()[coordinate] <= high
    return True


@pytest.mark.parametrize("rows", [[0], [0, 17], list(range(12))])
def test_subsets_and_unknown_learners_are_drawn(rows: list[int], tmp_path: Path) -> None:
    strange = build(
        {"elsewhere": unchanged},
        variants=[Variant("my_learner"), Variant("dyna_q", 9)],
        seeds=2,
        episodes=4,
        truth=level_truth,
    )
    strange.returns[...] -= 75  # no logarithmic axis for negative returns
    paths = save_all(subset(strange, rows, 1 + len(rows) % 2, 4), [], tmp_path)
    assert all(path.stat().st_size > 1000 for path in paths)
