"""Observations of ants, and their registry.

To add one to the package, write a function in `built_in.py` and add a line to `BUILT_IN`. To add
your own observation, call `register` from a plugin file.
"""

from taichi_ants.task.observations.built_in import BUILT_IN
from taichi_ants.task.observations.observation import OBSERVATIONS, Observation, register

__all__ = ["Observation", "get", "names", "register"]
OBSERVATIONS.built_in = {observation.name: observation for observation in BUILT_IN}
get, names = OBSERVATIONS.get, OBSERVATIONS.names
