"""The colony equals the plain reference: every tick, every ant, every cell, every bit."""

from dataclasses import replace

import numpy as np
import pytest
from random_castes import drawn_castes
from random_choices import NOISE
from random_colonies import RandomColony, mortal, random_colony, with_nests
from random_rewards import random_rewards
from same_colonies import assert_equal, every_tick

from taichi_ants import AntsError, Colony, TrainingConfig, World, learners, worlds
from taichi_ants.reference import ReferenceColony
from taichi_ants.reference.observations import AHEAD, OBSERVATIONS, cells_in_view
from taichi_ants.task import Observation, Rewards, Task, observations
from taichi_ants.task.constants import EMPTY
from taichi_ants.task.observations import observation

# Each entry needs its own kernels, so that there are few: learner, sharing, observation, dense,
# and where these are not the paper's the traffic, which trails are seen, and further `MORE`.
# For all but the first, ants and food come and go: what stays the same is left out of kernels.
UNDER = "strongest_under_carriers"
SOFT, BY_TRAIL, MISREADS = {"choice": "softmax"}, {"choice": "deneubourg"}, {"noise": "misread"}


def with_fields(names, outbound="trail", homing="compass"):
    return {"fields": names, "cues": (outbound, homing)}


KERNELS = [
    ("q_learning", "shared", "paper", False),
    ("sarsa", "shared", "ants_seen", True, "blocking", "half", with_fields("Ab", "b", "compass")),
    ("expected_sarsa", "shared", "five_cells", False),
    ("dyna_q", "shared", "trail_levels", True, "blocking", "half", with_fields("aBc", "B", "c")),
    ("dyna_q", "independent", "ants_seen", False),
    ("double_q", "independent", "paper", True, "blocking", "half", with_fields("ABc", "A",
     "trail")),
    ("sarsa_lambda", "independent", "paper", False),
    ("n_step_sarsa", "independent", "paper", False, "blocking", "half", with_fields("abC", "a",
     "C")),
    ("prioritized_sweeping", "independent", "trail_levels", False, "blocking", "half",
     with_fields("a", "trail", "compass")),
    ("q_learning", "frozen", "six_cells", False, "blocking", "strongest", with_fields("A",
     "trail", "A")),
    ("n_step_sarsa", "independent", "ants", False, "right_of_way", "strongest", with_fields("ab",
     "trail", "b")),
    ("q_learning", "shared", "queues", False, "following", UNDER, with_fields("Ab", "A", "b")),
    ("sarsa", "shared", "ants", False, "right_of_way", "half", SOFT | {"noise": NOISE}),
    ("q_learning", "frozen", "paper", False, "right_of_way", "half", BY_TRAIL | {"noise": NOISE}),
    ("q_learning", "frozen", "paper", False, "blocking", "half", BY_TRAIL | with_fields("aB", "a",
     "B")),
]  # fmt: skip


def of_kernel(
    seed: int, learner, sharing, observation, dense, traffic="blocking", view="half", **rules
) -> RandomColony:
    """A random colony with a learner, sharing and further rules, mostly with deaths and births."""
    models = {"learner": learner, "sharing": sharing, "observation": observation, "dense": dense}
    rules = {"changes": True} | models | rules
    drawn = random_colony(seed, traffic=traffic, view=view, **rules)
    return mortal(drawn) if rules["changes"] else drawn


def both(drawn: RandomColony) -> tuple[Colony, ReferenceColony]:
    return Colony(*drawn.model, **drawn.options), ReferenceColony(*drawn.model, **drawn.options)


def happened(plain: ReferenceColony, *counts: str) -> list[int]:
    """In how many episodes each of these counts is not 0."""
    return [sum(getattr(record, name) > 0 for record in plain.records) for name in counts]


def without_rocks(world: World) -> World:
    """Nor half of the food, nor trails."""
    return World(world.ranges, world.queen, foods=world.foods[::2], ants=world.ants)


# The others come later: what they add, the tests of independent runs and of pages have as well.
QUICK, LONG = (0, 1, 10, 13), (2, 3, 4, 5, 6, 7, 8, 9, 11, 14)


def marked(kernels: list, quick: tuple[int, ...], long: tuple[int, ...]) -> list:
    """Kernels with marks; golden hashes show that the results of the longest stay."""
    later = [pytest.mark.long if k in long else pytest.mark.slow for k in range(len(kernels))]
    marks = [() if k in quick else mark for k, mark in enumerate(later)]
    return [pytest.param(kernel, marks=mark) for kernel, mark in zip(kernels, marks, strict=True)]


@pytest.mark.parametrize("kernel", marked(KERNELS, QUICK, LONG), ids=str)
def test_every_tick_in_crowded_micro_worlds(kernel):
    """Two episodes each: something goes on between them, in every other case in another world."""
    observation, (*parts, rules) = kernel[2], kernel if len(kernel) > 6 else (*kernel, {})
    seen = np.zeros(5, dtype=int)
    later = KERNELS.index(kernel) not in QUICK
    is_large = observations.get(observation).n_states >= 1000
    for seed in range(8 if is_large or later else 12):
        rewards, changes = random_rewards(seed), kernel is not KERNELS[0]
        drawn = of_kernel(seed, *parts, rewards=rewards, changes=changes, **rules)
        if drawn.sharing == "independent":  # newborn ants begin with these values
            drawn = replace(drawn, training=replace(drawn.training, initial_q=1.7))
        colony, plain = both(drawn)
        for _ in every_tick(
            colony, plain, (11, None), (8, without_rocks(drawn.world) if seed % 2 else None)
        ):
            pass
        seen += happened(plain, "births", "deaths", "regrown", "deliveries", "blocked")
    rarely = "noise" in str(rules)  # ants that slip or misread deliver rarely
    births = not (rarely or later or observation == "queues")
    assert (seen >= [births, 3, 3, not rarely, 6]).all(), seen


# Learner, sharing, observation, dense, traffic, view; nests, kinds of food, several loads.
NESTS = [
    ("dyna_q", "shared", "queues", False, "following", "strongest_under_carriers", 3, 2, True),
    ("sarsa", "shared", "ants", True, "right_of_way", "strongest", 2, 3, False),
    ("sarsa_lambda", "independent", "ants_seen", False, "blocking", "half", 4, 1, True),
    ("q_learning", "frozen", "other_nest_ants", False, "right_of_way", "half", 2, 2, True),
]


def with_strangers(view):
    """The load, and for each cell ahead 0, 1 for an ant of the nest, or 2 for one of another."""
    index = view.carries
    for k in range(3):
        code = 2 * view.other_nest_ants[k]
        if view.ants[k] != 0:
            code = 1
        index = 3 * index + code
    return index


@pytest.mark.parametrize("kernel", marked(NESTS, (0, 3), (1, 2)), ids=str)
def test_every_tick_with_several_nests_and_kinds_of_food(kernel, seen_strangers):
    """Deliveries by nest and kind, loads, regrowth, births by nest: two episodes each."""
    learner, sharing, observation, *rules, nests, kinds, loads = kernel
    seen, simple = np.zeros(5, dtype=int), observation.replace("other_nest_ants", "paper")
    for seed in range(16):
        drawn = of_kernel(seed, learner, sharing, simple, *rules)
        drawn = with_nests(drawn, seed, nests, kinds, loads)
        if observation == "other_nest_ants":
            table = np.random.default_rng(seed).random((54, 5)).astype(np.float32)
            drawn = replace(drawn, task=replace(drawn.task, observation="other_nest_ants"))
            drawn = replace(drawn, q_values=table)
        if drawn.world.n_nests != nests:
            continue  # kernels are compiled for a number of nests
        colony, plain = both(drawn)
        for _ in every_tick(colony, plain, (13, None), (9, None)):
            pass
        seen[:4] += happened(plain, "births", "deaths", "regrown", "deliveries")
        seen[4] += any(nest > 0 for record in plain.records for nest, _ in record.delivered)
    assert (seen >= [1, 3, 3, 2, 1]).all(), seen


# Learner, sharing, observation, dense, traffic, view; castes, labour, nests; more rules.
CASTES = [
    ("dyna_q", "shared", "paper", True, "following", "strongest", 3, True, 2, {"fields": "ac",
     "cues": ("a", "compass"), "cues_of": [("a", "compass"), ("c", "trail")]}),
    ("n_step_sarsa", "independent", "paper", False, "blocking", "half", 2, True, 1, {}),
    ("q_learning", "frozen", "paper", False, "right_of_way", "half", 2, True, 1, {"choice":
     "deneubourg", "noise": NOISE, "fields": "ab", "cues": ("trail", "compass"), "cues_of":
     [("trail", "b"), ("a", "compass")]}),
    ("sarsa_lambda", "independent", "ants_seen", False, "right_of_way", "half", 2, True, 2, {}),
    ("q_learning", "frozen", "queues", False, "following", UNDER, 2, True, 1, SOFT),
]  # fmt: skip


@pytest.mark.parametrize("kernel", marked(CASTES, (0, 2), (1, 3, 4)), ids=str)
def test_every_tick_with_castes_and_division_of_labour(kernel):
    """Numbers, tables, cues and deposits of castes, births, thresholds and idle ants."""
    *parts, castes, labour, nests, more = kernel
    seen, cues = np.zeros(6, dtype=int), more.get("cues_of")
    rules = {name: one for name, one in more.items() if name != "cues_of"}
    for seed in range(18):
        drawn = of_kernel(seed, *parts, **rules)
        if nests > 1:
            drawn = with_nests(drawn, seed, nests, 1, loads=False)
        drawn = drawn_castes(drawn, seed, castes, labour, cues)
        if drawn is None or drawn.world.n_nests != nests:
            continue
        colony, plain = both(drawn)
        if kernel is CASTES[0] and colony._model.epsilon_varies:
            continue  # another kernel, which protocols have too
        idle = np.zeros(1, bool)
        for _ in every_tick(colony, plain, (13, None), (9, None)):
            now = colony.idle & colony.living
            begins = colony.ticks == 1  # all are new
            seen[4:] += [(idle & ~now).any() and not begins, (now & ~idle).any() and not begins]
            idle = now
        seen[:3] += happened(plain, "births", "deaths", "deliveries")
        seen[3] += len({ant.caste for ant in plain.ants.values()}) == castes
    assert (seen >= [1, 3, 2, 1, 20 * labour, 5 * labour]).all(), seen


def with_levels(view):
    """The load, and for each cell ahead whether two further pheromones are there."""
    index = view.carries
    for k in range(3):
        index = 4 * index
        if view.a[k] >= 1:
            index += 1
        if view.B[k] >= 1:
            index += 2
    return index


def levels_seen(world, ant):
    """The observation in plain Python; a misread cell has no pheromone."""
    index = int(ant.carries)
    for turn, cell in zip(AHEAD, cells_in_view(ant), strict=True):
        shows = world.ground.get(cell) == EMPTY and turn not in ant.misread
        index *= 4
        for number, name in enumerate("aB"):
            index += (shows and world.pheromones[name].level(cell) >= 1) << number
    return index


def test_misread_cells_show_no_further_pheromone(monkeypatch):
    """Drawn colonies whose ants observe two fields, in every tick."""
    monkeypatch.setattr(observation.OBSERVATIONS, "yours", dict(observation.OBSERVATIONS.yours))
    monkeypatch.setitem(OBSERVATIONS, "levels", levels_seen)
    observations.register(Observation("levels", 128, with_levels, reads=("a", "B")))
    hidden = shown = 0
    for seed in range(12):
        rules = {"sharing": "shared", "learner": "q_learning", "dense": False}
        drawn = mortal(random_colony(seed, fields="aB", changes=True, noise="misread", **rules))
        drawn = replace(drawn, task=replace(drawn.task, observation="levels"), q_values=None)
        colony, plain = both(drawn)
        for _ in every_tick(colony, plain, (20, None)):
            for ant in plain.ants.values():
                misread, ant.misread = ant.misread, {}
                hidden += levels_seen(plain.world, ant) != ant.state
                shown += ant.state % 64 > 0
                ant.misread = misread
    assert shown > 100
    assert hidden > 20


def test_each_learner_and_observation_is_compared():
    assert {kernel[0] for kernel in KERNELS} == set(learners.registry.BUILT_IN)
    assert {kernel[2] for kernel in KERNELS} == set(observations.names())


@pytest.fixture
def seen_strangers(monkeypatch):
    """The observation, registered for one test."""
    monkeypatch.setattr(observation.OBSERVATIONS, "yours", dict(observation.OBSERVATIONS.yours))
    monkeypatch.setitem(OBSERVATIONS, "other_nest_ants", strangers_seen)
    return observations.register(Observation("other_nest_ants", 54, with_strangers))


def strangers_seen(world, ant):
    """The observation in plain Python."""
    index = int(ant.carries)
    for cell in cells_in_view(ant):
        other = world.ants.get(cell)
        index = 3 * index + (0 if other is None else 1 + (other.nest != ant.nest))
    return index


def test_errors_below_the_last_place_of_the_sum_are_rounded():
    """Values of a quarter of 2^-32 that fall by themselves: the sum of the errors is 0."""
    task = Task(rewards=Rewards(0, 0, 0, 0, 0))
    training = TrainingConfig("q_learning", 1.0, 0.0, 0.0, 1.0)
    given = (worlds.paper(), task, training, 0, 40)
    table = np.full((128, 5), 2.0**-34, np.float32)
    colony, plain = Colony(*given, q_values=table), ReferenceColony(*given, q_values=table)
    colony.begin_episode()
    plain.begin_episode()
    colony.tick()
    plain.tick()
    assert_equal(colony, plain)
    held = np.unique(colony.q_values)
    assert held.tolist() == [0.0, 2.0**-34]  # of pairs with one ant, and of all others


@pytest.mark.parametrize(("learner", "planning_steps"), [("q_learning", 0), ("dyna_q", 1)])
def test_sums_of_errors_that_do_not_fit_are_refused(learner, planning_steps):
    """Forty errors of 10^8 each: no fixed-point number holds their sum."""
    more = {"planning_steps": planning_steps} if planning_steps else {}
    training = TrainingConfig(learner, 0.1, 0.9, 0.0, 1.0, **more)
    for worth, fits in ((1e6, True), (1e9, False)):
        colony = Colony(
            worlds.paper(), Task(), training, ants=40, q_values=np.full((128, 5), worth)
        )
        colony.begin_episode()
        colony.tick(3)
        if fits:
            colony.outcome()
        else:
            with pytest.raises(AntsError, match="not finite"):
                colony.outcome()
