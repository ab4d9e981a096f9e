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
    """Kernels compile in half the time without Taichi's pass over the control flow.

    Their results are the same: the slow tests, which hold both engines against the reference too,
    compile kernels as users do.
    """
    if config.option.markexpr.startswith("not slow"):
        os.environ.setdefault("TI_CFG_OPTIMIZATION", "0")


@pytest.fixture(scope="session")
def kernels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which processes keep compiled kernels, so that only the first one compiles."""
    return tmp_path_factory.mktemp("kernels")
