"""Transitions with explicit values, for tests of learners."""

import numpy as np

from taichi_ants.reference.ants import Transition
from taichi_ants.task.constants import Event


def transition(
    state: int, action: int, reward: int, next_state: int, number: int = 0, **given: object
) -> Transition:
    """Return a transition of an ant; by default its slot is its number, and no episode ends."""
    facts = {
        "slot": number,
        "next_action": None,
        "terminated": False,
        "truncated": False,
        **{"episode": 0, "step": 0, "event": Event.ENTERED_EMPTY},
        **{"cell": (0, 0, 0), "heading": 0},
        **given,
    }
    return Transition(
        number=number, state=state, action=action, reward=reward, next_state=next_state, **facts
    )


def values_of(learner):
    """The values that are not zero, by state and action."""
    table = np.array(learner.rows)
    return {(int(s), int(a)): float(table[s, a]) for s, a in np.argwhere(table)}
