"""The memory of a colony: NumPy arrays that kernels work on in place.

W worlds of the same ranges lie one behind the other, each with `size` cells, `slots` ants, `chunks`
groups of ants that threads work on, and `homes` places of food. Small tables of integers have one
row for each quantity, named below.
"""

from typing import Any, NamedTuple

import taichi as ti

from taichi_ants.task.constants import OBSTACLE

ANT_GROUND = OBSTACLE  # what the cell of an ant that wants nothing holds

# Rows of `ants`, one column for each slot.
CELL, HEADING, CARRIES, LIFE, AGE, NUMBER, STATE, ACTION, WANT, EVENT, VISITED = range(11)
ANT_ROWS = 11
# Values of LIFE: an empty slot, an ant, one that dies in this tick, one born in it.
VACANT, LIVING, DYING, NEWBORN = range(4)

# Rows of `worlds`, one column for each world.
(
    RUNNING,  # 1, or 0 once the episode has ended
    TOP,  # slots from here on are vacant
    FIRST_VACANT,  # no slot below is vacant
    LIVING_ANTS,
    NEXT_NUMBER,  # of the next ant that is born
    STORE,  # foods that the queen has not turned into ants yet
    MODEL_SIZE,  # visited pairs of the shared model
    DELIVERIES,
    FIRST_DELIVERY,  # ticks until then, -1
    BORN,
    DIED,
    REGROWN,
    MOVES,
    BLOCKED,
    HOMES,  # how many places of food
    PILES,
    QUEEN_CELL,
    TICKS,
) = range(18)
WORLD_ROWS = 18

# Rows of `tallies`, one column for each chunk: counted in a tick.
T_GIVES, T_MOVES, T_BLOCKED, T_DIED = range(4)
TALLY_ROWS = 4

# Rows of `homes`, one column for each place of food: the cell where it lies or lay, the tick it was
# taken (-1: it is there), whether it moves, its pile. The last row lists the places (numbers in
# their world) pile by pile.
HOME_CELL, HOME_TAKEN, HOME_MOVES, HOME_PILE, HOME_LISTED = range(5)
HOME_ROWS = 5

# Rows of `sums_of`, one column for each chunk and pair: updates in this tick, highest ant number,
# and that ant's outcome; the pairs with updates are listed in `touched`.
COUNT, LATEST, OUTCOME = range(3)
SUM_ROWS = 3

# What a configuration says, see `Settings`.
I32 = ti.types.ndarray(dtype=ti.i32, ndim=1)
TABLE_I32 = ti.types.ndarray(dtype=ti.i32, ndim=2)
U8 = ti.types.ndarray(dtype=ti.u8, ndim=1)
U64 = ti.types.ndarray(dtype=ti.u64, ndim=1)
I64 = ti.types.ndarray(dtype=ti.i64, ndim=1)
F32 = ti.types.ndarray(dtype=ti.f32, ndim=1)


class Settings(NamedTuple):
    """The numbers of a configuration, kernel arguments (i32 if not said otherwise).

    -1 stands for an option that is off.
    """

    worlds: Any
    ants: Any  # that start an episode
    slots: Any
    chunks: Any
    size: Any
    homes: Any  # room for places of food in each world
    episode: Any
    evaporates: Any  # 1 if the clock of integer trails runs (linear)
    adds: Any  # 1 if deposits add, 0 if they set, -1 if there are none
    level: Any
    cap: Any
    decay: Any  # f32: the factor of exponential evaporation, 1 for none, -1 for linear
    share: Any  # f32: what a cell gives to each neighbour, 0 without diffusion
    births: Any
    lifespan: Any
    regrowth: Any
    wander: Any
    ends_at_delivery: Any
    planning_steps: Any
    continuing: Any


class Arrays(NamedTuple):
    """All arrays, in the order of the kernels' arguments.

    Attributes:
        ground: u8 (W * size,): what a cell holds in the lower four bits, an ant as OBSTACLE; in the
            upper four what that ant wants: 1 + heading to enter a cell, 9 + heading to take food.
        trail: i32 (W * size,) in integer mode: the clock at which the trail has evaporated.
        level: f32 (W * size,) in dense mode, else (1,).
        spare: f32 (W * size,) with diffusion: the next levels.
        walls: u8 (W * size,): 1 for rocks and outside.
        closer: u8 (W * size,): a bit for each heading that leads nearer to the queen.
        home_of: i32 (W * size,): the place whose food lies in a cell, -1; (1,) if not needed.
        compass: i32 (20,), see `rules.actions`.
        ants: i32 (ANT_ROWS, W * slots).
        streams: u64 (W * slots,), the ants' random streams.
        first_streams: u64 (W * slots,), by ant number: where the streams of the ants that start an
            episode stopped.
        worlds: i32 (WORLD_ROWS, W).
        queen_streams: u64 (W,).
        seeds: u64 (W,).
        rewards: i32 (5,), by event.
        returns: i64 (W,), rewards of all ants in this episode.
        tallies: i32 (TALLY_ROWS, W * chunks).
        homes: i32 (HOME_ROWS, W * homes).
        piles: i32 (W * (homes + 1),): where each pile begins in the row
            HOME_LISTED.
        rates: f32 (W * 3,): learning rate, discount, epsilon.
        explore_below: u64 (W,): epsilon * 2**32.
        q: f32: one table a world (W * TABLE,), or one a slot.
        entries, slots_of: i32: one model a world (W * MODEL,), or one a slot.
        weights: f32: how far the mean of n errors moves a value, by n.
        sums: i64 (W * chunks * 640,), fixed-point sums of TD errors.
        errors: f32 (W * chunks * 640,), the last error.
        sums_of: i32 (SUM_ROWS, W * chunks * 640).
        touched: i32 (W * chunks * 641,): how many pairs have updates, then which.
    """

    ground: Any
    trail: Any
    level: Any
    spare: Any
    walls: Any
    closer: Any
    home_of: Any
    compass: Any
    ants: Any
    streams: Any
    first_streams: Any
    worlds: Any
    queen_streams: Any
    seeds: Any
    rewards: Any
    returns: Any
    tallies: Any
    homes: Any
    piles: Any
    rates: Any
    explore_below: Any
    q: Any
    entries: Any
    slots_of: Any
    weights: Any
    sums: Any
    errors: Any
    sums_of: Any
    touched: Any
