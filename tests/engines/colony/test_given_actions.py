"""Colonies that are given their actions, and single worlds that begin anew.

That they do what the reference does is compared in `tests/envs/test_colony.py`.
"""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

from taichi_ants import AntsError, Colony, Task, TrainingConfig, worlds
from taichi_ants.task import Life

MEADOW = worlds.open_world(5, (9, 8, 7))
LIVELY = Task(life=Life(births=True, lifespan=30, regrowth=2, pile_move_interval=9))
ALL = np.ones(3, bool)


def given(seeds=(3, 4, 5), task=LIVELY, **options) -> Colony:
    return Colony(MEADOW, task, None, seeds, ants=20, sharing="frozen", **options)


def pass_ticks(colony: Colony, ticks: int = 40, seed: int = 1) -> Colony:
    """Any actions; on the way two worlds begin anew, one of them with another seed."""
    rng = np.random.default_rng(seed)
    shape = len(colony.seeds), colony.capacity
    for tick in range(ticks):
        colony.act(rng.integers(0, 5, shape))
        if tick == 7:
            colony.reset_worlds(np.array([False, True, False]))
        if tick == 11:
            colony.reset_worlds(np.array([False, False, True]), [77])
    return colony


def begun(**options) -> Colony:
    colony = given(**options)
    colony.begin_episode()
    return colony


def assert_same(one: Colony, other: Colony) -> None:
    for name in one.stored:
        assert np.array_equal(one.arrays[name], other.arrays[name]), name


def test_a_world_with_another_seed_is_as_in_a_new_colony():
    colony, new = pass_ticks(begun()), begun(seeds=(8, 9, 77))
    colony.reset_worlds(ALL, [8, 9, 77])
    assert_same(colony, new)
    assert_same(pass_ticks(colony), pass_ticks(new))
    colony.reset_worlds(np.array([True, False, True]), [9, 9])  # seeds may repeat
    with pytest.raises(AntsError, match=r"^seeds contains 9 more than once; "):
        colony.save("never.npz")


def test_copies_pickles_and_files_go_on_alike(tmp_path):
    colony = pass_ticks(begun())
    colony.save(tmp_path / "colony.npz")
    others = [
        copy.deepcopy(colony),
        pickle.loads(pickle.dumps(colony)),
        Colony.load(tmp_path / "colony.npz"),
    ]
    expected = pass_ticks(colony, seed=2)
    for other in others:
        assert other.is_given_actions
        assert pass_ticks(other, seed=2) == expected


def test_what_is_not_allowed():
    colony = given()
    right = np.zeros((3, colony.capacity), int)
    with pytest.raises(AntsError, match=r"^no episode has begun; "):
        colony.act(right)
    colony.begin_episode()
    for wrong in (right[:2], right + 0.5, right.ravel(), None):
        with pytest.raises(AntsError, match=r"^actions is .*; give whole numbers of shape \(3, "):
            colony.act(wrong)
    for action in (-1, 5):
        with pytest.raises(AntsError, match=rf"^an action is {action}; it must lie between 0 and"):
            colony.act(right + action)
    colony.act(np.where(colony.living, 2, 99))  # nobody lives in the other slots
    with pytest.raises(AntsError, match=r"^training is None, so ants do not choose actions; "):
        colony.tick()
    with pytest.raises(AntsError, match=r"^which is .*; give a bool for each of the \d+ worlds\.$"):
        colony.reset_worlds(np.ones(2, bool))
    with pytest.raises(AntsError, match=r"^there are 2 seeds for 1 world; give 1 seed\.$"):
        colony.reset_worlds(np.array([True, False, False]), [1, 2])
    with pytest.raises(AntsError, match=r"^a seed is 0\.5; "):
        colony.reset_worlds(np.array([True, False, False]), [0.5])
    training = TrainingConfig("sarsa", 0.1, 0.9, 0.2, 0.9)
    learning = Colony(MEADOW, Task(), training, ants=9)
    learning.begin_episode()
    with pytest.raises(AntsError, match=r"^the ants of this colony choose their own actions"):
        learning.act(np.zeros((1, 9), int))
    for options in (
        {},
        {"sharing": "independent"},
        {"sharing": "frozen", "q_values": np.zeros((128, 5))},
    ):
        with pytest.raises(AntsError, match=r"^training is None; it must be one TrainingConfig, "):
            Colony(MEADOW, Task(), None, ants=9, **options)
