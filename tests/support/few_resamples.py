"""Bootstrap intervals with fewer resamples, for tests that do not need exact intervals."""

from collections.abc import Iterator

import numpy as np
import pytest

from taichi_ants.analysis import statistics

_RESAMPLES = 2000


@pytest.fixture(scope="module", autouse=True)
def few_resamples() -> Iterator[None]:
    """Limit the resamples in all tests of a module whose `conftest.py` imports this fixture."""
    all_of_them = statistics._resampled_means

    def fewer(deviations: np.ndarray, resamples: int, iqm: bool = False) -> np.ndarray:
        return all_of_them(deviations, min(resamples, _RESAMPLES), iqm)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(statistics, "_resampled_means", fewer)
        yield
