"""The twins of the package's learners, one file each."""

from __future__ import annotations

from taichi_ants.reference.learners.double_q import DoubleQ
from taichi_ants.reference.learners.dyna_q import DynaQ
from taichi_ants.reference.learners.expected_sarsa import ExpectedSarsa
from taichi_ants.reference.learners.learner import LEARNERS, Learner
from taichi_ants.reference.learners.n_step_sarsa import NStepSarsa
from taichi_ants.reference.learners.prioritized_sweeping import PrioritizedSweeping
from taichi_ants.reference.learners.q_learning import QLearning
from taichi_ants.reference.learners.sarsa import Sarsa
from taichi_ants.reference.learners.sarsa_lambda import SarsaLambda

__all__ = ["LEARNERS", "Learner"]

LEARNERS.register("q_learning", QLearning)
LEARNERS.register("sarsa", Sarsa)
LEARNERS.register("expected_sarsa", ExpectedSarsa)
LEARNERS.register("dyna_q", DynaQ)
LEARNERS.register("double_q", DoubleQ)
LEARNERS.register("sarsa_lambda", SarsaLambda)
LEARNERS.register("n_step_sarsa", NStepSarsa)
LEARNERS.register("prioritized_sweeping", PrioritizedSweeping)
