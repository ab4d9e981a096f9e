"""What tests share: compiled kernels, and hypothesis without time limits."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import settings

# Machines are shared and noisy: no limit on the time of an example, the same examples each time.
settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile("repeatable")


@pytest.fixture(scope="session")
def kernels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which processes keep compiled kernels, so that only the first one compiles."""
    return tmp_path_factory.mktemp("kernels")
