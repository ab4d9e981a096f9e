"""Trails of the colony against closed forms, conservation of food, and clear errors."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taichi_ants import AntsError, Colony, TrainingConfig, World, worlds
from taichi_ants.arguments import MAX_ANTS
from taichi_ants.engines import arguments
from taichi_ants.engines.colony.layout import NestRow
from taichi_ants.learners.policies import random_policy, trail_follower
from taichi_ants.rendering import colony_snapshots
from taichi_ants.task import Life, Pheromone, Task, foraging
from taichi_ants.task.constants import FOOD

TRAINING = TrainingConfig("q_learning", 0.1, 0.9, 1.0, 1.0)


def levels_after(pheromone: Pheromone, ticks: int, level: int = 400) -> np.ndarray:
    """The levels of a lone trail cell's world after so many ticks; the ant is walled in."""
    around = [(1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), (1, 0, 1)]
    world = World(
        (12, 12, 12),
        (11, 11, 0),
        obstacles=[tuple(np.add((0, 0, 11), step).tolist()) for step in around[:3]] + [(10, 10, 0)],
        trails=[((0, 0, 0), level)],
        ants=[((0, 0, 11), 0)],
    )
    training = TrainingConfig("q_learning", 0.1, 0.9, 0.0, 1.0)
    task = Task(pheromone=pheromone)
    colony = Colony(world, task, training, sharing="frozen", q_values=random_policy())
    colony.begin_episode()
    colony.tick(ticks)
    return colony.snapshot().trail


@pytest.mark.parametrize("ticks", [1, 7, 399, 400, 450])
def test_linear_evaporation(ticks):
    assert levels_after(Pheromone("linear"), ticks).sum() == max(0, 400 - ticks)


def test_no_evaporation():
    assert levels_after(Pheromone("none"), 500).sum() == 400


@pytest.mark.parametrize("half_life", [3.0, 50.0])
def test_exponential_evaporation_halves_in_its_half_life(half_life):
    """400 * 2^(-t / half-life), to the precision of repeated f32 products; gone below 1."""
    for ticks in (1, 3, 10, 30):
        expected = 400 * 0.5 ** (ticks / half_life)
        level = levels_after(Pheromone("exponential", half_life=half_life), ticks).sum()
        assert level == pytest.approx(expected if expected >= 1 else 0.0, rel=1e-5)


@pytest.mark.parametrize("rate", [0.1, 1.0])
def test_diffusion_keeps_the_mass(rate):
    """In the middle of a field one tick gives each of the six neighbours a sixth of the rate."""
    pheromone = Pheromone("none", diffusion=rate)
    once = np.sort(levels_after(pheromone, 1))[::-1]
    share = 400 * rate / 6
    expected = np.sort([400 - 6 * share] + [share] * 6)[::-1]
    assert once[:7] == pytest.approx(expected, rel=1e-5, abs=1e-3)
    assert once[7:].any() == np.False_
    # In many ticks it reaches the walls, which give back their share.
    assert levels_after(pheromone, 300).sum(dtype=np.float64) == pytest.approx(400, rel=1e-4)


@settings(max_examples=20)
@given(
    seed=st.integers(0, 10_000),
    ants=st.integers(1, 25),
    births=st.booleans(),
    lifespan=st.sampled_from([None, 5, 40]),
    regrowth=st.sampled_from([None, 0, 3]),
    pile_move_interval=st.sampled_from([1, 4]),
)
def test_food_is_conserved(seed, ants, births, lifespan, regrowth, pile_move_interval):
    """In the ground + carried + delivered = at the start + regrown; no two ants share a cell."""
    world = worlds.open_world(seed=seed % 7, ranges=(6, 6, 6))
    life = Life(
        births=births, lifespan=lifespan, regrowth=regrowth, pile_move_interval=pile_move_interval
    )
    colony = Colony(world, Task(life=life), TRAINING, seed, ants=ants)
    colony.begin_episode()
    for _ in range(6):
        colony.tick(10)
        now, outcome = colony.snapshot(), colony.outcome()
        there = (now.ground == FOOD).sum() + now.ant_carries.sum() + outcome.deliveries[0, 0]
        assert there == len(world.foods) + outcome.regrown[0, 0]
        assert len(set(now.ant_cells.tolist())) == len(now.ant_cells) == outcome.living[0, 0]
        assert outcome.living[0, 0] == ants + outcome.births[0, 0] - outcome.deaths[0, 0]


def test_births_fill_the_slots_and_no_more():
    """A colony that is fed well grows to its capacity; further foods wait in the store."""
    world = World(
        (6, 6, 6),
        (0, 0, 0),
        foods=[(2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 2, 2), (0, 0, 2), (2, 0, 2)],
        ants=[((1, 0, 0), 0)],
    )
    task = Task(life=Life(births=True, regrowth=0))
    training = TrainingConfig("q_learning", 0.3, 0.9, 0.5, 1.0)
    colony = Colony(world, task, training, ants=1, capacity=4)
    outcome = colony.run(1, 3000)
    assert outcome.living[0, 0] == 4
    assert outcome.births[0, 0] == 3
    stored = colony.arrays["nests"][NestRow.STORE, 0]
    assert stored == outcome.deliveries[0, 0] - 3 > 0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"ants": 5000}, "5000"),
        ({"ants": 0}, "ants is 0; it must lie between 1"),
        ({"ants": 1.0}, "ants is 1.0; it must be a whole number"),
        ({"ants": MAX_ANTS + 1}, "ants is"),
        ({"ants": 8, "capacity": 7}, "capacity is 7, but 8 ants start"),
        ({"capacity": 1.5}, "capacity is 1.5"),
        ({"start": "queen"}, "start is 'queen'; it must be one of nest, spread"),
        ({"ends_at_delivery": None}, "ends_at_delivery is None"),
        ({"ends_at_delivery": True, "ants": 2}, "ends_at_delivery is True with 2 ants"),
        ({"ends_at_delivery": True, "task": Task(life=Life(births=True))}, "births True"),
        ({"task": 3}, "task is 3"),
        (
            {
                "task": Task("six_cells"),
                "ants": 2000,
                "sharing": "independent",
                "start": "spread",
                "world": worlds.open_world(1, (60, 60, 60)),
                "seeds": range(30),
            },
            "60000 tables, with the memory of learner 'q_learning' for each, need more than",
        ),
        ({"task": Task("trail_levels"), "q_values": np.zeros((128, 5))}, "(432, 5)"),
        ({"sharing": "some"}, "'some'"),
        ({"sharing": "frozen"}, "sharing is 'frozen', but q_values is None; give the action"),
        ({"world": World((3, 3, 3), (0, 0, 0))}, "the world has no food"),
        ({"seeds": []}, "seeds"),
        ({"seeds": [1, 1]}, "1"),
        ({"world": [worlds.paper()] * 2, "seeds": [1]}, "2 worlds"),
        ({"world": [worlds.paper(), worlds.open_world(0, (5, 5, 5))], "seeds": [1, 2]}, "ranges"),
        ({"schedule": "quick"}, "'quick'"),
        ({"q_values": np.zeros((3, 3))}, "(3, 3)"),
        ({"q_values": np.zeros((2, 128, 5))}, "(2, 128, 5)"),
        ({"training": [TRAINING, TRAINING]}, "it must be one TrainingConfig"),
        ({"training": None}, "training is None"),
        ({"world": "paper"}, "world is 'paper'; it must be a World"),
        ({"world": 7}, "world is 7; it must be a World"),
        ({"world": ["paper"]}, "world is 'paper'; it must be a World"),
        ({"training": TrainingConfig("nobody", 0.1, 0.9, 0.3, 0.9)}, "'nobody'"),
    ],
)
def test_wrong_arguments_are_named(arguments, said):
    usual = {"world": worlds.paper(), "task": None, "training": TRAINING}
    with pytest.raises(AntsError, match=r"[.]$") as caught:
        Colony(**{**usual, **arguments})
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("settings", "capacity"),
    [
        ({}, 1),
        ({"ants": 7}, 7),
        ({"ants": np.int64(7), "capacity": np.int32(9)}, 9),
        ({"ants": 7, "task": Task(life=Life(births=True))}, 78),
        ({"ants": 7, "capacity": 7, "task": Task(life=Life(births=True))}, 7),
    ],
)
def test_the_capacity_leaves_room_for_ants_that_are_born(settings, capacity):
    usual = {"world": worlds.paper(), "task": None, "training": TRAINING}
    assert Colony(**{**usual, **settings}).capacity == capacity


@pytest.mark.parametrize("schedule", ["by_world", pytest.param("by_chunk", marks=pytest.mark.slow)])
@pytest.mark.parametrize("pheromone", [Pheromone(), Pheromone(diffusion=0.5)])
def test_a_world_whose_episode_has_ended_stays_as_it_is(schedule, pheromone):
    """Trails too stand still, whatever the other worlds do."""
    task = Task(pheromone=pheromone, evaporation_in_evaluation=True)
    colony = Colony(
        *(worlds.paper(), task, TRAINING, (1, 2)),
        sharing="frozen",
        q_values=trail_follower(),
        ends_at_delivery=True,
        schedule=schedule,
    )
    colony.begin_episode()
    while not (ticks := colony.outcome().first_delivery[0, 0]) > 0:
        colony.tick()
    ended = colony.snapshot(0)
    assert ended.trail.any()
    assert colony.outcome().ticks[0, 0] == ticks
    colony.tick(7)
    assert colony.snapshot(0) == ended


def test_both_schedules_agree_where_places_stay_vacant():
    """The ants are sorted by their cells now and then, but not in among the vacant places."""
    task, deliveries = Task(life=Life(regrowth=0)), []
    for schedule in ("by_world", "by_chunk"):
        colony = Colony(worlds.paper(), task, TRAINING, 3, ants=5, capacity=9, schedule=schedule)
        colony.begin_episode()
        colony.tick(100)
        deliveries.append(colony.outcome().counts())
    for name, counted in deliveries[0].items():
        np.testing.assert_array_equal(counted, deliveries[1][name], name)


def test_a_tick_needs_an_episode():
    with pytest.raises(AntsError, match="begin_episode"):
        Colony(worlds.paper(), None, TRAINING).tick()
    for look in (Colony.snapshot, lambda colony: next(colony_snapshots(colony))):
        with pytest.raises(AntsError, match="begin_episode"):
            look(Colony(worlds.paper(), None, TRAINING))


def test_episodes_may_take_place_in_other_worlds():
    """Each in a world of its own gives what moving it does, and goes on with one table."""
    places = [worlds.open_world(seed, ranges=(7, 7, 7)) for seed in range(3)]
    task = Task(life=Life(regrowth=1))
    listed, moved = (Colony(places[0], task, TRAINING, 4, ants=9) for _ in range(2))
    outcome = listed.run(3, 40, worlds=places)
    for episode, place in enumerate(places):
        moved.begin_episode(40, place)
        moved.tick(40)
        assert moved.outcome().returns[0, 0] == outcome.returns[episode, 0]
        moved.end_episode()
    assert moved == listed
    assert len(set(outcome.returns[:, 0].tolist())) > 1


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda colony: colony.run(2, 5, worlds=[worlds.paper()]), "each of the 2 episodes"),
        (lambda colony: colony.run(1, 5, worlds=worlds.paper()), "give a list with an entry"),
        (
            lambda colony: colony.run(1, 5, worlds={"a": worlds.paper()}),
            "give a list with an entry",
        ),
        (lambda colony: colony.begin_episode(world=3), "3; "),
        (lambda colony: colony.begin_episode(world=[worlds.paper()] * 2), "2 worlds for 1 seeds"),
    ],
)
def test_other_worlds_that_do_not_fit_are_refused(call, says):
    with pytest.raises(AntsError, match=says):
        call(Colony(worlds.paper(), Task(), TRAINING))


@pytest.mark.parametrize(
    ("last", "says"),
    [("paper", "'paper'"), (World((2, 1, 1), (0, 0, 0), [(1, 0, 0)]), "room|free")],
)
def test_worlds_are_checked_before_the_first_episode(last, says):
    one, other = (Colony(worlds.paper(), Task(), TRAINING, ants=5) for _ in range(2))
    with pytest.raises(AntsError, match=says):
        one.run(2, 9, worlds=[worlds.paper(), last])
    assert one == other


def test_kernels_are_told_only_what_has_changed(monkeypatch):
    """Taichi keeps some bytes for good each time, which made long lives grow."""
    colony = Colony(worlds.paper(), None, TrainingConfig("sarsa", 0.1, 0.9, 0.3, 0.5), 0, 3)
    colony.begin_episode()
    told, tell = [], arguments._Pack.__setitem__

    def telling(pack, name, value):
        told.append(name)
        tell(pack, name, value)

    monkeypatch.setattr(arguments._Pack, "__setitem__", telling)
    for _ in range(3):
        colony.tick()
    assert told == []
    colony.end_episode()
    colony.begin_episode()
    assert sorted(told) == ["epsilon", "explore_below"]


@pytest.mark.parametrize(("task", "most"), [(Task(), 44), (foraging(), 49)])
def test_an_ant_and_a_cell_take_few_bytes(task, most):
    """Of all that a colony keeps, with the start of an episode."""

    def size(side: int, ants: int) -> int:
        world = worlds.open_world(1, (side, side, side))
        settings = TrainingConfig("q_learning", 0.1, 0.9, 0.1, 1.0)
        colony = Colony(world, task, settings, ants=ants, schedule="by_chunk")
        return colony.nbytes

    assert (size(60, 2000) - size(60, 1000)) / 1000 < most
    cells = [worlds.open_world(1, (side,) * 3).grid.size for side in (50, 60)]
    assert (size(60, 1000) - size(50, 1000)) / (cells[1] - cells[0]) < 10
