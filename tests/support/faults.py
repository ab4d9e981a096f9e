"""Fault injection: commands that are killed, or find the disk full, at a file operation.

Commands run in forked processes, which cannot run kernels. Instead they use the engines' results of
the first run, see `remember`.
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

import colony
import compare
import pytest
from command_lines import assert_one_sentence, load

from taichi_ants import Task, files
from taichi_ants.analysis.bounds import baselines
from taichi_ants.files import results as result_files
from taichi_ants.studies import result_folder
from taichi_ants.studies.points import ColonyPoint, RunPoint

KILLED, WENT_ON = 77, 78  # exit statuses


def remember(patch: pytest.MonkeyPatch) -> None:
    """Cache the results of the engines, and remove times from results."""
    for owner, name in (
        *((RunPoint, "do"), (ColonyPoint, "do"), (compare, "what_policies_do")),
        *((baselines, "bound_rows"), (baselines, "policy_rows")),
        *((colony, "_drawn"), (colony, "limits_of")),
    ):
        known = _remembered(getattr(owner, name))
        patch.setattr(owner, name, staticmethod(known) if isinstance(owner, type) else known)
    made = result_folder.provenance(["command"])
    patch.setattr(result_folder, "provenance", lambda arguments: made)
    patch.setattr(result_folder, "time", SimpleNamespace(perf_counter=lambda: 0.0))
    patch.setattr(result_files, "seconds_of", lambda folder: 0.0)


def _remembered(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that caches results by its first argument and a task or tuple."""
    known: dict[Any, Any] = {}

    def remembering(first: Any, *others: Any) -> Any:
        what = first, others[0] if others and isinstance(others[0], (tuple, Task)) else None
        if what not in known:
            known[what] = function(first, *others)
        return known[what]

    return remembering


def run(name: str, arguments: Sequence[object], out: io.StringIO | None = None) -> tuple[int, str]:
    """Return exit status and standard error of a command run in this process.

    Args:
        out: A stream for its standard output.
    """
    said = io.StringIO()
    with contextlib.redirect_stdout(out or io.StringIO()), contextlib.redirect_stderr(said):
        try:
            load(name).main([str(argument) for argument in arguments])
        except SystemExit as end:
            return int(end.code or 0), said.getvalue()
    raise AssertionError("a command ends by exiting")


def everything(folder: Path) -> dict[str, bytes | None]:
    """Return all files with their contents, and all folders as None, below a folder."""
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
    """Assert that a command gives the same results if it is rerun after a fault.

    Tests a fault at every third file operation.

    Args:
        fault: `killed` or `full`.
        name, arguments: The command, which writes only to the folder `out`.
        out: A new folder; the function makes others in the same folder.

    Returns:
        The number of file operations, or up to two more.
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
        ended_with = run(name, [*arguments, "--out", place])
        assert ended_with == (0, ""), f"operation {number}: {ended_with}"
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
    """Run a command with a fault, then exit this forked process."""
    status = 1
    try:
        has_come = fault(number, place)
        status, complaint = run(name, arguments)
        said.write_text(complaint, "utf-8")
        status = status if has_come() else WENT_ON
    finally:
        os._exit(status)


def killed(number: int, place: Path) -> Callable[[], bool]:
    """Kill this process before change `number`, from 0, below `place`.

    Returns:
        A function that returns False, because the process would not be alive after the fault.
    """
    tempfile._O_TMPFILE_WORKS = False  # type: ignore[attr-defined]  # give every file a name
    done = [0]

    def hook(event: str, details: tuple) -> None:
        if _makes(event, details, place) or _removes(event, details, place):
            if done[0] == number:
                os._exit(KILLED)
            done[0] += 1

    sys.addaudithook(hook)
    return lambda: False


def full(number: int, place: Path) -> Callable[[], bool]:
    """Refuse all writes below `place` after the first `number` of them.

    Returns:
        A function that returns whether a write has been refused.
    """
    done = [0]

    def is_full() -> bool:
        return done[0] > number

    def hook(event: str, details: tuple) -> None:
        if _makes(event, details, place):
            done[0] += 1
            if is_full() and event != "open":
                raise OSError(28, os.strerror(28))

    def opened(path: Any, mode: str, **others: Any) -> Any:
        file = open(path, mode, **others)  # the file appears, but remains empty  # noqa: SIM115
        return open("/dev/full", "wb") if is_full() and mode == "wb" else file

    files.open = opened  # type: ignore[attr-defined]
    sys.addaudithook(hook)
    return is_full


def _makes(event: str, details: tuple, place: Path) -> bool:
    """Return whether an audit event makes or moves a file or folder below `place`."""
    path = str(details[0]) if event in ("open", "os.mkdir", "os.rename") else ""
    if not path.startswith(str(place)):
        return False
    made = details[2] & os.O_CREAT if event == "open" else not os.path.exists(path)
    return bool(made) or event == "os.rename"


def _removes(event: str, details: tuple, place: Path) -> bool:
    """Return whether an audit event removes a file or folder below `place`."""
    if event not in ("os.remove", "os.rmdir"):
        return False
    in_a_tree = details[1] != -1  # the path is relative to this folder
    return in_a_tree or (str(details[0]).startswith(str(place)) and os.path.exists(details[0]))
