"""The experiment on offline learning, as a user runs it."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_lines import run


@pytest.mark.long
def test_offline_prints_three_tables(kernels: Path, tmp_path: Path) -> None:
    done = run("offline", ["--seeds", 2], kernels, tmp_path)
    assert done.returncode == 0, done.stderr
    behaviours = ("random", "epsilon", "a learner's")
    tables = [table.splitlines() for table in done.stdout.split("─\n")[1:]]
    rows = [[line for line in lines if line.startswith(behaviours)] for lines in tables]
    assert list(map(len, rows)) == [4 * 5, 3 * 3 * 3, 2 * 3 * 2]
    # With what exploits its knowledge, every learner delivers.
    best = [line for line in rows[0] if line.startswith("epsilon 0.1") and " 100000 " in line]
    assert best[0].count("1.00 [1.00, 1.00]") == 4
