"""The study's figures show the data."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.container import ErrorbarContainer
from PIL import Image
from synthetic_colony_study import LIMITS, SIZES, build

from taichi_ants.analysis.colony import figures
from taichi_ants.analysis.colony.study import COPIED, JOINT, OFF, ON, OWN, RULES, WAYS
from taichi_ants.analysis.colony.tables import condition_rows

ARENAS = ("paper", "open")


@pytest.fixture(scope="module")
def rows() -> list[dict[str, Any]]:
    study = build(
        lambda rules, way, ants: 20.0 * ants * (2 if way == JOINT and ants > 1 else 1),
        seeds=6,
        noise=10,
        arenas=ARENAS,
    )
    return condition_rows(study, LIMITS)


def column(rows: list, name: str, arena: str, rules: str, way: str) -> list[float]:
    return [r[name] for r in rows if (r["arena"], r["rules"], r["way"]) == (arena, rules, way)]


def bars(axis: Axes) -> dict[str, ErrorbarContainer]:
    return {bar.get_label(): bar for bar in axis.containers if isinstance(bar, ErrorbarContainer)}


def points(bar: ErrorbarContainer) -> tuple[np.ndarray, np.ndarray]:
    line = bar.lines[0]
    return np.asarray(line.get_xdata()), np.asarray(line.get_ydata())


@pytest.mark.parametrize(
    ("name", "measures"),
    [
        ("scaling", ("deliveries", "per_ant")),
        ("crowding", ("blocked", "first_delivery")),
    ],
)
def test_ways_against_the_number_of_ants(rows, name, measures) -> None:
    axes = np.array(figures.draw(name, rows).axes).reshape(2, 2)
    for row, measure in zip(axes, measures, strict=True):
        for axis, arena in zip(row, ARENAS, strict=True):
            assert list(bars(axis)) == list(WAYS.values())
            bar = bars(axis)[WAYS[OWN]]
            x, y = points(bar)
            np.testing.assert_allclose(y, column(rows, f"{measure}_mean", arena, ON, OWN))
            np.testing.assert_allclose(x, SIZES, rtol=0.25)  # apart, so that bars do not hide
            ends = np.array([segment[:, 1] for segment in bar.lines[2][0].get_segments()])
            np.testing.assert_allclose(
                ends.T,
                [column(rows, f"{measure}_ci_{end}", arena, ON, OWN) for end in ("low", "high")],
            )
            assert axis.get_xscale() == "log"
            assert axis.get_yscale() == ("linear" if measure == "blocked" else "log")
    titles = [axis.get_title(loc="left") for axis in axes[0]]
    assert titles == ["The paper's world", "Open worlds (30, 30, 30)"]


def test_limits_stand_above_the_data(rows) -> None:
    total, each = (np.array(figures.draw("scaling", rows).axes).reshape(2, 2))[:, 0]
    for axis, per in ((total, 1), (each, 8)):
        (line,) = (line for line in axis.lines if line.get_label() == "limit")
        assert (line.get_xdata()[-1], line.get_ydata()[-1]) == (8, 200 / per)


def test_trails(rows) -> None:
    axes = np.array(figures.draw("trails", rows).axes).reshape(2, 2)
    for row, way in zip(axes, (COPIED, JOINT), strict=True):
        found = bars(row[1])
        assert list(found) == list(RULES.values())
        means = column(rows, "deliveries_mean", "open", OFF, way)
        np.testing.assert_allclose(points(found[RULES[OFF]])[1], means)


def test_files_are_wide_enough_to_read_and_little_data_can_be_drawn(rows, tmp_path: Path) -> None:
    figures.save_all(rows, tmp_path / "new")
    for name in ("scaling", "crowding", "trails"):
        assert Image.open(tmp_path / "new" / f"{name}.png").width == 1620
    lonely = build(seeds=1, sizes=(1,), ways=(COPIED,), rules=(ON,))
    nothing = build(lambda rules, way, ants: 0.0, noise=0, reward=lambda *_: 0.0)
    for number, study in enumerate((lonely, nothing)):
        figures.save_all(condition_rows(study, LIMITS), tmp_path / str(number))
        assert len(list((tmp_path / str(number)).iterdir())) == 3
