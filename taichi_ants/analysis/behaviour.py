"""Behaviours of ants that follow a final policy: deliver, or collect small rewards without end.

The step onto a trail (T), and with food the step nearer to the queen (S), are paid, so that a
policy can live on walking to and fro, or in circles. A mean over such runs and runs that deliver
means nothing: runs are counted by what they do.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.task.constants import N_STATES, RIGHT, SEES_LURE

if TYPE_CHECKING:
    from taichi_ants.engines.runs.traces import Trace

# A behaviour is a number, its place in this list.
BEHAVIOURS = ("delivers", "walks the trail", "circles with food", "other")
DELIVERS, WALKS, CIRCLES, OTHER = range(len(BEHAVIOURS))
NAMES = tuple(name.replace(" ", "_") for name in BEHAVIOURS)  # of columns, files
# For reports; of an episode without delivery its second half counts.
DEFINITIONS = (
    "the episode ends with a delivery",
    "without food, at least every fourth step leads onto a trail",
    "with food, at least every fourth step leads nearer to the queen",
    "none of these",
)
_PAID_SHARE = 0.25


def classify(trace: Trace, max_steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return what the ant does in each of m episodes, and what it earns, whatever steps are paid.

    Places in `BEHAVIOURS`, int8 (m,), and returns, int64 (m,). An episode without delivery uses
    all of its steps, `max_steps`.
    """
    episode = np.asarray(trace.episodes) - trace.episodes[0]
    late = np.asarray(trace.steps) >= max_steps // 2

    def count(which: np.ndarray) -> np.ndarray:
        return np.bincount(episode[which], minlength=episode[-1] + 1)

    carries = trace.percepts >= N_STATES // 2
    # Paid is a move onto a cell that looks T or S.
    ahead = trace.percepts >> (4 - 2 * np.minimum(trace.actions, RIGHT)) & 3
    paid = late & (trace.actions <= RIGHT) & (ahead == SEES_LURE)
    steps, with_food = count(late), count(late & carries)
    often = count(paid) >= _PAID_SHARE * steps
    walks, circles = often & (with_food == 0), often & (with_food == steps)
    delivers = count(trace.delivered) > 0
    behaviours = np.select([delivers, walks, circles], [DELIVERS, WALKS, CIRCLES], OTHER)
    returns = np.bincount(episode, weights=trace.rewards).astype(np.int64)
    return behaviours.astype(np.int8), returns


def counts(behaviours: np.ndarray) -> dict[int, int]:
    """How many runs do what, without what nobody does, in the order of `BEHAVIOURS`."""
    number_of = np.bincount(np.ravel(behaviours), minlength=len(BEHAVIOURS)).tolist()
    return {code: number for code, number in enumerate(number_of) if number}
