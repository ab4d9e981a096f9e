"""What comes and goes in a colony: births, food that grows back, food that wanders.

Each function handles one whole world, serially; there is little to do in a tick.
"""

import taichi as ti
from taichi.math import popcnt

from taichi_ants.engines.colony.layout import ANT_GROUND, AntRow, HomeRow, Stage, TallyRow, WorldRow
from taichi_ants.engines.colony.learning import forget
from taichi_ants.grid.constants import N_HEADINGS, STREAM_BORN
from taichi_ants.task.constants import EMPTY, FOOD, QUEEN
from taichi_ants.task.rules.policy import bit_number
from taichi_ants.task.rules.random_bits import advance, below, bits_of, high_word


@ti.func
def stream_of(seed, purpose, number):
    """The first state of a random stream, see `randomness.stream_state`."""
    h = bits_of(advance(seed))
    h = bits_of(advance(h ^ ti.cast(purpose, ti.u64)))
    return bits_of(advance(h ^ number))


@ti.func
def count_gives(c: ti.template(), w, tick):
    """Add up what the ants gave in this tick."""
    gives = 0
    for chunk in range(w * c.n_chunks, (w + 1) * c.n_chunks):
        gives += c.tallies[TallyRow.GIVES, chunk]
        c.worlds[WorldRow.MOVES, w] += c.tallies[TallyRow.MOVES, chunk]
        c.worlds[WorldRow.BLOCKED, w] += c.tallies[TallyRow.BLOCKED, chunk]
        c.tallies[TallyRow.GIVES, chunk] = 0
        c.tallies[TallyRow.MOVES, chunk] = 0
        c.tallies[TallyRow.BLOCKED, chunk] = 0
    c.worlds[WorldRow.DELIVERIES, w] += gives
    c.worlds[WorldRow.TICKS, w] = tick + 1
    if gives > 0 and c.worlds[WorldRow.FIRST_DELIVERY, w] < 0:
        c.worlds[WorldRow.FIRST_DELIVERY, w] = tick + 1
    if c.births == 1:
        c.worlds[WorldRow.STORE, w] += gives


@ti.func
def count_deaths(c: ti.template(), w):
    """Add up the ants that die in this tick."""
    for chunk in range(w * c.n_chunks, (w + 1) * c.n_chunks):
        c.worlds[WorldRow.DEATHS, w] += c.tallies[TallyRow.DEATHS, chunk]
        c.worlds[WorldRow.LIVING, w] -= c.tallies[TallyRow.DEATHS, chunk]
        c.tallies[TallyRow.DEATHS, chunk] = 0


@ti.func
def free_around(c: ti.template(), base, cell):
    """A bit for each heading at which the neighbour is empty."""
    free = 0
    for heading in ti.static(range(N_HEADINGS)):
        if c.ground[base + cell + c.compass[heading + 1]] == EMPTY:
            free |= 1 << heading
    return free


@ti.func
def give_birth(c: ti.template(), v: ti.template(), w):
    """Turn stored food into ants beside the queen, while there is room."""
    base, queen = w * c.size, c.worlds[WorldRow.QUEEN_CELL, w]
    free = free_around(c, base, queen)
    while (
        c.worlds[WorldRow.STORE, w] > 0 and c.worlds[WorldRow.LIVING, w] < c.n_slots and free != 0
    ):
        c.queen_streams[w] = advance(c.queen_streams[w])
        word = high_word(bits_of(c.queen_streams[w]))
        heading = bit_number(free, below(word, popcnt(free)))
        slot = c.worlds[WorldRow.FIRST_VACANT, w]
        while c.ants[AntRow.STAGE, w * c.n_slots + slot] != Stage.VACANT:
            slot += 1
        c.worlds[WorldRow.FIRST_VACANT, w] = slot + 1
        c.worlds[WorldRow.TOP, w] = ti.max(c.worlds[WorldRow.TOP, w], slot + 1)
        place_newborn(c, w, w * c.n_slots + slot, queen + c.compass[heading + 1], heading)
        if ti.static(v.alone):
            forget(c, v, w * c.n_slots + slot)
        c.worlds[WorldRow.STORE, w] -= 1
        free = free_around(c, base, queen)


@ti.func
def place_newborn(c: ti.template(), w, ant, cell, heading):
    """Fill a slot and a cell with a new ant."""
    number = c.worlds[WorldRow.NEXT_NUMBER, w]
    c.ants[AntRow.CELL, ant] = cell
    c.ants[AntRow.HEADING, ant] = heading
    c.ants[AntRow.CARRIES, ant] = 0
    c.ants[AntRow.STAGE, ant] = Stage.NEWBORN
    c.ants[AntRow.AGE, ant] = 0
    c.ants[AntRow.NUMBER, ant] = number
    born = ti.cast(c.episode, ti.u64) << ti.u64(32) | ti.cast(number, ti.u64)
    c.streams[ant] = stream_of(c.seeds[w], STREAM_BORN, born)
    c.ground[w * c.size + cell] = ANT_GROUND
    c.worlds[WorldRow.NEXT_NUMBER, w] = number + 1
    c.worlds[WorldRow.LIVING, w] += 1
    c.worlds[WorldRow.BIRTHS, w] += 1


@ti.func
def regrow(c: ti.template(), w, tick):
    """Food grows back at places that have waited long enough and are empty."""
    base = w * c.size
    for home in range(w * c.n_homes, w * c.n_homes + c.worlds[WorldRow.HOMES, w]):
        taken = c.homes[HomeRow.TAKEN, home]
        if taken >= 0 and tick >= taken + c.regrowth:
            place = base + c.homes[HomeRow.CELL, home]
            if c.ground[place] == EMPTY:
                c.ground[place] = FOOD
                c.home_of[place] = home
                c.homes[HomeRow.TAKEN, home] = -1
                c.worlds[WorldRow.REGROWN, w] += 1


@ti.func
def wander(c: ti.template(), w):
    """Every pile takes a step: its foods one after the other, the front ones first."""
    for pile in range(c.worlds[WorldRow.PILES, w]):
        c.queen_streams[w] = advance(c.queen_streams[w])
        heading = below(high_word(bits_of(c.queen_streams[w])), N_HEADINGS)
        step = c.compass[heading + 1]
        begins = w * (c.n_homes + 1) + pile
        for i in range(c.piles[begins], c.piles[begins + 1]):
            home = listed_home(c, w, i)
            c.homes[HomeRow.MOVES, home] = ti.cast(can_move(c, w, home, step), ti.i32)
        for i in range(c.piles[begins], c.piles[begins + 1]):
            home = listed_home(c, w, i)
            if c.homes[HomeRow.MOVES, home] == 1 and c.homes[HomeRow.TAKEN, home] < 0:
                place = w * c.size + c.homes[HomeRow.CELL, home]
                c.ground[place] = EMPTY
                c.home_of[place] = -1
        for i in range(c.piles[begins], c.piles[begins + 1]):
            home = listed_home(c, w, i)
            if c.homes[HomeRow.MOVES, home] == 1:
                c.homes[HomeRow.CELL, home] += step
                if c.homes[HomeRow.TAKEN, home] < 0:
                    place = w * c.size + c.homes[HomeRow.CELL, home]
                    c.ground[place] = FOOD
                    c.home_of[place] = home


@ti.func
def listed_home(c: ti.template(), w, i):
    """The column in `homes` of the i-th place in the order of piles."""
    return w * c.n_homes + c.homes[HomeRow.LISTED, w * c.n_homes + i]


@ti.func
def can_move(c: ti.template(), w, home, step):
    """Whether a place of food can take the step.

    Food can if the cell ahead is empty, or holds food of the same pile that can itself: the foods
    in a row move together. A place that waits for its food can unless rock or queen is ahead.
    """
    ahead = w * c.size + c.homes[HomeRow.CELL, home] + step
    can = c.walls[ahead] == 0 and c.ground[ahead] & 15 != QUEEN
    if c.homes[HomeRow.TAKEN, home] < 0:
        in_row = True
        while in_row:
            in_row = False
            other = c.home_of[ahead]
            if other >= 0:
                in_row = c.homes[HomeRow.PILE, other] == c.homes[HomeRow.PILE, home]
            if in_row:
                ahead += step
        can = c.ground[ahead] == EMPTY
    return can
