"""Births, deaths, regrowth of food, and wandering food in a colony.

`grow_old` and `update_slots` are phases of single ants, in parallel. The others process a whole
world serially, because they have little to do in a tick.
"""

import taichi as ti
from taichi.math import popcnt

from taichi_ants.arithmetic.random_bits import advance, bits_of, draw_below, high_word, stream_of
from taichi_ants.engines.colony import layout
from taichi_ants.engines.colony.columns import chunks_of, function, put, trait
from taichi_ants.engines.colony.layout import FoodSourceRow, NestRow, Stage, Tally, WorldRow
from taichi_ants.engines.colony.learning import reset_slot
from taichi_ants.engines.colony.steps import tally
from taichi_ants.engines.colony.views import ant_view, cell_view, nest_view
from taichi_ants.grid.constants import N_HEADINGS, STREAM_BORN
from taichi_ants.task.constants import EMPTY, FOOD, MAX_CASTES, OBSTACLE, QUEEN, Event
from taichi_ants.task.rules.policy import bit_number


@function
def count(c, v, w, tick):
    """Add the tallies of all chunks to the counts of a world, and reset them."""
    # No `+=`, which would be atomic and slower: one thread processes a world.
    gives = 0
    for chunk in range(w * chunks_of(c, v), (w + 1) * chunks_of(c, v)):
        first = chunk * layout.TALLY_WIDTH
        gives += ti.cast(c.tallies[first + Tally.DELIVERIES], ti.i32)
        for row in ti.static(layout.TOTALS):
            c.totals[row, w] = c.totals[row, w] + c.tallies[first + row]
        if ti.static(v.ants_change):
            deaths = ti.cast(c.tallies[first + Tally.DEATHS], ti.i32)
            c.worlds[WorldRow.DEATHS, w] = c.worlds[WorldRow.DEATHS, w] + deaths
            c.worlds[WorldRow.LIVING, w] = c.worlds[WorldRow.LIVING, w] - deaths
        for row in ti.static(range(len(Tally))):
            c.tallies[first + row] = 0
    c.worlds[WorldRow.DELIVERIES, w] = c.worlds[WorldRow.DELIVERIES, w] + gives
    if ti.static(v.counts_by_nest_and_kind):
        count_by_nest(c, v, w)
    else:
        c.nests[NestRow.STORE, w] = c.nests[NestRow.STORE, w] + gives * c.births
        for delivered in ti.static(v.at["delivered"]):
            delivered(nest_view(c, v, w, 0), gives)
    if ti.static(v.n_castes > 0):
        count_by_caste(c, v, w)
    if gives > 0 and c.worlds[WorldRow.FIRST_DELIVERY, w] < 0:
        c.worlds[WorldRow.FIRST_DELIVERY, w] = tick + 1


@function
def count_by_nest(c, v, w):
    """Add the deliveries of all chunks by nest and kind to those of a world, and reset them."""
    for nest in ti.static(range(v.n_nests)):
        column, of_nest = w * v.n_nests + nest, 0
        for kind in ti.static(range(v.n_kinds)):
            i, n = ti.static(nest * v.n_kinds + kind), 0
            for chunk in range(w * chunks_of(c, v), (w + 1) * chunks_of(c, v)):
                n += c.delivered[chunk * layout.NESTS_BY_KINDS + i]
                c.delivered[chunk * layout.NESTS_BY_KINDS + i] = 0
            c.deliveries_by_nest_and_kind[column * v.n_kinds + kind] += n
            of_nest += n
        c.nests[NestRow.STORE, column] += of_nest * c.births
        for delivered in ti.static(v.at["delivered"]):  # once, since it can round
            delivered(nest_view(c, v, w, nest), of_nest)


@function
def count_by_caste(c, v, w):
    """Add the deliveries of all chunks by caste to those of a world, and reset them."""
    for chunk in range(w * chunks_of(c, v), (w + 1) * chunks_of(c, v)):
        for i in range(v.n_castes):
            c.caste_deliveries[w * v.n_castes + i] += c.delivered_by_caste[chunk * MAX_CASTES + i]
            c.delivered_by_caste[chunk * MAX_CASTES + i] = 0


@function
def free_around(c, base, cell):
    """Return a bit for each heading at which the neighbour of a cell is empty."""
    free = 0
    for heading in ti.static(range(N_HEADINGS)):
        if c.ground[base + cell + c.compass[heading + 1]] == EMPTY:
            free |= 1 << heading
    return free


@function
def give_birth(c, v, w, tick):
    """Turn stored food into ants next to the queens, while slots and cells are free."""
    base = w * c.size
    for nest in range(v.n_nests):
        column = w * v.n_nests + nest
        queen = c.nests[NestRow.QUEEN_CELL, column]
        free = free_around(c, base, queen)
        while (
            c.nests[NestRow.STORE, column] > 0
            and c.worlds[WorldRow.LIVING, w] < c.n_slots
            and free != 0
        ):
            k, c.queen_streams[w] = draw_below(c.queen_streams[w], popcnt(free))
            heading = bit_number(free, k)
            slot = c.worlds[WorldRow.FIRST_VACANT, w]
            while trait(c.stage, w * c.n_slots + slot) != Stage.VACANT:
                slot += 1
            c.worlds[WorldRow.FIRST_VACANT, w] = slot + 1
            c.worlds[WorldRow.TOP, w] = ti.max(c.worlds[WorldRow.TOP, w], slot + 1)
            ant = w * c.n_slots + slot
            if ti.static(v.n_castes > 0):
                put(c.caste, ant, draw_caste(c, v, w, nest))
            place_newborn(c, v, w, nest, ant, queen + c.compass[heading + 1], heading)
            if ti.static(v.independent):
                reset_slot(c, v, ant)
            c.nests[NestRow.STORE, column] -= 1
            free = free_around(c, base, queen)


@function
def draw_caste(c, v, w, nest):
    """Return the caste of a newborn ant of a nest, drawn from the queen's stream if needed."""
    caste = 0
    if ti.static(v.n_castes > 1):
        c.queen_streams[w] = advance(c.queen_streams[w])
        word = ti.cast(high_word(bits_of(c.queen_streams[w])), ti.f64) / 4294967296.0
        for i in ti.static(range(v.n_castes - 1)):
            bound = c.caste_chances[(w * v.n_nests + nest) * v.n_castes + i]
            caste += ti.cast(bound <= word, ti.i32)
    return caste


@function
def place_newborn(c, v, w, nest, ant, cell, heading):
    number = c.worlds[WorldRow.NEXT_NUMBER, w]
    c.cell[ant] = cell
    put(c.heading, ant, heading)
    put(c.carries, ant, 0)
    put(c.stage, ant, Stage.NEWBORN)
    put(c.action, ant, -1)
    put(c.event, ant, Event.NONE)  # the slot can have one of an ant that died
    if ti.static(v.slips):
        put(c.executed, ant, -1)
    c.carried[ant] = 0
    c.number[ant] = number
    born = ti.cast(c.episodes[w], ti.u64) << ti.u64(32) | ti.cast(number, ti.u64)
    c.streams[ant] = stream_of(c.seeds[w], STREAM_BORN, born)
    ground = layout.ANT_GROUND
    if ti.static(v.n_nests > 1):
        put(c.nest, ant, nest)
        ground = OBSTACLE | (layout.ANT_STANDS - nest) << 4
    for born in ti.static(v.at["born"]):
        born(ant_view(c, v, w, ant))
    c.ground[w * c.size + cell] = ti.cast(ground, ti.u8)
    c.worlds[WorldRow.NEXT_NUMBER, w] = number + 1
    c.worlds[WorldRow.LIVING, w] += 1
    c.worlds[WorldRow.BIRTHS, w] += 1


@function
def grow_old(c, v, w, chunk, ant, tick):
    """Let an ant grow old; if it dies, empty its cell, or leave its food there."""
    if trait(c.stage, ant) == Stage.LIVING:
        dies = False
        for aged in ti.static(v.at["aged"]):
            dies = dies | aged(ant_view(c, v, w, ant))
        if dies:
            put(c.stage, ant, Stage.DYING)
            tally(c, v, Tally.DEATHS, chunk, 1)
            left_behind = ti.select(trait(c.carries, ant) == 1, FOOD, EMPTY)
            index = w * c.size + c.cell[ant]
            c.ground[index] = ti.cast(left_behind, ti.u8)
            if left_behind == FOOD:
                for dropped in ti.static(v.at["dropped"]):
                    dropped(ant_view(c, v, w, ant), cell_view(c, v, index))


@function
def regrow(c, v, w, tick):
    """Let food grow back in empty cells of food sources that have waited long enough."""
    first = w * c.n_food_sources
    for source in range(first, first + c.worlds[WorldRow.FOOD_SOURCES, w]):
        taken = c.food_sources[FoodSourceRow.TAKEN, source]
        waits, kind = c.regrowth, 0
        if ti.static(v.n_kinds > 1):
            kind = c.food_sources[FoodSourceRow.KIND, source]
        index = place_of(c, w, source)
        for wait in ti.static(v.at["waits"]):
            waits = wait(cell_view(c, v, index), kind, waits)
        if waits >= 0 and taken >= 0 and tick >= taken + waits and c.ground[index] == EMPTY:
            grown = 1
            for filled in ti.static(v.at["filled"]):
                grown = filled(cell_view(c, v, index), kind, grown)
            c.ground[index] = FOOD
            c.source_of[index] = source
            c.food_sources[FoodSourceRow.TAKEN, source] = -1
            c.worlds[WorldRow.REGROWN, w] += grown


@function
def place_of(c, w, source):
    return w * c.size + c.food_sources[FoodSourceRow.CELL, source]


@function
def move_piles(c, v, w, tick):
    """Move every pile, every `c.pile_move_interval` ticks."""
    if c.pile_move_interval > 0:
        if (tick + 1) % c.pile_move_interval == 0:
            for pile in range(c.worlds[WorldRow.PILES, w]):
                move_pile(c, w, w * (c.n_food_sources + 1) + pile)


@function
def move_pile(c, w, pile):
    """Move a pile: all food that can move leaves its cells, then enters the next ones.

    So the front of a pile makes way for the food behind it, in any order of the food sources.
    """
    heading, c.queen_streams[w] = draw_below(c.queen_streams[w], N_HEADINGS)
    step, first = c.compass[heading + 1], w * c.n_food_sources
    for i in range(first + c.piles[pile], first + c.piles[pile + 1]):
        source = first + c.food_sources[FoodSourceRow.LISTED, i]
        c.food_sources[FoodSourceRow.MOVES, source] = ti.cast(can_move(c, w, source, step), ti.i32)
    for enters in ti.static((False, True)):
        for i in range(first + c.piles[pile], first + c.piles[pile + 1]):
            source = first + c.food_sources[FoodSourceRow.LISTED, i]
            if c.food_sources[FoodSourceRow.MOVES, source] == 1:
                if ti.static(enters):
                    c.food_sources[FoodSourceRow.CELL, source] += step
                if c.food_sources[FoodSourceRow.TAKEN, source] < 0:
                    index = place_of(c, w, source)
                    c.ground[index] = FOOD if ti.static(enters) else EMPTY
                    c.source_of[index] = source if ti.static(enters) else -1


@function
def can_move(c, w, source, step):
    """Return whether a food source can move by a step.

    A source with food can move if the cell ahead is empty, or has food of the same pile that can
    move: food in a row moves together. A waiting source can move unless rock or queen is ahead.
    """
    ahead = place_of(c, w, source) + step
    can = c.walls[ahead] == 0 and c.ground[ahead] & 15 != QUEEN
    if c.food_sources[FoodSourceRow.TAKEN, source] < 0:
        pile, other = c.food_sources[FoodSourceRow.PILE, source], c.source_of[ahead]
        while other >= 0 and c.food_sources[FoodSourceRow.PILE, ti.max(other, 0)] == pile:
            ahead += step
            other = c.source_of[ahead]
        can = c.ground[ahead] == EMPTY
    return can


@function
def update_slots(c, v, w, chunk, ant, tick):
    """Free the slot of a dying ant, and let a newborn ant live, at the end of the tick."""
    if trait(c.stage, ant) == Stage.NEWBORN:
        put(c.stage, ant, Stage.LIVING)
    elif trait(c.stage, ant) == Stage.DYING:
        put(c.stage, ant, Stage.VACANT)
        ti.atomic_min(c.worlds[WorldRow.FIRST_VACANT, w], ant - w * c.n_slots)
        if c.number[ant] < c.n_ants:
            c.first_streams[w * c.n_slots + c.number[ant]] = c.streams[ant]


@function
def end_tick(c, v, w, tick):
    """Count the tick, and end the episode of a world at a delivery if `c.ends_at_delivery`."""
    for tick_ended in ti.static(v.at["tick_ended"]):
        for nest in range(v.n_nests):
            tick_ended(nest_view(c, v, w, nest))
    c.worlds[WorldRow.TICKS, w] = tick + 1
    if c.ends_at_delivery == 1 and c.worlds[WorldRow.DELIVERIES, w] > 0:
        c.worlds[WorldRow.RUNNING, w] = 0
