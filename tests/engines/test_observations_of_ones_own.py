"""Observations from outside of the package: what they read of a look, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from random_worlds import random_world

from taichi_ants import AntsError, Colony, Task, TrainingConfig, reference, rollout, train
from taichi_ants.reference import OBSERVATIONS
from taichi_ants.task import Observation
from taichi_ants.task.observations import registry
from taichi_ants.worlds import paper

CONFIG = TrainingConfig("sarsa", 0.3, 0.9, 0.3, 0.99)


def load(look):
    return look.carries


def own_trail(look):
    on_trail = 0
    if look.own_level >= 1:
        on_trail = 1
    return 2 * look.carries + on_trail


def nearer(look):
    index = look.carries
    for k in range(3):
        index = 2 * index + look.nearer[k]
    return index


def strongest(look):
    index = 2 * look.percept
    if look.strongest > 20 and look.levels[1] < look.strongest:
        index += 1
    return index


def too_large(look):
    return look.carries + 4


def outside(look):
    return look.codes[7]


def unknown(look):
    return look.nothing


PARTS = {"load": (load, 2), "own_trail": (own_trail, 4), "nearer": (nearer, 16)}
PARTS["strongest"] = (strongest, 256)


@pytest.fixture(autouse=True)
def registers(monkeypatch) -> None:
    """What a test registers is gone after it."""
    monkeypatch.setattr(registry, "_OBSERVATIONS", dict(registry._OBSERVATIONS))


@pytest.mark.parametrize("name", PARTS)
def test_a_row_may_read_any_part_of_a_look(name) -> None:
    row, n_states = PARTS[name]
    registry.register(Observation(name, n_states, row))
    task = Task(name, evaporation_in_training=True)
    trained = train(paper(), CONFIG, (0, 1), 20, 80, task)
    assert trained.q_values.shape == (1, 2, n_states, 5)
    colony = Colony(paper(), task, CONFIG, 0, ants=5)
    colony.run(2, 30)
    assert colony.q_values.shape == (1, n_states, 5)
    assert np.count_nonzero(colony.q_values) > 0


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        (too_large, "4"),
        (outside, "outside of an array"),
        (unknown, "nothing"),
    ],
)
def test_what_cannot_be_a_row_is_named(row, reason) -> None:
    registry.register(Observation("mistaken", 4, row))
    with pytest.raises(AntsError, match="mistaken") as caught:
        train(paper(), CONFIG, 0, 1, 1, Task("mistaken"))
    assert reason in str(caught.value)


def test_a_lambda_is_refused_at_once() -> None:
    with pytest.raises(AntsError, match="written with def"):
        registry.register(Observation("short", 4, lambda look: 0))


def test_one_ant_alone_and_a_colony_of_one_see_alike() -> None:
    row, n_states = PARTS["own_trail"]
    registry.register(Observation("own_trail", n_states, row))
    table = np.random.default_rng(3).normal(size=(n_states, 5)).astype(np.float32)
    for seed in range(6):
        world = random_world(seed)
        trace = rollout(world, table, seed, max_steps=60, task=Task("own_trail"), epsilon=0.4)
        assert trace.states.max() < n_states
        carried = trace.states >= 2
        assert (carried == (trace.percepts >= 64)).all()


def test_the_reference_lists_a_twin_of_each() -> None:
    assert set(OBSERVATIONS) == set(registry.names())
    assert reference.OBSERVATIONS is OBSERVATIONS
