"""What each ant of a colony does in a tick, phase by phase; see `rules` for what it means.

The conflict rule: a cell to enter must be empty at the start of the tick. Of several ants that want
one cell (to enter it, or to take the food in it) the one with the smallest key wins, a hash of the
cell it stands on and the tick. So neither ant numbers nor threads matter, and nothing is atomic:
each ant writes what it wants into its own cell, and looks at the six cells around what it wants.

Where cells with ants can be entered, see `Traffic`, the winners settle in a phase of their own who
of them moves: each ant finds its own way out of what all have written, and changes nothing that
another one reads.
"""

import taichi as ti
from taichi.math import popcnt

from taichi_ants.engines.colony.layout import (
    ANT_GROUND,
    ENTER,
    HAS_FOOD,
    PUSHES,
    STANDS,
    TAKE,
    TAKES_FOOD,
    WINS,
    AntRow,
    HomeRow,
    TallyRow,
)
from taichi_ants.engines.colony.trail import deposit, level_in_view, level_of, level_that_counts
from taichi_ants.engines.looks import judge
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.learners.memory import values_of
from taichi_ants.task.constants import (
    DELIVERED,
    EMPTY,
    ENTERED_EMPTY,
    ENTERED_LURE,
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
            v.half,
            ground_left,
            ground_forward,
            ground_right,
            level_in_view(c, v, left, clock),
            level_in_view(c, v, forward, clock),
            level_in_view(c, v, right, clock),
            strongest_of(c, v, left, forward, right, clock),
        )
    return percept


@ti.func
def strongest_of(c: ti.template(), v: ti.template(), left, forward, right, clock):
    """The largest level of the three cells ahead that counts."""
    others = ti.max(level_that_counts(c, v, forward, clock), level_that_counts(c, v, right, clock))
    return ti.max(level_that_counts(c, v, left, clock), others)


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
        standable = (looks_of(c.ground[place]) == EMPTY) | (c.ground[place] >= ANT_GROUND)
        look.levels[k] = ti.select(standable, level_of(c, v, place, clock), 0)
        look.ants[k] = ant_on(c.ground[place])
        look.nearer[k] = nearer >> (cells[k] % N_HEADINGS) & 1
        look.codes[k] = looks_of(c.ground[place])
    look.strongest = strongest_of(
        *(c, v, here + step_towards(c.compass, heading, LEFT)),
        here + step_towards(c.compass, heading, FORWARD),
        here + step_towards(c.compass, heading, RIGHT),
        clock,
    )
    judge(v.half, look, v.observation)
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
    ahead = cell + step_towards(c.compass, heading, FORWARD)
    enters = is_open(code_in_view(percept, ti.min(action, RIGHT))) and action <= RIGHT
    if ti.static(v.traffic.shared):
        enters = enters or (action <= RIGHT and has_ant(c, w * c.size + ahead))
    wanted = ti.select(enters, ahead, -1)
    mark = ti.select(enters, ENTER + heading, v.idle)
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
    if ti.static(v.traffic.shared):
        takes = ti.select(mark >= TAKE, TAKES_FOOD, 0)
        c.crowd[w * c.size + cell] = ti.cast(c.ants[AntRow.CARRIES, ant] | takes, ti.u8)


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
        cell = c.ants[AntRow.CELL, ant]
        if rivals > 0 and not wins(c, v, base, cell, wanted, kind, tick):
            c.ants[AntRow.WANT, ant] = -1
        elif ti.static(v.traffic.shared):
            c.crowd[base + cell] |= ti.cast(WINS, ti.u8)


@ti.func
def wanting(kind, heading):
    """The mark of an ant at `heading` from a cell that wants that cell: it looks back."""
    return kind | 1 + turn_round(heading)


@ti.func
def wins(c: ti.template(), v: ti.template(), base, cell, wanted, kind, tick):
    """Whether no other ant that wants the same comes before the one on `cell`."""
    own, won = conflict_key(cell, tick), True
    for heading in range(N_HEADINGS):
        other = wanted + c.compass[heading + 1]
        if c.ground[base + other] >> 4 == wanting(kind, heading) and other != cell:
            after = conflict_key(other, tick) > own
            if ti.static(v.traffic.carriers_first):
                loaded = c.crowd[base + cell] & HAS_FOOD
                other_loaded = c.crowd[base + other] & HAS_FOOD
                after = loaded > other_loaded or (loaded == other_loaded and after)
            won = won and after
    return won


@ti.func
def conflict_key(cell, tick):
    """The smallest key wins."""
    inner = bits_of(advance(ti.cast(cell, ti.u64)))
    return bits_of(advance(inner ^ ti.cast(tick, ti.u64)))


@ti.func
def has_ant(c: ti.template(), place):
    """Whether an ant stands on a cell; where cells with ants can be entered, all have a mark."""
    return c.ground[place] >> 4 != 0


@ti.func
def way_is_free(c: ti.template(), v: ti.template(), base, cell, wanted):
    """Whether the winner on `cell` enters a cell that is empty, or whose ant moves on as it does.

    The winners of cells with ants form queues; one moves if its head enters an empty cell. A queue
    that bites its own tail is a ring, which stays.
    """
    ahead = wanted
    if ti.static(v.traffic.follow):
        moving = True
        while moving:
            moving = has_ant(c, base + ahead) and ahead != cell
            moving = moving and c.crowd[base + ahead] & (WINS | TAKES_FOOD) == WINS
            if moving:
                heading = ti.cast(c.ground[base + ahead] >> 4, ti.i32) - ENTER
                ahead += c.compass[heading + 1]
    return not has_ant(c, base + ahead)


@ti.func
def entering(c: ti.template(), base, cell):
    """The cell of the ant that wins the cell of another one, -1 if nobody does."""
    found = -1
    for heading in ti.static(range(N_HEADINGS)):
        other = cell + c.compass[heading + 1]
        mark = c.ground[base + other] >> 4
        if mark == wanting(0, heading) and c.crowd[base + other] & WINS != 0:
            found = other
    return found


@ti.func
def gives_way(c: ti.template(), v: ti.template(), base, cell):
    """Whether the ant on a cell gives way to one with food that wins its cell.

    Where ants follow, one that moves is never asked: then the other one moves as well.
    """
    crowd = c.crowd[base + cell]
    stays = crowd & (HAS_FOOD | TAKES_FOOD) == 0
    if ti.static(not v.traffic.follow):
        if stays and crowd & WINS != 0:
            heading = ti.cast(c.ground[base + cell] >> 4, ti.i32) - ENTER
            stays = has_ant(c, base + cell + c.compass[heading + 1])
    return stays


@ti.func
def step_ahead(c: ti.template(), ant):
    """The index step to the cell before an ant."""
    return step_towards(c.compass, c.ants[AntRow.HEADING, ant], FORWARD)


@ti.func
def event_of(c: ti.template(), v: ti.template(), base, ant, clock):
    """The event of a move that succeeds; a cell with an ant is a lure if it is the better one."""
    action, percept = c.ants[AntRow.ACTION, ant], c.ants[AntRow.PERCEPT, ant]
    here = base + c.ants[AntRow.CELL, ant]
    ahead = here + step_ahead(c, ant)
    event = move_event(code_in_view(percept, action))
    if has_ant(c, ahead):
        better = level_of(c, v, ahead, clock) > level_of(c, v, here, clock)
        if c.ants[AntRow.CARRIES, ant] == 1:
            better = ti.cast(c.closer[here], ti.i32) >> c.ants[AntRow.HEADING, ant] & 1 == 1
        event = ti.select(better, ENTERED_LURE, ENTERED_EMPTY)
    return event


@ti.func
def settle(c: ti.template(), v: ti.template(), w, chunk, ant, tick):
    """Find out where the ant is after the tick, and what comes of its move.

    It moves on an empty way; or, with food, it changes places with the ant in its way; or it gives
    way to an ant with food that wins its cell; or it stays.
    """
    base, clock = w * c.size, tick * c.evaporates
    cell, wanted = c.ants[AntRow.CELL, ant], c.ants[AntRow.WANT, ant]
    carries, moves = c.ants[AntRow.CARRIES, ant], c.ants[AntRow.ACTION, ant] <= RIGHT
    enters, follower = False, entering(c, base, cell)
    event, goes, filled = FAILED, cell, 0
    if moves and wanted >= 0:
        enters = way_is_free(c, v, base, cell, wanted)
        if ti.static(v.traffic.follow):
            filled = ti.cast(enters and follower >= 0, ti.i32)
        if ti.static(v.traffic.swap):
            if not enters and carries == 1 and gives_way(c, v, base, wanted):
                enters, filled = True, 1
        if enters:
            goes, event = wanted, event_of(c, v, base, ant, clock)
    if ti.static(v.traffic.swap):
        if not enters and follower >= 0:
            if c.crowd[base + follower] & HAS_FOOD != 0 and gives_way(c, v, base, cell):
                goes, filled, event = follower, PUSHES, ENTERED_EMPTY
                if ti.static(v.traffic.grant):
                    if moves and cell + step_ahead(c, ant) == follower:
                        enters, filled = True, 1
                        event = event_of(c, v, base, ant, clock)
    c.ants[AntRow.GOES, ant], c.ants[AntRow.FILLED, ant] = goes, filled
    c.ants[AntRow.EVENT, ant] = event
    tally(c, TallyRow.BLOCKED, chunk, ti.cast(moves and not enters, ti.i32))


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
    if ti.static(v.traffic.shared):
        destination, event = c.ants[AntRow.GOES, ant], c.ants[AntRow.EVENT, ant]
        enters = destination != cell
        if c.ants[AntRow.FILLED, ant] == 0:
            c.ground[base + cell] = EMPTY
    else:
        c.ground[base + cell] = EMPTY
        tally(c, TallyRow.BLOCKED, chunk, ti.cast(moves and not enters, ti.i32))
    c.ground[base + destination] = ANT_GROUND
    c.ants[AntRow.CELL, ant] = destination
    tally(c, TallyRow.MOVES, chunk, ti.cast(moves, ti.i32))
    if c.ants[AntRow.CARRIES, ant] == 1:
        if enters:
            deposit(c, v, base + destination, clock, c.ants[AntRow.CARRIED, ant])
        elif action == GIVE and goals_in_view(percept) != 0:
            event = DELIVERED
            c.ants[AntRow.CARRIES, ant] = 0
            c.ants[AntRow.CARRIED, ant] = 0
            if c.turns_at_queen == 1:
                c.ants[AntRow.HEADING, ant] = turn_round(c.ants[AntRow.HEADING, ant])
            tally(c, TallyRow.DELIVERIES, chunk, 1)
    elif action == PICK_UP and wanted >= 0:
        event = PICKED_UP
        c.ants[AntRow.CARRIES, ant] = 1
        c.ground[base + wanted] = EMPTY
        take_from_home(c, base + wanted, tick)
        deposit(c, v, base + wanted, clock, 0)
        deposit(c, v, base + cell, clock, 0)
        c.ants[AntRow.HEADING, ant] = turn_round(c.ants[AntRow.HEADING, ant])
    if ti.static(v.sees_ants):
        c.ground[base + destination] = ground_under(c.ants[AntRow.CARRIES, ant])
    c.ants[AntRow.CARRIED, ant] += c.ants[AntRow.CARRIES, ant]
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
