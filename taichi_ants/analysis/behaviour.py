"""Behaviours of ants that follow a final policy: deliver, or collect small rewards without end.

A step onto a trail (T) is rewarded, and so is a carrier's step towards the queen (S). A policy can
therefore collect rewards by walking to and fro or in circles, without a delivery. The mean of such
runs and of runs that deliver describes neither, so runs are counted by behaviour.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.task.constants import N_STATES, RIGHT, SEES_CUE

if TYPE_CHECKING:
    from taichi_ants.engines.runs.results import Trace

__all__ = ["BEHAVIOURS", "classify"]
# A behaviour is an index into this list.
BEHAVIOURS = ("delivers", "walks the trail", "circles with food", "other")
DELIVERS, WALKS, CIRCLES, OTHER = range(len(BEHAVIOURS))
_PAID_SHARE = 0.25


def classify(trace: Trace, max_steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the behaviour and the return of the ant in each of m episodes.

    Args:
        trace: The trace of a `rollout`, or of several episodes.
        max_steps: The step limit, which episodes without a delivery reach.

    Returns:
        Behaviours, indices into `BEHAVIOURS`, int8 (m,); undiscounted returns, int64 (m,).

    >>> behaviours, returns = classify(rollout(worlds.paper(), result.q_values[0, 0]), 600)
    >>> BEHAVIOURS[behaviours[0]] in BEHAVIOURS, returns.shape
    (True, (1,))
    """
    episode = np.asarray(trace.episodes) - trace.episodes[0]
    late = np.asarray(trace.steps) >= max_steps // 2

    def count(which: np.ndarray) -> np.ndarray:
        return np.bincount(episode[which], minlength=episode[-1] + 1)

    carries = trace.paper_states >= N_STATES // 2
    # Moves onto a cell of the kind T or S are rewarded.
    ahead = trace.paper_states >> (4 - 2 * np.minimum(trace.actions, RIGHT)) & 3
    paid = late & (trace.actions <= RIGHT) & (ahead == SEES_CUE)
    steps, with_food = count(late), count(late & carries)
    often = count(paid) >= _PAID_SHARE * steps
    walks, circles = often & (with_food == 0), often & (with_food == steps)
    delivers = count(trace.delivered) > 0
    behaviours = np.select([delivers, walks, circles], [DELIVERS, WALKS, CIRCLES], OTHER)
    returns = np.bincount(episode, weights=trace.rewards).astype(np.int64)
    return behaviours.astype(np.int8), returns
