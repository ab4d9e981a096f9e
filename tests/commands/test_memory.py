"""Sweeps and comparisons of many seeds: in how much memory, and that blocks change no result."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from command_lines import call, command, contents, environment

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
WATCHED = """
import runpy, sys
del sys.argv[0]
try:
    runpy.run_path(sys.argv[0], run_name="__main__")
finally:
    with open("/proc/self/status") as status:
        print(*(line for line in status if line.startswith("VmHWM")), file=sys.stderr)
"""


@pytest.mark.long
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="tells what a process has taken")
def test_a_process_with_many_seeds_stays_small(kernels, tmp_path):
    """All of a command, with statistics."""
    arguments = [*COMPARE, "--seeds", 5000, "--threads", 1]
    done = subprocess.run(
        [sys.executable, "-c", WATCHED, *command("compare", arguments)[1:]],
        cwd=tmp_path,
        env=environment(kernels),
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert "all results are in results/" in done.stdout
    found = re.fullmatch(r"VmHWM:\s+(\d+) kB\n\n", done.stderr)
    assert found, done.stderr
    assert int(found[1]) < 450_000  # all runs and resamples at once take more than a GB
