"""The scripts in experiments/models: each writes a figure and a table, and shows what it says."""

from __future__ import annotations

import csv
import runpy
import sys
from pathlib import Path

import pytest
from command_lines import ROOT, run

from taichi_ants import files

MODELS = ROOT / "experiments" / "models"


def rows_of(name: str, seeds: int, folder, monkeypatch) -> dict[str, dict[str, str]]:
    """Run a script, and return its table by the first column."""
    arguments = [f"{name}.py", "--seeds", str(seeds), "--out", str(folder)]
    monkeypatch.setattr(sys, "argv", arguments)
    runpy.run_path(str(MODELS / f"{name}.py"), run_name="__main__")
    assert (folder / f"{name}.png").stat().st_size > 10_000
    with (folder / f"{name}.csv").open(encoding="utf-8") as file:
        return {row["model"]: row for row in csv.DictReader(file)}


@pytest.mark.slow
def test_home_trail(tmp_path, monkeypatch):
    """A second trail replaces most of a compass; without either, hardly any food is delivered."""
    rows = rows_of("home_trail", 4, tmp_path, monkeypatch)
    delivered = {name: float(row["deliveries"]) for name, row in rows.items()}
    assert delivered["compass"] > delivered["home trail"] > 0.6 * delivered["compass"]
    assert delivered["no cue"] < 0.1 * delivered["compass"]


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


def test_a_no_entry_pheromone(kernels: Path, tmp_path: Path) -> None:
    done = run("models/no_entry", ["--seeds", 2, "--out", tmp_path], kernels, tmp_path)
    assert done.returncode == 0, done.stderr
    rows = files.read_csv(tmp_path / "no_entry.csv")
    assert len(rows) == 2 * 2 * 30
    last = [row["delivered"] for row in rows if row["tick"] == 3000]
    assert min(last) > 0
    assert len(set(last)) > 1
    assert (tmp_path / "no_entry.png").stat().st_size > 10_000
