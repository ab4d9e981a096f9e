"""Learners, one file each, and policies that need no learning."""

from taichi_ants.learners.config import Hyperparameters, TrainingConfig
from taichi_ants.learners.learner import Learner, Memory, td_learner
from taichi_ants.learners.registry import get, names, register
from taichi_ants.settings import Setting

__all__ = [
    "Hyperparameters", "Learner", "Memory", "Setting", "TrainingConfig", "get", "names", "register",
    "td_learner",
]  # fmt: skip
__dir__ = __all__.copy  # completion lists only public names
