"""Sweeps of designs as commands: their tables, figures and folders."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_lines import assert_one_sentence, call, contents, numbers_in

DESIGN = """
kind = "colony"
measures = ["blocked", "deliveries"]
seeds = 2
ants = 4
episodes = 0
ticks = 20
rollouts = 1
policy = "trail_follower"
design = "sobol"
samples = 4
sensitivity = true

[task]
pheromone.evaporation = "exponential"

[vary]
task.pheromone.half_life = { from = 10, to = 1000, scale = "log" }
task.pheromone.view = ["half", "strongest"]
task.noise.slip = { from = 0, to = 0.5 }
task.noise.misread = 0.01
"""


@pytest.fixture
def sweep(tmp_path, capsys, monkeypatch):
    """Calls the command on a file of this text, in a folder of its own."""
    monkeypatch.chdir(tmp_path)

    def called(text, *more):
        Path("my.toml").write_text(text, "utf-8")
        return call("sweep", ["my.toml", *more], capsys)

    return called


def test_a_design_has_rows_of_drawn_values_indices_and_figures(sweep):
    status, out, err = sweep(DESIGN)
    assert (status, err) == (0, "")
    folder = Path("results/sweep-my")
    names = {name for name in contents(folder) if not name.startswith(("blocks/", "sessions/"))}
    assert names == {
        *(
            "runs.csv",
            "summary.csv",
            "sensitivity.csv",
            "report.txt",
            "manifest.json",
            "study.json",
        ),
        *("figures/blocked.png", "figures/sensitivity_blocked.png", "inputs/my.toml"),
    }
    rows = numbers_in(folder / "runs.csv")
    assert len(rows) == 4 * (3 + 2) * 2
    assert len({row["task.noise.slip"] for row in rows}) == 8
    assert all(10 <= row["task.pheromone.half_life"] <= 1000 for row in rows)
    assert {row["task.noise.misread"] for row in rows} == {0.01}
    indices = numbers_in(folder / "sensitivity.csv")
    assert [(row["measure"], row["setting"].rpartition(".")[2]) for row in indices][:3] == [
        *(("blocked", "half_life"), ("blocked", "view"), ("blocked", "slip")),
    ]
    assert all(0 <= row["seed_share"] <= 1 for row in indices)
    assert "20 points of the design 'sobol'; the 10 with the highest blocked:" in out
    assert "first order" in out
    again = sweep(DESIGN)
    assert "already has these results" in again[1]


def test_a_latin_hypercube_of_another_size_needs_another_folder(sweep):
    text = DESIGN.replace("sobol", "latin_hypercube").replace("sensitivity = true", "")
    assert sweep(text, "--no-figures")[0] == 0
    before = contents(Path("results"))
    status, out, err = sweep(text.replace("samples = 4", "samples = 6"), "--no-figures")
    assert (status, out) == (2, "")
    assert_one_sentence(err)
    assert "design.samples is 4 instead of 6" in err
    assert contents(Path("results")) == before
    assert sweep(text.replace("samples = 4", "samples = 6"), "--no-figures", "--force")[0] == 0
