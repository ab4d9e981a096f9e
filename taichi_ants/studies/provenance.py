"""Where results come from: what determines them, and what made them."""

from __future__ import annotations

import datetime
import hashlib
import os
import platform
import shlex
import subprocess
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from taichi_ants import __version__
from taichi_ants.worlds.world import World

_PACKAGES = ("taichi", "numpy", "scipy", "matplotlib")


def world_facts(world: World) -> dict[str, Any]:
    """A world in a few numbers, and a hash of all of it."""
    digest, numbers = hashlib.sha256(), {}
    for name in ("foods", "obstacles", "trails", "ants"):
        array = getattr(world, name)
        numbers[name] = len(array)
        digest.update(repr(array.shape).encode())
        digest.update(array.tobytes())
    where = {"ranges": list(world.ranges), "queen": list(world.queen)}
    return {**where, **numbers, "sha256": digest.hexdigest()}


def provenance(arguments: Sequence[str]) -> dict[str, Any]:
    """What made results: command, versions, machine, time and commit."""
    return {
        "command": shlex.join(arguments),
        "finished": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"),
        "commit": commit(),
        "python": platform.python_version(),
        "packages": {"taichi_ants": __version__, **{name: version(name) for name in _PACKAGES}},
        "platform": platform.platform(),
        "cpus": os.cpu_count(),
    }


def commit() -> str | None:
    """The commit of the source, "-dirty" behind it if files differ; None outside a checkout."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return None
    command = ["git", "describe", "--always", "--abbrev=40", "--exclude=*", "--dirty"]
    try:
        done = subprocess.run(
            command, cwd=root, capture_output=True, text=True, timeout=10, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()
