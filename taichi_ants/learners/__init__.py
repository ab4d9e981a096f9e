"""Learners, one file each, and policies that need no learning."""

from taichi_ants.learners.config import Hyperparameters, TrainingConfig
from taichi_ants.learners.learner import Learner, Memory, td_learner
from taichi_ants.learners.registry import get, label, names, register, settle
from taichi_ants.settings import Is

__all__ = [
    "Hyperparameters",
    "Is",
    "Learner",
    "Memory",
    "TrainingConfig",
    "get",
    "label",
    "names",
    "register",
    "settle",
    "td_learner",
]
__dir__ = __all__.copy  # completion lists only public names
