"""All empirical claims of the paper, in its order.

One is left out: that all methods have a similar cost per step, Dyna-Q's planning apart (3.3.2). A
comparison records no run times; the report shows measured ones.
"""

from __future__ import annotations

from taichi_ants.analysis.claims.curves import FIGURE_1_CLAIMS, GREEDY_CLAIMS
from taichi_ants.analysis.claims.model import Claim
from taichi_ants.analysis.claims.performance import (
    DYNA_CLAIMS,
    Q_LEARNING_CLAIMS,
    SARSA_CLAIMS,
)
from taichi_ants.analysis.claims.sensitivity import (
    DISCOUNT_CLAIMS,
    EXPLORATION_CLAIMS,
    GENERAL_CLAIMS,
    LEARNING_RATE_CLAIMS,
    PLANNING_CLAIMS,
)

CLAIMS: tuple[Claim, ...] = (
    *Q_LEARNING_CLAIMS,
    *SARSA_CLAIMS,
    *DYNA_CLAIMS,
    *FIGURE_1_CLAIMS,
    *GREEDY_CLAIMS,
    *LEARNING_RATE_CLAIMS,
    *EXPLORATION_CLAIMS,
    *DISCOUNT_CLAIMS,
    *PLANNING_CLAIMS,
    *GENERAL_CLAIMS,
)
