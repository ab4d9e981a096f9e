"""The learners: one file each, and policies that need no learning."""

from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.hyperparameters import Hyperparameters, number, whole_number
from taichi_ants.learners.registry import Learner, get, names, register, settle

__all__ = [
    "Hyperparameters",
    "Learner",
    "TrainingConfig",
    "get",
    "names",
    "number",
    "register",
    "settle",
    "whole_number",
]
