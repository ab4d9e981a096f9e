"""The script `experiments/models/division_of_labour.py`, and the Python of the pages on castes."""

from __future__ import annotations

import re
import runpy
import sys

import numpy as np
import pytest
from command_lines import ROOT, numbers_in


@pytest.mark.slow
def test_thresholds_divide_labour(tmp_path, capsys, monkeypatch):
    """More ants forage at a higher demand, and those with low thresholds forage more."""
    script = ROOT / "experiments" / "models" / "division_of_labour.py"
    monkeypatch.setattr(sys, "argv", [str(script), "--seeds", "3", "--out", str(tmp_path)])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(script), run_name="__main__")
    assert ended.value.code == 0
    rows = numbers_in(tmp_path / "division_of_labour.csv")
    assert len(rows) == 4 * 3 * 80
    late = {demand: [] for demand in (0.25, 0.5, 1, 2)}
    for row in rows:
        if row["tick"] > 2000:
            late[row["demand"]].append(row["foragers"])
    means = [np.mean(shares) for shares in late.values()]
    assert means == sorted(means)
    assert means[-1] > 3 * means[0] > 0.3
    table = [line.split() for line in capsys.readouterr().out.splitlines()[2:6]]
    for _, _, _, _, low, _, _, high, *_ in table:
        assert float(low) > 1.3 * float(high)
    assert (tmp_path / "division_of_labour.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_python_of_the_docs_runs():  # test_model_guides.py runs that of docs/models.md
    text = (ROOT / "docs" / "colony.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    (block,) = [one for one in blocks if "Caste" in one]
    names: dict = {}
    exec(block, names)
    assert [*names["task"].castes] == ["scout", "worker"]
