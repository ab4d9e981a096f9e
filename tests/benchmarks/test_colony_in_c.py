"""The colony's yardstick in C, a third writing of the rules, and the command."""

from __future__ import annotations

import colony_in_c
import numpy as np
import pytest
from throughput import compiler

from taichi_ants import AntsError

pytestmark = pytest.mark.skipif(compiler(1) is None, reason="there is no C compiler")


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    try:
        return colony_in_c.load(compiler(2), tmp_path_factory.mktemp("c"), 2)
    except AntsError:  # no compiler has OpenMP
        return colony_in_c.load(compiler(1), tmp_path_factory.mktemp("c"), 1)


@pytest.mark.parametrize("rules", ["the paper's", "queueing"])  # which has those of foraging
def test_c_gives_the_same_colonies(rules, library):
    colony = colony_in_c.scattered(colony_in_c.TASKS[rules], 300)
    colony.begin_episode()
    before = {name: array.copy() for name, array in colony.arrays.items()}
    one, two = (colony_in_c.live_in_c(library, colony, 400, threads) for threads in (1, 2))
    assert np.array_equal(one.q_values, two.q_values)
    assert one[1:] == two[1:]
    assert one.deliveries > 20
    assert one.blocked > 10_000
    assert all(np.array_equal(before[name], colony.arrays[name]) for name in before)
    colony_in_c.check_same(library, colony, 400, 2)
    colony.arrays["rewards"][3] += 1  # of C alone
    colony.begin_episode()
    other = colony_in_c.live_in_c(library, colony, 400, 1)
    assert other.returns != one.returns
