"""The study of colonies as a script; golden hashes hold its numbers."""

from __future__ import annotations

import pytest
from command_lines import call, contents, read_csv

SMALL = [
    *("study", "--world-kinds", "paper", "small", "--sizes", 1, 3, "--seeds", 2, "--seed", 3),
    *("--episodes", 4, "--ticks", 80, "--rollouts", 2),
]
FILES = {
    *("conditions.csv", "differences.csv", "seeds.csv", "manifest.json"),
    *("report.html", "report.txt", "study.json"),
    *("tables/colony_elsewhere.json", "tables/colony_glance.json"),
    *(f"figures/{name}.png" for name in ("elsewhere", "rules", "scaling", "training")),
    *(
        f"policies/paper_{rules}_{ants}.npz"
        for rules in ("paper", "foraging", "queueing")
        for ants in (1, 3)
    ),
}


@pytest.mark.slow
def test_all_files_are_there(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, out, err = call("colony", [*SMALL, "--out", "out"], capsys)
    assert (status, err) == (0, "")
    folder = tmp_path / "out"
    folders = ("blocks", "inputs", "sessions")
    assert {name for name in contents(folder) if not name.startswith(folders)} == FILES
    report = (folder / "report.txt").read_text("utf-8")
    assert out.startswith(report)
    assert len(out.splitlines()) <= 42
    assert out.splitlines()[-1] == "out/report.html"
    assert "Deliveries per 1000 ticks of 3 ants" in report
    assert "2 seeds, too few for a verdict, exploration rate 0.01; in brackets: without" in report
    assert "What does each rule add?" in report
    page = (folder / "report.html").read_text("utf-8")
    assert (
        "The paper&#39;s world, 2 seeds, too few for a verdict, exploration rate 0.01: deliveries"
        in page
    )
    assert "Trained in open worlds, 3 ants, 2 seeds, too few for a verdict" in page
    assert page.count('class="player"') == 3
    rows = read_csv(folder / "conditions.csv")
    # In the paper's world seven rules for one and three ants, and of three rules those that were
    # trained alone, or in open worlds; the latter in small worlds, too.
    assert len(rows) == 7 * 2 + 3 + 3 + 3
