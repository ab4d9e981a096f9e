"""Dyna-Q (Sutton 1990): Q-learning, and updates from a model of what was seen last."""

from taichi_ants.learners.q_learning import td_error
from taichi_ants.learners.registry import Learner

DYNA_Q = Learner(
    "dyna_q", td_error, plans=True, summary="Q-learning that replays a model of the world"
)
