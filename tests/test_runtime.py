"""Starting Taichi: when, with what, beside somebody else's, and where it keeps kernels."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest
from command_lines import ROOT

from taichi_ants import AntsError, runtime
from taichi_ants.environment import fallback_folder, is_writable_folder, prepare_for_taichi

BEGINNING = """
import sys
import numpy as np
import taichi_ants
from taichi_ants import AntsError, TrainingConfig, runtime, train
from taichi_ants.worlds import paper

config = TrainingConfig("expected_sarsa", 0.1, 0.97, 0.3, 0.9)

def trained():
    return train(paper(), config, 1, 8, 200)

def refused(text):
    try:
        trained()
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


def test_variables_of_taichi_change_no_results_and_may_name_the_cache(tmp_path):
    script = """
import os
import taichi as ti
before = dict(os.environ)
trained()
config = ti.lang.impl.current_cfg()
assert (config.arch in (ti.x64, ti.arm64), config.fast_math) == (True, False)
assert config.cpu_max_num_threads == runtime.available_threads()
assert dict(os.environ) == before
"""
    python(
        BEGINNING + script,
        tmp_path,
        TI_ARCH="cuda",
        TI_FAST_MATH="1",
        TI_LOG_LEVEL="debug",
        TI_CPU_MAX_NUM_THREADS="17",
        TI_DEFAULT_FP="64",
        TI_DEFAULT_IP="64",
        TI_OFFLINE_CACHE_FILE_PATH=str(tmp_path / "chosen"),
        XDG_CACHE_HOME=str(tmp_path / "kernels"),
    )
    assert list((tmp_path / "chosen").iterdir())
    assert not (tmp_path / "kernels").exists()


@pytest.mark.parametrize(
    ("age", "keeps_kernels"), [(3600, True), pytest.param(0, False, marks=pytest.mark.slow)]
)
def test_a_lock_that_a_killed_process_left_is_removed(tmp_path, age, keeps_kernels):
    folder = tmp_path / "taichi_ants" / "kernels"
    folder.mkdir(parents=True)
    lock = folder / "ticache.lock"
    lock.touch()
    os.utime(lock, (time.time() - age,) * 2)
    python(BEGINNING + "trained()", tmp_path, XDG_CACHE_HOME=str(tmp_path))
    assert lock.exists() != keeps_kernels  # one that is in use stays
    assert bool(list(folder.glob("*.tic"))) == keeps_kernels


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

init(cpu_max_num_threads=3)
field = ti.field(ti.i32, 4)
field.fill(7)
assert same()
assert field.to_numpy().tolist() == [7] * 4  # not restarted
assert runtime.start().threads == 3
for other in ({"threads": 1}, {"arch": "cuda"}):
    try:
        runtime.start(**other)
    except AntsError as error:
        assert "'cpu', 3 threads, and was not started by taichi_ants; leave" in str(error), error
    else:
        raise AssertionError("it was restarted")
assert field.to_numpy().tolist() == [7] * 4
assert runtime.start(threads=3, arch="cpu").threads == 3
assert same()

init(fast_math=True)
refused("destroy all fields and arrays")
ti.reset()
assert same()

for types in ({"default_fp": ti.f64}, {"default_fp": ti.f16}, {"default_ip": ti.i64}):
    init(offline_cache=False, **types)
    assert same()
    for now in (ti.lang.impl.current_cfg(), ti.lang.impl.get_runtime()):
        assert all(getattr(now, name) == one for name, one in types.items())  # still the caller's
"""
    python(BEGINNING + script, tmp_path, PYTHONWARNINGS="ignore")


@pytest.mark.long
def test_a_loud_taichi_of_the_callers_is_no_louder_for_our_kernels(tmp_path):
    """And is as loud as before afterwards; `python` demands that nothing is on stderr."""
    script = """
import contextlib
import io
import taichi as ti
from taichi_ants import Colony, trace_training
from taichi_ants.rendering import Scene

for settings in ({}, {"default_fp": ti.f64}, {"log_level": ti.CRITICAL}):
    with contextlib.redirect_stdout(io.StringIO()):
        ti.init(arch=ti.cpu, fast_math=False, offline_cache=False, **settings)
    loud = [ti.is_logging_effective(level) for level in ("debug", "info", "warn", "error")]
    trained()
    trace_training(paper(), config, 0, 2)
    colony = Colony(paper(), None, config, ants=4)
    colony.run(1, 20)
    Scene(paper().grid, (200, 160)).draw(colony.snapshot())
    after = [ti.is_logging_effective(level) for level in ("debug", "info", "warn", "error")]
    assert after == loud, (settings, after)
    assert loud == [False, not settings.get("log_level")] + [not settings.get("log_level")] * 2
"""
    python(BEGINNING + script, tmp_path, PYTHONWARNINGS="ignore")


def test_what_the_caller_keeps_in_our_taichi_is_not_destroyed(tmp_path):
    script = """
import taichi as ti

def kept(read):
    before = read()
    try:
        train(paper(), config, 1, 2, 20, threads=1)
    except AntsError as error:
        assert "has fields or arrays; leave out threads" in str(error), error
    else:
        raise AssertionError("Taichi was restarted")
    assert read() == before
    trained()
    ti.reset()
    assert runtime.start(threads=2).threads == 2

runtime.start(threads=2)
trained()
field = ti.field(ti.i32, 4)
field.fill(7)
kept(lambda: field.to_numpy().tolist())
declared = ti.field(ti.i32, 4)  # but not yet given its place
kept(lambda: None)
array = ti.ndarray(ti.f32, 3)
array.fill(2.5)
kept(lambda: array.to_numpy().tolist())
del array
assert runtime.start(threads=1).threads == 1
"""
    python(BEGINNING + script, tmp_path)


def test_all_goes_on_after_a_failed_request_for_cuda(tmp_path):
    script = """
expected = trained()
try:
    runtime.start(arch="cuda")
except AntsError as error:
    assert "no CUDA device" in str(error), error
    assert np.array_equal(trained().q_values, expected.q_values)
"""
    python(BEGINNING + script, tmp_path)


@pytest.mark.slow
def test_all_goes_on_after_a_reset_of_the_callers(tmp_path):
    """With kernels, colonies and pictures made before; a colony goes on bit for bit."""
    script = """
import contextlib
import io
import taichi as ti
from taichi_ants import Colony
from taichi_ants.rendering import Scene

def quietly(init, **settings):
    with contextlib.redirect_stdout(io.StringIO()):
        init(**settings)

def colony():
    made = Colony(paper(), None, config, ants=4, threads=2)
    made.begin_episode()
    made.tick(40)
    return made

def finished(colony):
    colony.tick(40)
    return colony.q_values, picture(colony)

def picture(colony):
    return scene.draw(colony.snapshot())

scene = Scene(paper().grid, (200, 160))
expected, (values, pixels) = trained(), finished(colony())
changes = (
    ti.reset,
    lambda: runtime.start(threads=1),
    lambda: quietly(ti.init, arch=ti.cpu, fast_math=False, log_level=ti.ERROR),
)
for change in changes:
    made = colony()
    change()
    now_values, now_pixels = finished(made)
    assert np.array_equal(now_values, values)
    assert np.array_equal(now_pixels, pixels)
    change()
    assert np.array_equal(trained().q_values, expected.q_values)
"""
    python(BEGINNING + script, tmp_path)


def test_it_is_restarted_only_for_other_settings(tmp_path):
    script = """
import taichi as ti
starts = []
init = ti.init
ti.init = lambda **settings: (starts.append(settings), init(**settings))
for threads, count in ((2, 1), (None, 1), (2, 1), (1, 2), (None, 2), (2, 3)):
    assert runtime.start(threads, "cpu").threads == threads or threads is None
    assert len(starts) == count
assert {settings["fast_math"] for settings in starts} == {False}
"""
    python(BEGINNING + script, tmp_path)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="nothing is forked here")
@pytest.mark.slow
def test_a_forked_process_is_told_to_be_spawned(tmp_path):
    """All that launches kernels, also what was made before; a fork before the start is fine."""
    script = """
import multiprocessing
from taichi_ants import Colony, evaluate, rollout, trace_training
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
table = trained().q_values[0, 0]
colony = Colony(paper(), None, config, ants=4)
colony.begin_episode()
colony.tick()
scene = Scene(paper().grid, (200, 160))
snapshot = colony.snapshot()
colony.save("colony.npz")
for work in (
    trained,
    lambda: evaluate(paper(), table),
    lambda: rollout(paper(), table),
    lambda: trace_training(paper(), config),
    lambda: Colony(paper(), None, config, ants=4),
    lambda: Colony.load("colony.npz"),
    lambda: colony.tick(),
    lambda: colony.run(1, 10),
    lambda: scene.draw(snapshot),
    lambda: Scene(paper().grid, (200, 160)).draw(snapshot),
):
    said = in_a_fork(work)
    assert said.startswith("this process was forked") and '"spawn"' in said, said
    assert said.count("forked") == 1
colony.tick()
trained()
"""
    python(BEGINNING + script, tmp_path, PYTHONWARNINGS="ignore")


def test_the_import_of_taichi_warns_of_nothing(tmp_path):
    """Python 3.11 and later have a warning for a function that Taichi calls."""
    for first in (
        "from taichi_ants import runtime as r; r.start()",
        # As in a notebook, of which Taichi would tell.
        "import io, sys; sys.stdout = io.StringIO(); from taichi_ants import learners",
    ):
        python(first, tmp_path, PYTHONWARNINGS="default")


@pytest.mark.parametrize(
    ("threads", "says"),
    [
        *((0, "threads is 0; it must lie between 1 and 1024."), (1025, "threads is 1025;")),
        *((1.0, "threads is 1.0; it must be a whole number."), (True, "threads is True;")),
        ("2", "threads is '2';"),
    ],
)
def test_threads(threads, says):
    with pytest.raises(AntsError) as caught:
        runtime.start(threads)
    assert str(caught.value).startswith(says)


def test_architectures():
    with pytest.raises(AntsError, match=r"^arch is 'metal'; it must be one of cpu, cuda\.$"):
        runtime.start(arch="metal")


def test_threads_are_those_that_this_process_may_use(monkeypatch):
    monkeypatch.setattr(runtime, "_QUOTAS", ())
    if hasattr(os, "sched_getaffinity"):
        assert runtime.available_threads() == len(os.sched_getaffinity(0))
    assert runtime.available_threads() >= 1


@pytest.mark.parametrize(
    ("contents", "threads"),
    [
        (["150000 100000\n"], 2),
        (["100000 100000\n"], 1),
        (["50000\n", "100000\n"], 1),  # half a processor
        (["max 100000\n"], 64),  # no quota
        (["-1\n", "100000\n"], 64),
        (["?"], 64),
        ([], 64),
    ],
)
def test_a_container_grants_time(contents, threads, monkeypatch, tmp_path):
    names = tuple(str(tmp_path / str(k)) for k in range(max(1, len(contents))))
    for name, text in zip(names, contents, strict=False):
        Path(name).write_text(text)
    monkeypatch.setattr(runtime, "_QUOTAS", (names,))
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: range(64), raising=False)
    assert runtime.available_threads() == threads


def test_writable_folders(tmp_path):
    (tmp_path / "file").write_text("x")
    assert is_writable_folder(str(tmp_path))
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    for path in ("", "/proc/nope", str(tmp_path / "file"), str(tmp_path / "new"), "a\0b"):
        assert not is_writable_folder(path), path


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def test_the_fallback_folder_is_the_users_alone(temporary):
    folder = Path(fallback_folder())
    assert folder.parent == temporary
    assert folder.stat().st_mode & 0o777 == 0o700
    assert fallback_folder() == str(folder)


def test_a_fallback_folder_of_somebody_else_is_not_used(temporary, monkeypatch):
    """Somebody could have put kernels there that do as they like."""
    usual = fallback_folder()
    real = os.lstat

    def of_somebody_else(path):
        values = list(real(path))
        values[4] = 12345
        return os.stat_result(values)

    monkeypatch.setattr(os, "lstat", of_somebody_else)
    other = fallback_folder()
    assert other != usual
    assert Path(other).parent == temporary


def test_a_file_in_place_of_the_fallback_folder(temporary):
    usual = Path(fallback_folder())
    usual.rmdir()
    usual.write_text("in the way")
    other = fallback_folder()
    assert other != str(usual)
    assert is_writable_folder(other)


@pytest.mark.parametrize("home", [None, "", "/proc/nope"])
def test_a_home_that_cannot_be_used_is_replaced(home, temporary, monkeypatch):
    if home is None:
        monkeypatch.delenv("HOME", raising=False)
    else:
        monkeypatch.setenv("HOME", home)
    prepare_for_taichi()
    assert os.environ["HOME"] == fallback_folder()


def test_what_the_user_has_set_stays(temporary, monkeypatch):
    monkeypatch.setenv("HOME", str(temporary))
    monkeypatch.setenv("ENABLE_TAICHI_HEADER_PRINT", "1")
    monkeypatch.delenv("TI_SKIP_VERSION_CHECK", raising=False)
    prepare_for_taichi()
    assert os.environ["HOME"] == str(temporary)
    assert os.environ["ENABLE_TAICHI_HEADER_PRINT"] == "1"
    assert os.environ["TI_SKIP_VERSION_CHECK"] == "ON"
    monkeypatch.setenv("TI_SKIP_VERSION_CHECK", "ON")  # so that it is put back


def test_an_error_in_a_kernel_tells_its_line_and_costs_no_marks_below_it(tmp_path):
    """Taichi draws a mark for each expression, also where nothing is wrong."""
    (tmp_path / "wrong.py").write_text(
        BEGINNING
        + """
runtime.start()
import taichi as ti

@ti.kernel
def wrong() -> ti.i32:
    return 1 + nothing

def complaint():
    try:
        wrong()
    except ti.TaichiCompilationError as error:
        return str(error)

with runtime.quiet():
    told = complaint()
assert "wrong.py" in told and "in wrong:" in told and "return 1 + nothing" in told, told
assert '"nothing" is not defined' in told and "^" not in told, told
assert "^" in complaint()
"""
    )
    python("import runpy; runpy.run_path('wrong.py')", tmp_path)


def test_kernels_flush_subnormal_numbers_but_their_caller_does_not(tmp_path):
    """Serial kernels, which the calling thread computes, and parallel ones."""
    script = """
import platform
tiny = sys.float_info.min
trained()

import taichi as ti
from taichi_ants.engines.arguments import Launch

assert tiny / 2 > 0.0 and np.float64(tiny) / 2 > 0.0

def halves(serial, arguments):
    @ti.kernel
    def halve(a: arguments):
        ti.loop_config(serialize=serial)
        for i in range(4):
            a.numbers[i] = a.numbers[i] * 0.5
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


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no such names")
@pytest.mark.parametrize("name", ["XDG_CACHE_HOME", "TI_OFFLINE_CACHE_FILE_PATH"])
def test_a_cache_folder_that_is_not_utf8_is_refused(tmp_path, name):
    folder = os.fsencode(tmp_path) + b"/caf\xe9"
    os.mkdir(folder)
    script = BEGINNING + 'refused("not UTF-8, which Taichi cannot read; set XDG_CACHE_HOME or ")'
    python(script, tmp_path, **{name: os.fsdecode(folder)})
