"""The share by the short branch, from counts that are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from taichi_ants.analysis import bridge
from taichi_ants.analysis.bridge import (
    BRIDGES,
    DESIGNS,
    LATE,
    LOADS,
    WINDOWS,
    Design,
    late_shares,
)
from taichi_ants.errors import AntsError

SEEDS = (3, 4, 5)


def counts(seeds: int) -> dict:
    """Each colony sends 3 foragers of 4 and 9 carriers of 10 by the short branch, but the last."""
    crossed = np.zeros((WINDOWS, 2, 2, seeds), np.int64)
    crossed[:, 0] = [[3], [1]]
    crossed[:, 1] = [[9], [1]]
    crossed[..., -1] = 0
    return {design: dict.fromkeys(BRIDGES, crossed) for design in DESIGNS}


@pytest.fixture
def found() -> dict:
    return counts(len(SEEDS))


def test_late_shares_are_of_the_second_half(found: dict) -> None:
    crossed = found[Design()][BRIDGES[0]].copy()
    crossed[: WINDOWS // 2, :, 0] = 1000
    shares = late_shares(crossed)
    np.testing.assert_allclose(shares[:, :2], [[0.75] * 2, [0.9] * 2])
    assert np.isnan(shares[:, 2]).all()


def test_rows_hold_every_count(found: dict) -> None:
    rows = bridge.rows(found, SEEDS, 3000)
    assert len(rows) == len(DESIGNS) * len(BRIDGES) * len(SEEDS) * len(LOADS) * WINDOWS
    first = rows[0]
    assert (first["seed"], first["load"], first["from_tick"]) == (3, "foragers", 0)
    assert (first["short"], first["long"]) == (3, 1)
    assert rows[WINDOWS - 1]["from_tick"] == 2700
    late = [row["from_tick"] for row in rows if row["bridge"] == LATE]
    assert late[:WINDOWS] == list(range(0, 6000, 600))


def test_the_report_has_a_row_for_each_design_and_bridge() -> None:
    text = bridge.report(counts(12), 3000)
    for name in BRIDGES[:-1]:
        assert sum(f" {name} " in line for line in text.splitlines()) >= len(DESIGNS)
    assert "75 [75, 75]" in text
    assert "90 [90, 90]" in text
    assert "12 seeds" in text
    assert "too few" not in text


def test_few_seeds_give_no_intervals_and_the_report_says_how_many(found: dict) -> None:
    """Nor do ten of which some had no crossing."""
    text = bridge.report(found, 3000)
    assert text.count("3 seeds, too few for") == 2  # a table each
    assert "[" not in text
    assert "[" not in bridge.report(counts(10), 3000)


def test_shares_after_a_late_opening() -> None:
    """Foragers by the short branch: nobody before, 10, 30, 50, 70, 90 % after, in 11 colonies."""
    crossed = np.zeros((WINDOWS, 2, 2, 12), np.int64)
    crossed[:5, :, 1] = 9
    crossed[5:, 0, 0] = np.array([1, 3, 5, 7, 9])[:, None]
    crossed[5:, 0, 1] = 10 - crossed[5:, 0, 0]
    crossed[:, 0, :, 0] = crossed[:, 0, ::-1, 0]  # this one ends with 10 %
    crossed[:, :, :, -1] = 0
    text = bridge.report({Design(): {LATE: crossed}}, 3000)
    (foragers,) = [line for line in text.splitlines() if " foragers " in line]
    *means, low, high, colonies, of, all_of_them = foragers.split()[6:]
    assert means == ["17", "34", "50", "66", "83"]
    assert float(low[1:-1]) < 83 < float(high[:-1])
    assert (colonies, of, all_of_them) == ("10", "of", "11")
    assert "opens after 3000 ticks" in text


def test_colonies_in_which_nobody_crosses_are_left_out_of_the_figure(
    found: dict, tmp_path: Path
) -> None:
    path = tmp_path / "bridge.png"
    for draw in (bridge.draw, bridge.draw_late):
        draw(path, found, 3000)
        with Image.open(path) as image:
            assert np.asarray(image.convert("RGB")).std() > 5
        with pytest.raises(AntsError):
            draw(tmp_path / "nowhere" / "bridge.png", found, 3000)
