"""Colonies in files with wrong contents are refused, by name, before a kernel believes them."""

from __future__ import annotations

import json

import numpy as np
import pytest
from random_colonies import random_colony

from taichi_ants import AntsError, Colony, ColonyConfig, TrainingConfig, worlds
from taichi_ants.engines.colony import arrays as names

PLANNING = TrainingConfig("dyna_q", 0.1, 0.9, 0.5, 1.0, planning_steps=2, delivery="continuing")


@pytest.fixture(scope="module", params=["shared", "own"])
def kept(request, tmp_path_factory) -> dict[str, np.ndarray]:
    """The arrays of a colony in which everything comes and goes."""
    path = tmp_path_factory.mktemp("kept") / "colony.npz"
    life = ColonyConfig(ants=12, births=True, lifespan=150, regrowth=2, wander=9)
    world = worlds.open_world(2, (14, 14, 14))
    colony = Colony(world, life, PLANNING, (1, 2), request.param)
    colony.begin_episode()
    colony.tick(200)
    assert colony.outcome().births.sum() > 0
    colony.save(path)
    Colony.load(path).tick(5)
    with np.load(path) as archive:
        return dict(archive)


def refused(arrays: dict[str, np.ndarray], folder) -> str:
    path = folder / "x.npz"
    np.savez(path, **arrays)
    with pytest.raises(AntsError, match=r"[.]$") as caught:
        Colony.load(path)
    text = str(caught.value)
    assert text.startswith(f"the colony in {str(path)!r} is damaged (")
    assert text.endswith("); name a file that Colony.save wrote.")
    assert "\n" not in text
    return text


@pytest.mark.parametrize(
    ("name", "place", "value", "said"),
    [
        ("ants", (names.CELL, 0), 10**8, "the cell of an ant is 100000000"),
        ("ants", (names.CELL, slice(None)), 0, "an ant is not where it stands"),
        ("ants", (names.HEADING, 3), 77, "the heading of an ant is 77"),
        ("ants", (names.HEADING, 3), -1, "the heading of an ant is -1"),
        ("ants", (names.CARRIES, 3), 2, "what an ant carries is 2"),
        ("ants", (names.LIFE, slice(None)), 1, "do not add up"),
        ("ants", (names.NUMBER, 3), -5, "the number of an ant is -5"),
        ("ants", (names.STATE, 3), 128, "the state of an ant is 128"),
        ("ants", (names.STATE, slice(None)), 63, "an ant sees what is not there"),
        ("ants", (names.STATE, slice(None)), 0, "an ant sees what is not there"),
        ("ants", (names.ACTION, 3), 5, "the action of an ant is 5"),
        ("worlds", (names.QUEEN_CELL, 0), 3, "a queen is elsewhere"),
        ("worlds", (names.TOP, 0), 10**6, "a slot is 1000000"),
        ("worlds", (names.FIRST_VACANT, 0), 88, "the slots of ants do not fit"),
        ("worlds", (names.MODEL_SIZE, 0), 641, "the size of a model is 641"),
        ("homes", (names.HOME_CELL, 0), 10**8, "a place of food is 100000000"),
        ("homes", (names.HOME_CELL, 0), 0, "a place of food lies outside the world"),
        ("home_of", 0, 0, "a home lies outside the world"),
        ("home_of", 200, 10**8, "a home is 100000000"),
        ("piles", 1, 10**8, "the start of a pile is 100000000"),
        ("ground", slice(0, 40), 0, "rocks are elsewhere"),
        ("ground", slice(None), 9, "rocks are elsewhere"),
        ("q", 17, np.nan, "q holds no finite numbers"),
        ("rates", 0, np.inf, "rates holds no finite numbers"),
        ("trail", 70, -3, "trail is below 0"),
        ("entries", 0, 7, "the action of an entry is 7"),
        ("slots_of", slice(0, 640), 0, "the pairs of a model do not add up"),
    ],
)
def test_wrong_numbers(kept, tmp_path, name, place, value, said) -> None:
    arrays = {key: array.copy() for key, array in kept.items()}
    arrays[f"array_{name}"][place] = value
    assert said in refused(arrays, tmp_path)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"config": None}, ""),
        ({"config": {"ants": 3}}, "pheromone"),
        ({"training": {"learner": "sarsa"}}, ""),
        ({"training": None}, "its learner is missing"),
        ({"seeds": []}, ""),
        ({"seeds": [1]}, ""),
        ({"worlds": []}, ""),
        ({"worlds": [{"ranges": [9, 9, 9], "queen": [0, 0, 0]}]}, ""),
        ({"world_of": [7, 7]}, ""),
        ({"sharing": "maybe"}, "sharing is 'maybe'"),
        ({"epsilon": 7}, "epsilon is 7"),
        ({"episode": 10**12}, "episode is 1000000000000"),
        ({"ticks": -1}, "ticks is -1"),
        ({"ticks": "many"}, "ticks is 'many'"),
        ({"schedule": "never"}, "schedule is 'never'"),
    ],
)
def test_wrong_facts(kept, tmp_path, changes, said) -> None:
    facts = {**json.loads(str(kept["facts"][()])), **changes}
    assert said in refused({**kept, "facts": np.array(json.dumps(facts))}, tmp_path)


def test_other_shapes_and_missing_arrays(kept, tmp_path) -> None:
    for name in ("array_ants", "array_q", "array_ground", "world0_foods"):
        for other in (kept[name][:-1], kept[name].astype(float), np.zeros(())):
            if name != "world0_foods" or other.ndim == 0:
                refused({**kept, name: other}, tmp_path)
        assert "is missing" in refused({k: v for k, v in kept.items() if k != name}, tmp_path)


@pytest.mark.parametrize("seed", range(24))
def test_what_was_saved_is_never_damaged(seed, tmp_path) -> None:
    """At no moment of its life, for all options, learners and ways of sharing."""
    one = random_colony(seed)
    colony = Colony(
        *(one.world, one.config, one.training, one.seed, one.sharing, one.q_values),
        schedule=("by_world", "by_chunk")[seed % 2],
    )
    Colony.load(saved(colony, tmp_path))
    for _ in range(2):
        colony.begin_episode()
        for ticks in (1, 1, 3, 20, 60):
            Colony.load(saved(colony, tmp_path))
            colony.tick(ticks)
        Colony.load(saved(colony, tmp_path))
        colony.end_episode()


def saved(colony: Colony, folder) -> str:
    colony.save(folder / "x.npz")
    return str(folder / "x.npz")
