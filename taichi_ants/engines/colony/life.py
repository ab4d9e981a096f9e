"""What comes and goes in a colony: births, food that grows back, food that wanders.

Each function handles one whole world, serially; there is little to do in a tick.
"""

import taichi as ti
from taichi.math import popcnt

from taichi_ants.engines.colony.arrays import (
    AGE,
    BLOCKED,
    BORN,
    CARRIES,
    CELL,
    DELIVERIES,
    DIED,
    FIRST_DELIVERY,
    FIRST_VACANT,
    HEADING,
    HOME_CELL,
    HOME_LISTED,
    HOME_MOVES,
    HOME_PILE,
    HOME_TAKEN,
    HOMES,
    LIFE,
    LIVING_ANTS,
    MOVES,
    NEWBORN,
    NEXT_NUMBER,
    NUMBER,
    PILES,
    QUEEN_CELL,
    REGROWN,
    STORE,
    T_BLOCKED,
    T_DIED,
    T_GIVES,
    T_MOVES,
    TICKS,
    TOP,
    VACANT,
    VISITED,
)
from taichi_ants.engines.runs.learning import MODEL, TABLE
from taichi_ants.grid.constants import N_HEADINGS, STREAM_BORN
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN
from taichi_ants.task.rules.policy import bit_number
from taichi_ants.task.rules.random_bits import advance, below, bits_of, high_word


@ti.func
def stream_of(seed, purpose, number):
    """The first state of a random stream, see `randomness.stream_state`."""
    h = bits_of(advance(seed))
    h = bits_of(advance(h ^ ti.cast(purpose, ti.u64)))
    return bits_of(advance(h ^ number))


@ti.func
def count_gives(c: ti.template(), k: ti.template(), w, tick):
    """Add up what the ants gave in this tick."""
    gives = 0
    for chunk in range(w * k.chunks, (w + 1) * k.chunks):
        gives += c.tallies[T_GIVES, chunk]
        c.worlds[MOVES, w] += c.tallies[T_MOVES, chunk]
        c.worlds[BLOCKED, w] += c.tallies[T_BLOCKED, chunk]
        c.tallies[T_GIVES, chunk] = 0
        c.tallies[T_MOVES, chunk] = 0
        c.tallies[T_BLOCKED, chunk] = 0
    c.worlds[DELIVERIES, w] += gives
    c.worlds[TICKS, w] = tick + 1
    if gives > 0 and c.worlds[FIRST_DELIVERY, w] < 0:
        c.worlds[FIRST_DELIVERY, w] = tick + 1
    if k.births == 1:
        c.worlds[STORE, w] += gives


@ti.func
def count_deaths(c: ti.template(), k: ti.template(), w):
    """Add up the ants that die in this tick."""
    for chunk in range(w * k.chunks, (w + 1) * k.chunks):
        c.worlds[DIED, w] += c.tallies[T_DIED, chunk]
        c.worlds[LIVING_ANTS, w] -= c.tallies[T_DIED, chunk]
        c.tallies[T_DIED, chunk] = 0


@ti.func
def free_around(c: ti.template(), base, cell):
    """A bit for each heading at which the neighbour is empty."""
    free = 0
    for heading in ti.static(range(N_HEADINGS)):
        if c.ground[base + cell + c.compass[heading + 1]] == EMPTY:
            free |= 1 << heading
    return free


@ti.func
def give_birth(c: ti.template(), k: ti.template(), own_tables: ti.template(), w):
    """Turn stored food into ants beside the queen, while there is room."""
    base, queen = w * k.size, c.worlds[QUEEN_CELL, w]
    free = free_around(c, base, queen)
    while c.worlds[STORE, w] > 0 and c.worlds[LIVING_ANTS, w] < k.slots and free != 0:
        c.queen_streams[w] = advance(c.queen_streams[w])
        word = high_word(bits_of(c.queen_streams[w]))
        heading = bit_number(free, below(word, popcnt(free)))
        slot = c.worlds[FIRST_VACANT, w]
        while c.ants[LIFE, w * k.slots + slot] != VACANT:
            slot += 1
        c.worlds[FIRST_VACANT, w] = slot + 1
        c.worlds[TOP, w] = ti.max(c.worlds[TOP, w], slot + 1)
        place_newborn(c, k, w, w * k.slots + slot, queen + c.compass[heading + 1], heading)
        if ti.static(own_tables):
            forget(c, w * k.slots + slot)
        c.worlds[STORE, w] -= 1
        free = free_around(c, base, queen)


@ti.func
def place_newborn(c: ti.template(), k: ti.template(), w, ant, cell, heading):
    """Fill a slot and a cell with a new ant."""
    number = c.worlds[NEXT_NUMBER, w]
    c.ants[CELL, ant] = cell
    c.ants[HEADING, ant] = heading
    c.ants[CARRIES, ant] = 0
    c.ants[LIFE, ant] = NEWBORN
    c.ants[AGE, ant] = 0
    c.ants[NUMBER, ant] = number
    born = ti.cast(k.episode, ti.u64) << ti.u64(32) | ti.cast(number, ti.u64)
    c.streams[ant] = stream_of(c.seeds[w], STREAM_BORN, born)
    c.ground[w * k.size + cell] = OBSTACLE
    c.worlds[NEXT_NUMBER, w] = number + 1
    c.worlds[LIVING_ANTS, w] += 1
    c.worlds[BORN, w] += 1


@ti.func
def forget(c: ti.template(), ant):
    """Empty the table and the model of a slot."""
    c.ants[VISITED, ant] = 0
    for i in range(TABLE):
        c.q[ant * TABLE + i] = 0.0
    if c.slots_of.shape[0] > 1:
        for i in range(MODEL):
            c.slots_of[ant * MODEL + i] = 0


@ti.func
def regrow(c: ti.template(), k: ti.template(), w, tick):
    """Food grows back at places that have waited long enough and are empty."""
    base = w * k.size
    for home in range(w * k.homes, w * k.homes + c.worlds[HOMES, w]):
        taken = c.homes[HOME_TAKEN, home]
        if taken >= 0 and tick >= taken + k.regrowth:
            place = base + c.homes[HOME_CELL, home]
            if c.ground[place] == EMPTY:
                c.ground[place] = FOOD
                c.home_of[place] = home
                c.homes[HOME_TAKEN, home] = -1
                c.worlds[REGROWN, w] += 1


@ti.func
def wander(c: ti.template(), k: ti.template(), w):
    """Every pile takes a step: its foods one after the other, the front ones first."""
    for pile in range(c.worlds[PILES, w]):
        c.queen_streams[w] = advance(c.queen_streams[w])
        heading = below(high_word(bits_of(c.queen_streams[w])), N_HEADINGS)
        step = c.compass[heading + 1]
        begins = w * (k.homes + 1) + pile
        for i in range(c.piles[begins], c.piles[begins + 1]):
            home = listed_home(c, k, w, i)
            c.homes[HOME_MOVES, home] = ti.cast(can_move(c, k, w, home, step), ti.i32)
        for i in range(c.piles[begins], c.piles[begins + 1]):
            home = listed_home(c, k, w, i)
            if c.homes[HOME_MOVES, home] == 1 and c.homes[HOME_TAKEN, home] < 0:
                place = w * k.size + c.homes[HOME_CELL, home]
                c.ground[place] = EMPTY
                c.home_of[place] = -1
        for i in range(c.piles[begins], c.piles[begins + 1]):
            home = listed_home(c, k, w, i)
            if c.homes[HOME_MOVES, home] == 1:
                c.homes[HOME_CELL, home] += step
                if c.homes[HOME_TAKEN, home] < 0:
                    place = w * k.size + c.homes[HOME_CELL, home]
                    c.ground[place] = FOOD
                    c.home_of[place] = home


@ti.func
def listed_home(c: ti.template(), k: ti.template(), w, i):
    """The column in `homes` of the i-th place in the order of piles."""
    return w * k.homes + c.homes[HOME_LISTED, w * k.homes + i]


@ti.func
def can_move(c: ti.template(), k: ti.template(), w, home, step):
    """Whether a place of food can take the step.

    Food can if the cell ahead is empty, or holds food of the same pile that can itself: the foods
    in a row move together. A place that waits for its food can unless rock or queen is ahead.
    """
    ahead = w * k.size + c.homes[HOME_CELL, home] + step
    can = c.walls[ahead] == 0 and c.ground[ahead] & 15 != QUEEN
    if c.homes[HOME_TAKEN, home] < 0:
        in_row = True
        while in_row:
            in_row = False
            other = c.home_of[ahead]
            if other >= 0:
                in_row = c.homes[HOME_PILE, other] == c.homes[HOME_PILE, home]
            if in_row:
                ahead += step
        can = c.ground[ahead] == EMPTY
    return can
