"""The executor that the options of a command choose, see `command_line.add_machines`."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from taichi_ants.runtime import available_threads
from taichi_ants.studies.executors import LocalWorkers, read_plugin
from taichi_ants.studies.ray_workers import RayWorkers


@contextmanager
def chosen(settings: Namespace) -> Iterator[dict[str, Any]]:
    """Yield the arguments of `Study.in_blocks` that the options of a command determine.

    Workers end with the `with` block. Each has the threads of `--threads`, by default those of this
    machine divided by the number of workers, or with Ray one.
    """
    how: dict[str, Any] = {"threads": settings.threads, "arch": settings.arch}
    how["shard"] = settings.shard or (1, 1)
    if not (settings.workers or settings.ray):
        yield how
        return
    how["plugins"] = [read_plugin(settings.plugin)] if settings.plugin else []
    workers: Any
    if settings.ray:
        how["threads"] = settings.threads or 1
        address = None if settings.ray is True else settings.ray
        workers = RayWorkers(address, how["threads"], settings.arch)
    else:
        how["threads"] = settings.threads or max(1, available_threads() // settings.workers)
        workers = LocalWorkers(settings.workers)
    with workers:
        yield {**how, "executor": workers}
