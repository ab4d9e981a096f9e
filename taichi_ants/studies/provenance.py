"""Facts about a run that do not determine its results: command, time, source, versions, machine."""

from __future__ import annotations

import datetime
import os
import platform
import shlex
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from email.message import Message
from email.parser import HeaderParser
from importlib import metadata
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from taichi_ants import __version__

# Packages that results depend on, if this package runs without being installed.
_DIRECT = ("taichi", "numpy", "scipy", "matplotlib")
_OF_DEVELOPERS = {"test", "dev", "bench", "lessons"}  # extras that no command imports


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
        "processor": processor(),
        "cpus": os.cpu_count(),
    }


def source() -> dict[str, Any]:
    """Return the `commit` of this package's source, and whether it was `clean`.

    Clean means that no tracked file differed from the commit. Both are None outside of a checkout.
    """
    nothing = {"commit": None, "clean": None}
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return nothing
    command = ["git", "describe", "--always", "--abbrev=40", "--exclude=*", "--dirty"]
    how: dict[str, Any] = {"stderr": subprocess.DEVNULL, "text": True, "timeout": 10}
    try:
        described = subprocess.check_output(command, cwd=root, **how).strip()
    except (OSError, subprocess.SubprocessError):
        return nothing
    return {"commit": described.removesuffix("-dirty"), "clean": not described.endswith("-dirty")}


def packages() -> dict[str, str]:
    """Return the versions of this package and of all installed ones that it depends on, by name.

    Includes the dependencies of dependencies, and packages of extras if this process has imported
    them.
    """
    found: dict[str, str] = {}
    waiting = [("taichi-ants", frozenset[str]()), *((name, frozenset[str]()) for name in _DIRECT)]
    done = set()
    while waiting:
        name, extras = waiting.pop()
        if (name, extras) in done:
            continue
        done.add((name, extras))
        with suppress(metadata.PackageNotFoundError):
            facts = _facts_of(name)
            found[name] = facts["Version"]
            waiting.extend(_needed(name, facts, extras))
    found.pop("taichi-ants", None)
    return {"taichi_ants": __version__, **dict(sorted(found.items()))}


def _facts_of(name: str) -> Message:
    """Return the metadata of a package without its description, which takes long to parse."""
    found = metadata.distribution(name)
    text = found.read_text("METADATA") or found.read_text("PKG-INFO") or ""
    return HeaderParser().parsestr(text.partition("\n\n")[0])


def _needed(
    name: str, facts: Message, extras: frozenset[str]
) -> Iterator[tuple[str, frozenset[str]]]:
    """Yield the packages, with their extras, that a package with some extras requires."""
    is_own = name == "taichi-ants"
    if is_own:
        extras = frozenset(facts.get_all("Provides-Extra") or ()) - _OF_DEVELOPERS
    for text in facts.get_all("Requires-Dist") or ():
        one = Requirement(text)
        marker, other = one.marker, canonicalize_name(one.name)
        always = marker is None or marker.evaluate({"extra": ""})
        chosen = marker is not None and any(marker.evaluate({"extra": each}) for each in extras)
        if always or (chosen and (not is_own or _is_imported(other))):
            yield other, frozenset(one.extras)


def _is_imported(name: str) -> bool:
    """Return whether this process has imported the package of a distribution."""
    return any(name == canonicalize_name(module) for module in sys.modules if "." not in module)


def processor() -> str:
    """Return the name of the processor, or of its architecture if the name is unknown."""
    with suppress(OSError, StopIteration):
        lines = Path("/proc/cpuinfo").read_text(errors="replace").splitlines()
        line = next(line for line in lines if line.startswith("model name"))
        return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
