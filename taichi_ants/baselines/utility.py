"""Ants that learn pheromone values by value iteration.

L. Panait, S. Luke. A pheromone-based utility model for collaborative foraging. Third International
Joint Conference on Autonomous Agents and Multiagent Systems (AAMAS 2004), 36-43.

There are two pheromones, one for the nest and one for food. The *utility* U_p(s) is larger the
nearer cell s is to goal p. A carrier comes from food and looks for the nest; a forager comes from
the nest and looks for food. In each tick an ant in cell s backs up the utility of its origin p:

    U_p(s) <- max(U_p(s), R_p(s) + discount * max over the neighbours s' of U_p(s'))

where the reward R_p is 1 in a cell of goal p, else 0. Then it moves to the neighbour with the
highest utility of the goal that it looks for. So carriers lead foragers and foragers lead carriers,
and both utilities increase towards their goals as state values do in value iteration.
`docs/baselines.md` lists sources and deviations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from taichi_ants import runtime
from taichi_ants.baselines.open_cells import open_cells
from taichi_ants.errors import AntsError
from taichi_ants.grid.constants import N_HEADINGS, STREAM_FORAGER
from taichi_ants.grid.randomness import stream_state
from taichi_ants.settings import Count, Seed, Setting, Share, checked_arguments
from taichi_ants.worlds.world import World

EVERY = 10  # ticks between measurements of the path
_MAX_ENTRIES = 1 << 27  # elements of the utilities: a gibibyte


@dataclass(frozen=True)
class Foraging:
    """Results of colonies.

    Attributes:
        shortest: Steps from the queen to the nearest food and back.
        deliveries: int32 (colonies, ticks), the food items delivered in each tick.
        lengths: int32 (colonies, ticks // 10), the length, every 10 ticks, of the path to food and
            back that always takes the highest utility; 0 if there is none.
        utilities: float64 (colonies, 2, grid.size), of the nest and of food, at the end.
    """

    shortest: int
    deliveries: np.ndarray
    lengths: np.ndarray
    utilities: np.ndarray

    @property
    def first_delivery(self) -> np.ndarray:
        """int64 (colonies,): the tick of the first delivery, from 1; 0 if there is none."""
        return _first(self.deliveries > 0)

    @property
    def found(self) -> np.ndarray:
        """int64 (colonies,): the first measured tick with a shortest path; 0 if there is none."""
        return EVERY * _first(self.lengths == self.shortest)


@checked_arguments
def forage(
    world: World,
    *,
    ticks: Count = 1000,
    ants: Count = 64,
    colonies: Count = 20,
    capacity: Count = 10,
    discount: Annotated[float, Setting(above=0, most=math.nextafter(1, 0))] = 0.9,
    evaporation: Share = 0.001,
    exploration: Share = 0.1,
    momentum: Share = 0.8,
    seed: Seed = 0,
    threads: int | None = None,
) -> Foraging:
    """Return results of independent colonies that collect food, which grows back at once.

    Args:
        world: The world; its trails and listed ants have no effect.
        ticks: The number of ticks.
        ants: The number of ants in each colony, which all start in the nest.
        colonies: The number of colonies; more colonies do not change the first ones.
        capacity: The largest number of ants in a cell; the nest has no limit.
        discount: The factor by which utility decreases per step, above 0 and below 1.
        evaporation: The share of all utilities that evaporates per tick.
        exploration: The probability of a random step if a neighbour has a utility above 0.
        momentum: The probability of a step straight ahead, if possible, where no neighbour has a
            utility above 0.

    Raises:
        AntsError: An argument is not allowed, or no food is reachable.
    """
    cells, neighbours, is_food, nest, steps = open_cells(world)
    if colonies * max(2 * world.grid.size, ticks, ants) > _MAX_ENTRIES:
        raise AntsError(
            f"{colonies} colonies of {ants} ants for {ticks} ticks in a world of {len(cells)} open "
            "cells need too much memory; choose fewer colonies, ants or ticks."
        )
    numbers = np.arange(colonies)[:, None] * 2**32 + np.arange(ants)
    states = stream_state(seed, STREAM_FORAGER, numbers)

    runtime.start(threads)
    from taichi_ants.baselines.kernels import live, measure  # imports Taichi

    goals = np.stack([np.arange(len(cells)) == nest, is_food == 1]).astype(np.int32)
    settings = capacity, discount, 1 - evaporation, exploration, momentum
    of_ants = np.zeros((colonies, ants, 3), np.int32)
    of_ants[..., 0] = nest
    of_ants[..., 1] = np.arange(ants) % N_HEADINGS
    standing = np.zeros((colonies, len(cells)), np.int32)
    standing[:, nest] = ants
    utilities = np.zeros((colonies, 2, len(cells)))
    deliveries = np.zeros((colonies, ticks), np.int32)
    lengths = np.zeros((colonies, ticks // EVERY), np.int32)
    with runtime.quiet():
        for first in range(0, ticks, EVERY):
            last = min(first + EVERY, ticks)
            state = states, of_ants, standing, utilities, deliveries
            live(neighbours, goals, *settings, first, last, *state)
            if last == first + EVERY:
                measure(neighbours, goals, nest, utilities, first // EVERY, lengths)
    spread = np.zeros((colonies, 2, world.grid.size))
    spread[..., cells] = utilities
    return Foraging(2 * steps, deliveries, lengths, spread)


def _first(hits: np.ndarray) -> np.ndarray:
    """Return the first true column of each row, from 1; 0 if there is none."""
    return np.pad(hits, ((0, 0), (1, 0))).argmax(axis=1)
