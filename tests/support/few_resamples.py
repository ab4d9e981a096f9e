"""Bootstrap intervals of fewer resamples, for tests that ask what is said, not how exactly."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from taichi_ants.analysis import statistics

_RESAMPLES = 2000


@pytest.fixture(scope="module", autouse=True)
def few_resamples() -> Iterator[None]:
    """For a whole module; its `conftest.py` imports it."""
    all_of_them = statistics._resampled_means

    def fewer(deviations: np.ndarray, resamples: int, iqm: bool = False) -> np.ndarray:
        return all_of_them(deviations, min(resamples, _RESAMPLES), iqm)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(statistics, "_resampled_means", fewer)
        yield
