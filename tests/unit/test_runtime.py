"""Starting Taichi: when, with what, beside somebody else's, and where it keeps kernels."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from command_lines import environment

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
        env=environment(folder / "kernels", **changes),
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
from taichi_ants.analysis import claims, figures, report, summary, table2
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
    python(BEGINNING + script, tmp_path)
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
        TI_OFFLINE_CACHE_FILE_PATH=str(tmp_path / "chosen"),
    )
    assert list((tmp_path / "chosen").iterdir())
    assert not (tmp_path / "kernels").exists()


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
assert runtime.start(threads=1).threads == 1
assert same()

init(fast_math=True)
refused("fast_math")
ti.reset()
assert same()

init(default_fp=ti.f64)
assert same()
"""
    python(BEGINNING + script, tmp_path, PYTHONWARNINGS="ignore")


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


def test_threads_are_those_that_this_process_may_use():
    if hasattr(os, "sched_getaffinity"):
        assert runtime.available_threads() == len(os.sched_getaffinity(0))
    assert runtime.available_threads() >= 1


def test_writable_folders(tmp_path):
    (tmp_path / "file").write_text("x")
    assert is_writable_folder(str(tmp_path))
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    for path in ("", "/proc", "/proc/nope", str(tmp_path / "file"), str(tmp_path / "new"), "a\0b"):
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


@pytest.mark.parametrize("home", [None, "", "/proc/nope", "/proc"])
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
