"""Figures show the data: what is on their axes, not only that files appear."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.markers import CARETLEFT, CARETRIGHT, MarkerStyle
from PIL import Image
from synthetic_comparison import build, change, level_truth, subset, unchanged

from taichi_ants.analysis.behaviour import BEHAVIOURS, CIRCLES, OTHER
from taichi_ants.analysis.bounds.baselines import GREEDY_SETTING, TRAINING_SETTING
from taichi_ants.analysis.paper.best_of import best_of, percentile_of
from taichi_ants.analysis.paper.comparison import Comparison, Hyperparameters, Variant
from taichi_ants.analysis.paper.figures import (
    best_runs,
    learning_curves,
    return_against_deliveries,
    save_all,
)
from taichi_ants.analysis.paper.published import (
    DYNA_P5,
    FACTORS,
    FIGURE_1,
    SARSA,
    TABLE_2,
    VARIANTS,
)
from taichi_ants.analysis.paper.sensitivity import sensitivity
from taichi_ants.analysis.statistics import interquartile_mean
from taichi_ants.analysis.style import BEHAVIOUR_LOOKS, in_training, looks

ARROWS = (CARETLEFT, CARETRIGHT)
BASELINES = [
    {
        "baseline": name,
        "setting": setting,
        "discount": discount,
        "return_mean": figure,
        "steps_mean": None if figure is None else 34.0,
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


def spans(episodes: int) -> list[range]:
    """Runs of episodes, from 0, whose lengths grow evenly on a logarithmic scale."""
    n = round(12 * np.log10(episodes + 1)) + 1
    edges = sorted({round(edge) for edge in np.geomspace(1, episodes + 1, n)})
    return [range(low - 1, high - 1) for low, high in itertools.pairwise(edges)]


def own_line(axis: Axes, place: int = 0) -> Line2D:
    """The line of a panel's learner in one of the delivery settings."""
    lines = [line for line in axis.lines if line.get_label() != "the other learners"]
    return [line for line in lines if len(line.get_xdata()) > 2 or len(axis.lines) < 3][place]


def test_learning_curves_are_interquartile_means_of_growing_spans(comparison: Comparison) -> None:
    axes = np.array(panels(learning_curves(comparison, BASELINES))).reshape(3, 4)
    parts = spans(120)
    assert (parts[0], parts[1], parts[-1][-1]) == (range(1), range(1, 2), 119)
    names = ("returns", "steps", "deliveries")
    for row, name in zip(axes, names, strict=True):
        for axis, variant in zip(row, VARIANTS, strict=True):
            for place, setting in enumerate(("continuing", "absorbing")):
                runs = getattr(comparison, name)[comparison.position(setting, variant, FIGURE_1)]
                means = np.array([runs[:, part].mean(axis=1) for part in parts])
                line = own_line(axis, place)
                middle = means.mean(axis=1) if name == "deliveries" else interquartile_mean(means)
                np.testing.assert_allclose(line.get_ydata(), middle)
                middles = [np.sqrt((part[0] + 1) * (part[-1] + 1)) for part in parts]
                np.testing.assert_allclose(line.get_xdata(), middles)
                if name != "deliveries":
                    band = axis.collections[place].get_paths()[0].vertices
                    low, high = np.percentile(means, (25, 75), axis=1)
                    assert band[:, 1].min() == pytest.approx(low.min())
                    assert band[:, 1].max() == pytest.approx(high.max())
            pale = [line for line in axis.lines if line.get_label() == "the other learners"]
            assert len(pale) == 3  # one for each, so that columns can be compared
            assert axis.get_xscale() == "log"
            assert axis.get_yscale() == ("log" if name == "steps" else "linear")
            shortest = {"returns": [45, 45], "steps": [34, 34]}.get(name)
            label = "shortest delivery: return 45 in 34 steps"
            found = [list(line.get_ydata()) for line in axis.lines if line.get_label() == label]
            assert found == ([shortest] if shortest else [])
    assert [axis.get_title(loc="left") for axis in axes[0]] == [v.label for v in VARIANTS]


def test_the_settings_of_delivery_are_told_apart_without_colour(comparison: Comparison) -> None:
    legend = learning_curves(comparison).legends[0]
    dashes = {
        text.get_text(): line.get_linestyle()
        for text, line in zip(legend.get_texts(), legend.get_lines(), strict=True)
    }
    assert dashes["continuing delivery"] != dashes["absorbing delivery"]


def test_the_caption_says_whose_choice_the_configuration_is(comparison: Comparison) -> None:
    """The paper's figure 1 does not name its hyperparameters."""
    words = words_of(learning_curves(comparison)).replace("\n", " ")
    assert "A point is the mean over a span of episodes; later spans are longer." in words
    assert FIGURE_1.label in words
    assert "does not name them: these are our choice" in words


def test_one_seed_has_lines_without_bands(comparison: Comparison) -> None:
    single = subset(comparison, range(len(comparison.rows)), 1, 5)
    figure = learning_curves(single)
    for axis in panels(figure):
        assert not axis.collections
        np.testing.assert_allclose(axis.get_lines()[0].get_xdata(), [1, 2, 3, 4, 5])
    assert "interquartile" not in words_of(figure)
    assert "1 seed." in words_of(figure)


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
    for place, setting in enumerate(("continuing", "absorbing")):
        best = max(some.positions(setting, SARSA), key=lambda row: means[row])
        parts = np.array([some.returns[best][:, part].mean(axis=1) for part in spans(120)])
        line = own_line(panels(figure)[1], place)
        np.testing.assert_allclose(line.get_ydata(), interquartile_mean(parts))
        assert f"{some.rows[best].hyperparameters.label} ({setting})" in words
    assert "figure 1" not in words_of(learning_curves(replace(comparison, world="garden.txt")))


def test_the_captions_say_only_what_is_true(comparison: Comparison) -> None:
    words = words_of(return_against_deliveries(comparison, BASELINES))
    assert "do not deliver, continuing delivery: none." in words
    assert "do not deliver, absorbing delivery: Dyna-Q (p5) 48 of 96." in words
    assert "greedily, without evaporation, as in training." in words
    falling = replace(comparison, train_evaporation=True)
    assert "greedily, with evaporation, as in training." in words_of(
        return_against_deliveries(falling)
    )


def test_sensitivity_shows_the_effect_of_each_hyperparameter() -> None:
    """A discount of 0.99 adds 200 to Dyna-Q where delivery is the end, and nothing elsewhere."""
    far = change(DYNA_P5, lambda point: point.discount == 0.99, late_return=200)
    comparison = build({"continuing": unchanged, "absorbing": far}, seeds=6, noise=2.0)
    figure = sensitivity(comparison)
    axes = panels(figure)
    titles = [axis.get_title(loc="left") for axis in axes]
    assert titles == ["Learning rate", "Discount", "Epsilon", "Decay of epsilon"]
    assert "from 0.9 to 0.99" in axes[1].get_xlabel()
    names = [label.get_text() for label in axes[0].get_yticklabels()]
    assert names == [variant.label for variant in VARIANTS]
    returns = comparison.measure("return_last50")
    for axis, name in zip(axes, Hyperparameters._fields, strict=True):
        left, right = axis.get_xlim()
        for setting, offset in (("continuing", -0.19), ("absorbing", 0.19)):
            for row, variant in enumerate(VARIANTS):
                pairs = []
                for position in comparison.positions(setting, variant):
                    here = comparison.rows[position].hyperparameters
                    if getattr(here, name) == FACTORS[name][0]:
                        other = here._replace(**{name: FACTORS[name][1]})
                        there = comparison.position(setting, variant, other)
                        pairs.append(returns[there] - returns[position])
                assert len(pairs) == 8
                here = [line for line in axis.lines if np.allclose(line.get_ydata(), row + offset)]
                centre = interquartile_mean(np.mean(pairs, axis=0)[None])[0]
                large = [line for line in here if line.get_marker() in tuple("os^D")]
                dots = next(line for line in here if line.get_marker() == ".").get_xdata()
                small = interquartile_mean(np.array(pairs))
                np.testing.assert_allclose(dots, small[(left <= small) & (small <= right)])
                if left <= centre <= right:
                    assert large[0].get_xdata()[0] == pytest.approx(centre)
                    bar = next(line for line in here if len(line.get_xdata()) == 2)
                    assert bar.get_xdata()[0] <= centre <= bar.get_xdata()[1]
                else:
                    assert not large
                    assert here[-1].get_marker() in ARROWS
    numbers = [text.get_text() for axis in axes for text in axis.texts]
    assert numbers == ["+200"]


def test_intervals_that_leave_the_axis_end_in_arrows(comparison: Comparison) -> None:
    noisy = subset(comparison, range(128), 6, 120)
    noisy.returns[3, :3] += 30
    figure = sensitivity(noisy)
    arrows = []
    for axis in panels(figure):
        left, right = axis.get_xlim()
        for line in axis.lines:
            if line.get_marker() in ARROWS:
                arrows.append(line.get_marker())
                edge = left if line.get_marker() == CARETLEFT else right
                assert list(line.get_xdata()) == [edge]
                look = MarkerStyle(line.get_marker())
                head = look.get_path().transformed(look.get_transform()).vertices[:, 0]
                inwards = head if edge == left else -head
                assert -1e-9 < inwards.min() < inwards.max()  # it lies inside
            elif len(line.get_xdata()) == 2 and line.get_xdata()[0] != line.get_xdata()[1]:
                assert left <= min(line.get_xdata()) <= max(line.get_xdata()) <= right
    assert CARETRIGHT in arrows


def test_without_two_values_there_is_no_effect(comparison: Comparison) -> None:
    alone = subset(comparison, [0, 16], 3, 60)
    figure = sensitivity(alone)
    assert "nothing to compare" in words_of(figure)
    two = subset(comparison, [0, 1], 3, 60)  # they differ in one hyperparameter
    assert [axis.get_title(loc="left") for axis in panels(sensitivity(two))] == ["Decay of epsilon"]


def test_best_runs_shows_the_distribution_and_the_papers_figures(comparison: Comparison) -> None:
    axes = np.array(panels(best_runs(comparison))).reshape(4, 4)
    rows = itertools.product(("continuing", "absorbing"), ("returns", "steps"))
    for row, (setting, name) in zip(axes, rows, strict=True):
        assert setting in row[0].get_ylabel().lower()
        for axis, variant in zip(row, VARIANTS, strict=True):
            values = best_of(comparison, setting, variant)[
                {"returns": "return", "steps": "steps_all"}[name]
            ]
            line = own_line(axis)
            x, y = np.asarray(line.get_xdata())[1:-1], np.asarray(line.get_ydata())[1:-1]
            assert line.get_drawstyle() == "steps-post"  # the few values there are, no hills
            assert x.tolist() == sorted(set(values.tolist()))
            np.testing.assert_allclose(y, [(values <= value).mean() for value in x])
            (mark,) = (line for line in axis.lines if line.get_marker() == "D")
            figures = TABLE_2[variant]
            figure = figures.return_last50 if name == "returns" else figures.steps_all
            assert mark.get_xdata()[0] == figure
            assert mark.get_ydata()[0] == percentile_of(figure, values) / 100
            assert axis.get_xscale() == "linear"
            left, right = axis.get_xlim()
            low, high = np.percentile(values, (2.5, 97.5))
            assert left < min(low, figure) <= max(high, figure) < right


def test_other_worlds_have_none_of_the_papers_figures(comparison: Comparison) -> None:
    for axis in panels(best_runs(replace(comparison, world="garden.txt"))):
        assert not [line for line in axis.lines if line.get_marker() == "D"]
        assert not axis.texts


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
    with_baselines = draw in (learning_curves, return_against_deliveries)
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
