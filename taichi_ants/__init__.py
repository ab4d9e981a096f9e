"""Taichi Ants: ants on a hexagonal grid that lay pheromone trails and learn by reinforcement.

Names are imported on first use, so that `import taichi_ants` is quick and does not start Taichi.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from taichi_ants.process_variables import prepare_for_taichi

if TYPE_CHECKING:
    from taichi_ants import (
        analysis,
        envs,
        learners,
        measures,
        offline,
        reference,
        rendering,
        rules,
        task,
        testing,
        worlds,
    )
    from taichi_ants.analysis.results import compare, plot, summary
    from taichi_ants.engines.colony.colony import Colony, ColonyEpisodes
    from taichi_ants.engines.colony.interventions import Interventions
    from taichi_ants.engines.runs.results import Rollouts, Trace, TrainingResult
    from taichi_ants.engines.runs.training import (
        continue_training,
        evaluate,
        rollout,
        trace_training,
        train,
    )
    from taichi_ants.envs.formats import tabulate
    from taichi_ants.errors import AntsError
    from taichi_ants.lab import replay
    from taichi_ants.learners.config import TrainingConfig
    from taichi_ants.learners.policies import load_policy, save_policy
    from taichi_ants.offline.dataset import Dataset
    from taichi_ants.offline.recording import record, record_colony
    from taichi_ants.protocol import At, Every, When
    from taichi_ants.task import Field, Life, Observation, Pheromone, Rewards, Task, states
    from taichi_ants.worlds import World

__version__ = "0.1.0"
PHYSICS = 1  # rises when equal settings and seeds give other numbers; see tests/golden/record.py

_NAMES_IN = {
    "analysis.results": ("compare", "plot", "summary"),
    "engines.colony.colony": ("Colony", "ColonyEpisodes"),
    "engines.colony.interventions": ("Interventions",),
    "engines.runs.results": ("Rollouts", "Trace", "TrainingResult"),
    "engines.runs.training": (
        *("continue_training", "evaluate", "rollout", "trace_training", "train"),
    ),
    "envs.formats": ("tabulate",),
    "errors": ("AntsError",),
    "lab": ("replay",),
    "learners.config": ("TrainingConfig",),
    "learners.policies": ("load_policy", "save_policy"),
    "offline.dataset": ("Dataset",),
    "offline.recording": ("record", "record_colony"),
    "protocol": ("At", "Every", "When"),
    "task": ("Field", "Life", "Observation", "Pheromone", "Rewards", "Task"),
    "worlds": ("World",),
}
__all__ = [
    "AntsError", "At", "Colony", "ColonyEpisodes", "Dataset", "Every", "Field", "Interventions",
    "Life", "Observation", "Pheromone", "Rewards", "Rollouts", "Task", "Trace", "TrainingConfig",
    "TrainingResult", "When", "World", "__version__", "analysis", "compare", "continue_training",
    "envs", "evaluate", "learners", "load_policy", "measures", "offline", "plot", "record",
    "record_colony", "reference", "rendering", "replay", "rollout", "rules", "save_policy",
    "states", "summary", "tabulate", "task", "testing", "trace_training", "train", "worlds",
]  # fmt: skip
__dir__ = __all__.copy  # completion lists only public names


prepare_for_taichi()


def __getattr__(name: str) -> object:
    for module, names in _NAMES_IN.items():
        if name in names:
            globals()[name] = getattr(import_module(f"taichi_ants.{module}"), name)
            return globals()[name]
    if name in __all__:
        return import_module(f"taichi_ants.{'task.states' if name == 'states' else name}")
    raise AttributeError(f"module 'taichi_ants' has no attribute {name!r}")
