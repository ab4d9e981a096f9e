"""Several nests and kinds of food: what always holds, files, other parts, and refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from random_colonies import RandomColony, random_colony, with_nests

from taichi_ants import AntsError, Colony, Life, Task, TrainingConfig, World
from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.features.foods import HELD
from taichi_ants.interventions import AddAnts, Place, RemoveAnts
from taichi_ants.learners.policies import trail_follower
from taichi_ants.protocol import At
from taichi_ants.reference import ReferenceColony
from taichi_ants.task import Food
from taichi_ants.task.constants import FOOD, Event

TRAINING = TrainingConfig("q_learning", 0.1, 0.9, 0.1, 1.0)
KINDS = {"seed": Food(pick_up=2, deliver=5, loads=3), "sugar": Food(deliver=20)}
WORLD = World(
    (8, 8, 8),
    [(0, 0, 0), (6, 0, 0)],
    foods=[((3, 1, 0), 0), ((4, 1, 0), 1), ((3, 2, 0), 1), ((2, 1, 0), 0)],
)


def made(drawn: RandomColony, **options) -> Colony:
    return Colony(
        drawn.world,
        drawn.task,
        drawn.training,
        [drawn.seed, 7],
        **drawn.population,
        sharing=drawn.sharing,
        q_values=drawn.q_values,
        **options,
    )


def two_nests(**options) -> Colony:
    given = {"ants": 12, "sharing": "frozen", "q_values": trail_follower("paper"), **options}
    return Colony(WORLD, Task(foods=KINDS), TRAINING, **given)


def drawn_nests(sharing: str = "frozen", most: int = 24):
    """Yield random colonies of two nests and two kinds of food with several loads."""
    for seed in range(most):
        one = random_colony(seed, sharing=sharing, learner="q_learning", dense=False, changes=True)
        one = with_nests(one, seed, 2, 2, loads=True)
        if one.world.n_nests == 2:
            yield one


def test_snapshots_have_nests_and_kinds():
    """As the reference has them, by the numbers of ants and the cells of food and queens."""
    rules = {"ants": 12, "sharing": "frozen", "q_values": trail_follower("paper")}
    colony, seen = two_nests(seeds=[5]), set()
    plain = ReferenceColony(WORLD, Task(foods=KINDS), TRAINING, 5, **rules)
    colony.begin_episode()
    plain.begin_episode()
    for _ in range(40):
        colony.tick()
        plain.tick()
        now, kinds = colony.snapshot(), np.zeros(colony.grid.size, np.uint8)
        ants = {ant.number: ant for ant in plain.ants.values()}
        of_ants = [ants[number] for number in now.ant_numbers.tolist()]
        assert now.ant_nests.tolist() == [ant.nest for ant in of_ants]
        carried = [ant.own["kind"] if ant.carries else -1 for ant in of_ants]
        assert now.ant_foods.tolist() == carried
        seen.update(zip(now.ant_nests.tolist(), carried, strict=True))
        for cell, food in plain.world.of_cells.items():
            if plain.world.ground[cell] == FOOD:
                kinds[colony.grid.index(cell)] = food["kind_of"]
        assert (now.food_kinds == kinds).all()
    assert now.queens.tolist() == [int(colony.grid.index(cell)) for cell in plain.world.queens]
    assert {(0, -1), (0, 0), (1, -1), (1, 0), (1, 1)} <= seen


def loads_of(colony: Colony, world: int) -> np.ndarray:
    """The loads in cells and of living carriers, by kind."""
    size, kinds = colony.grid.size, np.zeros(colony._model.n_kinds, int)
    here = np.flatnonzero(colony.snapshot(world).ground == FOOD) + world * size
    loads = colony.arrays["loads"][here] if HELD.is_used(colony.task) else 1
    np.add.at(kinds, colony.arrays["kind_of"][here], loads)
    carries = colony.living[world] & (
        colony.arrays["carries"].reshape(colony.living.shape)[world] == 1
    )
    np.add.at(kinds, colony.arrays["kind"].reshape(colony.living.shape)[world][carries], 1)
    return kinds


def test_loads_are_conserved():
    delivered = regrown = 0
    for drawn in drawn_nests():
        colony = made(drawn)
        colony.begin_episode()
        start = [loads_of(colony, world) for world in range(2)]
        for _ in range(30):
            colony.tick()
            outcome = colony.outcome()
            for world in range(2):
                there = loads_of(colony, world) + outcome.food_deliveries[0, world]
                assert there.sum() == start[world].sum() + outcome.regrown[0, world]
                births = outcome.births[0, world]
                stored = colony.arrays["nests"][1].reshape(2, 2)[world].sum()
                assert births + stored == outcome.deliveries[0, world] * drawn.task.life.births
        assert np.array_equal(outcome.nest_deliveries.sum(2), outcome.deliveries)
        delivered, regrown = delivered + outcome.deliveries.sum(), regrown + outcome.regrown.sum()
    assert min(delivered, regrown) > 20


def test_ants_deliver_to_their_own_queen_alone():
    happened = np.zeros(2, int)
    for drawn in drawn_nests():
        colony = made(drawn)
        far = np.stack([drawn.world.distances(nest) for nest in range(2)])
        colony.begin_episode()
        for _ in range(30):
            before, returns = colony.living.copy(), colony.outcome().returns
            colony.tick()
            acted = before & colony.living
            delivers = acted & (colony.events == Event.DELIVERED)
            nests = colony.nests[delivers]
            assert (far[nests, colony.cells[delivers]] == 1).all()
            happened += np.bincount(nests, minlength=2)
            if not colony._model.ants_change:
                gained = colony.outcome().returns - returns
                assert (colony.rewards.sum(axis=1, where=acted) == gained).all()
    assert happened.min() > 3


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
    with pytest.raises(AntsError) as caught:
        make()
    assert message in str(caught.value)


def begun() -> Colony:
    colony = two_nests()
    colony.begin_episode()
    return colony
