"""What a task can be, how it is written down, and what is refused."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from random_rewards import random_rewards

from taichi_ants.errors import AntsError
from taichi_ants.task import Life, Pheromone, Rewards, Task, Traffic, observations
from taichi_ants.task.observations import Observation, registry


def test_the_defaults_are_the_rules_of_the_world():
    task = Task()
    assert task == Task()
    assert hash(task) == hash(Task())
    assert dataclasses.astuple(task.pheromone) == (
        "linear",
        None,
        0.0,
        "set",
        250,
        None,
        None,
        "half",
    )
    assert dataclasses.astuple(task.rewards) == (0, -1, 1, 3, 10)
    assert task.life == Life(births=False, lifespan=None, regrowth=None, pile_move_interval=None)
    assert dataclasses.astuple(task.traffic) == (False, False, False, False)
    assert not task.turns_at_queen
    assert (task.observation, task.n_states, task.delivery) == ("paper", 128, "terminates")
    assert (task.evaporation_in_training, task.evaporation_in_evaluation) == (False, True)


def test_a_task_can_be_written_as_json():
    for task in (
        Task(),
        Task("six_cells", random_rewards(3), delivery="truncates", evaporation_in_training=True),
        Task(pheromone=Pheromone("exponential", 7.5, 0.1, "add", 9, 99), life=Life(True, 5, 0, 2)),
    ):
        assert Task.from_dict(json.loads(json.dumps(task.as_dict()))) == task
    assert Task.from_dict({"rewards": {"deliver": 5}}) == Task(rewards=Rewards(deliver=5))
    assert Task.from_dict({"traffic": "following"}) == Task(traffic=Traffic.named()["following"])


@pytest.fixture
def _no_observation_stays(monkeypatch):
    monkeypatch.setattr(registry.OBSERVATIONS, "yours", dict(registry.OBSERVATIONS.yours))


def always_zero(view):
    return 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"n_states": 0}, "n_states of 'mine' is 0; it must lie between 1"),
        ({"encode": 3}, "encode of 'mine' is 3; it must be a function of one argument"),
        ({"cells": (0, 1)}, r"cells of 'mine' is \(0, 1\); it must be a tuple of -1, 0, 1"),
        ({"name_of": int}, "name_of fails .the name of state 0 is 0; it must be text.;"),
        ({"cells": (-1, 0, 1, 4)}, "optionally -2, 2 and 3"),
        ({"reads": ("a", "a")}, r"reads of 'mine' is \('a', 'a'\); it must be a tuple of names"),
        ({"reads": ("level",)}, r"reads of 'mine' is \('level',\); it must be a tuple of names"),
        ({"shape": (2, 2)}, r"shape of 'mine' is \(2, 2\); it must be a tuple of .*n_states, 1;"),
    ],
)
@pytest.mark.usefixtures("_no_observation_stays")
def test_an_observation_that_cannot_be(changes, message):
    mine = Observation("mine", 1, always_zero)
    with pytest.raises(AntsError, match=message):
        observations.register(dataclasses.replace(mine, **changes))


@pytest.mark.parametrize("name", observations.names())
def test_each_row_has_a_name_of_its_own(name):
    """All but those that cannot be, which have a dash."""
    one = observations.get(name)
    names = [name for name in map(one.name_of, range(one.n_states)) if "-" not in name]
    assert len(set(names)) == len(names) >= 128


def test_the_numbers_that_kernels_take():
    pheromone = Pheromone("exponential", half_life=1, diffusion=0.6)
    assert (pheromone.decay, type(pheromone.decay)) == (np.float32(0.5), np.float32)
    assert (pheromone.share, type(pheromone.share)) == (np.float32(0.1), np.float32)
    assert Pheromone("exponential", 50).decay == np.float32(0.5**0.02)
    assert [
        Pheromone(evaporation, diffusion=diffusion).dense
        for evaporation in ("linear", "none", "exponential")
        for diffusion in (0, 0.1)
    ] == [False, True, False, True, True, True]
