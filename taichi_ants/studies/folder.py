"""Folders of results: study, runs, sessions, and finished tables.

- `study.json`: the module of the study, its options and settings, and all runs that it asks for.
- `inputs/`: copies of the files that the study has read.
- `blocks/`: the runs, see `studies.store`.
- `sessions/`: a file for each process that has computed, with its command, versions and machine.
- `manifest.json`: the checksums of tables and figures, once all runs are there.

No process changes the files of another one, so several can work in a folder without a lock.
"""

from __future__ import annotations

import datetime
import hashlib
import json
import os
import platform
import re
import shlex
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache, partial
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants import __version__, files, runtime
from taichi_ants.errors import AntsError, shown
from taichi_ants.settings import flat
from taichi_ants.studies.store import BLOCKS, Arrays, Store
from taichi_ants.studies.study import FailedBlocksError, Study

STUDY, MANIFEST, REPORT, PAGE = "study.json", "manifest.json", "report.txt", "report.html"
INPUTS, SESSIONS = "inputs", "sessions"
_OF_ALL = (STUDY, INPUTS, BLOCKS, SESSIONS)
_BESIDE_SETTINGS = "physics", "version", "plugin", "arch"  # what else determines results
# Packages that results depend on, if this package runs without being installed, and extras.
_DIRECT, _EXTRAS = ("taichi", "numpy", "scipy", "matplotlib"), ("pyarrow", "ray")
_version, _requires = cache(metadata.version), cache(metadata.requires)  # as each takes 2 ms


@dataclass(frozen=True)
class Results:
    """Runs of a study, from which it writes its tables and figures into a folder.

    Attributes:
        made: The command, time, source, versions and machine, for pages.
        figures, parquet: Whether to draw figures, and to write Parquet files too.
        part: Whether runs can be missing.
        arch: The processor of the simulation.
    """

    study: Study
    folder: Path
    store: Store
    made: Mapping[str, Any]
    figures: bool
    parquet: bool
    part: bool
    arch: str

    @property
    def read(self) -> Callable[..., Arrays]:
        """The method `read` of the store, for all seeds: it takes keys of points, and `arrays`."""
        return partial(self.store.read, seeds=self.study.seeds, part=self.part)

    @property
    def present(self) -> np.ndarray:
        """The runs that are there, bool (points, seeds)."""
        return ~self.study.missing(self.store)


def asked_in(folder: Path) -> dict[str, Any]:
    """Return what was asked for in a folder; AntsError if nothing was, or it is damaged."""
    asked = json_in(folder / STUDY)
    if asked is None:
        raise AntsError(f"{files.named(folder)} has no results; name the folder of a study.")
    return asked


def json_in(path: Path) -> dict[str, Any] | None:
    """Return the facts in a file of `write_json`; None if it is missing, AntsError if damaged."""
    if not path.exists():
        return None
    try:
        facts = json.loads(files.read_text(path))
        if facts.pop("checksum") == files.checksum_of_json(facts):
            return facts
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        pass
    raise AntsError(
        f"{files.named(path)} is damaged; remove it and run the command of this folder again, "
        "which finds all finished runs."
    )


def write_json(path: Path, facts: Mapping[str, Any]) -> None:
    """Write facts with their checksum."""
    contents = {**facts, "checksum": files.checksum_of_json(facts)}
    files.write_text(path, files.to_json(contents, indent=1) + "\n")


def ask(folder: Path, asked: Mapping[str, Any], inputs: Mapping[str, bytes], force: bool) -> None:
    """Write down what a study asks for, and copies of the files that it has read.

    `inputs` are their contents by their paths in the folder. Raises an AntsError, except with
    `force`, if the folder has other files, or points or seeds that the study lacks.
    """
    before = json_in(folder / STUDY)
    if before == asked:
        return
    has_others = folder.is_dir() and any(p.name not in _OF_ALL for p in folder.glob("[!.]*"))
    if before is None and has_others and not force:
        raise AntsError(
            f"{files.named(folder)} contains files, but no results; choose another --out, or give "
            "--force to add results to them."
        )
    if before and not force:
        _check_grows(folder, before, asked)
    for name, content in inputs.items():
        files.write_bytes(folder / name, content)
    write_json(folder / STUDY, asked)


def _check_grows(folder: Path, before: Mapping[str, Any], asked: Mapping[str, Any]) -> None:
    """Raise AntsError, which names what differs, if a study lacks what a folder has."""
    if all({*before[runs]} <= {*asked[runs]} for runs in ("points", "seeds")):
        return
    there, here = (
        {**{name: facts[name] for name in _BESIDE_SETTINGS}, **flat(facts["settings"])}
        for facts in (before, asked)
    )
    names = [name for name in {**there, **here} if there.get(name) != here.get(name)]
    words = (f"{n} is {shown(there.get(n), 40)} instead of {shown(here.get(n), 40)}" for n in names)
    raise AntsError(
        f"{files.named(folder)} contains results that this study lacks ({', '.join(words)}); "
        "choose another --out, or give --force to replace them."
    )


@contextmanager
def session(folder: Path, shard: tuple[int, int]) -> Iterator[None]:
    """Return a context in which a file says that this process computes, and then how it ended."""
    name = f"{time.strftime('%Y%m%dT%H%M%S')}-{socket.gethostname()}-{os.getpid()}.json"
    path, began = folder / SESSIONS / name, time.time()
    facts = {**provenance(sys.argv), "shard": shard, "began": began, "seconds": None, "failed": []}
    files.write_text(path, files.to_json(facts, indent=1))
    try:
        yield
    except FailedBlocksError as error:
        facts["failed"] = error.blocks
        raise
    finally:
        facts["seconds"] = time.time() - began
        with suppress(AntsError):  # the disk is full, which is the error to report
            files.write_text(path, files.to_json(facts, indent=1))


def sessions_in(folder: Path) -> list[dict[str, Any]]:
    """Return the facts about all processes that have computed in a folder, oldest first."""
    sessions = []
    for path in sorted((folder / SESSIONS).glob("*.json")):
        with suppress(ValueError):  # it is damaged; includes AntsError
            sessions.append(json.loads(files.read_text(path)))
    return sorted(sessions, key=lambda facts: facts["began"])


def is_finished(folder: Path, asked: Mapping[str, Any], manifest: Mapping[str, Any]) -> bool:
    """Return whether a folder has all files of a manifest, unchanged, as they were asked for."""
    return manifest.get("study") == files.checksum_of_json(asked) and all(
        (folder / name).is_file() and checksum_of(folder / name) == checksum
        for name, checksum in manifest["files"].items()
    )


def finished(folder: Path) -> dict[str, Any]:
    """Return the manifest of a folder; AntsError unless all its files are there, unchanged."""
    asked, manifest = asked_in(folder), json_in(folder / MANIFEST) or {}
    if not is_finished(folder, asked, manifest):
        raise AntsError(
            f"{files.named(folder)} has no finished results, or some of them have changed; run the "
            "command of this folder again, which writes what is missing."
        )
    return manifest


def checksum_of(path: Path) -> str:
    """Return the hexadecimal SHA-256 of a file."""
    with files.opened(path) as file:
        return hashlib.sha256(file.read()).hexdigest()


def provenance(arguments: Sequence[str]) -> dict[str, Any]:
    """Return the command, time, source, versions and machine, for the manifest of results.

    A command with an absolute path, as an installed one has, is recorded by its name alone.
    """
    program, *options = arguments
    if os.path.isabs(program):
        program = Path(program).name.replace("__main__.py", "taichi-ants")
    return {
        "command": shlex.join((program, *options)),
        "finished": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"),
        **source(),
        "python": platform.python_version(),
        "packages": packages(),
        "platform": platform.platform(),
        "processor": runtime.processor(),
        "cpus": os.cpu_count(),
    }


@cache
def source() -> dict[str, Any]:
    """Return the `commit` of this package's source, and whether it was `clean`.

    Clean means that no tracked file differed from the commit. Both are None outside of a checkout.
    """
    root = Path(__file__).resolve().parents[2]
    command = ["git", "describe", "--always", "--abbrev=40", "--exclude=*", "--dirty"]
    how: dict[str, Any] = {"stderr": subprocess.DEVNULL, "text": True, "timeout": 10}
    with suppress(OSError, subprocess.SubprocessError):
        if (root / ".git").exists():
            said = subprocess.check_output(command, cwd=root, **how).strip()
            return {"commit": said.partition("-")[0], "clean": "-" not in said}
    return {"commit": None, "clean": None}


def packages(also: Iterable[str] = ()) -> dict[str, str]:
    """Return the versions of this package and of those that it depends on, also indirectly.

    Includes extras that this process has imported, and installed packages in `also`.
    """
    versions = dict[str, str]()
    waiting = ["taichi-ants", *_DIRECT, *(name for name in _EXTRAS if name in sys.modules), *also]
    for name in waiting:  # which grows
        with suppress(metadata.PackageNotFoundError):
            if name not in versions:
                versions[name] = _version(name)
                needed = (line for line in _requires(name) or () if "extra ==" not in line)
                names = (re.split(r"[^\w.-]", line, maxsplit=1)[0] for line in needed)
                waiting += [re.sub(r"[-_.]+", "-", name).lower() for name in names]
    versions.pop("taichi-ants", None)
    return {"taichi_ants": __version__, **dict(sorted(versions.items()))}
