"""Starting Taichi: when, with what, beside somebody else's, and where it keeps kernels."""

import os
import subprocess
import sys
import tempfile

import pytest
from command_lines import ROOT

from taichi_ants.process_variables import fallback_folder, prepare_for_taichi

BEGINNING = """
import sys
import numpy as np
import taichi_ants
from taichi_ants import AntsError, TrainingConfig, runtime, train
from taichi_ants.worlds import paper

config = TrainingConfig("expected_sarsa", 0.1, 0.97, 0.3, 0.9)

def trained():
    return train(paper(), config, 1, 8, 200)

def refused(text, work=trained):
    try:
        work()
    except AntsError as error:
        assert text in str(error), error
    else:
        raise AssertionError("nothing was refused")
"""


def python(script, folder, **changes):
    """Run a script in a process of its own; it must say nothing."""
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), **changes},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert (done.stdout, done.stderr) == ("", "")


def test_taichi_starts_when_it_is_needed_and_says_nothing(tmp_path):
    script = """
import sys
import taichi_ants
taichi_ants.World, taichi_ants.TrainingConfig, taichi_ants.reference, taichi_ants.states
from taichi_ants import analysis, worlds
from taichi_ants.analysis import findings, results, statistics, tables
assert "taichi" not in sys.modules
"""
    python(script, tmp_path)
    script = """
import taichi as ti
assert ti.lang.impl.get_runtime().prog is None
trained()
config = ti.lang.impl.current_cfg()
assert config.arch in (ti.x64, ti.arm64)
assert not config.fast_math
assert runtime.start() == runtime.Runtime("cpu", runtime.available_threads())
"""
    python(BEGINNING + script, tmp_path, XDG_CACHE_HOME=str(tmp_path / "kernels"))
    assert list((tmp_path / "kernels" / "taichi_ants" / "kernels").iterdir())


def test_several_threads_start_it_at_once(tmp_path):
    script = """
from concurrent.futures import ThreadPoolExecutor
with ThreadPoolExecutor(4) as pool:
    made = [pool.submit(trained) for _ in range(4)]
assert all((one.result().q_values == trained().q_values).all() for one in made)
"""
    python(BEGINNING + script, tmp_path)


def test_beside_a_taichi_of_the_callers(tmp_path):
    """It is used as it is, and refused if it would change results."""
    script = """
import contextlib
import io
import taichi as ti
expected = trained()

def same():
    ours = trained()
    return np.array_equal(ours.returns, expected.returns) and (
        np.array_equal(ours.q_values, expected.q_values)
    )

def init(**settings):
    with contextlib.redirect_stdout(io.StringIO()):
        ti.init(**{"arch": ti.cpu, "fast_math": False, "log_level": ti.ERROR, **settings})

field = ti.field(ti.i32, 4)  # in the Taichi that this package has started
more = runtime.start().threads + 1
refused("and has fields or arrays; leave", lambda: runtime.start(threads=more))
assert same()

init(cpu_max_num_threads=3)
field = ti.field(ti.i32, 4)
field.fill(7)
assert same()
assert field.to_numpy().tolist() == [7] * 4  # not restarted
assert runtime.start().threads == 3
for other in ({"threads": 1}, {"arch": "cuda"}):
    said = "'cpu', 3 threads, and was not started by taichi_ants; leave"
    refused(said, lambda: runtime.start(**other))
assert field.to_numpy().tolist() == [7] * 4
assert runtime.start(threads=3, arch="cpu").threads == 3
assert same()

init(fast_math=True)
refused("destroy all fields and arrays")
ti.reset()
assert same()

init(offline_cache=False, default_fp=ti.f64, default_ip=ti.i64)
assert same()
for now in (ti.lang.impl.current_cfg(), ti.lang.impl.get_runtime()):
    assert (now.default_fp, now.default_ip) == (ti.f64, ti.i64)  # still the caller's
"""
    python(BEGINNING + script, tmp_path, PYTHONWARNINGS="ignore")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="nothing is forked here")
@pytest.mark.slow
def test_a_forked_process_is_told_to_be_spawned(tmp_path):
    """A forked process cannot launch kernels, unless it was forked before Taichi started."""
    script = """
import multiprocessing
from taichi_ants import Colony
from taichi_ants.rendering import Scene

def in_a_fork(work):
    context = multiprocessing.get_context("fork")
    reader, writer = context.Pipe()
    process = context.Process(target=lambda: writer.send(said_by(work)))
    process.start()
    process.join(60)
    assert process.exitcode == 0
    return reader.recv()

def said_by(work):
    try:
        work()
    except AntsError as error:
        return str(error)
    return "done"

assert in_a_fork(trained) == "done"
trained()
colony = Colony(paper(), None, config, ants=4)
colony.begin_episode()
snapshot = colony.snapshot()
scene = Scene(paper().grid, (200, 160))
for work in (trained, lambda: colony.run(1, 10), lambda: scene.draw(snapshot)):
    said = in_a_fork(work)
    assert said.startswith("this process was forked") and '"spawn"' in said, said
colony.run(1, 10)
trained()
"""
    python(BEGINNING + script, tmp_path, PYTHONWARNINGS="ignore")


@pytest.mark.parametrize("home", ["", "/proc/nope"])
def test_a_home_that_cannot_be_used_is_replaced(home, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setenv("HOME", home)
    prepare_for_taichi()
    assert os.environ["HOME"] == fallback_folder()


def test_kernels_flush_subnormal_numbers_but_their_caller_does_not(tmp_path):
    """Serial kernels, which the calling thread computes, and parallel ones."""
    script = """
import platform
tiny = sys.float_info.min
trained()

import taichi as ti
from taichi_ants.engines.launch import Launch

assert tiny / 2 > 0.0 and np.float64(tiny) / 2 > 0.0

def halves(serial, arguments):
    @ti.kernel
    def halve(a: arguments):
        ti.loop_config(serialize=serial)
        for i in range(4):
            a[i] = a[i] * 0.5
    return halve

for serial in (True, False):
    numbers = np.full(4, tiny)
    Launch(lambda arguments: halves(serial, arguments))({"numbers": numbers})
    if platform.machine() == "x86_64":
        assert not numbers.any()
    assert tiny / 2 > 0.0
"""
    script_file = tmp_path / "halves.py"  # Taichi reads the source of kernels
    script_file.write_text(BEGINNING + script, encoding="utf-8")
    python(f"import runpy; runpy.run_path({str(script_file)!r})", tmp_path)
