"""The twins of the package's learners, one file each."""

from __future__ import annotations

from taichi_ants.reference.learners.double_q import DoubleQ
from taichi_ants.reference.learners.dyna_q import DynaQ
from taichi_ants.reference.learners.expected_sarsa import ExpectedSarsa
from taichi_ants.reference.learners.learner import Learner
from taichi_ants.reference.learners.n_step_sarsa import NStepSarsa
from taichi_ants.reference.learners.prioritized_sweeping import PrioritizedSweeping
from taichi_ants.reference.learners.q_learning import QLearning
from taichi_ants.reference.learners.sarsa import Sarsa
from taichi_ants.reference.learners.sarsa_lambda import SarsaLambda

__all__ = ["LEARNERS", "DynaQ", "Learner"]

LEARNERS: dict[str, type[Learner]] = {
    "q_learning": QLearning,
    "sarsa": Sarsa,
    "expected_sarsa": ExpectedSarsa,
    "dyna_q": DynaQ,
    "double_q": DoubleQ,
    "sarsa_lambda": SarsaLambda,
    "n_step_sarsa": NStepSarsa,
    "prioritized_sweeping": PrioritizedSweeping,
}
