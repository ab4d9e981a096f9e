"""Observations of ants, and their registry."""

from taichi_ants.task.observations.observation import Observation
from taichi_ants.task.observations.registry import get, names, register

__all__ = ["Observation", "get", "names", "register"]
