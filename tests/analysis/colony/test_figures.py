"""The study's figures show the data."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.container import ErrorbarContainer
from PIL import Image
from synthetic_colony_study import LIMITS, SIZES, build

from taichi_ants.analysis.colony import figures
from taichi_ants.analysis.colony.study import (
    COPIED,
    COPIED_LONG,
    JOINT,
    OFF,
    ON,
    OWN,
    PHEROMONES,
    WAYS,
    ColonyStudy,
)
from taichi_ants.analysis.statistics import bootstrap_interval


@pytest.fixture(scope="module")
def study() -> ColonyStudy:
    return build(
        lambda pheromone, way, ants: 20.0 * ants * (2 if way == JOINT and ants > 1 else 1),
        seeds=6,
        noise=10,
        arenas=("paper", "open"),
    )


def bars(axis: Axes) -> dict[str, ErrorbarContainer]:
    return {bar.get_label(): bar for bar in axis.containers if isinstance(bar, ErrorbarContainer)}


def points(bar: ErrorbarContainer) -> tuple[np.ndarray, np.ndarray]:
    line = bar.lines[0]
    return np.asarray(line.get_xdata()), np.asarray(line.get_ydata())


def ends(bar: ErrorbarContainer) -> np.ndarray:
    return np.array([segment[:, 1] for segment in bar.lines[2][0].get_segments()])


@pytest.mark.parametrize(
    ("make", "measures"),
    [
        (figures.scaling, ("deliveries", "per_ant")),
        (figures.crowding, ("blocked", "first_delivery")),
    ],
)
def test_ways_against_the_number_of_ants(study: ColonyStudy, make, measures) -> None:
    axes = np.array(make(study).axes).reshape(2, 2)
    for row, measure in zip(axes, measures, strict=True):
        for axis, arena in zip(row, study.arenas, strict=True):
            assert list(bars(axis)) == list(WAYS.values())
            values = np.stack([study.values(arena, ON, OWN, n, measure) for n in SIZES])
            x, y = points(bars(axis)[WAYS[OWN]])
            np.testing.assert_allclose(y, values.mean(axis=1))
            np.testing.assert_allclose(x, SIZES, rtol=0.25)  # apart, so that bars do not hide
            np.testing.assert_allclose(
                ends(bars(axis)[WAYS[OWN]]), np.transpose(bootstrap_interval(values))
            )
            assert axis.get_xscale() == "log"
            assert axis.get_yscale() == ("linear" if measure == "blocked" else "log")
    assert [axis.get_title(loc="left") for axis in axes[0]] == ["The paper world", "The open world"]


def test_limits_stand_above_the_data(study: ColonyStudy) -> None:
    total, each = (np.array(figures.scaling(study).axes).reshape(2, 2))[:, 0]
    for axis, per in ((total, 1), (each, 8)):
        (line,) = (line for line in axis.lines if line.get_label() == "limit")
        assert (line.get_xdata()[-1], line.get_ydata()[-1]) == (8, LIMITS.deliveries(8) / per)
    without = figures.scaling(build(limits=None))
    assert not any(line.get_label() == "limit" for axis in without.axes for line in axis.lines)


def test_trails(study: ColonyStudy) -> None:
    axes = np.array(figures.trails(study).axes).reshape(2, 2)
    for row, way in zip(axes, (COPIED, JOINT), strict=True):
        found = bars(row[1])
        assert list(found) == list(PHEROMONES.values())
        means = [study.mean(study.arenas[1], OFF, way, n) for n in SIZES]
        np.testing.assert_allclose(points(found[PHEROMONES[OFF]])[1], means)


def test_ratios_to_copies_lie_on_a_logarithmic_axis(study: ColonyStudy) -> None:
    """A difference can be minus 160 % of what copies deliver, a ratio is never below 0."""
    axis = figures.joint_learning(study).axes[0]
    assert axis.get_yscale() == "log"
    found = bars(axis)
    assert list(found) == [WAYS[way] for way in WAYS if way != COPIED]
    x, y = points(found[WAYS[JOINT]])
    np.testing.assert_allclose(x, SIZES[1:], rtol=0.25)
    np.testing.assert_allclose(y, [2, 2, 2], rtol=0.1)
    arena = study.arenas[0]
    means = [[study.mean(arena, ON, way, n) for n in SIZES[1:]] for way in (JOINT, COPIED)]
    np.testing.assert_allclose(y, np.divide(*means))
    low, high = ends(found[WAYS[JOINT]]).T
    assert (low > 0).all()
    assert ((low < y) & (y < high)).all()
    np.testing.assert_allclose(points(found[WAYS[COPIED_LONG]])[1], [1, 1, 1], rtol=0.1)


def test_intervals_of_ratios() -> None:
    """Worked by hand: equal seeds have one ratio; a resample of copies without any has none."""
    centre, low, high = figures.ratios(np.full((1, 8), 6.0), np.full((1, 8), 4.0))
    assert centre == low == high == 1.5
    proportional = np.arange(1.0, 9.0)[None]
    for value in figures.ratios(3 * proportional, proportional):  # paired by seed
        assert value == pytest.approx(3)
    centre, low, high = figures.ratios(np.array([[4.0, 2.0]]), np.array([[3.0, 0.0]]))
    assert (centre, high) == (2.0, np.inf)
    centre, low, high = figures.ratios(np.array([[4.0]]), np.array([[2.0]]))
    assert centre == 2.0
    assert np.isnan([low, high]).all()


def test_a_way_that_delivers_nothing_is_an_arrow() -> None:
    study = build(lambda pheromone, way, ants: 0.0 if way == OWN else 20.0, noise=0, seeds=3)
    axis = figures.joint_learning(study).axes[0]
    arrows = [line for line in axis.lines if line.get_transform() == axis.get_xaxis_transform()]
    assert [line.get_marker() for line in arrows] == ["v"]
    assert len(arrows[0].get_xdata()) == len(SIZES) - 1


def test_colours_and_markers_differ() -> None:
    for looks in (figures._WAY_LOOKS, figures._PHEROMONE_LOOKS):
        for position in (0, 1):
            assert len({look[position] for look in looks.values()}) == len(looks)


def test_files_are_wide_enough_to_read_and_little_data_can_be_drawn(
    study: ColonyStudy, tmp_path: Path
) -> None:
    paths = figures.save_all(study, tmp_path / "new")
    assert [path.name for path in paths] == [
        *("scaling.png", "crowding.png", "trails.png", "joint_learning.png"),
    ]
    assert {Image.open(path).width for path in paths} == {1620}
    lonely = build(seeds=1, sizes=(1,), ways=(COPIED,), pheromones=(ON,), first=lambda ants: -1)
    assert all(path.exists() for path in figures.save_all(lonely, tmp_path / "lonely"))
    nothing = build(lambda pheromone, way, ants: 0.0, noise=0, reward=lambda *_: 0.0)
    assert all(path.exists() for path in figures.save_all(nothing, tmp_path / "nothing"))
