"""What a colony can be configured to, and what is refused."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from taichi_ants.errors import AntsError
from taichi_ants.task.colony import MAX_ANTS, ColonyConfig, Pheromone


def test_the_defaults_are_the_rules_of_the_world():
    config = ColonyConfig()
    assert dataclasses.astuple(config.pheromone) == ("linear", None, 0.0, "set", 250, None)
    assert (config.ants, config.slots, config.births, config.ends_at_delivery) == (
        1,
        1,
        False,
        False,
    )
    assert (config.lifespan, config.regrowth, config.wander) == (None, None, None)
    assert hash(config) == hash(ColonyConfig())


@pytest.mark.parametrize(
    ("settings", "slots"),
    [
        ({"ants": 7}, 7),
        ({"ants": 7, "births": True}, 78),
        ({"ants": 7, "capacity": 7, "births": True}, 7),
        ({"ants": 7, "capacity": 9}, 9),
        ({"ants": MAX_ANTS, "births": True}, MAX_ANTS),
    ],
)
def test_slots(settings, slots):
    assert ColonyConfig(**settings).slots == slots


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"ants": 0}, "ants is 0; it must lie between 1"),
        ({"ants": 1.0}, "ants is 1.0; it must be a whole number"),
        ({"ants": True}, "ants is True"),
        ({"ants": MAX_ANTS + 1}, "ants is"),
        ({"ants": 5, "capacity": 4}, "capacity is 4, but 5 ants start"),
        ({"capacity": 1.5}, "capacity is 1.5"),
        ({"pheromone": "linear"}, "pheromone is 'linear'"),
        ({"births": 1}, "births is 1; it must be True or False"),
        ({"lifespan": 0}, "lifespan is 0; it must lie between 1 and .*, or None"),
        ({"lifespan": 2.0}, "lifespan is 2.0; it must be a whole number, or None"),
        ({"regrowth": -1}, "regrowth is -1; it must lie between 0"),
        ({"wander": 0}, "wander is 0"),
        ({"wander": "daily"}, "wander is 'daily'"),
        ({"start": "queen"}, "start is 'queen'; it must be one of nest, spread"),
        ({"ends_at_delivery": None}, "ends_at_delivery is None"),
        ({"ends_at_delivery": True, "ants": 2}, "ends_at_delivery is set with 2 ants"),
        ({"ends_at_delivery": True, "births": True}, "births True"),
    ],
)
def test_a_colony_that_cannot_be(settings, message):
    with pytest.raises(AntsError, match=message):
        ColonyConfig(**settings)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"evaporation": "quick"}, "evaporation is 'quick'; .* linear, exponential, none"),
        ({"half_life": 0}, "half_life is 0; it must be a number of ticks above 0"),
        ({"half_life": math.inf}, "half_life is inf"),
        ({"half_life": math.nan}, "half_life is nan"),
        ({"half_life": "50"}, "half_life is '50'"),
        ({"diffusion": 1.01}, "diffusion is 1.01; it must be a number from 0 to 1"),
        ({"diffusion": -0.1}, "diffusion is -0.1"),
        ({"diffusion": None}, "diffusion is None"),
        ({"deposit": "drop"}, "deposit is 'drop'; .* set, add, none"),
        ({"level": 0}, "level is 0; it must lie between 1 and 1000000"),
        ({"level": 2.5}, "level is 2.5"),
        ({"cap": 1_000_001}, "cap is 1000001"),
        ({"half_life": 10}, "half_life is 10, but evaporation is 'linear'; give evaporation='expo"),
        ({"half_life": 10, "evaporation": "none"}, "half_life is 10, but evaporation is 'none'"),
        ({"cap": 10}, "cap is 10, but deposit is 'set'; give deposit='add' with it, or leave"),
    ],
)
def test_a_pheromone_that_cannot_be(settings, message):
    with pytest.raises(AntsError, match=message):
        Pheromone(**settings)


def test_the_limits_are_allowed():
    ColonyConfig(ants=1, capacity=1, lifespan=1, regrowth=0, wander=1, ends_at_delivery=True)
    ColonyConfig(ants=np.int64(3), capacity=np.int32(3), births=np.bool_(True))
    Pheromone("exponential", 1e-300, 1, "add", 1, 1_000_000)


def test_what_is_left_out_is_filled_in_where_it_means_something():
    assert Pheromone("exponential").half_life == 50
    assert Pheromone(deposit="add").cap == 1000
    for option in ({"half_life": 7, "evaporation": "exponential"}, {"cap": 7, "deposit": "add"}):
        assert dataclasses.replace(Pheromone(**option), level=3) == Pheromone(**option, level=3)


def test_the_numbers_that_kernels_take():
    pheromone = Pheromone("exponential", half_life=1, diffusion=0.6)
    assert (pheromone.decay, type(pheromone.decay)) == (np.float32(0.5), np.float32)
    assert (pheromone.share, type(pheromone.share)) == (np.float32(0.1), np.float32)
    assert Pheromone("exponential", 50).decay == np.float32(0.5**0.02)
    assert [
        Pheromone(evaporation, diffusion=diffusion).dense
        for evaporation in ("linear", "none", "exponential")
        for diffusion in (0, 0.1)
    ] == [False, True, False, True, True, True]
