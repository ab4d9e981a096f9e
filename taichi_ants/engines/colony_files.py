"""Colonies in files: everything that is needed to go on, bit for bit."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants import learners, results, runtime
from taichi_ants.colony_config import ColonyConfig, Pheromone
from taichi_ants.config import TrainingConfig
from taichi_ants.constants import N_ACTIONS, N_STATES
from taichi_ants.engines import checks
from taichi_ants.engines.colony_damage import check_contents
from taichi_ants.errors import AntsError
from taichi_ants.worlds.world import World

if TYPE_CHECKING:
    from taichi_ants.engines.colony import Colony

_FORMAT = "taichi-ants colony 1"
# What the worlds and configurations determine is not stored.
_DERIVED = frozenset({"walls", "closer", "compass", "rewards", "weights", "spare", "seeds"})
# What numbers, texts and arrays that mean nothing lead to while a colony is built from them.
_SIGNS_OF_DAMAGE = (
    *(AntsError, ArithmeticError, AttributeError, LookupError, RecursionError, TypeError),
    ValueError,
)
_WORLD_PARTS = ("foods", "obstacles", "trails", "ants")


def save_colony(colony: Colony, path: results.PathLike) -> None:
    """Write a colony, uncompressed; raises as `results.write_atomically` does."""
    arrays: dict[str, np.ndarray] = {
        f"array_{name}": array for name, array in colony.arrays.items() if name not in _DERIVED
    }
    distinct = list(dict.fromkeys(colony.worlds))
    for number, world in enumerate(distinct):
        for part in _WORLD_PARTS:
            arrays[f"world{number}_{part}"] = getattr(world, part)
    facts = {
        "format": _FORMAT,
        "config": asdict(colony.config),
        "training": asdict(colony.training),
        "sharing": colony.sharing,
        "seeds": list(colony.seeds),
        "worlds": [{"ranges": world.ranges, "queen": world.queen} for world in distinct],
        "world_of": [distinct.index(world) for world in colony.worlds],
        "chunks": colony.chunks,
        "schedule": colony.schedule,
        "epsilon": colony.epsilon,
        "episode": colony.episode,
        "ticks": colony.ticks,
    }
    arrays["facts"] = np.array(results.to_json(facts))
    results.write_npz(path, arrays, compress=False)


def load_colony(
    cls: type[Colony], path: results.PathLike, threads: int | None, arch: str | None
) -> Colony:
    """Read a colony that `save_colony` wrote.

    Raises:
        AntsError: The file is missing, damaged, or holds no colony; or its learner is not
            registered.
    """
    stored = results.read_npz(path)
    facts = _facts(stored, path)
    runtime.start(threads, arch)  # what is wrong with these says nothing about the file
    try:
        learners.get(facts["training"]["learner"])
    except (KeyError, TypeError) as error:
        raise _damaged(path, "its learner is missing") from error
    try:
        colony = _rebuild(cls, stored, facts, threads, arch)
        colony.epsilon = checks.checked_share("epsilon", facts["epsilon"])
        colony.episode = checks.checked_count("episode", facts["episode"], least=-1)
        colony.ticks = checks.checked_count("ticks", facts["ticks"], least=0)
        for name, array in colony.arrays.items():
            if name not in _DERIVED:
                kept = stored[f"array_{name}"]
                if kept.shape != array.shape or kept.dtype != array.dtype:
                    raise ValueError(f"{name} has another shape or type")
                colony.arrays[name] = np.ascontiguousarray(kept)
        check_contents(colony)
    except _SIGNS_OF_DAMAGE as error:
        raise _damaged(path, _reason(error)) from error
    return colony


def _facts(stored: dict[str, np.ndarray], path: results.PathLike) -> dict[str, Any]:
    try:
        facts = json.loads(str(stored["facts"][()]))
        if facts["format"] != _FORMAT:
            raise ValueError(facts["format"])
    except (KeyError, ValueError, TypeError, RecursionError) as error:
        raise AntsError(
            f"{str(path)!r} holds no colony of this version; name a file that Colony.save wrote."
        ) from error
    return facts


def _damaged(path: results.PathLike, reason: str) -> AntsError:
    return AntsError(
        f"the colony in {str(path)!r} is damaged ({reason}); name a file that Colony.save wrote."
    )


def _reason(error: Exception) -> str:
    if isinstance(error, KeyError):
        return f"{error} is missing"
    return " ".join(str(error).rstrip(".").split()) or type(error).__name__


def _rebuild(
    cls: type[Colony],
    stored: dict[str, np.ndarray],
    facts: dict[str, Any],
    threads: int | None,
    arch: str | None,
) -> Colony:
    worlds = [
        World(
            tuple(facts["worlds"][number]["ranges"]),
            tuple(facts["worlds"][number]["queen"]),
            **{part: stored[f"world{number}_{part}"] for part in _WORLD_PARTS},
        )
        for number in range(len(facts["worlds"]))
    ]
    pheromone = Pheromone(**facts["config"].pop("pheromone"))
    return cls(
        [worlds[number] for number in facts["world_of"]],
        ColonyConfig(pheromone=pheromone, **facts["config"]),
        TrainingConfig(**facts["training"]),
        facts["seeds"],
        facts["sharing"],
        q_values=_own_tables(stored, facts),
        threads=threads,
        arch=arch,
        schedule=facts["schedule"],
    )


def _own_tables(stored: dict[str, np.ndarray], facts: dict[str, Any]) -> np.ndarray | None:
    """Any tables of the right shape, if a colony that does not learn has one a slot."""
    slots = stored["array_ants"].shape[1] // len(facts["seeds"])
    one_a_slot = stored["array_q"].size == len(facts["seeds"]) * slots * N_STATES * 8
    if facts["sharing"] != "fixed" or not one_a_slot:
        return None
    return np.zeros((len(facts["seeds"]), slots, N_STATES, N_ACTIONS), np.float32)
