"""Training results in files: everything that is needed to go on, bit for bit."""

from __future__ import annotations

from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants import files
from taichi_ants.engines.stored import FileKind, world_arrays, world_facts, world_from
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.task import Task

if TYPE_CHECKING:
    from taichi_ants.engines.runs.results import TrainingResult

_KIND = FileKind("taichi-ants training 3", "training result", "TrainingResult.save")
_OUTCOMES = ("returns", "steps", "deliveries")


def save_training(result: TrainingResult, path: files.PathLike) -> None:
    """Write a result, compressed; raises as `files.write_atomically` does."""
    facts = {
        "world": world_facts(result.world),
        "task": result.task.as_dict(),
        "configs": [config.as_dict() for config in result.configs],
        "seeds": result.seeds,
        "max_steps": result.max_steps,
        "costs": [asdict(cost) for cost in result.costs],
    }
    arrays = {name: getattr(result, name) for name in _OUTCOMES}
    arrays |= {f"state_{name}": array for name, array in vars(result.state).items()}
    _KIND.write(path, facts, {**arrays, **world_arrays(result.world, "world")}, compress=True)


def load_training(cls: type[TrainingResult], path: files.PathLike) -> TrainingResult:
    """Read a result that `save_training` wrote; its learners need not be registered.

    Raises:
        AntsError: The file is missing, damaged, or holds no training result.
    """
    from taichi_ants.checks import checked_count, checked_max_steps, checked_seeds
    from taichi_ants.engines.runs.results import LearnerCost
    from taichi_ants.engines.runs.state import RunState

    stored, facts = _KIND.read(path)
    with _KIND.rebuilding(path):
        task = Task.from_dict(facts["task"])
        costs = tuple(LearnerCost(**cost) for cost in facts["costs"])
        for cost in costs:
            checked_count("steps", cost.steps, most=2**63 - 1, least=0)
        outcomes: dict[str, Any] = {name: np.ascontiguousarray(stored[name]) for name in _OUTCOMES}
        return cls(
            world=world_from(stored, "world", facts["world"]),
            configs=tuple(TrainingConfig(**config) for config in facts["configs"]),
            seeds=checked_seeds(facts["seeds"]),
            max_steps=checked_max_steps(facts["max_steps"], task),
            task=task,
            **outcomes,
            costs=costs,
            state=RunState(
                **{
                    field.name: np.ascontiguousarray(stored[f"state_{field.name}"])
                    for field in fields(RunState)
                }
            ),
        )
