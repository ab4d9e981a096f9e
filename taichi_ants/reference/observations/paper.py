"""The paper's state: the percept itself."""

from __future__ import annotations

from taichi_ants.reference.observations.observation import Observation
from taichi_ants.reference.vision import observe

PAPER = Observation(128, observe)
