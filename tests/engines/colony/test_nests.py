"""Several nests and kinds of food: tables, changes by hand, and refusals."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from taichi_ants import Colony, Life, Task, TrainingConfig, World
from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.interventions import AddAnts, Place, RemoveAnts
from taichi_ants.learners.policies import trail_follower
from taichi_ants.protocol import At
from taichi_ants.task import Food

TRAINING = TrainingConfig("q_learning", 0.1, 0.9, 0.1, 1.0)
KINDS = {"seed": Food(pick_up=2, deliver=5, loads=3), "sugar": Food(deliver=20)}
WORLD = World(
    (8, 8, 8),
    [(0, 0, 0), (6, 0, 0)],
    foods=[((3, 1, 0), 0), ((4, 1, 0), 1), ((3, 2, 0), 1), ((2, 1, 0), 0)],
)


def two_nests(**options) -> Colony:
    given = {"ants": 12, "sharing": "frozen", "q_values": trail_follower("paper"), **options}
    return Colony(WORLD, Task(foods=KINDS), TRAINING, **given)


def test_each_nest_learns_into_its_own_table():
    colony = Colony(WORLD, Task(foods=KINDS), TRAINING, [1, 2, 3], ants=12)
    assert colony.run(1, 200).nest_deliveries.shape == (1, 3, 2)
    tables = colony.q_values
    assert tables.shape == (3, 2, 128, 5)
    assert not np.array_equal(tables[:, 0], tables[:, 1])
    frozen = Colony(WORLD, Task(foods=KINDS), TRAINING, [1, 2, 3], ants=12, sharing="frozen",
                    q_values=tables)  # fmt: skip
    assert np.array_equal(frozen.q_values, tables)


def test_changes_by_hand_keep_nests_and_kinds_in_later_episodes():
    colony = two_nests(capacity=20)
    interventions = Interventions(colony)
    colony.begin_episode()
    interventions.apply(Place("food", [[5, 3, 0]], kind="sugar"))
    interventions.apply(Place("queen", [[6, 6, 0]], nest=1))
    interventions.apply(AddAnts(number=3, nest=1))
    interventions.apply(RemoveAnts(share=1.0, nest=0))
    assert colony.nests[colony.living].tolist() == [1] * 9
    interventions.begin_episode()
    world = colony.worlds[0]
    assert world.queens.tolist() == [[0, 0, 0], [6, 6, 0]]
    kinds = dict(zip(map(tuple, world.foods.tolist()), world.food_kinds.tolist(), strict=True))
    before = zip(map(tuple, WORLD.foods.tolist()), WORLD.food_kinds.tolist(), strict=True)
    assert kinds == {**dict(before), (5, 3, 0): 1}
    assert sorted(colony.nests[colony.living].tolist()) == [0] * 6 + [1] * 6


@pytest.mark.parametrize(
    ("make", "message"),
    [
(lambda: Interventions(begun()).apply(AddAnts(number=1, nest=2)), "nest` is 2"),
(lambda: begun().run(1, 5, protocol=[At(2, remove_ants={"share": 0.5, "nest": 2})]),
         "`remove_ants.nest` is 2, but the world has 2 nests"),
(lambda: Colony(WORLD, Task(), TRAINING), "the world has 2 kinds of food, but the task 1"),
(lambda: Colony([WORLD, replace(WORLD, other_queens=())], Task(foods=KINDS), TRAINING,
                        [1, 2]), "all worlds of a colony must have the same number"),
(lambda: Task(foods=KINDS, life=Life(regrowth=3)), "set the regrowth of each kind instead"),
(lambda: Task(foods={f"kind_{k}": Food() for k in range(9)}), "at most 8."),],
)  # fmt: skip
def test_refusals(make, message):
    refused(message, make)


def begun() -> Colony:
    colony = two_nests()
    colony.begin_episode()
    return colony
