"""Runs the command lines of `experiments/` for tests: as a process, or within this one."""

from __future__ import annotations

import importlib
import os
import runpy
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXPERIMENTS = ROOT / "experiments"


def crowding() -> float:
    """How many processes have wanted each core of late, at least 1; what is timed takes as long."""
    return max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))


def promptly() -> float:
    """Seconds in which a process ends that is stopped; alone it takes one or two."""
    return 4.0 * crowding()


def environment(kernels: Path, **changes: str | None) -> dict[str, str]:
    """The environment of a process that keeps compiled kernels in a folder; None removes a name."""
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    wanted = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(paths),
        "XDG_CACHE_HOME": str(kernels),
        "COLUMNS": "100",
        **changes,
    }
    return {name: value for name, value in wanted.items() if value is not None}


def command(name: str, arguments: Sequence[object]) -> list[str]:
    """The command line of an experiment."""
    return [sys.executable, str(EXPERIMENTS / f"{name}.py"), *map(str, arguments)]


def run(
    name: str, arguments: Sequence[object], kernels: Path, folder: Path, **changes: str | None
) -> subprocess.CompletedProcess[str]:
    """Run an experiment in a process of its own, in a folder, to its end."""
    return subprocess.run(
        command(name, arguments),
        cwd=folder,
        env=environment(kernels, **changes),
        capture_output=True,
        text=True,
        timeout=300,
    )


def start(
    name: str, arguments: Sequence[object], kernels: Path, folder: Path, **settings: object
) -> subprocess.Popen[str]:
    """Start an experiment in a process of its own, in a folder; what it writes can be read."""
    return subprocess.Popen(
        command(name, arguments),
        cwd=folder,
        env=environment(kernels),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **settings,
    )


def load(name: str) -> ModuleType:
    """A command as a module."""
    return importlib.import_module(f"taichi_ants.commands.{name}")


Outcome = tuple[int, str, str]


def call(name: str, arguments: Sequence[object], capsys: pytest.CaptureFixture[str]) -> Outcome:
    """Run an experiment within this process; exit status, standard output and error."""
    capsys.readouterr()
    with pytest.raises(SystemExit) as exit_:
        load(name).main([str(argument) for argument in arguments])
    written = capsys.readouterr()
    return exit_.value.code, written.out, written.err


def call_script(
    name: str, arguments: Sequence[object], capsys: pytest.CaptureFixture[str]
) -> Outcome:
    """Run a script of an experiment, which is no command, within this process."""
    capsys.readouterr()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", [f"{name}.py", *map(str, arguments)])
        with pytest.raises(SystemExit) as exit_:
            runpy.run_path(str(EXPERIMENTS / f"{name}.py"), run_name="__main__")
    written = capsys.readouterr()
    return exit_.value.code, written.out, written.err


def contents(folder: Path) -> dict[str, bytes]:
    """All files below a folder by their path, with what is in them."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def assert_one_sentence(stderr: str) -> None:
    """One line that says what is wrong: no traceback, no usage."""
    assert stderr.startswith("error: ")
    assert stderr.endswith(".\n")
    assert stderr.count("\n") == 1


Caller = Callable[[Sequence[object]], Outcome]
