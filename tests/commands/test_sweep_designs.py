"""Sweeps of designs and searches as commands: their folders, and that they survive a kill."""

from __future__ import annotations

import json
import signal
import time
from pathlib import Path

import pytest
from command_lines import assert_one_sentence, call, contents, run, start

from taichi_ants import files

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
SEARCH = """
kind = "colony"
measures = ["reward", "blocked"]
seeds = 6
ants = 4
episodes = 0
ticks = 20
rollouts = 1
policy = "random"

[search]
maximise = "reward"
trials = 12
prune_after = 2
held_out = 4
vary.task.noise.slip = { from = 0, to = 0.5 }
vary.ants = { from = 1, to = 9 }
"""
VARIES = {"manifest.json", "optuna.journal"}  # they have times


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
    assert set(contents(folder)) == {
        *("runs.csv", "summary.csv", "sensitivity.csv", "report.txt", "manifest.json"),
        *("figures/blocked.png", "figures/sensitivity_blocked.png", "inputs/my.toml"),
    }
    rows = files.read_csv(folder / "runs.csv")
    assert len(rows) == 4 * (3 + 2) * 2
    assert len({row["task.noise.slip"] for row in rows}) == 8
    assert all(10 <= row["task.pheromone.half_life"] <= 1000 for row in rows)
    assert {row["task.noise.misread"] for row in rows} == {0.01}
    indices = files.read_csv(folder / "sensitivity.csv")
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
    assert "a Latin hypercube of 4 samples, which cannot be extended to 6" in err
    assert contents(Path("results")) == before
    assert sweep(text.replace("samples = 4", "samples = 6"), "--no-figures", "--force")[0] == 0


def test_a_search_has_its_files_and_can_be_shown(sweep):
    status, out, err = sweep(SEARCH)
    assert (status, err) == (0, "")
    folder = Path("results/sweep-my")
    assert set(contents(folder)) == {
        *("trials.csv", "held_out.csv", "best.toml", "optuna.journal", "report.txt"),
        *("manifest.json", "figures/search.png", "inputs/my.toml"),
    }
    assert "12 trials of up to 6 seeds" in out
    before = contents(folder)
    assert "already has these results" in sweep(SEARCH)[1]
    status, out, err = sweep(SEARCH.replace("trials = 12", "trials = 11"))
    assert (status, out) == (2, "")
    assert_one_sentence(err)
    assert "(search.trials is 12 instead of 11)" in err
    assert contents(folder) == before
    # The file of the best settings gives what the search has measured with the held-out seeds.
    assert sweep((folder / "best.toml").read_text("utf-8"), "--no-figures", "--out", "best")[0] == 0
    rows = files.read_csv("best/runs.csv")
    held = files.read_csv(folder / "held_out.csv")
    assert [row["reward"] for row in rows] == [row["best"] for row in held]
    assert [row["seed"] for row in rows] == [row["seed"] for row in held] == [6, 7, 8, 9]


@pytest.mark.slow
def test_a_search_that_was_killed_gives_the_same_results(kernels, tmp_path):
    (tmp_path / "my.toml").write_text(SEARCH.replace("trials = 12", "trials = 60"), "utf-8")
    arguments = ["my.toml", "--no-figures"]
    assert run("sweep", [*arguments, "--out", "whole"], kernels, tmp_path).returncode == 0
    for number in (1, 20, 50):
        process = start("sweep", [*arguments, "--out", "parts"], kernels, tmp_path)
        blocks = tmp_path / "parts" / "unfinished" / "blocks"
        while process.poll() is None and len(list(blocks.rglob("*.npz"))) < number:
            time.sleep(0.002)
        process.send_signal(signal.SIGKILL)
        process.communicate(timeout=60)
        assert process.returncode == -signal.SIGKILL
    assert run("sweep", [*arguments, "--out", "parts"], kernels, tmp_path).returncode == 0
    whole, parts = contents(tmp_path / "whole"), contents(tmp_path / "parts")
    assert whole.keys() == parts.keys()
    assert [name for name in whole if whole[name] != parts[name]] == sorted(VARIES)
    settings = (json.loads(one["manifest.json"])["settings"] for one in (whole, parts))
    assert next(settings) == next(settings)
