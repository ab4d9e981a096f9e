"""Cues declared as the compass is: kernels equal their twins, and pages have their words."""

from dataclasses import replace

import pytest
from random_colonies import random_colony
from same_colonies import every_tick

from taichi_ants import Colony
from taichi_ants.features.cues import CUES, Cue
from taichi_ants.kernel_functions import KernelFunction, ti
from taichi_ants.reference import ReferenceColony, cues
from taichi_ants.reference.geometry import distance, neighbour
from taichi_ants.task.constants import SEES_CUE
from taichi_ants.viewer.recorder import Recorder

LIGHT = (0, 0, 0)  # in a corner of the world


def light(a):
    """The headings that lead nearer to the light."""
    return a.brighter


def convoy(a):
    """The headings that lead away from neighbours with food."""
    away = 0
    for heading in ti.static(range(6)):
        carrier = a.ground[a.place + a.compass[heading + 1]] >> 7
        away = away | ti.cast(carrier, ti.i32) << (heading + 3) % 6
    return away


def is_nearer_to_the_light(world, ant, cell):
    return distance(cell, LIGHT) < distance(ant.cell, LIGHT)


def is_away_from_a_carrier(world, ant, cell):
    (heading,) = [turn for turn in range(6) if neighbour(ant.cell, turn) == cell]
    behind = world.ants.get(neighbour(ant.cell, heading + 3))
    return behind is not None and behind.carries


DECLARED = {
    "light": (
        is_nearer_to_the_light,
        *("nearer to the light", KernelFunction(light)),
        *({"brighter": lambda world, nest: world.grid.closer_to(LIGHT)}, False),
    ),
    "convoy": (is_away_from_a_carrier, "before a carrier", KernelFunction(convoy), {}, True),
}
COLONIES = [  # learner, sharing, observation, traffic, choice
    ("q_learning", "shared", "paper", "blocking", "greedy"),
    ("q_learning", "frozen", "paper", "right_of_way", "deneubourg"),
]


@pytest.mark.parametrize(
    ("name", "least"), [("light", 10), pytest.param("convoy", 5, marks=pytest.mark.long)]
)
def test_a_declared_cue_equals_its_twin_in_every_tick(name, least, monkeypatch):
    twin, *declared = DECLARED[name]
    monkeypatch.setitem(CUES, name, Cue(*declared))
    monkeypatch.setattr(cues, name, twin, raising=False)
    shown = 0
    for learner, sharing, observation, traffic, choice in COLONIES:
        for seed in range(4):
            rules = {"learner": learner, "sharing": sharing, "traffic": traffic, "choice": choice}
            drawn = random_colony(seed, cues=("trail", name), dense=seed % 2 > 0, **rules)
            task = replace(drawn.task, observation=observation)
            given = (drawn.world, task, drawn.training, drawn.seed)
            options = {**drawn.population, "sharing": sharing}
            if observation == drawn.task.observation:
                options["q_values"] = drawn.q_values
            colony, plain = Colony(*given, **options), ReferenceColony(*given, **options)
            for _ in every_tick(colony, plain, (25, None)):
                for ant in plain.ants.values():
                    codes = [ant.paper_state >> shift & 3 for shift in (4, 2, 0)]
                    shown += ant.carries and SEES_CUE in codes
    assert shown >= least
    header = Recorder(colony).header()
    assert header["senses"][header["groups"][0]["cues"][1]] == declared[0]
