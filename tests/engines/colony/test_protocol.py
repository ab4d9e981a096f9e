"""Protocols: kernels equal the reference at each tick, and worlds do not depend on each other."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from random_castes import drawn_castes
from random_choices import NO_NOISE, NOISE
from random_colonies import mortal, random_colony, with_nests
from random_protocols import random_protocol
from refusals import refused
from same_colonies import every_tick_of_protocol

from taichi_ants import AntsError, Colony, TrainingConfig, World, worlds
from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.engines.colony.timetable import Timetable
from taichi_ants.engines.layout import note_best_actions
from taichi_ants.interventions import Place, RemoveAnts, from_dict
from taichi_ants.learners.policies import trail_follower
from taichi_ants.protocol import At, Every, When
from taichi_ants.reference import ReferenceColony
from taichi_ants.task import foraging
from taichi_ants.task.constants import BEST_AT, EMPTY, FOOD, OBSTACLE, ROW

# Each entry needs its own kernels, see test_against_reference.py.
KERNELS = [
    ("q_learning", "frozen", "queues", False, "following", "strongest_under_carriers"),
    ("sarsa", "shared", "ants", False, "right_of_way", "strongest", "ab", ("trail", "b")),
    ("double_q", "independent", "ants_seen", True, "blocking", "half", "aB", ("a", "B")),
    ("q_learning", "frozen", "paper", True, "following", "strongest_under_carriers"),
    # With two nests and two kinds of food.
    ("sarsa", "shared", "ants", False, "following", "half", "ab", ("a", "b"), (2, 2, True)),
    ("q_learning", "frozen", "queues", True, "right_of_way", "half", "", ("trail", "compass"),
     (2, 2, False)),
]  # fmt: skip
WITH_CASTES = ("sarsa", "shared", "paper", False, "right_of_way", "half", "a", ("trail", "a"))
KERNELS.append(WITH_CASTES)
VARIED = (0, 3, 7, 8, 11, 24)
QUICK = (KERNELS[4], WITH_CASTES)
MARKED = [pytest.param(one, marks=[pytest.mark.long] * (one not in QUICK)) for one in KERNELS]
TICKS = 14
FOLLOWS = TrainingConfig("q_learning", 1.0, 1.0, 0.05, 1.0)


def several(world: World) -> list[World]:
    """Three worlds with the same ranges."""
    return [world, replace(world, obstacles=(), trails=()), world]


def drawn_cases(kernel, seed, n_worlds):
    """The arguments of a colony of some worlds, and a protocol."""
    learner, sharing, observation, dense, traffic, view, *more = kernel
    drawn = random_colony(
        *(seed, 10, sharing, 5, None, learner, observation, dense),
        traffic=traffic,
        view=view,
        changes=True,
        choice="softmax" if learner == "q_learning" else "greedy",
        noise=NOISE if learner == "q_learning" else NO_NOISE,
        **dict(zip(("fields", "cues"), more, strict=False)),
    )
    if len(more) > 2:
        drawn = with_nests(mortal(drawn), seed, *more[2])
    if kernel is WITH_CASTES:
        cues = [("trail", "a"), ("a", "compass")]
        drawn = (
            drawn_castes(drawn, seed, 2, True, cues)
            or drawn_castes(drawn, 0, 2, True, cues)
            or drawn
        )
    rng = np.random.default_rng([seed, 8])
    population = {**drawn.population, "ends_at_delivery": False}
    population["capacity"] = capacity = population["ants"] + int(rng.integers(2, 9))
    rules = {**population, "sharing": sharing, "q_values": drawn.q_values}
    learns = sharing != "frozen"
    protocol = random_protocol(rng, drawn.world, drawn.task, capacity, TICKS, n_worlds, learns)
    places = several(drawn.world)[:n_worlds]
    return places, drawn.task, drawn.training, drawn.seed, rules, protocol


@pytest.mark.parametrize("kernel", MARKED, ids=lambda kernel: "-".join(map(str, kernel[:4])))
def test_every_tick_of_drawn_protocols_equals_the_reference(kernel):
    done, refused = Counter(), 0
    several, by_chunk = len(kernel) > 8, kernel is WITH_CASTES
    # Castes whose ants explore at different rates, which is another kernel.
    for seed in VARIED if by_chunk else range(8 if several else 7):
        n_worlds = 1 + 2 * (seed % 3 > 0)
        places, task, training, first, rules, protocol = drawn_cases(kernel, seed, n_worlds)
        if several and places[0].n_nests == 1:
            continue  # the world is too small; kernels are compiled for a number of nests
        seeds = [first + w for w in range(n_worlds)]
        schedule = "by_chunk" if by_chunk else "by_world"
        try:
            colony = Colony(places, task, training, seeds, **rules, schedule=schedule)
            Timetable(colony, protocol, TICKS)
        except AntsError:
            continue
        plains = [
            ReferenceColony(place, task, training, one, **rules)
            for place, one in zip(places, seeds, strict=True)
        ]
        try:
            for _ in every_tick_of_protocol(colony, protocol, plains, TICKS):
                pass
            done.update(one.path for event in protocol for one in event.interventions)
        except AntsError:
            refused += 1
    expected = {"remove_ants", "add_ants", "ants", "clear", "move", "place", "trail", "task"}
    expected |= {"epsilon", *(["learning_rate"] if kernel[1] != "frozen" else [])}
    assert refused < (16 if several else 12)  # queens of two nests leave less room for changes
    assert expected <= done.keys(), done


FORAGING = foraging().replace(life={"regrowth": 0})
PROTOCOL = [
    At(60, remove_ants=0.5),
    Every(40, start=50, stop=130, trail=0),
    When("deliveries", above=2, place={"what": "rock", "cells": [[0, 5, 5], [5, 5, 0]]}),
    When("living", below=15, add_ants=3, once=False, interval=30),
    At(120, task={"pheromone.level": 100}, epsilon=0.2),
]


def followers(seeds, schedule=None, world=None):
    """Colonies that follow the hand-written policy."""
    given = world or worlds.paper(), FORAGING, FOLLOWS, seeds
    rules = {"ants": 20, "sharing": "frozen", "q_values": trail_follower("ants")}
    return Colony(*given, **rules, schedule=schedule)


def test_a_run_leaves_no_trace_of_its_protocol():
    colony, other = followers(range(3)), followers(range(3))
    colony.run(1, 160, protocol=PROTOCOL)
    assert (colony.task, colony.epsilon) == (other.task, other.epsilon)
    assert np.array_equal(colony.q_values, other.q_values)
    colony.begin_episode()
    other.begin_episode()
    for name in ("walls", "closer", "ground"):
        assert np.array_equal(colony.arrays[name], other.arrays[name]), name
    assert followers([5]).run(2, 90) == followers([5]).run(2, 90, protocol=[])


def test_events_of_successive_ticks_all_happen():
    colony = Colony(
        worlds.paper(), None, FOLLOWS, 0, 5, sharing="frozen", q_values=trail_follower()
    )
    events = [At(tick=1, remove_ants=1), At(tick=2, remove_ants=1)]
    assert colony.run(1, 4, protocol=events).living.tolist() == [[3]]


def test_interventions_by_hand_change_the_worlds_that_are_named():
    colony = followers(range(3))
    colony.begin_episode()
    cell = [3, 3, 0]
    for one in ({"clear": [cell]}, {"place": {"what": "rock", "cells": [cell]}}):
        Interventions(colony, worlds=[0, 2]).apply(from_dict(one))
    Interventions(colony, worlds=[1]).apply(from_dict({"remove_ants": 4}))
    Interventions(colony, worlds=[2]).apply(RemoveAnts(share=0.125))  # 2.5 ants
    grounds = [int(colony.snapshot(w).ground[colony.grid.index(cell)]) for w in range(3)]
    assert grounds == [OBSTACLE, EMPTY, OBSTACLE]
    assert colony.living.sum(axis=1).tolist() == [20, 16, 17]
    for one in ({"epsilon": 0.5}, {"task": {"pheromone.level": 9}}, {"ants": 5}):
        with pytest.raises(AntsError, match="the worlds of a colony share"):
            Interventions(colony, worlds=[1]).apply(from_dict(one))
    everywhere = Interventions(colony)
    everywhere.apply(Place("food", [[4, 4, 0]]))
    everywhere.apply(from_dict({"ants": 9}))
    everywhere.begin_episode()
    assert colony.living.sum(axis=1).tolist() == [9, 9, 9]
    # Later episodes start with the changes of the object that begins them.
    cells = colony.grid.index([cell, [4, 4, 0]])
    now = [colony.snapshot(w).ground[cells].tolist() for w in range(3)]
    assert now == [[EMPTY, FOOD]] * 3


@pytest.mark.parametrize("schedule", ["by_world", "by_chunk"])
def test_kernels_rely_on_stored_best_actions_and_on_slots_without_gaps(schedule):
    """They would not notice if either was wrong."""
    config = TrainingConfig("q_learning", 0.1, 0.9, 0.5, 1.0, initial_q=0.1)
    colony = Colony(worlds.paper(), FORAGING, config, (1, 2), ants=30, schedule=schedule)
    colony.begin_episode()
    for number in (7, 3, 0):
        colony.tick(40)
        Interventions(colony, [1]).apply(RemoveAnts(cells=colony.cells[1, [number, 20]].tolist()))
        ants = 30 - np.array([[0], [30 - np.count_nonzero(colony.living[1])]])
        assert np.array_equal(colony.living, np.arange(30) < ants)
        stored = colony.arrays["q"].copy()
        note_best_actions(stored)
        assert np.array_equal(stored, colony.arrays["q"])
    assert ants[1] < 30
    assert len(np.unique(stored.reshape(-1, ROW)[:, BEST_AT])) > 5


WRONG_IN_A_RUN = [
    (At(100, trail=0), "`at.tick` is 100, but episodes have 100 ticks; choose at most 99"),
    (At(9, clear=[[99, 0, 0]]), "(99, 0, 0) is outside"),
    (
        At(9, task={"observation": "paper"}),
        "the task cannot change observation from 'ants' to 'paper' in an",
    ),
    (At(9, task={"noise.slip": 0.1}), "cannot change noise.slip from 0.0 to 0.1 in an episode"),
    ([At(9, add_ants=5), At(50, ants=9)], "after 9 ticks, 5 ants cannot join 20 ants, because"),
    (When("living", above=3, epsilon=0.3), "`when.epsilon` would change all 2 worlds"),
    (
        At(9, place={"what": "food", "cells": [[1, 0, 0]], "kind": "seed"}),
        "`place.kind` is 'seed'; it must be left out, because the task has no kinds of food",
    ),
    (At(9, place={"what": "queen", "cells": [[9, 0, 0]]}), "the queen cannot move to cell"),
]


def test_wrong_protocols_are_refused_in_one_sentence():
    colony = followers(range(2))
    for protocol, said in WRONG_IN_A_RUN:
        refused(said, colony.run, 1, 100, protocol=protocol)
        assert colony.epsilon == 0.05
