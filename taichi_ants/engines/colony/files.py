"""Colonies in files: everything that is needed to go on, bit for bit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants import checks, files, learners, runtime
from taichi_ants.engines.colony.memory import set_learning_rate
from taichi_ants.engines.records import same
from taichi_ants.engines.stored import FileKind, world_arrays, world_facts, world_from
from taichi_ants.errors import checked_whole
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.task import Task
from taichi_ants.task.constants import N_ACTIONS

if TYPE_CHECKING:
    from taichi_ants.engines.colony.colony import Colony

_KIND = FileKind("taichi-ants colony 9", "colony", "Colony.save")
_OPTIONS = ("seeds", "ants", "capacity", "start", "ends_at_delivery", "sharing", "schedule")
_MOMENT = ("epsilon", "learning_rate", "length", "ticks")


def save_colony(colony: Colony, path: files.PathLike) -> None:
    """Write a colony, uncompressed; raises as `files.write_atomically` does."""
    facts, arrays = _contents(colony)
    _KIND.write(path, facts, arrays, compress=False)


def same_colony(one: Colony, other: Colony) -> bool:
    """Whether two colonies would be written alike, so that they go on alike."""
    (facts, arrays), (other_facts, other_arrays) = _contents(one), _contents(other)
    return (
        facts == other_facts
        and arrays.keys() == other_arrays.keys()
        and all(same(array, other_arrays[name]) for name, array in arrays.items())
    )


def _contents(colony: Colony) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """All that a file of a colony holds: facts and arrays."""
    arrays = {f"array_{name}": colony.arrays[name] for name in colony.stored}
    numbers = {world: number for number, world in enumerate(dict.fromkeys(colony.worlds))}
    for world, number in numbers.items():
        arrays |= world_arrays(world, f"world{number}")
    facts = {
        "task": colony.task.as_dict(),
        "training": None if colony.is_given_actions else colony.training.as_dict(),
        "worlds": [world_facts(world) for world in numbers],
        "world_of": [numbers[world] for world in colony.worlds],
        "one_a_slot": colony.one_a_slot,
        "rounds": colony.rounds.tolist(),
        "homes": colony.n_homes,  # more than there are foods at the start, if a hand put food there
        **{name: getattr(colony, name) for name in (*_OPTIONS, *_MOMENT)},
    }
    return facts, arrays


def load_colony(
    cls: type[Colony], path: files.PathLike, threads: int | None, arch: str | None
) -> Colony:
    """Read a colony that `save_colony` wrote.

    Raises:
        AntsError: The file is missing, damaged, or holds no colony; or its learner or
            observation is not registered.
    """
    stored, facts = _KIND.read(path)
    runtime.start(threads, arch)  # what is wrong with these says nothing about the file
    with _KIND.rebuilding(path):
        given = facts["training"]
        training = None if given is None else TrainingConfig(**given)
    if training is not None:
        learners.get(training.learner)
    with _KIND.rebuilding(path):
        worlds = [
            world_from(stored, f"world{number}", one) for number, one in enumerate(facts["worlds"])
        ]
        task, options = Task.from_dict(facts["task"]), {name: facts[name] for name in _OPTIONS}
        if (
            options["sharing"] == "fixed" and training is not None
        ):  # tables of the right shape, until its own are put in
            leading = (len(facts["seeds"]), facts["capacity"]) if facts["one_a_slot"] else ()
            options["q_values"] = np.zeros((*leading, task.n_states, N_ACTIONS), np.float32)
        colony = cls([worlds[number] for number in facts["world_of"]], task, training, **options)
        for name in ("epsilon", "learning_rate"):
            setattr(colony, name, checks.checked_share(name, facts[name]))
        set_learning_rate(colony)
        colony.length = checked_whole("length", facts["length"], least=0)
        colony.ticks = checked_whole("ticks", facts["ticks"], least=0)
        rounds = np.array(facts.get("rounds", colony.rounds), np.int64)  # files had none before
        if rounds.shape != colony.rounds.shape or rounds.min() < 0:
            raise ValueError("rounds has another shape, or is below 0")
        colony.rounds = rounds
        if facts.get("homes", colony.n_homes) != colony.n_homes:
            colony.make_room_for_homes(facts["homes"])
        for name in colony.stored:
            array, kept = colony.arrays[name], stored[f"array_{name}"]
            if kept.shape != array.shape or kept.dtype != array.dtype:
                raise ValueError(f"{name} has another shape or type")
            array[:] = kept
    return colony
