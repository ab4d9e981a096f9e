"""The examples of models in `experiments/models`, as a user runs them."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_lines import run

from taichi_ants import files


@pytest.mark.slow
def test_colonies_on_a_double_bridge_choose_one_branch_and_keep_it(
    kernels: Path, tmp_path: Path
) -> None:
    done = run("models/double_bridge", ["--seeds", 16, "--out", tmp_path], kernels, tmp_path)
    assert done.returncode == 0, done.stderr
    lasting, evaporating = (
        [line.split() for line in done.stdout.splitlines() if line.startswith(start)]
        for start in ("no evaporation", "half-life 300")
    )
    for equal, _, late in (lasting, evaporating):
        assert int(equal[-1]) >= 50  # of colonies, on one of two equal branches
        assert int(late[-5]) == 0  # of colonies, on a short branch that opens late
    assert len(files.read_csv(tmp_path / "double_bridge.csv")) == 6 * 16
    assert (tmp_path / "double_bridge.png").stat().st_size > 10_000


def test_ants_that_misread_cells(kernels: Path, tmp_path: Path) -> None:
    small = ["--seeds", 2, "--episodes", 6, "--ticks", 300, "--out", tmp_path]
    done = run("models/misreading", small, kernels, tmp_path)
    assert done.returncode == 0, done.stderr
    rows = files.read_csv(tmp_path / "misreading.csv")
    assert len(rows) == 12
    for row in rows:
        assert row["difference"] == row["with trails"] - row["without"]
    mean = {rate: sum(r["with trails"] for r in rows if r["misread"] == rate) for rate in (0, 0.4)}
    assert mean[0] > 4 * mean[0.4]
    assert (tmp_path / "misreading.png").stat().st_size > 10_000
