"""What tests share: compiled kernels, and hypothesis without time limits."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

# Machines are shared and noisy: no limit on the time of an example, the same examples each time.
settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile("repeatable")


def pytest_configure(config: pytest.Config) -> None:
    """Share compiled kernels among all processes of the tests, and with the next run.

    Kernels compile in half the time without Taichi's pass over the control flow. Their results are
    the same: the slow tests, which hold both engines against the reference too, compile kernels as
    users do.
    """
    if config.option.markexpr.startswith("not slow"):
        os.environ.setdefault("TI_CFG_OPTIMIZATION", "0")
    folder = config.rootpath / ".pytest_cache" / "kernels"
    os.environ["XDG_CACHE_HOME"] = str(folder)
    os.environ["TI_OFFLINE_CACHE_MAX_SIZE_OF_FILES"] = str(2**30)
    if not hasattr(config, "workerinput"):
        # A process that is killed while Taichi writes kernels leaves the lock, and no other one
        # writes any from then on.
        (folder / "taichi_ants" / "kernels" / "ticache.lock").unlink(missing_ok=True)


@pytest.fixture(scope="session")
def kernels() -> Path:
    """The folder in which processes keep compiled kernels."""
    return Path(os.environ["XDG_CACHE_HOME"])
