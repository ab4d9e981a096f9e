"""Data sets as Minari's, and back."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from taichi_ants import (
    AntsError,
    Colony,
    Dataset,
    Life,
    Task,
    TrainingConfig,
    from_minari,
    record,
    record_colony,
    to_minari,
    worlds,
)
from taichi_ants.envs.formats import FORMATS
from taichi_ants.learners.policies import trail_follower

ID = "taichi_ants/HexForage-v0"

minari = pytest.importorskip("minari")
pytest.importorskip("h5py")


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))


def colony_data() -> Dataset:
    task = Task(life=Life(births=True, lifespan=15, regrowth=0))
    training = TrainingConfig("q_learning", 0.1, 0.9, 0.3, 1.0)
    follower = trail_follower()
    world = worlds.open_world(5, (6, 6, 6))
    return record_colony(Colony(world, task, training, 7, 4, q_values=follower), 1, 40)


@pytest.mark.parametrize("form", FORMATS)
def test_written_and_read_back(form):
    data = colony_data()
    written = to_minari(data, "ants/colony-v0", form)
    assert from_minari(written) == data
    assert from_minari("ants/colony-v0") == data


def test_an_episode_of_an_ant_is_one_of_minaris():
    """As Minari's own readers see it."""
    data = colony_data()
    to_minari(data, "ants/colony-v0", "index")
    loaded = minari.load_dataset("ants/colony-v0")
    assert loaded.total_steps == len(data)
    assert loaded.total_episodes == len(data.begins) - 1
    for k, episode in enumerate(loaded.iterate_episodes()):
        rows = slice(data.begins[k], data.begins[k + 1])
        states = [*data.state[rows], data.next_state[rows][-1]]
        assert episode.observations.tolist() == states
        assert episode.actions.tolist() == data.action[rows].tolist()
        assert episode.rewards.tolist() == data.reward[rows].tolist()
        assert (episode.terminations | episode.truncations).tolist() == [False] * (
            len(states) - 2
        ) + [True]
        assert len(episode.infos["step"]) == len(states)
        assert loaded.action_space == spaces.Discrete(5)


def test_the_environment_of_single_ants_is_recovered():
    """With its world, rules and format: the same actions give the same episode."""
    world, task = worlds.open_world(5, (6, 6, 6)), Task(delivery="truncates", observation="ants")
    to_minari(record(world, task=task, seeds=3, episodes=2), "ants/alone-v0", "one_hot")
    loaded = minari.load_dataset("ants/alone-v0")
    recovered = loaded.recover_environment()
    assert recovered.observation_space == loaded.observation_space
    assert recovered.spec.kwargs["evaporation"] is True  # as in evaluation: nobody learned
    rules = {"world": world, "task": task, "evaporation": True}
    ours = gymnasium.make(ID, **rules, observation_format="one_hot")
    seen, _ = ours.reset(seed=1)
    assert np.array_equal(seen, recovered.reset(seed=1)[0])
    for action in np.random.default_rng(0).integers(0, 5, 300).tolist():
        one, other = ours.step(action), recovered.step(action)
        assert np.array_equal(one[0], other[0])
        assert one[1:4] == other[1:4]
        if one[2] or one[3]:
            break
    learned = record(world, TrainingConfig("q_learning", 0.1, 0.9, 0.3, 1.0), 1, task=task)
    again = to_minari(learned, "ants/learner-v0").recover_environment()
    assert again.spec.kwargs["evaporation"] is task.evaporation_in_training
    to_minari(colony_data(), "ants/colony-v0")
    with pytest.raises(ValueError, match="env"):
        minari.load_dataset("ants/colony-v0").recover_environment()


@pytest.mark.filterwarnings("ignore::UserWarning:minari")
def test_what_others_wrote_needs_a_world():
    """And does not know the probabilities of actions."""
    data = record(worlds.paper(), None, 3, 4, 20)
    from minari.data_collector import EpisodeBuffer

    buffers = [
        EpisodeBuffer(
            observations=np.append(data.state[a:b], data.next_state[b - 1]).astype(np.int64),
            actions=data.action[a:b],
            rewards=data.reward[a:b].astype(float),
            terminations=np.zeros(b - a, bool),
            truncations=np.zeros(b - a, bool),  # the collector was stopped
        )
        for a, b in zip(data.begins[:-1], data.begins[1:], strict=True)
    ]
    given = {"action_space": spaces.Discrete(5), "observation_space": spaces.Discrete(128)}
    other = minari.create_dataset_from_buffers("others/ants-v0", buffers, **given)
    with pytest.raises(AntsError, match="give the arguments world and task"):
        from_minari(other)
    read = from_minari(other, worlds.paper())
    assert np.array_equal(read.state, data.state)
    assert np.array_equal(read.truncated, data.truncated)
    assert np.isnan(read.behaviour_probability).all()
    with pytest.raises(AntsError, match="Discrete"):
        from_minari(other, worlds.paper(), Task("six_cells"))


def test_names_that_are_taken_missing_or_wrong():
    data = record(worlds.paper(), None, 1, 4, 5)
    to_minari(data, "ants/taken-v0")
    for name in ("ants/taken-v0", "no name"):
        with pytest.raises(AntsError, match="Minari cannot write"):
            to_minari(data, name)
    with pytest.raises(AntsError, match="Minari has no data set 'ants/missing-v0'"):
        from_minari("ants/missing-v0")
    for odd in (None, 3, "", "n" * 300, "a\0b"):
        with pytest.raises(AntsError):
            from_minari(odd)


def test_damaged_files_are_named(tmp_path):
    """Cut, overwritten or gone, and damage that only the numbers show."""
    data = colony_data()
    to_minari(data, "ants/colony-v0")
    folder = tmp_path / "ants" / "colony-v0" / "data"
    numbers, facts = folder / "main_data.hdf5", folder / "metadata.json"
    whole, described = numbers.read_bytes(), facts.read_text()
    damaged = [whole[:1000], whole[: len(whole) // 2], bytes(len(whole)), b""]
    damaged += [whole[:at] + bytes(64) + whole[at + 64 :] for at in range(0, len(whole), 50_000)]
    said = []
    for content in damaged:
        numbers.write_bytes(content)
        try:
            from_minari("ants/colony-v0")
        except AntsError as error:
            said.append(str(error))
    assert len(said) >= 4
    assert all(str(folder.parent) in one and "\n" not in one for one in said)
    numbers.write_bytes(whole)
    assert from_minari("ants/colony-v0") == data
    for text in ("", "{}", "[" * 100_000, described.replace("taichi_ants", "x" * 11)):
        facts.write_text(text)
        with pytest.raises(AntsError):
            from_minari("ants/colony-v0")
    numbers.unlink()
    with pytest.raises(AntsError, match="is damaged"):
        from_minari("ants/colony-v0")
