"""The reference: the rules of the world in plain Python, to test the fast kernels against.

It is an oracle, not a simulator to use: every rule is written down a second time, as directly as it
reads, with a geometry of its own (tuples of cube coordinates in normal form), its own random
streams, its own vision, observations and learners. Tests compare each step of the engines with it,
for equality to the bit. To keep the two independent, this package imports nothing of `taichi_ants`
but constants, errors, and the types `Task`, `TrainingConfig` (with `update_weights`) and `World`;
of a world it reads only the fields (ranges, queen, foods, obstacles, trails, ants).

Read `colony.py` first: `ReferenceColony.tick` is a tick. One ant that learns, or that follows a
table, is a colony of one: `beginner`, `follower`.
"""

from __future__ import annotations

from taichi_ants.reference.colony import ReferenceColony, beginner, follower
from taichi_ants.reference.learners import LEARNERS
from taichi_ants.reference.observations import OBSERVATIONS

__all__ = ["LEARNERS", "OBSERVATIONS", "ReferenceColony", "beginner", "follower"]
