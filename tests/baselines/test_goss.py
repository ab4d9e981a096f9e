"""The published model of the double bridge: equal to the reference, and to what was published."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_ants.baselines.goss import (
    LATE_RATIO,
    PUBLISHED,
    PUBLISHED_LATE,
    choices,
    class_shares,
    crossing_steps,
)
from taichi_ants.errors import AntsError
from taichi_ants.reference.baselines import bridge_choices


@pytest.mark.parametrize(
    ("short", "long", "settings"),
    [
        (9, 9, {}),
        (9, 13, {"seed": -3}),
        (9, 19, {"seed": 2**64 - 1}),
        (1, 1, {"k": 0.37, "n": 3}),
        (1, 7, {"k": 5, "n": 1}),
        (400, 600, {"k": 1e9, "n": 8}),
        (9, 19, {"opens": 31, "k": 200}),
        (3, 7, {"opens": 1000}),
    ],
)
def test_every_choice_equals_the_reference(short: int, long: int, settings: dict) -> None:
    took = choices(short, long, 5, **settings)
    reference = {"seed": 0, **settings}
    for colony in range(5):
        expected = bridge_choices(short, long, colony=colony, ants=1000, **reference)
        assert took[colony].tolist() == expected


@pytest.mark.parametrize("ratio", PUBLISHED)
def test_colonies_divide_as_published(ratio: float) -> None:
    shares = class_shares(choices(*crossing_steps(ratio), 30_000))
    assert shares.sum() == pytest.approx(100)
    assert np.abs(shares - PUBLISHED[ratio]).max() < 3


def test_colonies_stay_on_the_long_branch_if_the_short_one_opens_late() -> None:
    took = choices(*crossing_steps(LATE_RATIO), 5000, ants=2000, opens=1000)
    assert not took[:, :1000].any()
    assert 0 < took[:, 1000:].mean() < 0.01
    assert np.abs(class_shares(took, 1501, 2000) - PUBLISHED_LATE).max() < 1


def test_neither_threads_nor_other_colonies_change_a_choice(monkeypatch) -> None:
    whole = choices(9, 13, 300, threads=2)
    assert np.array_equal(choices(9, 13, 300, threads=1), whole)
    assert np.array_equal(choices(9, 13, 70), whole[:70])
    assert np.array_equal(choices(9, 13, 70, ants=200), whole[:70, :200])
    monkeypatch.setattr("taichi_ants.baselines.goss._LAUNCH", 7)
    assert np.array_equal(choices(9, 13, 70), whole[:70])
    assert not np.array_equal(choices(9, 13, 300, seed=1), whole)
    assert len(np.unique(whole, axis=0)) == 300


def test_the_first_ants_know_nothing() -> None:
    first = choices(9, 19, 40_000, ants=2)
    assert np.abs(first.mean(axis=0) - 0.5).max() < 0.01
    assert abs(np.corrcoef(first.T)[0, 1]) < 0.02


def test_classes_by_hand() -> None:
    took = np.zeros((5, 20), np.uint8)
    for colony, short in enumerate((0, 1, 2, 9, 10)):
        took[colony, 10 : 10 + short] = 1
    # Shares of the last ten ants 0, 0.1, 0.2, 0.9 and 1.
    assert class_shares(took, 11, 20).tolist() == [40, 20, 0, 0, 40]
    assert class_shares(took, 1, 10).tolist() == [100, 0, 0, 0, 0]


def test_steps_of_a_crossing() -> None:
    assert [crossing_steps(ratio) for ratio in PUBLISHED] == [(9, 9), (9, 13), (9, 19)]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"short": 0}, "`short` is 0; it must be between 1"),
        ({"long": 8}, "`long` is 8; it must lie between 9"),
        ({"colonies": 1.5}, "`colonies` is 1.5; it must be a whole number"),
        ({"ants": 999}, "`ants` is 999; it must be even"),
        ({"k": 0}, "`k` is 0; it must be above 0"),
        ({"k": float("nan")}, "`k` is nan"),
        ({"n": 2.5}, "`n` is 2.5; it must be a whole number"),
        ({"n": 9}, "`n` is 9; it must be between 1 and 8"),
        ({"opens": 1001}, "`opens` is 1001; it must lie between 0 and 1000"),
        ({"seed": None}, "`seed` is None"),
    ],
)
def test_errors_name_what_is_wrong(given: dict, message: str) -> None:
    with pytest.raises(AntsError, match=message):
        choices(**{"short": 9, "long": 13, "colonies": 2, **given})


def test_windows_and_ratios_are_checked() -> None:
    took = np.zeros((2, 20), np.uint8)
    with pytest.raises(AntsError, match="last is 21; it must lie between 1 and 20"):
        class_shares(took, 1, 21)
    with pytest.raises(AntsError, match="first is 12; it must lie between 1 and 11"):
        class_shares(took, 12, 11)
    for ratio in (0.9, "2", float("nan")):
        with pytest.raises(AntsError, match="`ratio` is"):
            crossing_steps(ratio)
