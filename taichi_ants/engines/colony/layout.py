"""Names of the columns, rows and flags in the arrays of a colony."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum, auto
from functools import partial
from typing import NamedTuple

import numpy as np

from taichi_ants.features import arrays
from taichi_ants.features.feature import ANT, Feature
from taichi_ants.task.constants import MAX_FOOD_KINDS, MAX_NESTS, OBSTACLE
from taichi_ants.task.model import Model


class Column(NamedTuple):
    """An array with an entry for each slot: its value at the start, and the models that use it."""

    dtype: type
    start: int = 0
    is_used: Callable[[Model], bool] = lambda model: True


def _uses(feature: Feature, model: Model) -> bool:
    return feature in model.features


# Small values that each tick uses take one byte, which is a quarter of the memory traffic.
COLUMNS = {
    "cell": Column(np.int32),
    # Ticks since the pick-up of its food, or, if a field needs it, without food.
    "carried": Column(np.int32),
    "number": Column(np.int32, -1),  # -1 in a slot that was never used in this episode
    # The cell to enter or to take food from, else its own; later its previous cell.
    "want": Column(np.int32),
    # The state index, unless it is the paper's state.
    "state": Column(np.int32, 0, lambda model: not model.sees_paper_state),
    # The reward of the last action, if rewards are by your own rule.
    "reward": Column(np.int32, 0, lambda model: model.has_own_reward),
    "heading": Column(np.int8),
    "carries": Column(np.int8),
    "stage": Column(np.int8),  # a `Stage`
    "paper_state": Column(np.int8),  # which decides about actions and rewards
    "event": Column(np.int8),  # the result of the last action, an `Event`
    # The last action, -1 before the first one; or the next one, if actions are given.
    "action": Column(np.int8, -1),
    # The last action as executed, if actions slip; else it is `action`.
    "executed": Column(np.int8, -1, lambda model: model.slips),
    # The next action if it is drawn already, else -1.
    "next_action": Column(np.int8, -1, lambda model: model.draws_next_action),
    "nest": Column(np.int8, 0, lambda model: model.n_nests > 1),
    # The kind of the last food that it picked up.
    "kind": Column(np.int8, 0, lambda model: model.n_kinds > 1),
    **{
        array.name: Column(np.dtype(array.dtype).type, 0, partial(_uses, feature))
        for feature, array in arrays(ANT)
    },
}


class Stage(IntEnum):
    """The content of a slot: no ant, an ant, an ant that dies in this tick, or a newborn ant."""

    VACANT = 0
    LIVING = auto()
    DYING = auto()
    NEWBORN = auto()


class WorldRow(IntEnum):
    """Rows of `worlds`, one column for each world."""

    RUNNING = 0  # 1, or 0 once the episode has ended
    TOP = auto()  # slots from this one on are vacant
    FIRST_VACANT = auto()  # no slot below this one is vacant
    NEXT_NUMBER = auto()  # the number of the next newborn ant
    FOOD_SOURCES = auto()
    PILES = auto()
    # The counts of `ColonyEpisodes`, by the names of its fields.
    TICKS = auto()  # also the number of the present tick, from 0
    DELIVERIES = auto()
    FIRST_DELIVERY = auto()
    BIRTHS = auto()
    DEATHS = auto()
    REGROWN = auto()
    LIVING = auto()


class NestRow(IntEnum):
    """Rows of `nests`, one column for each world and nest."""

    QUEEN_CELL = 0
    STORE = auto()  # food items that the queen has not turned into ants yet


class Tally(IntEnum):
    """Counts of a tick: the first of the TALLY_WIDTH numbers in `tallies` for each chunk.

    The rows of `totals` are 64-bit sums over the episode of the counts named in `TOTALS`.
    """

    RETURNS = 0
    MOVES = auto()
    BLOCKED = auto()
    CARRIED = auto()  # ticks with food of all delivered loads
    DELIVERIES = auto()
    DEATHS = auto()


TOTALS = (Tally.RETURNS, Tally.MOVES, Tally.BLOCKED, Tally.CARRIED)
# Numbers in `delivered` for each chunk: deliveries of a tick by nest and kind of food.
NESTS_BY_KINDS = MAX_NESTS * MAX_FOOD_KINDS
# Wide enough that two chunks never share a cache line, which would slow threads down.
TALLY_WIDTH = 16


class Order(IntEnum):
    """Indices of `orders`, the parameters of a launch of `kernels.ticks`."""

    TICKS = 0  # the number of ticks
    PARTS = auto()  # the number of parts of the work
    THREADS = auto()  # the number of threads among which independent worlds are dealt, see `ticks`
    FIRST = auto()  # the first group of phases that is not done yet
    SPINS = auto()  # the number of checks for the other parts before the first part gives up
    PASSED = auto()  # not a parameter: the ticks since `ColonyState.ticks` was 0, which it counts


class Barrier(IntEnum):
    """Indices of `barrier`, each in its own cache line."""

    STARTED = 0  # the number of parts that have started
    ARRIVED = 8  # the number of arrivals at barriers, without those of the first part
    OPENED = 16  # the number of opened barriers; negative if the first part has given up


GAVE_UP = -(2**40)  # added to OPENED when the first part gives up, which keeps the number


class CasteRow(IntEnum):
    """The first rows of `castes`, one column for each caste; numbers of features follow."""

    EPSILON = 0  # -1 if it has that of the colony
    EPSILON_SPREAD = auto()
    LEARNING_RATE = auto()  # -1 if it has that of the colony
    DISCOUNT = auto()
    TEMPERATURE = auto()
    K = auto()
    EXPONENT = auto()
    LEARNS = auto()  # 0 if it follows a policy
    LAYS = auto()  # a bit for each pheromone
    CUES = auto()  # the number of its cues in `Task.all_cues`


class FoodRow(IntEnum):
    """Rows of `food_numbers`, one column for each kind of food; see `Food`."""

    PICK_UP = 0
    DELIVER = auto()
    LOADS = auto()
    REGROWTH = auto()  # -1 if it does not grow back


class FoodSourceRow(IntEnum):
    """Rows of `food_sources`, one column for each food source."""

    CELL = 0
    TAKEN = auto()  # the tick in which its food was taken; -1 if it has food
    MOVES = auto()  # 1 if it moves in this tick
    PILE = auto()
    KIND = auto()
    LISTED = auto()  # the numbers of the food sources in their world, pile by pile


class SumRow(IntEnum):
    """Rows of `sums_of`: the updates of a state-action pair in a tick, a column for each chunk."""

    COUNT = 0
    LATEST = auto()  # the highest ant number
    TRANSITION = auto()  # the transition of that ant


# In `ground`, the lower four bits of a cell are its ground, see `task.constants`. The upper four
# mark an ant on it: 7 minus its nest, plus 8 if it carries food and others can see that.
ANT_STANDS = 7
ANT_GROUND = OBSTACLE | ANT_STANDS << 4  # the cell of an ant without food

# The number of slots from which threads share a world: a single world, and each of many.
_LARGE_ALONE, _LARGE_COLONY = 2048, 16_384
_CHUNKS_PER_THREAD = 2


def array_of(number: int, dense: bool) -> str:
    """Return the name of the array of a pheromone; 0 is the trail."""
    return f"field_{number}" if number else "level" if dense else "trail"


def usual_schedule(n_worlds: int, capacity: int) -> str:
    """Return the faster schedule for `n_worlds` worlds with `capacity` slots each."""
    large = capacity >= (_LARGE_ALONE if n_worlds == 1 else _LARGE_COLONY)
    return "by_chunk" if large else "by_world"


def chunks_of(schedule: str, threads: int) -> int:
    """Return the number of chunks of ants in a world."""
    return _CHUNKS_PER_THREAD * threads if schedule == "by_chunk" else 1
