"""Shared setup of all tests: compiled kernels, and hypothesis without time limits."""

import gc
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

# Test machines are shared and noisy: no time limits, and the same examples in each run.
settings.register_profile("repeatable", deadline=None, derandomize=True, max_examples=50)
settings.load_profile("repeatable")


def pytest_configure(config: pytest.Config) -> None:
    """Share compiled kernels and modules among all test processes, and with later runs.

    Kernels compile in half to three quarters of the time without Taichi's advanced optimisations,
    with equal results. The tests of `pytest -m optimised` compile kernels as users do, and compare
    engines with the reference once more.
    """
    if not config.option.markexpr.startswith("optimised"):
        os.environ.setdefault("TI_ADVANCED_OPTIMIZATION", "0")
    # Otherwise each of the many processes that tests start compiles the package once more.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    folder = config.rootpath / ".pytest_cache" / "kernels"
    os.environ["XDG_CACHE_HOME"] = str(folder)
    os.environ["TI_OFFLINE_CACHE_MAX_SIZE_OF_FILES"] = str(2**30)
    if hasattr(config, "workerinput"):
        from taichi.lang import kernel_impl

        kernel_impl._inside_class = _inside_class
    else:
        # A process killed while Taichi writes kernels leaves its lock, which blocks all others.
        (folder / "taichi_ants" / "kernels" / "ticache.lock").unlink(missing_ok=True)


def _inside_class(level_of_class_stackframe: int) -> bool:
    """Return whether a kernel is in a class; Taichi looks for its source, 10 ms under pytest."""
    return "__qualname__" in sys._getframe(level_of_class_stackframe - 1).f_locals


def pytest_collection_finish() -> None:
    """Exclude modules, tests and parameters from garbage collection; collect the rest rarely."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Yield a headless Chromium."""
    from browser import started

    with started() as one:
        yield one


@pytest.fixture(scope="session")
def kernels() -> Path:
    """Return the cache folder for compiled kernels."""
    return Path(os.environ["XDG_CACHE_HOME"])
