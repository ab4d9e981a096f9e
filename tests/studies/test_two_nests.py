"""The script `experiments/models/two_nests.py`, and the Python of the pages about nests."""

from __future__ import annotations

import csv
import re
import runpy
import sys

import pytest
from command_lines import ROOT


def test_two_nests_share_a_pile(tmp_path, capsys, monkeypatch):
    script = ROOT / "experiments" / "models" / "two_nests.py"
    monkeypatch.setattr(sys, "argv", [str(script), "--seeds", "3", "--out", str(tmp_path)])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(script), run_name="__main__")
    assert ended.value.code == 0
    with open(tmp_path / "two_nests.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3 * 3 * 25
    last = [row for row in rows if row["tick"] == "500"]
    assert len(last) == 9
    assert all(0 < int(row["first"]) + int(row["second"]) <= 140 for row in last)
    assert (tmp_path / "two_nests.png").read_bytes().startswith(b"\x89PNG")
    assert capsys.readouterr().out.startswith("distances")


@pytest.mark.slow
def test_the_python_of_the_docs_runs():  # test_model_guides.py runs that of docs/models.md
    text = (ROOT / "docs" / "colony.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    (block,) = [one for one in blocks if "Food" in one]
    names: dict = {}
    exec(block, names)
    assert names["world"].n_food_kinds == 2
