"""Colonies that are given their actions, and single worlds that begin anew.

That they do what the reference does is compared in `tests/envs/test_colony.py`.
"""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

from taichi_ants import AntsError, Colony, Task, worlds
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
