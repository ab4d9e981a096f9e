"""Folders of results: a command computes the results, or shows those that the folder has."""

from __future__ import annotations

import datetime
import os
import platform
import shlex
import subprocess
import sys
import time
from argparse import Namespace
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

from taichi_ants import __version__, files
from taichi_ants.files.results import PAGE, REPORT, ResultFolder, checksum_of, read_manifest

_PACKAGES = ("taichi", "numpy", "scipy", "matplotlib")
Results = TypeVar("Results")
# (folder of results, results if just computed, manifest) -> HTML
Pages = Callable[[Path, Results | None, Mapping[str, Any]], str]


def work_or_show(
    settings: Namespace,
    determines: Mapping[str, Any],
    work: Callable[[Path, Path], Results],
    leading: Sequence[str] = (),
    page: Pages[Results] | None = None,
) -> None:
    """Compute the results of a command unless its folder has them, and print the report.

    Args:
        settings: The command's `out`, `force`, `no_figures`, `plugin` and `arch`.
        determines: Everything else that determines the results.
        work: A function of two folders, for blocks and for results; it writes the report.
        leading: The argument of `ResultFolder`, whose errors are raised.
        page: A function that makes the page; a missing page is made again.
    """
    plugin = checksum_of(Path(settings.plugin)) if settings.plugin else None
    facts = {**determines, "arch": settings.arch, "plugin": plugin}
    folder = ResultFolder(settings.out, facts, leading)
    if not settings.force and folder.is_finished():
        _show(settings, folder, page)
    else:
        began = time.perf_counter()
        with folder.work(settings.force) as (blocks, ready):
            results = work(blocks, ready)
            report = files.read_text(ready / REPORT)
            seconds = folder.seconds_before + time.perf_counter() - began
            made = provenance(sys.argv) | {"seconds": seconds, "figures": not settings.no_figures}
            if page:
                files.write_text(ready / PAGE, page(ready, results, made))
            folder.publish(ready, made)
        print(f"{report}\n{seconds:.1f} s; all results are in {settings.out}/")
    if page:
        print(settings.out / PAGE)


def _show(settings: Namespace, folder: ResultFolder, page: Pages[Results] | None) -> None:
    """Print the report of finished results, and make a missing page again."""
    folder.check(may_lack=PAGE if page else None)
    folder.tidy()
    manifest = read_manifest(settings.out)
    is_missing = not (settings.out / PAGE).exists()
    if page and is_missing:
        folder.add(PAGE, page(settings.out, None, manifest))
    print(files.read_text(settings.out / REPORT))
    print(f"{settings.out}/ already has these results; use --force to compute them again.")
    if not (settings.no_figures or manifest["figures"]):
        print("They have no figures because of --no-figures; use --force to draw figures.")
    if page and is_missing:
        print(f"{PAGE} was missing and has been written again from the other files.")


def provenance(arguments: Sequence[str]) -> dict[str, Any]:
    """Return the command, time, commit, versions and machine, for the manifest of results."""
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
    """Return the commit of the source, with "-dirty" if files differ; None outside a checkout."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return None
    command = ["git", "describe", "--always", "--abbrev=40", "--exclude=*", "--dirty"]
    how: dict[str, Any] = {"stderr": subprocess.DEVNULL, "text": True, "timeout": 10}
    try:
        return subprocess.check_output(command, cwd=root, **how).strip()
    except (OSError, subprocess.SubprocessError):
        return None
