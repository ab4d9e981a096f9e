"""Names of what lies in the memory of a colony: the rows of its tables of integers."""

from __future__ import annotations

from enum import IntEnum, auto

from taichi_ants.task.constants import OBSTACLE


class AntRow(IntEnum):
    """What is known of an ant: rows of `ants` (int32), then of `traits` (int8); columns are slots.

    What is small and used in each tick lies in `traits`, a quarter as much for memory to move. Rows
    that a colony does not use, at the end of either table, are left out. Kernels know each row as
    an array of its own, by its name in small letters.
    """

    CELL = 0
    CARRIED = auto()  # ticks with the food that it carries
    NUMBER = auto()  # -1 in a slot that was never used in this episode
    WANT = auto()  # the cell to enter, or of the food to take, else its own; then where it was
    STATE = auto()  # the row of the table; where the percept is the row, it is not used
    AGE = auto()  # in ticks; only where ants are born or die
    HEADING = auto()
    CARRIES = auto()
    STAGE = auto()  # a `Stage`
    PERCEPT = auto()  # the paper's state: what acting and rewards go by
    EVENT = auto()  # the result of the last action, an `Event`
    ACTION = auto()  # the last action, -1 before the first one; or the next one, if it is given
    NEXT_ACTION = auto()  # that it has drawn already, -1; only for learners that draw ahead


FIRST_TRAIT = AntRow.HEADING


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
    HOMES = auto()
    PILES = auto()
    QUEEN_CELL = auto()
    # What `ColonyEpisodes` counts, by the names of its fields.
    TICKS = auto()  # also the number of the present tick, from 0; its end adds 1
    DELIVERIES = auto()
    FIRST_DELIVERY = auto()
    MOVES = auto()
    BLOCKED = auto()
    BIRTHS = auto()
    DEATHS = auto()
    REGROWN = auto()
    LIVING = auto()


class Tally(IntEnum):
    """What is counted in a tick: `tallies` has TALLY_WIDTH numbers for each chunk, these first."""

    RETURNS = 0
    DELIVERIES = auto()
    MOVES = auto()
    BLOCKED = auto()
    DEATHS = auto()


# Wide enough that no two chunks share a line of a cache: threads would fight for it.
TALLY_WIDTH = 16


class Order(IntEnum):
    """Places in `orders`: what a launch is told."""

    TICKS = 0  # how many are to pass
    MEMBERS = auto()  # threads that share the work of a tick, see `kernels.by_team`


class HomeRow(IntEnum):
    """Rows of `homes`, one column for each food of the start: where it lies, or grows back."""

    CELL = 0
    TAKEN = auto()  # the tick in which it was taken; -1: it is there
    MOVES = auto()  # whether it does in this tick
    PILE = auto()
    LISTED = auto()  # the homes (numbers in their world), pile by pile


class SumRow(IntEnum):
    """Rows of `sums_of`, one column for each chunk and pair: updates of the pair in this tick."""

    COUNT = 0
    LATEST = auto()  # the highest ant number
    OUTCOME = auto()  # and what that ant saw


# What the lower four bits of a cell in `ground` say is how it looks, see `task.constants`; the
# upper four mark the ant on it, and tell whether it carries food where somebody sees that.
ANT_STANDS, STANDS_WITH_FOOD = 7, 15
ANT_GROUND = OBSTACLE | ANT_STANDS << 4  # the cell of an ant without food
