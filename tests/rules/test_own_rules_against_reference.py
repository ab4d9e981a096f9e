"""Colonies with rules of users equal the plain reference, in every tick and bit."""

from __future__ import annotations

from dataclasses import replace

import pytest
from random_choices import NOISE
from random_colonies import random_colony
from same_colonies import every_tick

from taichi_ants import Colony
from taichi_ants.reference import ReferenceColony
from taichi_ants.task import Life

TRAIL = {"evaporation": "power_law", "half_life": None, "deposit": "weaker", "cap": None}
FIELDS = {"a": {"deposit": "weaker", "cap": None}}
# By name: the changes of a drawn task, and the arguments of `random_colony`.
MODELS = {
    "weber": (
        {"choice": "weber", "pheromone": {**TRAIL, "level": 250, "slope": None}},
        {"sharing": "frozen", "traffic": "following", "noise": NOISE, "dense": True},
    ),
    "restless": (
        {"choice": "restless", "reward": "shaped", "fields": {"B": {"evaporation": "power_law"}}},
        {"sharing": "shared", "learner": "sarsa", "fields": "B", "dense": False},
    ),
    "blocked weber": (
        {"choice": "weber", "homing_cue": "trail"},
        {"sharing": "frozen", "dense": True},
    ),
    "shaped": (
        {"reward": "shaped", "fields": FIELDS},
        {"sharing": "independent", "learner": "n_step_sarsa", "fields": "a", "changes": True},
    ),
}
MARKS = {"weber": (), "blocked weber": pytest.mark.long}
MARKED = [pytest.param(name, marks=MARKS.get(name, pytest.mark.slow)) for name in MODELS]


@pytest.mark.parametrize("model", MARKED)
def test_every_tick_with_rules_of_users(model):
    changes, arguments = MODELS[model]
    delivered = 0
    for seed in range(6):
        drawn = random_colony(seed, **arguments)
        task = drawn.task.replace(
            **changes, **({} if arguments.get("changes") else {"life": Life()})
        )
        needs = task.needs_table
        drawn = replace(drawn, task=task, training=drawn.training if needs else None)
        q_values = drawn.q_values if needs else None
        given = (drawn.world, task, drawn.training, drawn.seed)
        options = {**drawn.population, "sharing": drawn.sharing, "q_values": q_values}
        colony = Colony(*given, **options)
        plain = ReferenceColony(*given, **options)
        for _ in every_tick(colony, plain, (12, None), (9, None)):
            pass
        delivered += sum(record.deliveries for record in plain.records)
    assert delivered > 0
