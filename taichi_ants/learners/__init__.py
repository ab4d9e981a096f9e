"""The learners: one file each, and policies that need no learning."""

from taichi_ants.learners.registry import Learner, get, names, register

__all__ = ["Learner", "get", "names", "register"]
