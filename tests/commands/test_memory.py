"""Sweeps and comparisons of many seeds: in how much memory, and that blocks change no result."""

from __future__ import annotations

import gc
import re
import shutil
import subprocess
import sys
import tracemalloc
from collections import namedtuple
from pathlib import Path

import compare
import numpy as np
import pytest
from command_lines import assert_one_sentence, call, command, contents, environment, load

from taichi_ants.studies.points import RunPoint
from taichi_ants.studies.sweep import read_sweep

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
BLOCK = 20  # runs, at most
Usage = namedtuple("Usage", "free")


@pytest.fixture
def small_blocks(monkeypatch):
    monkeypatch.setattr(RunPoint, "runs_of_a_block", BLOCK)


def sweep_of(seeds, folder):
    """A sweep of 6 points, all of which is measured, but nothing drawn or written."""
    file = folder / f"{seeds}.toml"
    file.write_text(SWEEP.replace("SEEDS", str(seeds)))
    asked = read_sweep(file)
    return lambda blocks: asked.measured(blocks, lambda share: None)


def comparison_of(seeds, folder):
    """A comparison of 4 configurations, all of which is measured, too."""
    command = load("compare")
    settings = command.parse_arguments([str(one) for one in (*COMPARE, "--seeds", seeds)])
    study = command.build_study(settings)

    def measure(blocks):
        arrays = compare.measured(study, blocks, {})
        comparison = compare.comparison_of(settings, study, arrays)
        return {name: comparison.measures[name] for name in ("return_all", "greedy_steps")}

    return measure


MEASURED = {"sweep": sweep_of, "compare": comparison_of}
BLOCKS_OF_SEEDS = {"sweep": 6, "compare": 4}  # of BLOCK seeds each


def peak(measure, folder):
    """The most bytes that Python and NumPy have held at once while this was measured."""
    folder.mkdir()
    gc.collect()
    tracemalloc.start()
    measure(folder)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return most


@pytest.mark.slow
@pytest.mark.parametrize("name", MEASURED)
def test_memory_does_not_grow_with_the_runs_but_for_what_is_measured(name, small_blocks, tmp_path):
    MEASURED[name](1, tmp_path)(tmp_path)  # imports and compiles
    few, many = (
        peak(MEASURED[name](seeds, tmp_path), tmp_path / f"of {seeds}")
        for seeds in (2 * BLOCK, 14 * BLOCK)
    )
    of_a_run = (many - few) / (12 * BLOCK * BLOCKS_OF_SEEDS[name])
    assert of_a_run < 640  # bytes, what Python cleans up now and then included; a table has 2560


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
        found.append({n: one for n, one in files.items() if n.endswith((".csv", ".npz", ".txt"))})
        shutil.rmtree("out")
    assert found[0] == found[1]
    assert len(found[0]) >= 3


@pytest.mark.parametrize("name", MEASURED)
def test_what_is_stopped_goes_on_to_the_same(name, small_blocks, tmp_path, monkeypatch):
    first = tmp_path / "first"
    first.mkdir()
    expected = MEASURED[name](2 * BLOCK, tmp_path)(first)
    second = tmp_path / "second"
    second.mkdir()
    done = sorted(first.iterdir())
    for path in done[:3]:
        shutil.copy(path, second)
    damaged = second / done[1].name
    damaged.write_bytes(damaged.read_bytes()[:-100])
    calls, real = [], RunPoint.do
    counted = staticmethod(lambda *given: calls.append(given) or real(*given))
    monkeypatch.setattr(RunPoint, "do", counted)
    found = MEASURED[name](2 * BLOCK, tmp_path)(second)
    blocks = [points for points, *_ in calls if points[0].episodes > 1]  # one compiles kernels
    assert len(blocks) == len(done) - 2
    assert sorted(path.name for path in second.iterdir()) == [path.name for path in done]
    for measure, array in expected.items():
        np.testing.assert_array_equal(found[measure], array)


def test_a_disk_without_room_is_told_before_the_work(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("my.toml").write_text(SWEEP.replace("SEEDS", "1000"))
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: Usage(10**5))
    for name, arguments, needed in (
        ("sweep", ["my.toml"], "864.0 kB"),  # 6000 runs, 3 measures, 8 + 2 * 20 bytes
        ("compare", [*COMPARE, "--seeds", 1000], "12.0 MB"),  # 4000 runs, 2560 + 8 + 110 * 4 bytes
    ):
        status, out, err = call(name, [*arguments, "--out", "out"], capsys)
        assert (status, out) == (2, "")
        assert_one_sentence(err)
        assert f"needs {needed} on the disk of 'out" in err
        assert "100.0 kB are free; free some space" in err
        assert not Path("out").exists()


def test_blocks_that_are_done_need_no_more_room(tmp_path, small_blocks, monkeypatch):
    measure = sweep_of(2 * BLOCK, tmp_path)
    blocks = tmp_path / "blocks"
    blocks.mkdir()
    measure(blocks)
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: Usage(0))
    measure(blocks)


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
