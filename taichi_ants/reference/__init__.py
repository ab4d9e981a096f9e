"""The reference: the rules of the world in plain Python, to test the fast kernels against.

The reference is for tests, not for simulations. It implements every rule a second time, as directly
as possible: geometry (tuples of cube coordinates), random streams, vision, observations, learners.
Tests compare each step of the engines with it, for equality to the bit. To stay independent, this
package imports only constants, errors, and the types `Task`, `TrainingConfig` (with
`update_weights`) and `World` from `taichi_ants`. It reads only the fields of a world.

Read `ReferenceColony.tick` in `colony.py` first.
"""

from __future__ import annotations

from taichi_ants.reference.colony import ReferenceColony
from taichi_ants.reference.learners import LEARNERS
from taichi_ants.reference.observations import OBSERVATIONS

__all__ = ["LEARNERS", "OBSERVATIONS", "ReferenceColony"]
__dir__ = __all__.copy  # completion lists only public names
