"""Names of what lies in the arrays of a colony."""

from __future__ import annotations

from enum import IntEnum, auto

from taichi_ants.task.constants import OBSTACLE

# Columns: the arrays with one entry for each slot, by which kernels know the ants. What is small
# and used in each tick takes a byte, a quarter as much for memory to move.
INTEGER_COLUMNS = (
    "cell",
    "carried",  # ticks with the food that it carries
    "number",  # -1 in a slot that was never used in this episode
    "want",  # the cell to enter, or of the food to take, else its own; then where it was
    "state",  # the state index; only where that is not the percept
    "age",  # in ticks; only where ants are born or die
)
BYTE_COLUMNS = (
    "heading",
    "carries",
    "stage",  # a `Stage`
    "percept",  # the paper's state: what acting and rewards go by
    "event",  # the result of the last action, an `Event`
    "action",  # the last action, -1 before the first one; or the next one, if it is given
    "next_action",  # the one that it has drawn already, -1; only for learners that draw ahead
)


class Stage(IntEnum):
    """What is in a slot: nothing, an ant, one that dies in this tick, or one born in it."""

    VACANT = 0
    LIVING = auto()
    DYING = auto()
    NEWBORN = auto()


class WorldRow(IntEnum):
    """Rows of `worlds`, one column for each world."""

    RUNNING = 0  # 1, or 0 once the episode has ended
    TOP = auto()  # slots from here on are vacant
    FIRST_VACANT = auto()  # no slot below is vacant
    NEXT_NUMBER = auto()  # of the next ant that is born
    STORE = auto()  # foods that the queen has not turned into ants yet
    FOOD_SOURCES = auto()
    PILES = auto()
    QUEEN_CELL = auto()
    # What `ColonyEpisodes` counts, by the names of its fields.
    TICKS = auto()  # also the number of the present tick, from 0; its end adds 1
    DELIVERIES = auto()
    FIRST_DELIVERY = auto()
    BIRTHS = auto()
    DEATHS = auto()
    REGROWN = auto()
    LIVING = auto()


class Tally(IntEnum):
    """Counts of a tick: `tallies` has TALLY_WIDTH numbers for each chunk, these first.

    Those of `TOTALS` are summed over the episode in 64 bits, rows of `totals` of these numbers.
    """

    RETURNS = 0
    MOVES = auto()
    BLOCKED = auto()
    DELIVERIES = auto()
    DEATHS = auto()


TOTALS = (Tally.RETURNS, Tally.MOVES, Tally.BLOCKED)
# Wide enough that no two chunks share a line of a cache: threads would fight for it.
TALLY_WIDTH = 16


class Order(IntEnum):
    """Places in `orders`: what a launch of `kernels.ticks` is told."""

    TICKS = 0  # how many are to pass
    PARTS = auto()  # into how many the work is divided
    FIRST = auto()  # the number of the first group to do; those before are done already
    SPINS = auto()  # how often the first part looks for the others before it gives up


class Barrier(IntEnum):
    """Places in `barrier`, each in a cache line of its own."""

    STARTED = 0  # parts
    ARRIVED = 8  # times that parts other than the first one came to a barrier
    OPENED = 16  # barriers that all have passed; negative once the first part has given up


GAVE_UP = -(2**40)  # added to OPENED then, so that it still shows how many there were


class FoodSourceRow(IntEnum):
    """Rows of `food_sources`, one column for each food source: where food lies or grows back."""

    CELL = 0
    TAKEN = auto()  # the tick in which it was taken; -1: it is there
    MOVES = auto()  # whether it does in this tick
    PILE = auto()
    LISTED = auto()  # the food sources (numbers in their world), pile by pile


class SumRow(IntEnum):
    """Rows of `sums_of`, one column for each chunk and pair: updates of the pair in this tick."""

    COUNT = 0
    LATEST = auto()  # the highest ant number
    TRANSITION = auto()  # and what that ant saw


# What the lower four bits of a cell in `ground` say is how it looks, see `task.constants`; the
# upper four mark the ant on it, and tell whether it carries food where somebody sees that.
ANT_STANDS, STANDS_WITH_FOOD = 7, 15
ANT_GROUND = OBSTACLE | ANT_STANDS << 4  # the cell of an ant without food

# Slots from which threads share the ants of a world: of a single one, and of each of many.
_LARGE_ALONE, _LARGE_COLONY = 2048, 16_384
_CHUNKS_PER_THREAD = 2


def usual_schedule(n_worlds: int, capacity: int) -> str:
    """Return the faster schedule for so many worlds of so many slots."""
    large = capacity >= (_LARGE_ALONE if n_worlds == 1 else _LARGE_COLONY)
    return "by_chunk" if large else "by_world"


def chunks_of(schedule: str, threads: int) -> int:
    """Return into how many chunks the ants of a world are divided."""
    return _CHUNKS_PER_THREAD * threads if schedule == "by_chunk" else 1
