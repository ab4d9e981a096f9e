"""The study's figures show the data."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from PIL import Image
from synthetic_colony_study import LIMITS, SIZES, build

from taichi_ants.analysis.colony import figures
from taichi_ants.analysis.colony.study import COPIED, JOINT, ON, OWN, RULES, WAYS, Design
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


def lines(axis: Axes) -> dict[str, Line2D]:
    return {str(line.get_label()): line for line in axis.lines}


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
            drawn = lines(axis)
            assert list(drawn)[: len(WAYS)] == [Design(ON, way).words for way in WAYS]
            line = drawn[Design(ON, OWN).words]
            expected = column(rows, f"{measure}_mean", arena, ON, OWN)
            assert line.get_xydata().tolist() == [*map(list, zip(SIZES, expected, strict=True))]
            band = axis.collections[list(WAYS).index(OWN)].get_paths()[0].vertices[:, 1]
            for end, extreme in (("low", band.min()), ("high", band.max())):
                of_all = column(rows, f"{measure}_ci_{end}", arena, ON, OWN)
                assert extreme == {"low": min, "high": max}[end](of_all)
    titles = [axis.get_title(loc="left") for axis in axes[0]]
    assert titles == ["The paper's world", "Open worlds (30, 30, 30)"]


def test_limits_stand_above_the_data(rows) -> None:
    total, each = (np.array(figures.draw("scaling", rows).axes).reshape(2, 2))[:, 0]
    for axis, per in ((total, 1), (each, 8)):
        line = lines(axis)["limit"]
        assert (line.get_xdata()[-1], line.get_ydata()[-1]) == (8, 200 / per)


def test_trails(rows) -> None:
    axes = np.array(figures.draw("trails", rows).axes).reshape(2, 2)
    for row, measure in zip(axes, ("deliveries", "reward"), strict=True):
        for rules in RULES:
            line = lines(row[1])[Design(rules, JOINT).words]
            means = column(rows, f"{measure}_mean", "open", rules, JOINT)
            np.testing.assert_array_equal(line.get_ydata(), means)


def test_files_are_wide_enough_to_read_and_little_data_can_be_drawn(rows, tmp_path: Path) -> None:
    figures.save_all(rows, tmp_path / "new")
    for name in ("scaling", "crowding", "trails"):
        assert Image.open(tmp_path / "new" / f"{name}.png").width == 1620
    lonely = build(seeds=1, sizes=(1,), ways=(COPIED,), rules=(ON,))
    nothing = build(lambda rules, way, ants: 0.0, noise=0, reward=lambda *_: 0.0)
    for number, study in enumerate((lonely, nothing)):
        figures.save_all(condition_rows(study, LIMITS), tmp_path / str(number))
        assert len(list((tmp_path / str(number)).iterdir())) == 3
