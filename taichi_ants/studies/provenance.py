"""Facts about a run that do not determine its results: command, time, source, versions, machine."""

from __future__ import annotations

import datetime
import os
import platform
import re
import shlex
import subprocess
import sys
from collections.abc import Iterable, Sequence
from contextlib import suppress
from importlib import metadata
from pathlib import Path
from typing import Any

from taichi_ants import __version__

# Packages that results depend on, if this package runs without being installed.
_DIRECT = "taichi", "numpy", "scipy", "matplotlib"
_EXTRAS = "pyarrow", "SALib", "ray"  # that studies use


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


def packages(also: Iterable[str] = ()) -> dict[str, str]:
    """Return the versions of this package and of those that it depends on, also indirectly.

    Includes extras that this process has imported, and installed packages in `also`.
    """
    versions = dict[str, str]()
    waiting = ["taichi-ants", *_DIRECT, *(name for name in _EXTRAS if name in sys.modules), *also]
    for name in waiting:  # which grows
        with suppress(metadata.PackageNotFoundError):
            if name not in versions:
                versions[name] = metadata.version(name)
                needed = (line for line in metadata.requires(name) or () if "extra ==" not in line)
                names = (re.split(r"[^\w.-]", line, maxsplit=1)[0] for line in needed)
                waiting += [re.sub(r"[-_.]+", "-", name).lower() for name in names]
    versions.pop("taichi-ants", None)
    return {"taichi_ants": __version__, **dict(sorted(versions.items()))}


def processor() -> str:
    """Return the name of the processor, or of its architecture if the name is unknown."""
    with suppress(OSError, StopIteration):
        lines = Path("/proc/cpuinfo").read_text(errors="replace").splitlines()
        line = next(line for line in lines if line.startswith("model name"))
        return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
