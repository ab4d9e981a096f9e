"""Colonies that are given their actions, and single worlds that begin anew.

That they do what the reference does is compared in `tests/envs/test_colony.py`.
"""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest
from random_colonies import random_colony
from same_colonies import assert_equal

from taichi_ants import AntsError, Colony, Task, TrainingConfig, worlds
from taichi_ants.engines.colony import layout
from taichi_ants.engines.colony.layout import WorldRow
from taichi_ants.reference import ReferenceColony
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


@pytest.mark.parametrize("task", [LIVELY, Task()], ids=["births", "paper"])
@pytest.mark.slow
def test_threads_and_schedules_give_the_same(task, monkeypatch):
    """Many chunks; without births ants would be sorted, if nobody gave their actions by slot."""
    monkeypatch.setattr(layout, "_CHUNKS_PER_THREAD", 8)
    expected = pass_ticks(begun(threads=1, task=task))
    assert expected.arrays["worlds"][WorldRow.TICKS].tolist() == [40, 32, 28]
    assert expected.arrays["episodes"].tolist() == [0, 1, 0]
    assert_same(expected, pass_ticks(begun(threads=1, schedule="by_chunk", task=task)))
    for schedule in ("by_world", "by_chunk"):
        assert_same(expected, pass_ticks(begun(threads=2, schedule=schedule, task=task)))


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


def test_colonies_that_learn_can_be_copied_too():
    training = TrainingConfig("sarsa", 0.1, 0.9, 0.2, 0.9)
    colony = Colony(MEADOW, Task(), training, (1, 2), ants=9)
    colony.run(1, 20)
    colony.begin_episode()
    other = pickle.loads(pickle.dumps(colony))
    colony.tick(20)
    other.tick(20)
    assert other == colony


@pytest.mark.slow
@pytest.mark.parametrize("sharing", ["independent", "shared"])
def test_worlds_in_which_ants_learn_begin_anew_as_well(sharing):
    """As the reference; epsilon and the learning rate stay, so that it must not decay there."""
    for seed in range(6):
        drawn = random_colony(
            seed,
            sharing=sharing,
            learner="q_learning",
            dense=False,
            changes=True,
            observation="ants_seen" if sharing == "independent" else "paper",
        )
        steady = {"epsilon_decay": 1.0, "learning_rate_decay": 1.0, "min_learning_rate": 0.0}
        training = replace(drawn.training, epsilon=0.3, **steady)
        rules = {**drawn.population, "ends_at_delivery": False, "sharing": sharing}
        seeds = (seed, seed + 50)
        colony = Colony(drawn.world, drawn.task, training, seeds, **rules)
        plains = [ReferenceColony(drawn.world, drawn.task, training, one, **rules) for one in seeds]
        colony.begin_episode()
        for plain in plains:
            plain.begin_episode()
        for tick in range(16):
            if tick in (5, 9):
                colony.reset_worlds(np.arange(2) == tick // 9)
                plains[tick // 9].end_episode()
                plains[tick // 9].begin_episode()
            colony.tick()
            for world, plain in enumerate(plains):
                plain.tick()
                assert_equal(colony, plain, world)


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
