"""The learners: one file each, registered here."""

from taichi_ants.learners.dyna_q import DYNA_Q
from taichi_ants.learners.expected_sarsa import EXPECTED_SARSA
from taichi_ants.learners.q_learning import Q_LEARNING
from taichi_ants.learners.registry import Learner, get, names, register
from taichi_ants.learners.sarsa import SARSA

for _learner in (Q_LEARNING, SARSA, EXPECTED_SARSA, DYNA_Q):
    register(_learner)

__all__ = ["Learner", "get", "names", "register"]
