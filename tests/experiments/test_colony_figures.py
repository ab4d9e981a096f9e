"""The study's figures show the data."""

import colony_figures as figures
import pytest
from colony_findings import (
    ABC,
    ABROAD,
    JOINT,
    PAPER,
    QUEUES,
    RULES,
    ConditionRow,
    Trained,
    condition_rows,
)
from matplotlib.axes import Axes
from synthetic_colony_study import build

WORLD_KINDS = ("paper", "open")


@pytest.fixture(scope="module")
def rows() -> list[ConditionRow]:
    study = build(
        lambda rules, regime, ants: 20.0 * ants * (1 + list(RULES).index(rules)),
        seeds=6,
        noise=10,
        world_kinds=WORLD_KINDS,
    )
    return condition_rows(study)


def column(rows: list, name: str, world_kind: str, rules: str, regime: str = JOINT) -> list[float]:
    return [r.columns()[name] for r in rows if r.condition[:3] == (world_kind, rules, regime)]


def dots(axis: Axes) -> dict[int, float]:
    """The means by line, from above."""
    found = [line.get_xydata()[0] for line in axis.lines if line.get_marker() == "o"]
    return {int(place): mean for mean, place in found}


@pytest.mark.parametrize(
    ("name", "designs"),
    [
        ("rules", [Trained(rules) for rules in RULES]),
        ("elsewhere", [Trained(rules, ABROAD) for rules in (PAPER, ABC, QUEUES)]),
    ],
)
def test_a_line_shows_the_largest_colony_of_a_design(rows, name, designs) -> None:
    figure = figures.FIGURES[name](rows)
    for axis, world_kind in zip(figure.axes, WORLD_KINDS, strict=True):
        means = dots(axis)
        labels = [text.get_text() for text in figure.axes[0].get_yticklabels()]
        assert labels == [RULES[design.rules] for design in designs]
        for place, design in enumerate(designs):
            *_, low = column(rows, "deliveries_ci_low", world_kind, *design)
            *_, mean = column(rows, "deliveries_mean", world_kind, *design)
            assert means[place] == mean
            interval, spread, bounds = axis.collections[3 * place : 3 * place + 3]
            assert interval.get_segments()[0].min(axis=0).tolist() == [low, place]
            *_, worst = column(rows, "deliveries_min", world_kind, *design)
            assert spread.get_segments()[0].min(axis=0).tolist() == [worst, place]
            assert bounds.get_segments()[0][:, 0].tolist() == [200, 200]
            marks = [line for line in axis.lines if line.get_marker() == "|"]
            assert marks[place].get_xdata() == [200]
    caption = " ".join(figure._supxlabel.get_text().split())
    assert (
        "Means over 6 seeds with 95 % intervals (too few for these: use 10 or more). Exploration "
        "rate 0.01." in caption
    )
    titles = [axis.get_title(loc="left") for axis in figure.axes]
    assert titles == ["The paper's world", "Open worlds (30, 30, 30)"]
