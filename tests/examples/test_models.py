"""The scripts in experiments/models: each writes a figure and a table, and shows what it says."""

from __future__ import annotations

import csv
import runpy
import sys

import pytest
from command_lines import ROOT

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
