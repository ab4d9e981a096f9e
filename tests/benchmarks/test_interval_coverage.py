"""What the intervals over seeds cover, on pools of real training runs."""

from __future__ import annotations

import importlib.util
from types import ModuleType

import numpy as np
import pytest
from command_lines import ROOT

DRAWS = 500  # the standard error of a coverage of 0.95 is 0.01


@pytest.fixture(scope="module")
def benchmark() -> ModuleType:
    path = ROOT / "benchmarks" / "interval_coverage.py"
    spec = importlib.util.spec_from_file_location("interval_coverage", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_coverage_of_a_known_pool(benchmark: ModuleType) -> None:
    """Of a pool of 0s with one 1000 in fifty, 10 seeds have none in four of five draws."""
    pool = np.zeros(4000)
    pool[::50] = 1000
    missed = 1 - benchmark.coverage(pool, 10, iqm=False, draws=200)
    assert missed > 0.98**10 - 0.15
    assert benchmark.coverage(pool, 10, iqm=True, draws=200) == 1
    text = benchmark.coverage_table({"made up": pool}, None, 20)
    assert text.splitlines()[2].startswith("| made up | 20.00 | 0.00 | 0.")


@pytest.mark.slow
def test_intervals_cover_the_centres_of_real_runs_as_documented(benchmark: ModuleType) -> None:
    """Prints the tables; docs/statistics.md has them."""
    pools = benchmark.pools()
    print(benchmark.coverage_table(pools, None, DRAWS))
    covered = {
        (name, iqm, seeds): benchmark.coverage(pool, seeds, iqm, draws=DRAWS)
        for name, pool in pools.items()
        for iqm in (False, True)
        for seeds in (10, 20, 100)
    }
    for (name, iqm, seeds), share in covered.items():
        if iqm:  # what a reader can rely on from 10 seeds on
            assert share > 0.92, (name, seeds)
            if not name.startswith("deliveries"):  # there the IQM is 1 in every draw
                assert share < 0.98, (name, seeds)
    # Heavy tails: what the documents warn of is so.
    fast = "return, Q-learning at 0.01 / 0.99 / 0.3 / 0.99"
    assert covered[fast, False, 10] < 0.5
    assert covered[fast, False, 20] < 0.5
    assert covered[fast, False, 100] < 0.8
    assert covered["return, Q-learning at 0.001 / 0.99 / 0.3 / 0.99", False, 10] < 0.85
    assert covered["return, Q-learning at 0.001 / 0.99 / 0.3 / 0.99", False, 100] > 0.9
    for name, pool in pools.items():  # verdicts err less often than they say
        share = benchmark.coverage(pool, 20, True, benchmark.VERDICT_LEVEL, DRAWS)
        assert share > 0.995, name
