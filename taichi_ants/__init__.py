"""Taichi Ants: ants on a hexagonal grid that lay pheromone trails and learn by reinforcement.

The names below are imported when they are first used, so that `import taichi_ants` is quick and
Taichi starts only where a kernel is needed.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from taichi_ants.environment import prepare_for_taichi

if TYPE_CHECKING:
    from taichi_ants import analysis, learners, reference, rendering, states, worlds
    from taichi_ants.colony_config import ColonyConfig, Pheromone
    from taichi_ants.config import TrainingConfig
    from taichi_ants.engines.colony import Colony, ColonyEpisodes
    from taichi_ants.engines.results import LearnerCost, Rollouts, TrainingResult
    from taichi_ants.engines.runs import continue_training, evaluate, train
    from taichi_ants.engines.traces import Trace, rollout, trace_training
    from taichi_ants.errors import AntsError
    from taichi_ants.policies import load_policy, save_policy
    from taichi_ants.worlds import World

__version__ = "0.1.0"

_HOMES = {
    "AntsError": "taichi_ants.errors",
    "Colony": "taichi_ants.engines.colony",
    "ColonyConfig": "taichi_ants.colony_config",
    "ColonyEpisodes": "taichi_ants.engines.colony",
    "Pheromone": "taichi_ants.colony_config",
    "LearnerCost": "taichi_ants.engines.results",
    "Rollouts": "taichi_ants.engines.results",
    "Trace": "taichi_ants.engines.traces",
    "TrainingConfig": "taichi_ants.config",
    "TrainingResult": "taichi_ants.engines.results",
    "World": "taichi_ants.worlds",
    "continue_training": "taichi_ants.engines.runs",
    "evaluate": "taichi_ants.engines.runs",
    "load_policy": "taichi_ants.policies",
    "rollout": "taichi_ants.engines.traces",
    "save_policy": "taichi_ants.policies",
    "trace_training": "taichi_ants.engines.traces",
    "train": "taichi_ants.engines.runs",
}
_MODULES = ("analysis", "learners", "reference", "rendering", "states", "worlds")

__all__ = [
    "AntsError",
    "Colony",
    "ColonyConfig",
    "ColonyEpisodes",
    "LearnerCost",
    "Pheromone",
    "Rollouts",
    "Trace",
    "TrainingConfig",
    "TrainingResult",
    "World",
    "__version__",
    "analysis",
    "continue_training",
    "evaluate",
    "learners",
    "load_policy",
    "reference",
    "rendering",
    "rollout",
    "save_policy",
    "states",
    "trace_training",
    "train",
    "worlds",
]

prepare_for_taichi()


def __getattr__(name: str) -> object:
    if name in _HOMES:
        value = getattr(import_module(_HOMES[name]), name)
        globals()[name] = value
        return value
    if name in _MODULES:
        return import_module(f"taichi_ants.{name}")
    raise AttributeError(f"module 'taichi_ants' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
