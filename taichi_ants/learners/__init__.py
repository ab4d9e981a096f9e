"""The learners: one file each, and policies that need no learning."""

from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.hyperparameters import Hyperparameters, number
from taichi_ants.learners.learner import Learner, Memory, td_learner
from taichi_ants.learners.registry import get, label, names, register, settle

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
