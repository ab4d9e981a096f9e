"""The comparison as a process: stopped, killed, piped, without a home, with a plugin."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import plain_runs
import pytest
from command_lines import (
    EXPERIMENTS,
    assert_one_sentence,
    command,
    contents,
    environment,
    promptly,
    run,
    start,
)

from taichi_ants import TrainingConfig, reference, worlds
from taichi_ants.reference.learners import QLearning

LONG = [
    *("--seeds", 4, "--episodes", 500, "--learners", "q_learning", "dyna_q"),
    *("--planning-steps", 9, "--learning-rates", 0.001, 0.01, "--discounts", 0.9, 0.99),
    *("--epsilons", 0.5, "--no-figures"),
]
PICTURED = [
    *("--seeds", 2, "--episodes", 20, "--learners", "q_learning", "sarsa", "--discounts", 0.9),
    *("--learning-rates", 0.1, "--epsilons", 0.3, "--epsilon-decays", 0.9),
]
MANY = [*LONG, "--seeds", 50]
BLOCKS = 2 * 2 * 2  # settings of delivery, learners, pieces of at most 333 runs
TINY = [
    *("--seeds", 1, "--episodes", 2, "--max-steps", 30, "--learners", "q_learning"),
    *("--learning-rates", 0.1, "--discounts", 0.9, "--epsilons", 0.3, "--epsilon-decays", 0.9),
    *("--delivery", "terminates", "--no-figures"),
]


def blocks_in(folder):
    """Finished blocks with the time at which they were written."""
    found = (folder / "unfinished" / "blocks").glob("*.npz")
    return {path.name: path.stat().st_mtime_ns for path in found}


def stop_after_a_block(process, folder, stop_signal, least):
    """Send a signal once there are `least` blocks; what the process wrote, and how long it took."""
    while process.poll() is None and len(blocks_in(folder)) < least:
        time.sleep(0.002)
    sent = time.perf_counter()
    process.send_signal(stop_signal)
    out, err = process.communicate(timeout=60)
    return out, err, time.perf_counter() - sent


def test_an_interruption_before_the_first_block_leaves_nothing(kernels, tmp_path):
    process = start("compare", [*LONG, "--out", "new/folder"], kernels, tmp_path)
    while process.poll() is None and not (tmp_path / "new").exists():
        time.sleep(0.002)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (130, "")
    assert err.startswith("Stopped")
    assert err.count("\n") == 1
    if not blocks_in(tmp_path / "new" / "folder"):  # under load the first may be done by now
        assert list(tmp_path.iterdir()) == []


@pytest.mark.long
def test_finished_blocks_are_kept_and_a_damaged_one_is_done_again(kernels, tmp_path):
    folder, arguments = tmp_path / "out", [*MANY, "--out", "out"]
    process = start("compare", arguments, kernels, tmp_path)
    out, err, seconds = stop_after_a_block(process, folder, signal.SIGTERM, 2)
    assert (process.returncode, out) == (143, "")
    assert err == "Stopped; finished runs are saved. Run the same command again to resume.\n"
    assert seconds < promptly()
    assert [path.name for path in folder.iterdir()] == ["unfinished"]
    kept = blocks_in(folder)
    assert 2 <= len(kept) < BLOCKS
    damaged = folder / "unfinished" / "blocks" / min(kept)
    damaged.write_bytes(damaged.read_bytes()[:-100])
    process = start("compare", arguments, kernels, tmp_path)
    _, err, _ = stop_after_a_block(process, folder, signal.SIGINT, len(kept) + 1)
    said, stopped = err.splitlines()
    assert damaged.name in said
    assert said.endswith("is damaged or has other settings, so it is computed again.")
    assert stopped.startswith("Stopped")
    assert np.load(damaged)["returns"].size
    del kept[damaged.name]
    assert kept.items() < blocks_in(folder).items()  # none of the others was done again


@pytest.mark.slow
def test_an_interruption_of_the_pictures_keeps_the_runs(kernels, tmp_path):
    """Ctrl-C on a terminal."""
    arguments = [*PICTURED, "--out", "out"]
    process = start("compare", arguments, kernels, tmp_path, start_new_session=True)
    unfinished = tmp_path / "out" / "unfinished"
    while process.poll() is None and not list(unfinished.glob("ready/*/policies/*")):
        time.sleep(0.002)
    time.sleep(0.3)
    os.killpg(process.pid, signal.SIGINT)
    sent = time.perf_counter()
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (130, ""), err
    assert err.startswith("Stopped")
    assert err.count("\n") == 1
    assert time.perf_counter() - sent < promptly()
    assert len(blocks_in(tmp_path / "out")) == 2 * 2


@pytest.mark.long
def test_a_second_process_at_the_same_work_may_finish_it(kernels, tmp_path):
    arguments = [*MANY, "--out", "out"]
    process = start("compare", arguments, kernels, tmp_path)
    try:
        while process.poll() is None and not blocks_in(tmp_path / "out"):
            time.sleep(0.002)
        process.send_signal(signal.SIGSTOP)
        assert run("compare", arguments, kernels, tmp_path).returncode == 0
        before = contents(tmp_path / "out")
    finally:
        process.send_signal(signal.SIGCONT)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 2
    assert_one_sentence(err)
    assert "another process has finished the same work in 'out'" in err
    assert contents(tmp_path / "out") == before


REHEARSED = """
import pathlib, numpy as np
from taichi_ants.report import results
from taichi_ants.commands import compare
from taichi_ants.report.comparison import played
from taichi_ants.task.constants import N_ACTIONS
from taichi_ants.viewer import record_episode

point = compare.build_study(compare.parse_arguments(["--seeds", "1"])).points[0]
episode = played(point, np.zeros((point.task.n_states, N_ACTIONS), np.float32), 0)
results.warm_up(point, None, {"threads": 1, "arch": None}, False)

from taichi.lang.kernel_impl import Kernel
materialize, late = Kernel.materialize, []

def noted(self, key=None, **how):
    if key not in self.compiled_kernels:
        late.append(self.func.__name__)
    return materialize(self, key, **how)

Kernel.materialize = noted
results.render_policy(pathlib.Path("a.gif"), episode, "title")
record_episode(episode, "delivers")
print(late)
"""


@pytest.mark.long
def test_what_is_prepared_beside_has_all_kernels_that_drawing_needs(kernels, tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", REHEARSED],
        cwd=tmp_path,
        env=environment(kernels),
        text=True,
        capture_output=True,
        check=True,
    )
    assert done.stdout.splitlines()[-1] == "[]"


def test_help_is_quick_and_needs_no_taichi(tmp_path):
    script = (
        "import runpy, sys\n"
        f"sys.argv = ['compare.py', '--help']\n"
        "try:\n"
        f"    runpy.run_path({str(EXPERIMENTS / 'compare.py')!r}, run_name='__main__')\n"
        "except SystemExit as end:\n"
        "    assert end.code == 0\n"
        "heavy = {'taichi', 'numpy', 'scipy', 'matplotlib', 'rich'} & set(sys.modules)\n"
        "print('heavy:', sorted(heavy))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script],
        env=environment(tmp_path),
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.stdout.endswith("heavy: []\n")
    for flag in (
        *("--seeds", "--seed", "--episodes", "--max-steps", "--delivery", "--learners"),
        *("--learning-rates", "--discounts", "--epsilons", "--epsilon-decays"),
        *("--planning-steps", "--world", "--threads", "--arch", "--out", "--quick", "--force"),
        "--no-figures",
    ):
        assert f"  {flag}" in done.stdout
    told = "".join(done.stdout.split())  # lines may break at hyphens
    assert "(default:results/compare,with--quickresults/compare-quick)" in told


@pytest.mark.slow
def test_only_the_beginning_is_read(kernels, tmp_path):
    """`| head -1`, and an output that is full."""
    arguments = [*TINY, "--out", "out"]
    assert run("compare", arguments, kernels, tmp_path).returncode == 0
    before = contents(tmp_path / "out")
    line = " ".join(command("compare", arguments))
    for end, status, complaint in (
        ("| head -1", 0, ""),
        ("> /dev/full", 2, "error: [Errno 28] No space left on device.\n"),
        (">&-", 0, ""),
    ):
        done = subprocess.run(
            ["bash", "-c", f"{line} {end}; exit ${{PIPESTATUS[0]}}"],
            cwd=tmp_path,
            env=environment(kernels, PYTHONIOENCODING="ascii"),
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert (done.returncode, done.stderr) == (status, complaint)
        if "head" in end:
            assert done.stdout.startswith("World: the paper's.")
            assert done.stdout.count("\n") == 1
    assert contents(tmp_path / "out") == before


@pytest.mark.long
def test_without_a_home(kernels, tmp_path):
    """Kernels are then kept among the temporary files."""
    places = {"HOME": None, "XDG_CACHE_HOME": None, "TMPDIR": str(kernels)}
    done = run("compare", [*TINY, "--out", "out"], kernels, tmp_path, **places)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "out" / "summary.csv").exists()
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    if hasattr(os, "getuid"):
        assert (kernels / f"taichi_ants-{os.getuid()}").stat().st_mode & 0o077 == 0


HYSTERETIC = """
import taichi as ti

from taichi_ants.learners import register, td_learner
from taichi_ants.task.rules.policy import best_value


@ti.func
def td_error(value, reward, discount, next_values, next_action, epsilon):
    error = reward + discount * best_value(next_values) - value
    if error < 0:
        error *= 0.25
    return error


register(td_learner("hysteretic", td_error, summary="slow to believe bad news"))
"""


class Hysteretic(QLearning):
    def error(self, step, epsilon):
        error = super().error(step, epsilon)
        return error * np.float32(0.25) if error < 0 else error


@pytest.mark.long
def test_a_learner_from_a_file_of_ones_own(kernels, tmp_path, monkeypatch):
    (tmp_path / "own.py").write_text(HYSTERETIC)
    arguments = [
        *(*TINY, "--learners", "hysteretic", "q_learning", "--plugin", "own.py"),
        *("--episodes", 12, "--max-steps", 120, "--out", "out"),
    ]
    done = run("compare", arguments, kernels, tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert "hysteretic" in done.stdout

    monkeypatch.setitem(reference.LEARNERS, "hysteretic", Hysteretic)
    with np.load(tmp_path / "out" / "runs.npz") as archive:
        for row, name in enumerate(("hysteretic", "q_learning")):
            config = TrainingConfig(name, 0.1, 0.9, 0.3, 0.9)
            plain = plain_runs.train(worlds.paper(), config, 0, 12, 120)
            assert archive["return_all"][row, 0] == np.mean(plain.returns)
            assert archive["steps_all"][row, 0] == np.mean(plain.steps)
        assert not np.array_equal(archive["return_all"][0], archive["return_all"][1])

    # A file that was changed since may mean other results.
    (tmp_path / "own.py").write_text(HYSTERETIC.replace("0.25", "0.5"))
    refused = run("compare", arguments, kernels, tmp_path)
    assert refused.returncode == 2
    assert_one_sentence(refused.stderr)
    assert "plugin" in refused.stderr


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("script") is None, reason="needs `script` for a terminal")
def test_progress_on_a_terminal(kernels, tmp_path):
    line = " ".join(command("compare", [*TINY, "--out", "out"]))
    done = subprocess.run(
        ["script", "-qec", line, "/dev/null"],
        cwd=tmp_path,
        env=environment(kernels, TERM="xterm"),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0
    assert re.search(r"training.*0%", done.stdout)
    assert re.search(r"statistics and pictures.*0%", done.stdout)
