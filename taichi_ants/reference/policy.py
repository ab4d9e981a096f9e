"""The epsilon-greedy policy."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from taichi_ants.reference.random_stream import RandomStream, pick
from taichi_ants.task.constants import N_ACTIONS


def choose_action(values: Sequence[np.float32], epsilon: float, stream: RandomStream) -> int:
    """Choose an action with exactly one draw.

    Args:
        values: The action values of the state, 5 of np.float32.
        epsilon: Probability of a random one of all five actions; else a best one, ties at random.
        stream: Where the draw comes from. Its high word decides whether to explore, its low word
            which action it is.
    """
    high, low = stream.draw()
    if high < int(epsilon * 4294967296.0):
        return pick(low, N_ACTIONS)
    best_value = max(values)
    best = [action for action in range(N_ACTIONS) if values[action] == best_value]
    return best[pick(low, len(best))]
