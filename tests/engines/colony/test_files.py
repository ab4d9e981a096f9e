"""Colonies in files and copies: what was saved goes on, and what was changed is refused."""

import copy
import json
import pickle

import numpy as np
import pytest
from random_colonies import random_colony
from refusals import refused

from taichi_ants import AntsError, Colony, TrainingConfig, worlds
from taichi_ants.files import archives
from taichi_ants.task import Life, Task

PLANNING = TrainingConfig("dyna_q", 0.1, 0.9, 0.5, 1.0, planning_steps=2)


@pytest.fixture(scope="module")
def kept(tmp_path_factory) -> dict[str, np.ndarray]:
    """The arrays of a colony in which everything comes and goes."""
    path = tmp_path_factory.mktemp("kept") / "colony.npz"
    life = Life(births=True, lifespan=150, regrowth=2, pile_move_interval=9)
    task = Task(delivery="truncates", evaporation_in_training=True, life=life)
    world = worlds.open_world(2, (14, 14, 14))
    colony = Colony(world, task, PLANNING, (1, 2), ants=12)
    colony.begin_episode()
    colony.tick(200)
    assert colony.outcome().births.sum() > 0
    colony.save(path)
    Colony.load(path).tick(5)
    return archives.read(path)


def of_file(arrays: dict[str, np.ndarray], folder) -> Colony:
    archives.write(folder / "x.npz", arrays)
    return Colony.load(folder / "x.npz")


def test_what_others_have_written_is_not_believed(kept, tmp_path) -> None:
    """Kernels would write where the cell of an ant or the memory of a learner points."""
    np.savez(tmp_path / "x.npz", **kept)
    with pytest.raises(AntsError, match=r"is damaged, or not an \.npz file of this version"):
        Colony.load(tmp_path / "x.npz")


def test_copies_of_colonies_with_given_actions_go_on_alike(tmp_path):
    """Also when worlds have begun anew, one of them with another seed."""
    world, rng = worlds.open_world(5, (9, 8, 7)), np.random.default_rng(1)
    life = Life(births=True, lifespan=30, regrowth=2, pile_move_interval=9)
    colony = Colony(world, Task(life=life), None, (3, 4, 5), ants=20, sharing="frozen")
    colony.begin_episode()
    colony.act(rng.integers(0, 5, (3, colony.capacity)))
    colony.reset_worlds(np.array([False, True, False]))
    colony.reset_worlds(np.array([False, False, True]), [77])
    others = copy.deepcopy(colony), pickle.loads(pickle.dumps(colony)), reread(colony, tmp_path)
    for _ in range(40):
        actions = rng.integers(0, 5, (3, colony.capacity))
        for one in (colony, *others):
            one.act(actions)
    assert all(one.is_given_actions and one == colony for one in others)
    colony.reset_worlds(np.array([True, False, True]), [9, 9])  # seeds may repeat
    with pytest.raises(AntsError, match=r"^seeds contains 9 more than once"):
        colony.save(tmp_path / "never.npz")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"task": None}, ""),
        ({"task": {"delivery": "never"}}, "`task.delivery` is 'never'"),
        ({"task": {"observation": "six_cells"}}, "array_state"),
        ({"training": {"learner": "sarsa"}}, ""),
        ({"seeds": [1]}, ""),
        ({"worlds": [{"ranges": [9, 9, 9], "queen": [0, 0, 0]}]}, "damaged (KeyError: 'foods')"),
        ({"world_of": [7, 7]}, ""),
        ({"epsilon": 7}, "epsilon is 7"),
        ({"schedule": "never"}, "schedule is 'never'"),
    ],
)
def test_wrong_facts(kept, tmp_path, changes, said) -> None:
    facts = {**json.loads(kept["facts"].item()), **changes}
    arrays = {**kept, "facts": np.array(json.dumps(facts))}
    assert refused(said, of_file, arrays, tmp_path).startswith("the colony in '")


@pytest.mark.parametrize(
    "name",
    [
        "dyna_q",
        pytest.param("double_q", marks=pytest.mark.long),
        pytest.param("sarsa_lambda", marks=pytest.mark.slow),
    ],
)
def test_what_was_saved_goes_on_bit_for_bit(name, tmp_path) -> None:
    """At many moments of its life: a model, further tables, or traces are part of it."""
    one = random_colony(7, sharing="independent", learner=name, observation="ants_seen")
    colony = Colony(
        *(one.world, one.task, one.training, one.seed),
        **one.population,
        sharing="independent",
        q_values=one.q_values,
    )
    colony = reread(colony, tmp_path)
    for _ in range(2):
        colony.begin_episode()
        for ticks in (1, 3, 20):
            again = reread(colony, tmp_path)
            assert again == colony
            again.tick(ticks)
            colony.tick(ticks)
            assert again == colony
        colony.end_episode()


def reread(colony: Colony, folder) -> Colony:
    colony.save(folder / "x.npz")
    return Colony.load(folder / "x.npz")
