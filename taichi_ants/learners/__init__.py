"""The learners: one file each, and policies that need no learning."""

from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.hyperparameters import Hyperparameters, number
from taichi_ants.learners.registry import (
    Learner,
    Memory,
    get,
    label,
    names,
    register,
    settle,
    td_learner,
)

__all__ = [
    "Hyperparameters",
    "Learner",
    "Memory",
    "TrainingConfig",
    "get",
    "label",
    "names",
    "number",
    "register",
    "settle",
    "td_learner",
]
