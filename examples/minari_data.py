"""Exchange offline data with Minari, Farama's library of data sets.

Requires Minari: `pip install "minari[hdf5]>=0.5"`. `to_minari` writes a data set of this package,
with an episode for each ant's episode. `from_minari` reads it again, or one that another program
recorded in the environments of this package. As a script, it writes a random ant's data set, reads
it, learns from it, and prints how many rollouts deliver.
"""

import argparse
import json
from typing import Any

import gymnasium
import minari
import numpy as np
from minari.data_collector import EpisodeBuffer

import taichi_ants
from taichi_ants import Dataset, Task, World, offline, worlds
from taichi_ants.envs.formats import ObservationFormat, ShownObservations
from taichi_ants.files import to_json
from taichi_ants.offline.dataset import COLUMNS

# Infos of each step, and of the last observation of an episode, in addition to Minari's fields.
INFOS = ("run", "agent", "step", "behaviour_probability")


def to_minari(data: Dataset, name: str, form: ObservationFormat = "cells") -> minari.MinariDataset:
    """Return a data set written to Minari's local storage, for example as "ants/random-v0"."""
    shown, buffers = ShownObservations(data.task.sees, form), []
    for first, end in zip(data.begins[:-1], data.begins[1:], strict=True):
        rows = slice(first, end)
        infos = {info: np.append(getattr(data, info)[rows], 0) for info in INFOS}
        buffers.append(
            EpisodeBuffer(
                observations=shown.show(np.append(data.state[rows], data.next_state[end - 1])),
                actions=data.action[rows].astype(np.int64),
                rewards=data.reward[rows].astype(np.float64),
                terminations=data.terminated[rows],
                truncations=data.truncated[rows],
                infos=infos,
            )
        )
    space = gymnasium.spaces.Discrete(5)
    written = minari.create_dataset_from_buffers(
        name, buffers, observation_space=shown.space, action_space=space
    )
    written.storage.update_metadata({"taichi_ants": to_json({**data.facts(), "format": form})})
    return written


def from_minari(
    name: str, world: World | None = None, task: Task | None = None, form: str = "cells"
) -> Dataset:
    """Return a data set; one that `to_minari` has not written needs a world, task and format."""
    source = minari.load_dataset(name)
    metadata = source.storage.metadata
    known: dict[str, Any] = {"world": world, "task": task or Task(), "seeds": (0,)}
    known["behaviour"] = {"policy": "unknown"}
    if "taichi_ants" in metadata:
        facts = json.loads(metadata["taichi_ants"])
        known, form = Dataset.described(facts), facts["format"]
    shown, pieces = ShownObservations(known["task"].sees, form).table, []
    state_of = {row.tobytes(): state for state, row in enumerate(shown)}
    for number, episode in enumerate(source.iterate_episodes()):
        rows, n = episode.observations.astype(shown.dtype), len(episode)
        states = np.array([state_of[row.tobytes()] for row in rows])
        usual = {"run": np.zeros(n), "agent": np.zeros(n), "step": np.arange(n)}
        usual["behaviour_probability"] = np.full(n, np.nan)
        truncated = np.array(episode.truncations) & ~episode.terminations
        truncated[-1] = not episode.terminations[-1]  # a data set may end within an episode
        piece = {info: (episode.infos or usual).get(info, usual[info])[:n] for info in INFOS}
        piece |= {"episode": np.full(n, number), "state": states[:-1], "next_state": states[1:]}
        piece |= {"action": episode.actions, "reward": episode.rewards, "truncated": truncated}
        pieces.append({**piece, "terminated": episode.terminations})
    columns = {
        column: np.concatenate([piece[column] for piece in pieces]).astype(dtype)
        for column, dtype in COLUMNS.items()
    }
    return Dataset(**known, **columns)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--name", default="ants/random-v0", help="name of the data set in Minari")
    args = parser.parse_args()
    recorded = taichi_ants.record(worlds.paper(), seeds=range(20), episodes=5)
    to_minari(recorded, args.name)
    table = offline.fitted_q_iteration(from_minari(args.name))
    rollouts = taichi_ants.evaluate(worlds.paper(), table, 20)
    print(f"{len(recorded)} transitions; {rollouts.deliveries.sum()} of 20 rollouts deliver")
