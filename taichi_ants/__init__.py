"""Taichi Ants: ants on a hexagonal grid that lay pheromone trails and learn by reinforcement.

The names below are imported when they are first used, so that `import taichi_ants` is quick and
Taichi starts only where a kernel is needed.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from taichi_ants.environment import prepare_for_taichi

if TYPE_CHECKING:
    from taichi_ants import analysis, learners, reference, rendering, task, worlds
    from taichi_ants.engines.colony.colony import Colony, ColonyEpisodes
    from taichi_ants.engines.runs.results import Rollouts, TrainingResult
    from taichi_ants.engines.runs.traces import Trace, rollout, trace_training
    from taichi_ants.engines.runs.training import continue_training, evaluate, train
    from taichi_ants.errors import AntsError
    from taichi_ants.learners.config import TrainingConfig
    from taichi_ants.learners.policies import load_policy, save_policy
    from taichi_ants.task import Life, Observation, Pheromone, Rewards, Task, states
    from taichi_ants.worlds import World

__version__ = "0.1.0"

_HOMES = {
    "AntsError": "taichi_ants.errors",
    "Colony": "taichi_ants.engines.colony.colony",
    "ColonyEpisodes": "taichi_ants.engines.colony.colony",
    **dict.fromkeys(("Life", "Observation", "Pheromone", "Rewards", "Task"), "taichi_ants.task"),
    "Rollouts": "taichi_ants.engines.runs.results",
    "Trace": "taichi_ants.engines.runs.traces",
    "TrainingConfig": "taichi_ants.learners.config",
    "TrainingResult": "taichi_ants.engines.runs.results",
    "World": "taichi_ants.worlds",
    "continue_training": "taichi_ants.engines.runs.training",
    "evaluate": "taichi_ants.engines.runs.training",
    "load_policy": "taichi_ants.learners.policies",
    "rollout": "taichi_ants.engines.runs.traces",
    "save_policy": "taichi_ants.learners.policies",
    "trace_training": "taichi_ants.engines.runs.traces",
    "train": "taichi_ants.engines.runs.training",
}
_MODULES = {"states": "taichi_ants.task.states"} | {
    name: f"taichi_ants.{name}"
    for name in ("analysis", "learners", "reference", "rendering", "task", "worlds")
}

__all__ = [
    "AntsError",
    "Colony",
    "ColonyEpisodes",
    "Life",
    "Observation",
    "Pheromone",
    "Rewards",
    "Rollouts",
    "Task",
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
    "task",
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
        return import_module(_MODULES[name])
    raise AttributeError(f"module 'taichi_ants' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
