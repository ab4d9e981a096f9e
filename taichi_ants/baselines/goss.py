"""The model of Goss and others, which explains how ants choose the shorter branch of a bridge.

Goss, Aron, Deneubourg and Pasteels: Self-organized shortcuts in the Argentine ant.
Naturwissenschaften 76 (1989), 579-581.

At each end of the bridge, one ant leaves every 2 seconds, which is a *step* of the model. If that
end has S marks of the short branch and L of the long one, it takes the short one with probability

    (k + S)^n / ((k + S)^n + (k + L)^n),  k = 20, n = 2.

It leaves one mark of its branch at the end where it chooses, and one at the other end when it
arrives. Marks do not evaporate. The short branch takes 20 seconds, the long one 20 r: 10 and 10 r
cells of 2 seconds each. An ant is in the first cell when it chooses and in the last when it
arrives. The paper classifies colonies by the share of the 501st to 1000th ant that took the short
branch. `docs/research_notes.md` compares readings of the paper.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated

import numpy as np

from taichi_ants import runtime
from taichi_ants.errors import AntsError, checked_whole
from taichi_ants.grid.constants import STREAM_BRIDGE
from taichi_ants.grid.randomness import stream_state
from taichi_ants.settings import Count, Seed, Setting, checked_arguments

# Percent of colonies for each ratio r of the branches, by the share of ants on the short branch:
# 0-20 %, 20-40 %, 40-60 %, 60-80 %, 80-100 %.
PUBLISHED: Mapping[float, tuple[int, ...]] = MappingProxyType(
    {1.0: (37, 9, 8, 7, 39), 1.4: (23, 10, 8, 10, 49), 2.0: (15, 6, 6, 7, 66)}
)
# The same for r = 2 and a short branch that opens after the 1000th ant; ants 1501 to 2000 count.
PUBLISHED_LATE = (100, 0, 0, 0, 0)
LATE_RATIO = 2.0
N_CLASSES = 5
SHORT_CELLS = 10  # 2 seconds each
MAX_EXPONENT = 8
_LAUNCH = 1 << 14  # colonies per launch, which takes less than half a second


@checked_arguments
def crossing_steps(ratio: Annotated[float, Setting(least=1, most=100)]) -> tuple[int, int]:
    """Return the steps to cross the short branch and a branch that is `ratio` times as long."""
    return SHORT_CELLS - 1, round(SHORT_CELLS * ratio) - 1


@checked_arguments
def choices(
    short: Count,
    long: int,
    colonies: Count = 10_000,
    *,
    ants: Count = 1000,
    k: Annotated[float, Setting(above=0, most=1e9)] = 20.0,
    n: Annotated[int, Setting(least=1, most=MAX_EXPONENT)] = 2,
    opens: int = 0,
    seed: Seed = 0,
    threads: int | None = None,
) -> np.ndarray:
    """Return the branch that each ant takes: uint8 (colonies, ants), 1 for the short one.

    Ants choose in turn at the nest and at the food; ant 0 chooses at the nest.

    Args:
        short, long: Steps to cross the branches, see `crossing_steps`; a step is 2 seconds.
        colonies: The number of colonies; more colonies do not change the first ones.
        ants: The number of choices, which must be even.
        k, n: The constant and the exponent of the choice function.
        opens: The number of ants, from 0 to `ants`, that choose before the short branch opens and
            have to take the long one.

    Raises:
        AntsError: An argument is not allowed.
    """
    checked_whole("`long`", long, short)
    if ants % 2:
        raise AntsError(f"`ants` is {ants}; it must be even: half choose at each end.")
    checked_whole("`opens`", opens, 0, ants)
    states = stream_state(seed, STREAM_BRIDGE, np.arange(colonies))
    runtime.start(threads)
    from taichi_ants.baselines.kernels import cross  # imports Taichi

    took = np.zeros((colonies, ants), np.uint8)
    with runtime.quiet():
        for first in range(0, colonies, _LAUNCH):
            some = slice(first, first + _LAUNCH)
            cross(took[some], states[some], short, long, k, n, opens)
    return took


def class_shares(took: np.ndarray, first: int = 501, last: int = 1000) -> np.ndarray:
    """Return the percentage of colonies in each class of shares of the short branch, float64 (5,).

    The classes are 0-20 %, ... 80-100 % of the ants `first` to `last`, counted from 1; a share on a
    border belongs to the class above. `took` is a result of `choices`. Raises AntsError if there
    are no such ants.
    """
    checked_whole("last", last, 1, took.shape[1])
    checked_whole("first", first, 1, last)
    short = took[:, first - 1 : last].sum(axis=1, dtype=np.int64)
    classes = np.minimum(N_CLASSES * short // (last - first + 1), N_CLASSES - 1)
    return 100 * np.bincount(classes, minlength=N_CLASSES) / len(took)
