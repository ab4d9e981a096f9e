"""The hand-written policies, and policy files."""

import json
from pathlib import Path

import numpy as np
import pytest

from taichi_ants.errors import AntsError
from taichi_ants.learners.policies import load_policy, random_policy, save_policy, trail_follower
from taichi_ants.task import Task, foraging, observations
from taichi_ants.task.constants import FORWARD, GIVE, LEFT, PICK_UP, RIGHT


def best_actions(q_values: np.ndarray, name: str, observation: str = "paper") -> set[int]:
    sees = observations.get(observation)
    (row,) = (row for row in range(sees.n_states) if sees.name_of(row) == name)
    return set(np.flatnonzero(q_values[row] == q_values[row].max()).tolist())


@pytest.mark.parametrize(
    ("name", "actions"),
    [
        ("foraging E T F", {PICK_UP}),
        ("foraging F F O", {PICK_UP}),
        ("foraging T T T", {FORWARD}),
        ("foraging T E T", {LEFT, RIGHT}),
        ("foraging E O T", {RIGHT}),
        ("foraging E E E", {FORWARD}),
        ("foraging O E E", {FORWARD, RIGHT}),
        ("foraging E O E", {LEFT, RIGHT}),
        ("foraging O E O", {FORWARD}),
        ("foraging O O O", {LEFT}),
        ("carrying O Q E", {GIVE}),
        ("carrying S S O", {LEFT, FORWARD}),
        ("carrying E E S", {RIGHT}),
        ("carrying E E E", {LEFT, FORWARD, RIGHT}),
        ("carrying O E O", {FORWARD}),
        ("carrying O O O", {LEFT}),
    ],
)
def test_what_the_trail_follower_does(name: str, actions: set[int]) -> None:
    assert best_actions(trail_follower(), name) == actions


# Files.


def test_a_policy_comes_back_from_its_file(tmp_path: Path) -> None:
    q_values = np.random.default_rng(1).normal(size=(128, 5)).astype(np.float32)
    metadata = {"learner": "sarsa", "seed": np.int64(3), "world": "world of é", "none": None}
    path = tmp_path / "policy"
    save_policy(path, q_values, metadata)
    loaded, observation, loaded_metadata = load_policy(path)
    np.testing.assert_array_equal(loaded, q_values)
    assert loaded.dtype == np.float32
    assert observation == "paper"
    assert loaded_metadata == {"learner": "sarsa", "seed": 3, "world": "world of é", "none": None}
    assert [entry.name for entry in tmp_path.iterdir()] == ["policy"]


def task_of(path, metadata, observation="ants"):
    save_policy(path, random_policy(observation), metadata, observation)
    return load_policy(path).task


def test_a_policy_knows_the_rules_for_which_it_was_made(tmp_path: Path) -> None:
    path = tmp_path / "policy.npz"
    assert task_of(path, {"task": foraging().as_dict()}) == foraging()
    assert task_of(path, {}) == Task("ants")
    # The rows of its table are those of its observation, whatever else its metadata say.
    assert task_of(path, {"task": Task().as_dict()}) == Task("ants")
    for wrong in ({"smell": 1}, 3):
        with pytest.raises(AntsError, match=r"`task(\.smell)?` is "):
            task_of(path, {"task": wrong})


@pytest.mark.parametrize(
    ("q_values", "message"),
    [
        (np.zeros((127, 5)), r"\(127, 5\)"),
        (np.zeros(640), r"\(640,\)"),
        (np.full((128, 5), np.nan), "nan for state 0 and action 0"),
        (np.full((128, 5), 1e300), "inf"),
        (np.full((128, 5), "a"), "real numbers"),
        (np.zeros((128, 5), bool), "real numbers"),
    ],
)
def test_values_that_are_no_policy_are_refused_both_ways(
    tmp_path: Path, q_values: np.ndarray, message: str
) -> None:
    path = tmp_path / "policy.npz"
    with pytest.raises(AntsError, match=message):
        save_policy(path, q_values, {})
    with pytest.raises(AntsError, match="metadata is None; it must be a mapping"):
        save_policy(path, random_policy(), None)  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []
    facts = {"kind": "policy", "version": 2, "observation": "paper", "metadata": {}}
    np.savez(path, q_values=q_values, facts=json.dumps(facts))  # as other programs do
    with pytest.raises(AntsError, match=message) as raised:
        load_policy(path)
    assert str(path) in str(raised.value)
