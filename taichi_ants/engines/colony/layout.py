"""Names of the columns, rows and flags in the arrays of a colony."""

import math
from collections.abc import Iterable
from enum import IntEnum, auto
from typing import Any

from taichi_ants.errors import check_one_of
from taichi_ants.features import arrays
from taichi_ants.features.castes import CASTES
from taichi_ants.features.feature import ANT, Array
from taichi_ants.runtime import MAX_THREADS
from taichi_ants.task.constants import MAX_FOOD_KINDS, MAX_NESTS, OBSTACLE
from taichi_ants.task.model import Model

# Small values that each tick uses take one byte, which is a quarter of the memory traffic.
_CORE = (
    Array("cell", ANT, "i4", "cells", doc="Flat index of the cell"),
    Array("carried", ANT, "i4", "carried",
          doc="Ticks since the pick-up of the food or, if a field needs it, without food"),
    Array("number", ANT, "i4", "numbers", start=-1,
          doc="Number of the last ant in the slot; -1 in a slot not used in this episode"),
    # The cell to enter or to take food from, else its own; later its previous cell.
    Array("want", ANT, "i4"),
    Array("state", ANT, "i4", "states", "i4", instead="paper_state",
          doc="State index before the next action"),
    # The reward of the last action, if rewards are by your own rule.
    Array("reward", ANT, "i4"),
    Array("heading", ANT, "i1", "headings", doc="Heading, 0 to 5"),
    Array("carries", ANT, "i1", "carrying", "bool", doc="Whether the ant carries food"),
    Array("stage", ANT, "i1", "_stages"),  # a `Stage`
    Array("paper_state", ANT, "i1", "paper_states",
          doc="State index in the paper's view, which decides about actions and rewards"),
    Array("event", ANT, "i1", "events", doc="Result of the last action, an `Event`"),
    Array("action", ANT, "i1", "actions", start=-1,
          doc="Last action, -1 before the first; the next one if actions are given"),
    Array("executed", ANT, "i1", "executed", "i1", start=-1, instead="action",
          doc="Last action as executed, which differs from the chosen one if it slipped"),
    Array("next_action", ANT, "i1", "next_actions", start=-1,
          doc="Next action if it is drawn already, else -1"),
    Array("nest", ANT, "i1", "nests", "i4", doc="Number of the nest"),
)  # fmt: skip
# The arrays with an entry for each slot by name; of features, too.
COLUMNS = {array.name: array for array in (*_CORE, *(array for _, array in arrays(ANT)))}


def columns_of(model: Model) -> list[Array]:
    needs = {
        "state": not model.sees_paper_state,
        "reward": model.has_own_reward,
        "executed": model.slips,
        "next_action": model.draws_next_action,
        "nest": model.n_nests > 1,
        **{array.name: feature in model.features for feature, array in arrays(ANT)},
    }
    return [array for name, array in COLUMNS.items() if needs.get(name, True)]


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
    """Indices of `orders`, the parameters of a launch whose work is divided into parts."""

    TICKS = 0  # the number of ticks
    PARTS = auto()  # the number of parts of the work
    CHUNKS = auto()  # the number of chunks of each world, of which each part does its share
    THREADS = auto()  # the number of threads among which independent worlds are dealt, see `ticks`
    FIRST = auto()  # the first group of phases that is not done yet
    SPINS = auto()  # the number of checks for the other parts before the first part gives up
    PASSED = auto()  # not a parameter: the ticks since `ColonyState.ticks` was 0, which it counts


LINE = 16  # numbers in `barrier` that fill two cache lines, which processors fetch together
ARRIVALS_TOGETHER = 8  # the number of parts that count their arrivals in one line


class Barrier(IntEnum):
    """Indices of `barrier`, see there."""

    STARTED = 0  # the number of parts that have started
    OPENED = LINE  # the number of opened barriers; negative if the first part has given up
    ARRIVED = 2 * LINE  # the number of times that all of some parts have arrived
    TOGETHER = 3 * LINE  # the arrivals of some parts, and of the next ones LINE further, and so on


GAVE_UP = -(2**40)  # added to OPENED when the first part gives up, which keeps the number
BARRIER_SIZE = Barrier.TOGETHER + LINE * (1 + MAX_THREADS // ARRIVALS_TOGETHER)


def _rows(names: Iterable[str]) -> Any:
    return IntEnum("Row", [name.upper() for name in names], start=0)


# Rows of `castes`, one column for each caste; numbers of other features follow.
CasteRow = _rows(CASTES.of_castes)


class FoodSourceRow(IntEnum):
    """Rows of `food_sources`, one column for each food source."""

    CELL = 0
    TAKEN = auto()  # the tick in which its food was taken; -1 if it has food
    MOVES = auto()  # 1 if it moves in this tick
    PILE = auto()
    KIND = auto()
    LISTED = auto()  # the numbers of the food sources in their world, pile by pile


class SumRow(IntEnum):
    """Rows of `sums_of`: the updates of a state-action pair in a tick, see `learning`."""

    COUNT = 0
    LATEST = auto()  # the highest ant number
    TRANSITION = auto()  # the transition of that ant


# In `ground`, the lower four bits of a cell are its ground, see `task.constants`. The upper four
# mark an ant on it: 7 minus its nest, plus 8 if it carries food and others can see that.
ANT_STANDS = 7
ANT_GROUND = OBSTACLE | ANT_STANDS << 4  # the cell of an ant without food

BY_ANT = "by_ant"  # the schedule of a GPU
SCHEDULES = "by_world", "by_chunk", BY_ANT
# Places of sums in a world, at most, and ants for each, so that few add to the same one at once.
PLACES, ANTS_OF_PLACE = 64, 512
# The number of slots from which threads share a world: a single world, and each of many.
_LARGE_ALONE, _LARGE_COLONY = 2048, 16_384
SORTED_BITS = 16  # of the number of a cell, by which ants are sorted
TOUCHED_LINE = 32  # numbers that fill two cache lines, see `LINE`
# The most sums of TD errors of all chunks, if the tables are large: 24 bytes each.
_MOST_SUMS = 2**22


def array_of(number: int, dense: bool) -> str:
    """Return the name of the array of a pheromone; 0 is the trail."""
    return f"field_{number}" if number else "level" if dense else "trail"


def schedule_of(given: str | None, n_worlds: int, capacity: int, arch: str) -> str:
    """Return a schedule, by default the faster one; AntsError if it is not for the processor."""
    large = capacity >= (_LARGE_ALONE if n_worlds == 1 else _LARGE_COLONY)
    fastest = BY_ANT if arch == "cuda" else "by_chunk" if large else "by_world"
    schedule = fastest if given is None else given
    check_one_of("schedule", schedule, SCHEDULES if arch == "cpu" else (BY_ANT,))
    return schedule


def most_chunks(n_worlds: int, capacity: int, pairs: int, most: int) -> int:
    """Return the most chunks of a world, if each has sums for some pairs of state and action."""
    return max(1, min(most, capacity, _MOST_SUMS // max(1, n_worlds * pairs)))


def chunks_for(parts: int, n_worlds: int, most: int) -> int:
    """Return the fewest chunks of a world that give all parts equal shares, if that is allowed."""
    return min(parts // math.gcd(parts, n_worlds), most)
