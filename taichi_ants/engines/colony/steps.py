"""What each ant of a colony does in a tick, phase by phase; see `rules` for what it means.

The conflict rule: a cell to enter must be empty at the start of the tick. Of several ants that want
one cell (to enter it, or to take the food in it) the one with the smallest key wins, a hash of the
cell it stands on and the tick. So neither ant numbers nor threads matter, and nothing is atomic:
each ant writes what it wants into its own cell, and looks at the six cells around what it wants.
"""

import taichi as ti
from taichi.math import popcnt

from taichi_ants.engines.colony.layout import (
    ANT_GROUND,
    ENTER,
    STANDS,
    TAKE,
    AntRow,
    HomeRow,
    TallyRow,
)
from taichi_ants.engines.colony.trail import deposit, level_in_view, level_of
from taichi_ants.engines.looks import judge
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.learners.memory import values_of
from taichi_ants.task.constants import (
    DELIVERED,
    EMPTY,
    FAILED,
    FORWARD,
    GIVE,
    LEFT,
    OBSTACLE,
    PICK_UP,
    PICKED_UP,
    RIGHT,
    ROW,
)
from taichi_ants.task.rules.actions import (
    is_open,
    move_event,
    step_towards,
    turn_round,
    turned_by,
)
from taichi_ants.task.rules.policy import bit_number, choose, lowest_bit_number
from taichi_ants.task.rules.random_bits import advance, bits_of, draw_below
from taichi_ants.task.rules.vision import (
    code_in_view,
    goals_in_view,
    nearer_from,
    percept_carrying,
    percept_foraging,
)


@ti.func
def observe(c: ti.template(), v: ti.template(), w, ant, clock):
    """What an ant sees: the percept, and the row of its table."""
    percept, row = 0, 0
    if ti.static(v.sees_percept):
        percept = see(c, v, w, ant, clock)
        row = percept
    else:
        look = look_around(c, v, w, ant, clock)
        percept = look.percept
        row = v.row(look)
    return percept, row


@ti.func
def see(c: ti.template(), v: ti.template(), w, ant, clock):
    """The percept alone, without what only other observations need."""
    heading, here = c.ants[AntRow.HEADING, ant], w * c.size + c.ants[AntRow.CELL, ant]
    left = here + step_towards(c.compass, heading, LEFT)
    forward = here + step_towards(c.compass, heading, FORWARD)
    right = here + step_towards(c.compass, heading, RIGHT)
    ground_left, ground_forward = looks_of(c.ground[left]), looks_of(c.ground[forward])
    ground_right = looks_of(c.ground[right])
    percept = 0
    if c.ants[AntRow.CARRIES, ant] == 1:
        nearer = nearer_from(c.closer[here], heading)
        percept = percept_carrying(ground_left, ground_forward, ground_right, nearer)
    else:
        percept = percept_foraging(
            ground_left,
            ground_forward,
            ground_right,
            level_in_view(c, v, left, clock),
            level_in_view(c, v, forward, clock),
            level_in_view(c, v, right, clock),
        )
    return percept


@ti.func
def look_around(c: ti.template(), v: ti.template(), w, ant, clock):
    """All that the ant can look at."""
    heading, here = c.ants[AntRow.HEADING, ant], w * c.size + c.ants[AntRow.CELL, ant]
    nearer = nearer_from(c.closer[here], heading)
    look = v.look_type(carries=c.ants[AntRow.CARRIES, ant], own_level=level_of(c, v, here, clock))
    cells = ti.static(v.observation.cells)
    for k in ti.static(range(len(cells))):
        towards = (heading + cells[k] + N_HEADINGS) % N_HEADINGS
        place = here + step_towards(c.compass, towards, FORWARD)
        look.levels[k] = level_in_view(c, v, place, clock)
        look.ants[k] = ant_on(c.ground[place])
        look.nearer[k] = nearer >> (cells[k] % N_HEADINGS) & 1
        look.codes[k] = looks_of(c.ground[place])
    judge(look, v.observation)
    return look


@ti.func
def looks_of(ground):
    """How a cell looks, without the mark of the ant on it: u8 -> i32."""
    return ti.cast(ground & 15, ti.i32)


@ti.func
def ant_on(ground):
    """0 if no ant stands on a cell, 1 if one without food does, 2 if one with food does."""
    return (ti.cast(ground >> 4, ti.i32) + 1) >> 3


@ti.func
def ground_under(carries):
    """What the cell of an ant holds when nobody wants anything."""
    return ti.cast(OBSTACLE | (STANDS << 4) + (carries << 7), ti.u8)


@ti.func
def table_of(c: ti.template(), v: ti.template(), owner):
    """Where the tables of an ant, or of the world whose ants share one, begin."""
    return owner * c.tables * (v.observation.n_states * ROW)


@ti.func
def draw_action(c: ti.template(), v: ti.template(), w, ant, row):
    """The ant's choice at a row of its table."""
    c.streams[ant] = advance(c.streams[ant])
    table = table_of(c, v, ant if ti.static(v.own_tables) else w)
    return choose(values_of(c.q, table, row), bits_of(c.streams[ant]), c.explore_below)


@ti.func
def want(c: ti.template(), v: ti.template(), w, chunk, ant, tick):
    """Turn, and write down what the action needs: a cell to enter, or a food to take.

    Hardly a branch: what the next ant does cannot be predicted from what this one did.
    """
    action = c.ants[AntRow.ACTION, ant]
    if action < 0:
        action = draw_action(c, v, w, ant, c.ants[v.row_at, ant])
    percept, cell = c.ants[AntRow.PERCEPT, ant], c.ants[AntRow.CELL, ant]
    heading = turned_by(c.compass, c.ants[AntRow.HEADING, ant], action)
    enters = is_open(code_in_view(percept, ti.min(action, RIGHT))) and action <= RIGHT
    wanted = ti.select(enters, cell + step_towards(c.compass, heading, FORWARD), -1)
    mark = ti.select(enters, ENTER + heading, 0)
    if action == PICK_UP and c.ants[AntRow.CARRIES, ant] == 0:
        foods = goals_in_view(percept)
        if foods != 0:
            position = lowest_bit_number(foods)
            if foods & (foods - 1) != 0:  # several foods in view
                k, c.streams[ant] = draw_below(c.streams[ant], popcnt(foods))
                position = bit_number(foods, k)
            wanted = cell + step_towards(c.compass, heading, position)
            mark = TAKE + (heading + position + N_HEADINGS - 1) % N_HEADINGS
    c.ants[AntRow.HEADING, ant] = heading
    c.ants[AntRow.ACTION, ant] = action
    c.ants[AntRow.WANT, ant] = wanted
    c.ground[w * c.size + cell] = ti.cast(OBSTACLE | mark << 4, ti.u8)


@ti.func
def resolve(c: ti.template(), v: ti.template(), w, chunk, ant, tick):
    """Give up what another ant wins."""
    wanted, base = c.ants[AntRow.WANT, ant], w * c.size
    if wanted >= 0:
        mark = ti.cast(c.ground[base + c.ants[AntRow.CELL, ant]] >> 4, ti.i32)
        kind = mark & 8  # 8 to take, else 0
        rivals = -1  # the ant itself is found too
        for heading in ti.static(range(N_HEADINGS)):
            other = c.ground[base + wanted + c.compass[heading + 1]] >> 4
            rivals += ti.cast(other == wanting(kind, heading), ti.i32)
        if rivals > 0 and not wins(c, base, c.ants[AntRow.CELL, ant], wanted, kind, tick):
            c.ants[AntRow.WANT, ant] = -1


@ti.func
def wanting(kind, heading):
    """The mark of an ant at `heading` from a cell that wants that cell: it looks back."""
    return kind | 1 + turn_round(heading)


@ti.func
def wins(c: ti.template(), base, cell, wanted, kind, tick):
    """Whether no other ant that wants the same has a smaller key than the one on `cell`."""
    own, won = conflict_key(cell, tick), True
    for heading in range(N_HEADINGS):
        other = wanted + c.compass[heading + 1]
        if c.ground[base + other] >> 4 == wanting(kind, heading) and other != cell:
            won = won and conflict_key(other, tick) > own
    return won


@ti.func
def conflict_key(cell, tick):
    """The smallest key wins."""
    inner = bits_of(advance(ti.cast(cell, ti.u64)))
    return bits_of(advance(inner ^ ti.cast(tick, ti.u64)))


@ti.func
def commit(c: ti.template(), v: ti.template(), w, chunk, ant, tick):
    """Do what was won: move, take, give, deposit."""
    base, clock = w * c.size, tick * c.evaporates
    action, percept = c.ants[AntRow.ACTION, ant], c.ants[AntRow.PERCEPT, ant]
    cell, wanted = c.ants[AntRow.CELL, ant], c.ants[AntRow.WANT, ant]
    moves = action <= RIGHT
    enters = moves and wanted >= 0
    destination = ti.select(enters, wanted, cell)
    event = ti.select(enters, move_event(code_in_view(percept, ti.min(action, RIGHT))), FAILED)
    c.ground[base + cell] = EMPTY
    c.ground[base + destination] = ANT_GROUND
    c.ants[AntRow.CELL, ant] = destination
    tally(c, TallyRow.MOVES, chunk, ti.cast(moves, ti.i32))
    tally(c, TallyRow.BLOCKED, chunk, ti.cast(moves and not enters, ti.i32))
    if c.ants[AntRow.CARRIES, ant] == 1:
        if enters:
            deposit(c, v, base + destination, clock)
        elif action == GIVE and goals_in_view(percept) != 0:
            event = DELIVERED
            c.ants[AntRow.CARRIES, ant] = 0
            tally(c, TallyRow.DELIVERIES, chunk, 1)
    elif action == PICK_UP and wanted >= 0:
        event = PICKED_UP
        c.ants[AntRow.CARRIES, ant] = 1
        c.ground[base + wanted] = EMPTY
        take_from_home(c, base + wanted, tick)
        deposit(c, v, base + wanted, clock)
        deposit(c, v, base + cell, clock)
        c.ants[AntRow.HEADING, ant] = turn_round(c.ants[AntRow.HEADING, ant])
    if ti.static(not v.sees_percept):
        c.ground[base + destination] = ground_under(c.ants[AntRow.CARRIES, ant])
    c.ants[AntRow.EVENT, ant] = event
    tally(c, TallyRow.RETURNS, chunk, c.rewards[event])


@ti.func
def tally(c: ti.template(), row, chunk, n):
    """Count in a chunk, whose ants one thread moves; `+=` would be atomic, which takes longer."""
    c.tallies[row, chunk] = c.tallies[row, chunk] + n


@ti.func
def take_from_home(c: ti.template(), place, tick):
    """If the food of a home lay there, the home waits from now on."""
    if c.n_homes > 0:
        home = c.home_of[place]
        if home >= 0:
            c.homes[HomeRow.TAKEN, home] = tick
            c.home_of[place] = -1
