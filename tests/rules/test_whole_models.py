"""Whole models: everything that a colony can have, drawn together, equals the plain reference.

Each model combines nests, kinds of food, fields, cues, noise, castes, division of labour, traffic,
a learner, rules of users, and a drawn protocol.
"""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from random_castes import drawn_castes
from random_choices import NOISE
from random_colonies import RandomColony, random_colony, with_nests
from random_protocols import random_protocol
from same_colonies import every_tick_of_protocol

from taichi_ants import AntsError, Colony
from taichi_ants.protocol import ProtocolEvent
from taichi_ants.reference import ReferenceColony

TICKS = 50
TRAIL = {"evaporation": "power_law", "half_life": None, "deposit": "weaker", "cap": None}
TRAIL |= {"level": 250, "slope": None}
ALARM = {"deposit": "alarm", "level": 250, "cap": None, "slope": None}
# By name: learner, sharing, traffic, dense, fields, and more arguments of `random_colony`; nests,
# kinds of food, loads; castes, labour, their cues; and changes of the task.
MODELS = {
    "softmax": (
        ("sarsa", "shared", "right_of_way", False, "ab", {"cues": ("a", "b"), "choice": "softmax"}),
        (2, 2, True), (2, True, None), {}),
    "deneubourg": (
        ("q_learning", "frozen", "following", False, "aB",
         {"choice": "deneubourg", "view": "strongest"}),
        (2, 1, False), (2, True, [("trail", "compass"), ("a", "B")]), {}),
    "rules of users": (
        ("q_learning", "frozen", "following", True, "", {}),
        (2, 2, False), (2, True, None), {"choice": "weber", "pheromone": TRAIL}),
    "rewards of users": (
        ("sarsa", "shared", "right_of_way", False, "B", {}), (3, 2, True), (2, True, None),
        {"choice": "restless", "reward": "shaped", "fields": {"B": {"evaporation": "power_law"}}}),
    "labour of users": (
        ("sarsa", "shared", "following", False, "aB", {}), (2, 2, False), (2, True, None),
        {"reward": "demanded", "pheromone": ALARM, "fields": {"a": ALARM, "B": ALARM}}),
    "choice by labour": (
        ("q_learning", "frozen", "blocking", True, "aB", {}), (2, 1, False), (2, True, None),
        {"choice": "hungry", "fields": {"a": {**ALARM, "deposited_when": "dead_end"}}}),
    "own tables": (
        ("dyna_q", "independent", "following", True, "a",
         {"observation": "queues", "cues": ("a", "compass")}),
        (2, 3, True), (2, True, None), {}),
    "castes without labour": (
        ("expected_sarsa", "shared", "blocking", True, "aB", {"observation": "trail_levels"}),
        (2, 2, False), (3, False, [("B", "a"), ("trail", "compass")]), {}),
}  # fmt: skip
NAMES = ("learner", "sharing", "traffic", "dense", "fields")


def drawn_model(name: str, seed: int) -> tuple[RandomColony, list[ProtocolEvent]] | None:
    """Return a drawn colony of a model and its protocol; None if its world has too few cells."""
    (*listed, more), (nests, kinds, loads), castes, changes = MODELS[name]
    arguments = {**dict(zip(NAMES, listed, strict=True)), **more}
    drawn = random_colony(seed, 60, largest_range=8, noise=NOISE, changes=True, **arguments)
    if not drawn.task.food_changes or drawn.population["ants"] < 20:
        return None  # other kernels, or few steps
    life = drawn.task.life
    drawn = replace(drawn, task=drawn.task.replace(life={"lifespan": life.lifespan and 25}))
    drawn = with_nests(drawn, seed, nests, kinds, loads)
    if castes[1]:  # your rules can read thresholds; `drawn_castes` draws others
        changes = {"labour": "thresholds", "castes": {"one": {"threshold": 1.0}}, **changes}
    drawn = replace(drawn, task=drawn.task.replace(**changes))
    if not drawn.task.needs_table:
        drawn = replace(drawn, training=None, q_values=None)
    made = drawn_castes(drawn, seed, *castes)
    if made is None or made.world.n_nests != nests:
        return None
    capacity = made.population["ants"] + 12
    made = replace(
        made, population={**made.population, "ends_at_delivery": False, "capacity": capacity}
    )
    rng, learns = np.random.default_rng([seed, 11]), made.sharing != "frozen"
    protocol = random_protocol(rng, made.world, made.task, capacity, TICKS, 1, learns)
    return made, protocol


def steps_compared(
    drawn: RandomColony, protocol: list[ProtocolEvent], schedule: str, seen: Counter
) -> int:
    """Compare the episodes of a colony tick by tick, and return the number of ant-steps.

    An episode ends early if its world does not allow an intervention.
    """
    colony = Colony(*drawn.model, **drawn.options, schedule=schedule)
    plain, steps = ReferenceColony(*drawn.model, **drawn.options), 0
    try:
        for _ in every_tick_of_protocol(colony, protocol, [plain], TICKS):
            steps += len(plain.ants)
    except AntsError:
        seen["refused"] += 1
    for record in plain.records:
        seen["deliveries"] += record.deliveries
        seen["deaths"] += record.deaths
        seen["later nests"] += sum(n for (nest, _), n in record.delivered.items() if nest)
    return steps


@pytest.mark.parametrize(
    ("name", "ant_steps"),
    [
        ("rules of users", 1_500),
        pytest.param("labour of users", 6_000, marks=pytest.mark.slow),
        pytest.param("rewards of users", 6_000, marks=pytest.mark.slow),
        # Two million in all, in ten minutes.
        *(pytest.param(name, 340_000, marks=pytest.mark.long) for name in MODELS),
        pytest.param("softmax", 2_500, marks=pytest.mark.optimised),
    ],
)
def test_every_tick_of_whole_models(name, ant_steps):
    steps, seed, seen = 0, 0, Counter()
    schedules = ("by_world", "by_chunk")
    if ant_steps < 10_000:  # each needs its own kernels
        schedules = schedules[list(MODELS).index(name) % 2 :][:1]
    while steps < ant_steps:
        assert seed < 100 or steps > 10 * seed, (steps, seed, seen)
        found = drawn_model(name, seed)
        if found is not None:
            try:
                steps += steps_compared(*found, schedules[seed % len(schedules)], seen)
            except AntsError:  # the protocol asks for other kernels
                seen["other kernels"] += 1
        seed += 1
    assert {"deliveries", "deaths", "later nests"} <= {name for name, n in seen.items() if n}
    assert seen["refused"] < seed / 2, (seen, seed)
