"""Tools for benchmarks: a description of the machine, measured paces, published tables."""

from __future__ import annotations

import math
import platform
import sys
import time
from argparse import ArgumentTypeError
from collections.abc import Callable, Sequence
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from taichi_ants import runtime

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / "experiments"))
from published import FIGURES as FIGURES  # noqa: E402
from published import show as show  # noqa: E402

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
        f"{runtime.processor()}, {runtime.available_threads()} processors, {platform.system()}, "
        f"Python {platform.python_version()}, {', '.join(versions)}."
    )


def count_in_powers(axis: Any) -> None:
    """Make an axis logarithmic, with labels such as 10⁴; the style of figures has no formulas."""
    raised = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
    axis.axes.set_xscale("log")
    axis.set_major_formatter(lambda value, _: "10" + f"{math.log10(value):.0f}".translate(raised))


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
