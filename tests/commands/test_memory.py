"""Sweeps and comparisons of many seeds: in how much memory, and that blocks change no result."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from command_lines import call, contents

from taichi_ants.studies.points import RunPoint

SWEEP = """
kind = "runs"
measures = ["return_last50", "greedy_deliveries"]
seeds = SEEDS
episodes = 50
max_steps = 20
rollouts = 3
[training]
learner = "sarsa"
discount = 0.9
epsilon_decay = 0.99
[vary]
training.learning_rate = [0.01, 0.1]
training.epsilon = [0.1, 0.5, 1.0]
"""
COMPARE = [
    *("--episodes", 60, "--max-steps", 20, "--learners", "sarsa", "--learning-rates", 0.01),
    *("--discounts", 0.9, "--epsilons", 0.3, 0.5, "--epsilon-decays", 0.99, "--no-figures"),
]


@pytest.mark.parametrize(("name", "size"), [("sweep", 11), ("compare", 3)])
def test_blocks_of_any_size_give_the_same(name, size, tmp_path, capsys, monkeypatch):
    """To the bytes of all files."""
    monkeypatch.chdir(tmp_path)
    Path("my.toml").write_text(SWEEP.replace("SEEDS", "7"))
    arguments = ["my.toml", "--no-figures"] if name == "sweep" else [*COMPARE, "--seeds", 7]
    found = []
    for runs in (5000, size):
        monkeypatch.setattr(RunPoint, "runs_of_a_block", runs)
        assert call(name, [*arguments, "--out", "out"], capsys)[0] == 0
        files = contents(Path("out"))
        found.append(
            {n: one for n, one in files.items() if n.endswith((".csv", ".txt", "runs.npz"))}
        )
        shutil.rmtree("out")
    assert found[0] == found[1]
    assert len(found[0]) >= 3


# Runs a script, and says at its end how much memory the process has taken. The system's own account
# of a process that has ended counts the one that started it, too.
