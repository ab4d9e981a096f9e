"""What the tests of the command lines share."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def kernels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which processes keep compiled kernels, so that only the first one compiles."""
    return tmp_path_factory.mktemp("kernels")
