"""Conversion of data sets to and from Minari; requires the extra `minari`.

AntsError means that a data set does not exist or is not from these environments, or that its name
is taken or not allowed.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.envs.registration import EnvSpec

from taichi_ants.envs.formats import ObservationFormat, Shown
from taichi_ants.errors import AntsError, expect, imported, shown
from taichi_ants.files import to_json
from taichi_ants.offline.dataset import COLUMNS, Dataset
from taichi_ants.task import Task
from taichi_ants.task.constants import N_ACTIONS
from taichi_ants.worlds.world import World

if TYPE_CHECKING:
    from minari import MinariDataset

_FACTS = "taichi_ants"  # the key of the description in Minari's metadata
_FORMATS: dict[type, ObservationFormat] = {
    spaces.Discrete: "index",
    spaces.MultiDiscrete: "cells",
    spaces.Box: "one_hot",
}
# Infos of each step, and of the last observation of an episode, in addition to Minari's fields.
_INFOS = ("run", "agent", "step", "behaviour_probability")


def to_minari(
    data: Dataset, dataset_id: str, observation_format: ObservationFormat = "cells"
) -> MinariDataset:
    """Return a data set written to Minari's local storage, with an episode for each ant's episode.

    Args:
        data: The data set.
        dataset_id: Its name in Minari, for example "ants/random-v0".
        observation_format: "cells", "index" or "one_hot", as in the environments. Infos are the
            run, the ant, the tick, and the probability of the action.
    """
    expect("data", data, Dataset)
    minari = imported("a data set of Minari", "minari", "minari")
    from minari.data_collector import EpisodeBuffer

    form = Shown(data.task.sees, observation_format)
    buffers = []
    for first, end in zip(data.begins[:-1], data.begins[1:], strict=True):
        rows = slice(first, end)
        infos = {name: np.append(getattr(data, name)[rows], 0) for name in _INFOS}
        for name in ("run", "agent", "step"):
            infos[name][-1] = infos[name][-2] + (name == "step")
        infos["behaviour_probability"][-1] = np.nan
        buffers.append(
            EpisodeBuffer(
                observations=form.show(np.append(data.state[rows], data.next_state[end - 1])),
                actions=data.action[rows].astype(np.int64),
                rewards=data.reward[rows].astype(np.float64),
                terminations=data.terminated[rows],
                truncations=data.truncated[rows],
                infos=infos,
            )
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # about optional metadata
            written = minari.create_dataset_from_buffers(
                dataset_id,
                buffers,
                observation_space=form.space,
                action_space=spaces.Discrete(N_ACTIONS),
                algorithm_name=str(data.behaviour.get("policy", "unknown")),
                description=f"Ants on a hexagonal grid, recorded by taichi_ants: {data.behaviour}",
                requirements=["taichi-ants"],
                env=_spec(data, observation_format),
            )
    except (TypeError, ValueError) as error:
        raise AntsError(
            f"Minari cannot write {shown(dataset_id)} ({' '.join(str(error).split())}); choose "
            'another name, for example "ants/random-v0".'
        ) from error
    written.storage.update_metadata({_FACTS: to_json(data.facts())})
    return written


def _spec(data: Dataset, observation_format: ObservationFormat) -> EnvSpec | None:
    """Return the environment for `recover_environment`, or None if ants were not alone."""
    if data.agent.any():
        return None
    task, learned = data.task, data.behaviour.get("policy") == "learner"
    settings = {
        "world": data.world.as_dict(),
        "task": task.as_dict(),
        "evaporation": task.evaporation_in_training if learned else task.evaporation_in_evaluation,
        "observation_format": observation_format,
    }
    return replace(gymnasium.spec("taichi_ants/HexForage-v0"), kwargs=settings)


def from_minari(
    dataset: str | MinariDataset, world: World | None = None, task: Task | None = None
) -> Dataset:
    """Return a data set that `to_minari` wrote, or that Minari recorded in these environments.

    Args:
        dataset: The data set, or its name.
        world: The world of the ants, required unless `to_minari` wrote the data set.
        task: The rules of the ants if `to_minari` did not write the data set; by default, the
            paper's.
    """
    minari = imported("a data set of Minari", "minari", "minari")
    try:
        path = Path(
            minari.storage.get_dataset_path(dataset)
            if isinstance(dataset, str)
            else dataset.storage.data_path
        )
        if not path.is_dir():
            raise FileNotFoundError
    except (OSError, ValueError, AttributeError):
        raise AntsError(
            f"Minari has no data set {shown(dataset)}; run `minari list local` for the names."
        ) from None
    with _reading(path):
        source = minari.load_dataset(dataset) if isinstance(dataset, str) else dataset
        facts = source.storage.metadata.get(_FACTS)
        known: dict[str, Any] = {"world": world, "task": task or Task(), "seeds": (0,)}
        known["behaviour"] = {"policy": "unknown"}
        if facts is not None:
            known = Dataset.described(json.loads(facts))
    if known["world"] is None:
        raise AntsError(
            "the data set does not contain a world and a task; give the arguments world and task."
        )
    form = Shown(known["task"].sees, _FORMATS.get(type(source.observation_space), "cells"))
    if (source.observation_space, source.action_space) != (form.space, spaces.Discrete(N_ACTIONS)):
        raise AntsError(
            f"the data set has the spaces {source.observation_space} and {source.action_space}; "
            f"for this task they must be {form.space} and Discrete({N_ACTIONS})."
        )
    with _reading(path):
        pieces = [_rows(episode, k, form) for k, episode in enumerate(source.iterate_episodes())]
        rows: dict[str, Any] = {
            name: np.concatenate([piece[name] for piece in pieces]).astype(dtype)
            for name, dtype in COLUMNS.items()
        }
        return Dataset(**known, **rows)


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Turn all errors while the files of a data set are read into an AntsError that names them."""
    try:
        yield
    except Exception as error:  # h5py and Minari raise many kinds
        text = " ".join(str(error).rstrip(".").split()) or type(error).__name__
        raise AntsError(
            f"the data set in {str(path)!r} is damaged, or not from these environments ({text}); "
            "write it again, or name another data set."
        ) from error


def _rows(episode: Any, number: int, form: Shown) -> dict[str, np.ndarray]:
    states, n = form.states(episode.observations), len(episode)
    rewards = np.rint(episode.rewards)
    if not np.array_equal(rewards, episode.rewards):
        wrong = np.asarray(episode.rewards)[rewards != episode.rewards][0]
        raise AntsError(f"a reward is {wrong:g}; it must be a whole number.")
    infos = episode.infos or {}
    usual = {"run": np.zeros(n), "agent": np.zeros(n), "step": np.arange(n)}
    usual["behaviour_probability"] = np.full(n, np.nan)
    truncated = np.array(episode.truncations) & ~episode.terminations
    truncated[-1] = not episode.terminations[-1]  # a data set may end within an episode
    return {
        **{name: infos[name][:n] if name in infos else usual[name] for name in _INFOS},
        "episode": np.full(n, number),
        "state": states[:-1],
        "action": episode.actions,
        "reward": rewards,
        "next_state": states[1:],
        "terminated": episode.terminations,
        "truncated": truncated,
    }
