"""The experiment on offline learning, as a user runs it."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_lines import run


@pytest.mark.long
def test_offline_prints_three_tables(kernels: Path, tmp_path: Path) -> None:
    done = run("offline", ["--seeds", 2, "--markdown"], kernels, tmp_path)
    assert done.returncode == 0, done.stderr
    tables = done.stdout.split("**(")[1:]
    rows = [[line for line in table.splitlines() if line.startswith("| ")] for table in tables]
    assert [len(lines) - 2 for lines in rows] == [4 * 5, 3 * 3 * 3, 2 * 3 * 2]
    # With what exploits its knowledge, every learner delivers.
    best = [line for line in rows[0] if line.startswith("| epsilon 0.1 | 100000")]
    assert best[0].count("1.00 [1.00, 1.00]") == 4
