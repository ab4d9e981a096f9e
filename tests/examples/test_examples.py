"""Each example runs, in a version of a few seconds, and says what its docstring promises."""

import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from command_lines import ROOT, environment

from taichi_ants import load_policy, task

EXAMPLES = ROOT / "examples"
NEEDS = {
    **{"ppo": "torch", "shared_policy": "torch", "search": "optuna"},
    **{"sb3_ppo": "stable_baselines3", "minari_data": "minari"},
}


def run(name: str, arguments: list[object], kernels: Path, folder: Path) -> str:
    """What an example prints; skips where what it needs is missing."""
    needed = NEEDS.get(name)
    if needed and find_spec(needed) is None:
        pytest.skip(f"{name}.py needs {needed}")
    command = [sys.executable, str(EXAMPLES / f"{name}.py"), *map(str, arguments)]
    done = subprocess.run(
        list(map(str, command)),
        env=environment(kernels),
        cwd=folder,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_example_is_here() -> None:
    names = {path.stem for path in EXAMPLES.glob("*.py")}
    assert names == {"q_learning", "sb3_vec_env", *NEEDS}


@pytest.mark.slow
def test_q_learning_delivers_in_40_lines(kernels: Path, tmp_path: Path) -> None:
    said = run("q_learning", ["--seeds", 3], kernels, tmp_path)
    assert said == "seed 3: 50 of 50 rollouts deliver, 13.0 in 35.0 steps\n"
    assert len((EXAMPLES / "q_learning.py").read_text().splitlines()) <= 40


@pytest.mark.slow
def test_minari_data_learns_from_what_it_has_written(
    kernels: Path, tmp_path: Path, monkeypatch
) -> None:
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "data"))
    said = run("minari_data", [], kernels, tmp_path)
    assert said == "58652 transitions; 20 of 20 rollouts deliver\n"


@pytest.mark.long
def test_a_search_resumes_and_ends_with_held_out_seeds(kernels: Path, tmp_path: Path) -> None:
    run("search", ["--trials", 1, "--journal", "stopped"], kernels, tmp_path)
    resumed = run("search", ["--trials", 2, "--journal", "stopped"], kernels, tmp_path)
    assert resumed == run("search", ["--trials", 2], kernels, tmp_path)
    assert re.match(r"best of 2 trials: {'half_life': \d", resumed)
    assert re.search(r"held-out seeds: \d+ .* against \d+, difference .* \[.*\]$", resumed)


@pytest.mark.slow
def test_ppo_leaves_a_policy_file(kernels: Path, tmp_path: Path) -> None:
    said = run("ppo", ["--seeds", 0, 1, "--steps", 4096], kernels, tmp_path)
    assert len(re.findall(r"^seed \d: \d+ of 100 rollouts deliver, ", said, re.M)) == 2
    policy = load_policy(tmp_path / "ppo.npz")
    assert policy.observation == "paper"
    assert policy.metadata["seed"] == 1
    assert policy.task == task.fetching()


@pytest.mark.long
def test_sb3_ppo_counts_the_rollouts_that_deliver(kernels: Path, tmp_path: Path) -> None:
    said = run("sb3_ppo", ["--seeds", 0, "--steps", 2048], kernels, tmp_path)
    assert re.search(r"^seed 0: \d+ of 100 rollouts deliver; greedily \d+, with ", said, re.M)
    assert load_policy(tmp_path / "sb3_ppo.npz").observation == "paper"


@pytest.mark.long
def test_shared_policy_sets_a_network_beside_a_table(kernels: Path, tmp_path: Path) -> None:
    said = run("shared_policy", ["--seeds", 0, "--episodes", 1], kernels, tmp_path)
    assert re.search(r"^seed 0: network \d+, greedily \d+, table \d+$", said, re.M)
    policy = load_policy(tmp_path / "shared_policy.npz")
    assert policy.observation == "ants"
    assert policy.task.life.regrowth == 0
