"""Facts about a run that do not determine its results: command, time, source, versions, machine."""

from __future__ import annotations

import datetime
import os
import platform
import shlex
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib import metadata
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from taichi_ants import __version__

# Packages that results depend on, if this package runs without being installed.
_DIRECT = ("taichi", "numpy", "scipy", "matplotlib")


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
    root = Path(__file__).resolve().parents[2]
    command = ["git", "describe", "--always", "--abbrev=40", "--exclude=*", "--dirty"]
    how: dict[str, Any] = {"stderr": subprocess.DEVNULL, "text": True, "timeout": 10}
    with suppress(OSError, subprocess.SubprocessError):
        if (root / ".git").exists():
            described = subprocess.check_output(command, cwd=root, **how).strip()
            commit, _, changed = described.partition("-")
            return {"commit": commit, "clean": not changed}
    return {"commit": None, "clean": None}


def packages() -> dict[str, str]:
    """Return the versions of this package and of those that it depends on, also indirectly.

    Includes packages of extras if this process has imported them.
    """
    imported = {canonicalize_name(name) for name in sys.modules if "." not in name}
    versions, waiting = dict[str, str](), ["taichi-ants", *_DIRECT]
    for name in waiting:  # which grows
        with suppress(metadata.PackageNotFoundError):
            if name in versions:
                continue
            versions[name] = metadata.version(name)
            for needed in map(Requirement, metadata.requires(name) or ()):
                other = canonicalize_name(needed.name)
                is_always = needed.marker is None or needed.marker.evaluate({"extra": ""})
                if is_always or (name == "taichi-ants" and other in imported):
                    waiting.append(other)
    versions.pop("taichi-ants", None)
    return {"taichi_ants": __version__, **dict(sorted(versions.items()))}


def processor() -> str:
    """Return the name of the processor, or of its architecture if the name is unknown."""
    with suppress(OSError, StopIteration):
        lines = Path("/proc/cpuinfo").read_text(errors="replace").splitlines()
        line = next(line for line in lines if line.startswith("model name"))
        return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
