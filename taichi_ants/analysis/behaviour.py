"""What an ant does that follows its final policy: deliver, or collect small rewards without end.

The step onto a trail (T), and with food the step nearer to the queen (S), are paid, so that a
policy can live on walking to and fro, or in circles. Returns of such runs and of runs that deliver
have no common mean that means anything: runs are counted by what they do.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.task.constants import N_STATES, RIGHT, SEES_LURE

if TYPE_CHECKING:
    from taichi_ants.engines.runs.traces import Trace

# What an ant does is a number, its place in this list.
BEHAVIOURS: tuple[str, ...] = ("delivers", "walks the trail", "circles with food", "other")
DELIVERS, WALKS, CIRCLES, OTHER = range(len(BEHAVIOURS))

NAMES: tuple[str, ...] = tuple(name.replace(" ", "_") for name in BEHAVIOURS)  # of columns, files

# What each of them means, for reports; of an episode without delivery its second half counts.
DEFINITIONS: tuple[str, ...] = (
    "the episode ends with a delivery",
    "without food, at least every fourth step leads onto a trail",
    "with food, at least every fourth step leads nearer to the queen",
    "none of these",
)
_PAID_SHARE = 0.25


def classify(trace: Trace, max_steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return what the ant does in each of m episodes, and what it earns, whatever steps are paid.

    Places in `BEHAVIOURS`, int8 (m,), and returns, int64 (m,); see `DEFINITIONS`. An episode
    without delivery uses all of its steps, `max_steps`.
    """
    episode = np.asarray(trace.episodes) - trace.episodes[0]
    late = np.asarray(trace.steps) >= max_steps // 2

    def count(which: np.ndarray) -> np.ndarray:
        return np.bincount(episode[which], minlength=episode[-1] + 1)

    carries = trace.percepts >= N_STATES // 2
    paid = late & _enters_lure(trace.percepts, trace.actions)
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


def _enters_lure(states: np.ndarray, actions: np.ndarray) -> np.ndarray:
    """bool (n,): whether the action is a move onto a cell that looks T or S, which succeeds."""
    codes = states >> (4 - 2 * np.minimum(actions, RIGHT)) & 3
    return (actions <= RIGHT) & (codes == SEES_LURE)
