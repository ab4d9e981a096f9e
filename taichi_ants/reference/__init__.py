"""The reference: the rules of the world in plain Python, to test the fast kernels against.

It is an oracle, not a simulator to use: every rule is written down a second time, as directly as it
reads, with a geometry of its own (tuples of cube coordinates in normal form), its own random
streams, its own vision and its own learners. Tests compare each step of the engines with it, for
equality to the bit. To keep the two independent, this package imports nothing of `taichi_ants` but
`constants`, `errors`, the configurations (with the weights of `learners.config.update_weights`) and
the type `World`, and of a world it reads only the fields (ranges, queen, foods, obstacles, trails,
ants).

- `train`, `rollout`, `start`: whole runs, with a record of every step if asked for.
- `ReferenceColony`: many ants in one world, tick by tick; `Snapshot`: all of it between two ticks.
- `WorldState`, `Ant`, `observe`, `act`: the world and one ant, step by step.
- `choose_action`: the epsilon-greedy policy.
- `register`, `learner_named`, `learner_names`: the twins of the package's learners.
- `RandomStream`, `stream_state`: the draws.
- `normal_form`, `neighbour`, `distance`, `exists`, `existing_cells`: the geometry.
"""

from __future__ import annotations

from taichi_ants.reference.ant import Ant, Event, act, cells_in_view, observe
from taichi_ants.reference.colony import ReferenceColony
from taichi_ants.reference.colony_records import (
    AntSnapshot,
    ColonyAnt,
    EpisodeRecord,
    Snapshot,
    Transition,
)
from taichi_ants.reference.geometry import (
    Cell,
    distance,
    existing_cells,
    exists,
    neighbour,
    normal_form,
)
from taichi_ants.reference.learners import Learner, learner_named, learner_names, register
from taichi_ants.reference.policy import choose_action
from taichi_ants.reference.random_stream import RandomStream, stream_state
from taichi_ants.reference.records import LearningStep, Rollout, Run, Step
from taichi_ants.reference.runs import rollout, train
from taichi_ants.reference.start import start
from taichi_ants.reference.world_state import WorldState

__all__ = [
    "Ant",
    "AntSnapshot",
    "Cell",
    "ColonyAnt",
    "EpisodeRecord",
    "Event",
    "Learner",
    "LearningStep",
    "RandomStream",
    "ReferenceColony",
    "Rollout",
    "Run",
    "Snapshot",
    "Step",
    "Transition",
    "WorldState",
    "act",
    "cells_in_view",
    "choose_action",
    "distance",
    "existing_cells",
    "exists",
    "learner_named",
    "learner_names",
    "neighbour",
    "normal_form",
    "observe",
    "register",
    "rollout",
    "start",
    "stream_state",
    "train",
]
