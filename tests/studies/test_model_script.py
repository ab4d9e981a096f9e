"""The scripts in `experiments/models`: their options, files and tables."""

from __future__ import annotations

import csv
import re
import runpy
import sys

import numpy as np
import pytest
from command_lines import ROOT

from taichi_ants.analysis.statistics import bootstrap_interval
from taichi_ants.studies.model_script import table

DOCS = (ROOT / "docs" / "protocol.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_colony_recovers_after_a_removal(tmp_path, capsys, monkeypatch):
    script = ROOT / "experiments" / "models" / "recovery.py"
    monkeypatch.setattr(sys, "argv", [str(script), "--seeds", "2", "--out", str(tmp_path)])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(script), run_name="__main__")
    assert ended.value.code == 0
    with open(tmp_path / "recovery.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    ants = {(row["removed"], row["seed"], int(row["tick"])): int(row["ants"]) for row in rows}
    assert len(ants) == 4 * 2 * 80
    for seed in "01":
        before, half = (ants[share, seed, 2000] for share in ("0.0", "0.5"))
        assert half == before - int(0.5 * before + 0.5)
        assert all(
            ants["0.5", seed, tick] == ants["0.0", seed, tick] for tick in range(0, 2000, 50)
        )
    assert (tmp_path / "recovery.png").read_bytes().startswith(b"\x89PNG")
    assert capsys.readouterr().out.startswith("share removed  ticks to recover\n")


def test_a_table_has_a_line_for_each_condition():
    rows = [{"kind": kind, "x": n} for kind in "ab" for n in (1, 2, 4)]
    low, high = bootstrap_interval(np.array([[1.0, 2.0, 4.0]]))
    lines = table(rows).splitlines()
    assert lines[0].split() == ["kind", "x"]
    assert lines[2] == f"a     2.333 [{low[0]:.4g}, {high[0]:.4g}]"
    assert len(lines) == 4
    assert table(rows[:1]).splitlines()[2] == "a     1"


@pytest.mark.slow
def test_the_python_of_the_docs_runs():
    names: dict = {}
    exec("\n".join(re.findall(r"```python\n(.*?)```", DOCS, re.DOTALL)), names)
    assert names["results"].living.max() == 20
