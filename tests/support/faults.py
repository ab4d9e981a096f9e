"""Commands that are killed, or find the disk full, at each of their file operations in turn.

A command runs in forked processes, which cannot run kernels. They need not: what the engines give
is remembered from the first time, see `remember`.
"""

from __future__ import annotations

import contextlib
import io
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NoReturn

import pytest
from command_lines import assert_one_sentence, load

from taichi_ants import Task, files
from taichi_ants.analysis.bounds import baselines
from taichi_ants.files.results import ResultFolder
from taichi_ants.report import results
from taichi_ants.studies import colony_study, result_folder, runner

KILLED, WENT_ON = 77, 78  # how processes end


def remember(patch: pytest.MonkeyPatch) -> None:
    """Let the same work give the same at once, and let all results be made at the same time."""
    for owner, name in (
        *((runner.RunPoint, "do"), (runner.ColonyPoint, "do"), (results, "what_policies_do")),
        *((baselines, "bound_rows"), (baselines, "policy_rows")),
        *((colony_study, "_drawn"), (colony_study, "limits_of")),
    ):
        known = _remembered(getattr(owner, name))
        patch.setattr(owner, name, staticmethod(known) if isinstance(owner, type) else known)
    made = result_folder.provenance(["command"])
    patch.setattr(result_folder, "provenance", lambda arguments: made)
    patch.setattr(result_folder, "time", SimpleNamespace(perf_counter=lambda: 0.0))
    patch.setattr(ResultFolder, "_seconds_so_far", lambda folder: 0.0)


def _remembered(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that is called once for each of the things that tell its calls apart."""
    known: dict[Any, Any] = {}

    def remembering(first: Any, *others: Any) -> Any:
        what = first, others[0] if others and isinstance(others[0], (tuple, Task)) else None
        if what not in known:
            known[what] = function(first, *others)
        return known[what]

    return remembering


def run(name: str, arguments: Sequence[object], out: io.StringIO | None = None) -> tuple[int, str]:
    """Run a command here; its exit status, and what it has said on standard error.

    Args:
        out: Takes what it prints.
    """
    said = io.StringIO()
    with contextlib.redirect_stdout(out or io.StringIO()), contextlib.redirect_stderr(said):
        try:
            load(name).main([str(argument) for argument in arguments])
        except SystemExit as end:
            return int(end.code or 0), said.getvalue()
    raise AssertionError("a command ends by exiting")


def everything(folder: Path) -> dict[str, bytes | None]:
    """All files and folders below a folder, with what is in the files."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
        for path in sorted(folder.rglob("*"))
    }


def assert_it_survives(
    fault: Callable[[int, Path], Callable[[], bool]],
    name: str,
    arguments: Sequence[object],
    out: Path,
) -> int:
    """After a fault at every third file operation, a command ends as if there had been none.

    Args:
        fault: `killed` or `full`.
        name, arguments: The command, which writes to the folder `out` alone.
        out: A new folder; others are made beside it.

    Returns:
        How many operations there were, up to two more.
    """
    assert run(name, [*arguments, "--out", out]) == (0, "")
    expected = everything(out)
    for number in range(fault is full, 1000, 3):
        place = out.with_name(f"{fault.__name__}-{number}")
        said = out.with_name("said")
        process = os.fork()
        if process == 0:
            _end_with_a_fault(fault, number, name, [*arguments, "--out", place], place, said)
        ended = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
        if ended == WENT_ON:
            assert everything(place) == expected
            return number
        if ended != KILLED:
            assert ended == 2
            assert_one_sentence(said.read_text("utf-8"))
        assert run(name, [*arguments, "--out", place]) == (0, ""), f"operation {number}"
        assert everything(place) == expected, f"operation {number}"
        shutil.rmtree(place)
    raise AssertionError("it does not come to an end")


def _end_with_a_fault(
    fault: Callable[[int, Path], Callable[[], bool]],
    number: int,
    name: str,
    arguments: Sequence[object],
    place: Path,
    said: Path,
) -> NoReturn:
    """Run a command in a process that was forked for it, to its end."""
    status = 1
    try:
        has_come = fault(number, place)
        status, complaint = run(name, arguments)
        said.write_text(complaint, "utf-8")
        status = status if has_come() else WENT_ON
    finally:
        os._exit(status)


def killed(number: int, place: Path) -> Callable[[], bool]:
    """Kill this process before it changes something in a place, counted from 0."""
    tempfile._O_TMPFILE_WORKS = False  # type: ignore[attr-defined]  # as where all files have names
    done = [0]

    def hook(event: str, details: tuple) -> None:
        if _makes(event, details, place) or _removes(event, details, place):
            if done[0] == number:
                os._exit(KILLED)
            done[0] += 1

    sys.addaudithook(hook)
    return lambda: False


def full(number: int, place: Path) -> Callable[[], bool]:
    """Let nothing be written in a place from one time on, counted from 0; whether it has come."""
    done = [0]

    def is_full() -> bool:
        return done[0] > number

    def hook(event: str, details: tuple) -> None:
        if _makes(event, details, place):
            done[0] += 1
            if is_full() and event != "open":
                raise OSError(28, os.strerror(28))

    def opened(path: Any, mode: str, **others: Any) -> Any:
        file = open(path, mode, **others)  # it can be made, but nothing goes into it  # noqa: SIM115
        return open("/dev/full", "wb") if is_full() and mode == "wb" else file

    files.open = opened  # type: ignore[attr-defined]
    sys.addaudithook(hook)
    return is_full


def _makes(event: str, details: tuple, place: Path) -> bool:
    """Whether an audit event is of a file or folder that is made or moved in a place."""
    path = str(details[0]) if event in ("open", "os.mkdir", "os.rename") else ""
    if not path.startswith(str(place)):
        return False
    made = details[2] & os.O_CREAT if event == "open" else not os.path.exists(path)
    return bool(made) or event == "os.rename"


def _removes(event: str, details: tuple, place: Path) -> bool:
    """Whether an audit event is of something that is removed from a place."""
    if event not in ("os.remove", "os.rmdir"):
        return False
    in_a_tree = details[1] != -1  # its path is told from there on
    return in_a_tree or (str(details[0]).startswith(str(place)) and os.path.exists(details[0]))
