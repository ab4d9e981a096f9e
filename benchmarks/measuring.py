"""Tools for benchmarks: a description of the machine, measured paces, tables in a docs page."""

from __future__ import annotations

import math
import platform
import time
from argparse import ArgumentTypeError
from collections.abc import Callable, Sequence
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

from taichi_ants import runtime
from taichi_ants.analysis.tables import Table
from taichi_ants.errors import AntsError
from taichi_ants.files import read_text, write_text

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "results" / "performance.md"
FIGURES = ROOT / "docs" / "figures"

Work = Callable[[], int]  # does some work, and returns the number of steps in it


def a_ratio(text: str) -> float:
    """Return a number of at least 0, as the type of an option."""
    if not 0 <= (value := float(text)) < math.inf:
        raise ArgumentTypeError(f"{text} is not allowed, give a finite number of at least 0")
    return value


def machine(packages: Sequence[str]) -> str:
    """Return a description of the machine: processors, system, and versions of packages."""
    versions = [f"{name} {version(name)}" for name in packages if find_spec(name) is not None]
    return (
        f"{_processor()}, {runtime.available_threads()} processors, {platform.system()}, "
        f"Python {platform.python_version()}, {', '.join(versions)}."
    )


def _processor() -> str:
    described = Path("/proc/cpuinfo")
    if described.exists():
        for line in described.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def pace(work: Work, seconds: float) -> tuple[float, float]:
    """Return the pace of work that is repeated for at least some seconds.

    Returns:
        Steps per second by the wall clock, and CPU nanoseconds per step.
    """
    steps, began, cpu = 0, time.perf_counter(), time.process_time()
    while not steps or time.perf_counter() - began < seconds:
        steps += work()
    wall, cpu = time.perf_counter() - began, time.process_time() - cpu
    return steps / wall, cpu * 1e9 / steps


def publish(name: str, tables: Sequence[Table], page: Path) -> None:
    """Replace the text between `<!-- name -->` and `<!-- /name -->` of a page by tables.

    Raises:
        AntsError: The page lacks these marks, or cannot be read or written.
    """
    text, first, last = read_text(page), f"<!-- {name} -->\n", f"<!-- /{name} -->"
    before, begins, rest = text.partition(first)
    _, ends, after = rest.partition(last)
    if not begins or not ends:
        raise AntsError(f"{page} lacks the lines {first.strip()} and {last}; add both lines.")
    new = "\n".join(table.markdown() for table in tables)
    write_text(page, f"{before}{first}\n{new}\n{last}{after}")
