"""The share by the short branch, from counts that are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from taichi_ants.analysis import bridge
from taichi_ants.analysis.bridge import BRIDGES, DESIGNS, LOADS, WINDOWS, Design, late_shares
from taichi_ants.errors import AntsError

SEEDS = (3, 4, 5)


@pytest.fixture
def found() -> dict:
    """Each colony sends 3 foragers of 4 and 9 carriers of 10 by the short branch, but the last."""
    crossed = np.zeros((WINDOWS, 2, 2, len(SEEDS)), np.int64)
    crossed[:, 0] = [[3], [1]]
    crossed[:, 1] = [[9], [1]]
    crossed[..., -1] = 0
    return {design: dict.fromkeys(BRIDGES, crossed) for design in DESIGNS}


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


def test_the_report_has_a_row_for_each_design_and_bridge(found: dict) -> None:
    text = bridge.report(found)
    for name in BRIDGES:
        assert sum(f" {name} " in line for line in text.splitlines()) >= len(DESIGNS)
    assert "75 [75, 75]" in text
    assert "90 [90, 90]" in text


def test_colonies_in_which_nobody_crosses_are_left_out_of_the_figure(
    found: dict, tmp_path: Path
) -> None:
    path = tmp_path / "bridge.png"
    bridge.draw(path, found, 3000)
    with Image.open(path) as image:
        assert np.asarray(image.convert("RGB")).std() > 5
    with pytest.raises(AntsError):
        bridge.draw(tmp_path / "nowhere" / "bridge.png", found, 3000)
