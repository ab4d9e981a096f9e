"""The executor that the options of a command choose, see `command_line.add_machines`."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from taichi_ants.studies.command import executor_of
from taichi_ants.studies.plugins import read_plugin


@contextmanager
def chosen(settings: Namespace) -> Iterator[dict[str, Any]]:
    """Yield the arguments of `Study.in_blocks` that the options of a command determine."""
    with executor_of(settings) as (executor, threads):
        how: dict[str, Any] = {"threads": threads, "arch": settings.arch}
        how["shard"] = settings.shard or (1, 1)
        if executor is not None:
            how["executor"] = executor
            how["plugins"] = [read_plugin(settings.plugin)] if settings.plugin else []
        yield how
