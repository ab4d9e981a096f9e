"""The reference: the rules of the world in plain Python, to test the fast kernels against.

It is an oracle, not a simulator to use: every rule is written down a second time, as directly as it
reads, with a geometry of its own (tuples of cube coordinates in normal form), its own random
streams, its own vision, observations and learners. Tests compare each step of the engines with it,
for equality to the bit. To keep the two independent, this package imports nothing of `taichi_ants`
but constants, errors, and the types `Task`, `TrainingConfig` (with `update_weights`) and `World`;
of a world it reads only the fields (ranges, queen, foods, obstacles, trails, ants).

- `ReferenceColony`: ants in one world, tick by tick; `Snapshot`: all of it between two ticks.
- `train`, `rollout`: whole runs of a colony of one; `follower`: its ant before a rollout.
- `LEARNERS`, `OBSERVATIONS`: the twins of the package's learners and observations by name.
- `Ant`, `WorldState`, `observe`, `cells_in_view`, `start`: the world, and what an ant sees of it.
- `choose_action`: the epsilon-greedy policy.
- `RandomStream`, `stream_state`: the draws.
- `normal_form`, `neighbour`, `distance`, `exists`, `existing_cells`: the geometry.
"""

from __future__ import annotations

from taichi_ants.reference.colony import ReferenceColony
from taichi_ants.reference.geometry import (
    Cell,
    distance,
    existing_cells,
    exists,
    neighbour,
    normal_form,
)
from taichi_ants.reference.learners import LEARNERS, Learner
from taichi_ants.reference.observations import OBSERVATIONS, Observation
from taichi_ants.reference.policy import choose_action
from taichi_ants.reference.random_stream import RandomStream, stream_state
from taichi_ants.reference.records import Ant, EpisodeRecord, Event, Snapshot, Transition
from taichi_ants.reference.runs import Rollout, Run, follower, rollout, train
from taichi_ants.reference.start import start
from taichi_ants.reference.vision import cells_in_view, observe
from taichi_ants.reference.world_state import WorldState

__all__ = [
    "LEARNERS",
    "OBSERVATIONS",
    "Ant",
    "Cell",
    "EpisodeRecord",
    "Event",
    "Learner",
    "Observation",
    "RandomStream",
    "ReferenceColony",
    "Rollout",
    "Run",
    "Snapshot",
    "Transition",
    "WorldState",
    "cells_in_view",
    "choose_action",
    "distance",
    "existing_cells",
    "exists",
    "follower",
    "neighbour",
    "normal_form",
    "observe",
    "rollout",
    "start",
    "stream_state",
    "train",
]
