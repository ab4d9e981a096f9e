"""What each ant of a colony does in a tick, phase by phase; see `rules` for what it means.

The conflict rule: a cell to enter must be empty at the start of the tick. Of several ants that want
one cell (to enter it, or to take the food in it) the one with the smallest key wins, a hash of the
cell it stands on and the tick. So neither ant numbers nor threads matter, and nothing is atomic:
each ant writes what it wants into `wants` at its own cell, and looks at the six cells around what
it wants. `wants` stays as it is while ants act, and each ant takes its own mark away when it looks
around at the end of the tick.

Where cells with ants can be entered, see `Traffic`, the winners are marked in a phase of their own
before all act: each ant finds its own way out of what all have written.
"""

import taichi as ti
from taichi.math import popcnt

from taichi_ants.engines.colony.layout import (
    ANT_GROUND,
    ENTER,
    HAS_FOOD,
    MARK,
    PUSHES,
    STANDS,
    TAKE,
    TAKES_FOOD,
    TALLY_WIDTH,
    WINS,
    HomeRow,
    Tally,
)
from taichi_ants.engines.colony.trail import (
    deposit,
    level_in_view,
    level_of,
    level_that_counts,
)
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
    step_around,
    step_towards,
    turn_round,
    turned_by,
)
from taichi_ants.task.rules.policy import bit_number, choose_in_crowd, lowest_bit_number
from taichi_ants.task.rules.random_bits import advance, bits_of, draw_below
from taichi_ants.task.rules.vision import (
    code_in_view,
    goals_in_view,
    nearer_from,
    percept_carrying,
    percept_foraging,
)


@ti.func
def trait(column: ti.template(), ant):
    """One of the small numbers of an ant, as i32."""
    return ti.cast(column[ant], ti.i32)


@ti.func
def put(column: ti.template(), ant, value):
    """Write down one of the small numbers of an ant."""
    column[ant] = ti.cast(value, ti.i8)


@ti.func
def row_seen(c: ti.template(), v: ti.template(), ant):
    """The row of its table that an ant looks at."""
    row = trait(c.percept, ant)
    if ti.static(not v.sees_percept):
        row = c.state[ant]
    return row


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
    heading, here = trait(c.heading, ant), w * c.size + c.cell[ant]
    left = here + step_towards(c.compass, heading, LEFT)
    forward = here + step_towards(c.compass, heading, FORWARD)
    right = here + step_towards(c.compass, heading, RIGHT)
    ground_left, ground_forward = looks_of(c.ground[left]), looks_of(c.ground[forward])
    ground_right = looks_of(c.ground[right])
    percept = 0
    if trait(c.carries, ant) == 1:
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
    heading, here = trait(c.heading, ant), w * c.size + c.cell[ant]
    nearer = nearer_from(c.closer[here], heading)
    look = v.look_type(carries=trait(c.carries, ant), own_level=level_of(c, v, here, clock))
    cells = ti.static(v.observation.cells)
    for k in ti.static(range(len(cells))):
        place = here + step_around(c.compass, heading, cells[k])
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
def draw_action(c: ti.template(), v: ti.template(), w, ant, row, random_state):
    """The ant's choice at a row of its table, by a random stream that was advanced for it."""
    table = table_of(c, v, ant if ti.static(v.own_tables) else w)
    values, bits = values_of(c.q, table, row), bits_of(random_state)
    return choose_in_crowd(c.compass, values, bits, c.explore_below)


@ti.func
def want(c: ti.template(), v: ti.template(), w, chunk, ant, tick):
    """Turn, and write down what the action needs: a cell to enter, or a food to take.

    Hardly a branch: what the next ant does cannot be predicted from what this one did.
    """
    action, percept = trait(c.action, ant), trait(c.percept, ant)
    cell, carries = c.cell[ant], trait(c.carries, ant)
    random_state = c.streams[ant]
    if action < 0:
        random_state = advance(random_state)
        action = draw_action(c, v, w, ant, row_seen(c, v, ant), random_state)
    heading = turned_by(c.compass, trait(c.heading, ant), action)
    ahead = cell + step_towards(c.compass, heading, FORWARD)
    enters = is_open(code_in_view(percept, ti.min(action, RIGHT)))
    if ti.static(v.traffic.shared):
        enters = enters | (c.ground[w * c.size + ahead] >> 4 != 0)
    enters = enters & (action <= RIGHT)
    wanted = ti.select(enters, ahead, cell)
    mark = ti.select(enters, ENTER + heading, v.idle)
    foods = goals_in_view(percept)
    if foods != 0 and action == PICK_UP and carries == 0:
        position = lowest_bit_number(foods)
        if foods & (foods - 1) != 0:  # several foods in view
            k, random_state = draw_below(random_state, popcnt(foods))
            position = bit_number(foods, k)
        wanted = cell + step_towards(c.compass, heading, position)
        mark = TAKE + (heading + position + N_HEADINGS - 1) % N_HEADINGS
    c.streams[ant] = random_state
    put(c.heading, ant, heading)
    put(c.action, ant, action)
    c.want[ant] = wanted
    if ti.static(v.traffic.shared):
        mark |= ti.select(carries == 1, HAS_FOOD, 0) | ti.select(mark >= TAKE, TAKES_FOOD, 0)
    c.wants[w * c.size + cell] = ti.cast(mark, ti.u8)


@ti.func
def prevails(c: ti.template(), v: ti.template(), base, cell, wanted, tick):
    """Whether the ant on a cell gets what it wants; one that wants nothing wants its own cell."""
    kind = ti.cast(c.wants[base + cell], ti.i32) & 8  # 8 to take, else 0
    rivals = -1  # the ant itself is found too
    for heading in ti.static(range(N_HEADINGS)):
        other = ti.cast(c.wants[base + wanted + c.compass[heading + 1]], ti.i32) & MARK
        rivals += ti.cast(other == wanting(kind, heading), ti.i32)
    won = wanted != cell
    if rivals > 0:
        won = won and wins(c, v, base, cell, wanted, kind, tick)
    return won


@ti.func
def resolve(c: ti.template(), v: ti.template(), w, chunk, ant, tick):
    """Where cells with ants can be entered: mark the winners, and note what a move would be.

    A move is judged before any ant lays a trail.
    """
    base, cell, wanted = w * c.size, c.cell[ant], c.want[ant]
    won = prevails(c, v, base, cell, wanted, tick)
    c.wants[base + cell] = c.wants[base + cell] | ti.cast(ti.select(won, WINS, 0), ti.u8)
    c.want[ant] = ti.select(won, wanted, cell)
    put(c.event, ant, event_of(c, v, base, ant, tick * c.evaporates))


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
        mark = ti.cast(c.wants[base + other], ti.i32) & MARK
        if mark == wanting(kind, heading) and other != cell:
            after = conflict_key(other, tick) > own
            if ti.static(v.traffic.carriers_first):
                loaded = c.wants[base + cell] & HAS_FOOD
                other_loaded = c.wants[base + other] & HAS_FOOD
                after = loaded > other_loaded or (loaded == other_loaded and after)
            won = won and after
    return won


@ti.func
def conflict_key(cell, tick):
    """The smallest key wins."""
    inner = bits_of(advance(ti.cast(cell, ti.u64)))
    return bits_of(advance(inner ^ ti.cast(tick, ti.u64)))


@ti.func
def had_ant(c: ti.template(), place):
    """Whether an ant stood on a cell at the start of the tick; there all have a mark."""
    return c.wants[place] != 0


@ti.func
def heading_wanted(c: ti.template(), place):
    """The heading at which the ant on a cell wants to enter the next one."""
    return (ti.cast(c.wants[place], ti.i32) & MARK) - ENTER


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
            moving = had_ant(c, base + ahead) and ahead != cell
            moving = moving and c.wants[base + ahead] & (WINS | TAKES_FOOD) == WINS
            if moving:
                ahead += c.compass[heading_wanted(c, base + ahead) + 1]
    return not had_ant(c, base + ahead)


@ti.func
def entering(c: ti.template(), base, cell):
    """The cell of the ant that wins the cell of another one, -1 if nobody does."""
    found = -1
    for heading in ti.static(range(N_HEADINGS)):
        other = cell + c.compass[heading + 1]
        mark = ti.cast(c.wants[base + other], ti.i32) & (MARK | WINS)
        found = ti.select(mark == wanting(WINS, heading), other, found)
    return found


@ti.func
def gives_way(c: ti.template(), v: ti.template(), base, cell):
    """Whether the ant on a cell gives way to one with food that wins its cell.

    Where ants follow, one that moves is never asked: then the other one moves as well.
    """
    mark = c.wants[base + cell]
    stays = mark & (HAS_FOOD | TAKES_FOOD) == 0
    if ti.static(not v.traffic.follow):
        if stays and mark & WINS != 0:
            stays = had_ant(c, base + cell + c.compass[heading_wanted(c, base + cell) + 1])
    return stays


@ti.func
def step_ahead(c: ti.template(), ant):
    """The index step to the cell before an ant."""
    return step_towards(c.compass, trait(c.heading, ant), FORWARD)


@ti.func
def event_of(c: ti.template(), v: ti.template(), base, ant, clock):
    """The event of a move that succeeds; a cell with an ant is a lure if it is the better one."""
    action, percept = trait(c.action, ant), trait(c.percept, ant)
    event = move_event(code_in_view(percept, ti.min(action, RIGHT)))
    here = base + c.cell[ant]
    ahead = here + step_ahead(c, ant)
    if had_ant(c, ahead):  # seldom, so that few trails are read
        rises = level_of(c, v, ahead, clock) > level_of(c, v, here, clock)
        nearer = ti.cast(c.closer[here], ti.i32) >> trait(c.heading, ant) & 1 == 1
        better = ti.select(trait(c.carries, ant) == 1, nearer, rises)
        event = ti.select(better, ENTERED_LURE, ENTERED_EMPTY)
    return event


@ti.func
def settle(c: ti.template(), v: ti.template(), base, ant, cell, wanted, carries, moves):
    """Where the ant is after the tick, whether another one enters its cell, and its event.

    It moves on an empty way; or, with food, it changes places with the ant in its way; or it gives
    way to an ant with food that wins its cell; or it stays.
    """
    # Conditions one inside the other: Taichi works out both sides of an `and`.
    enters, event, goes, filled = False, FAILED, cell, 0
    if moves & (wanted != cell):
        enters = way_is_free(c, v, base, cell, wanted)
        if ti.static(v.traffic.follow):
            filled = ti.cast(enters and entering(c, base, cell) >= 0, ti.i32)
        if ti.static(v.traffic.swap):
            if not enters:
                if carries == 1:
                    if gives_way(c, v, base, wanted):
                        enters, filled = True, 1
        if enters:
            goes, event = wanted, trait(c.event, ant)
    if ti.static(v.traffic.swap):
        if not enters:
            follower = entering(c, base, cell)
            if follower >= 0:
                if c.wants[base + follower] & HAS_FOOD != 0 and gives_way(c, v, base, cell):
                    goes, filled, event = follower, PUSHES, ENTERED_EMPTY
                    if ti.static(v.traffic.grant):
                        if moves & (cell + step_ahead(c, ant) == follower):
                            enters, filled = True, 1
                            event = trait(c.event, ant)
    return goes, filled, event, enters


@ti.func
def act(c: ti.template(), v: ti.template(), w, chunk, ant, tick):
    """Do what is won: move, take, give, deposit."""
    base, clock = w * c.size, tick * c.evaporates
    action, percept = trait(c.action, ant), trait(c.percept, ant)
    cell, wanted = c.cell[ant], c.want[ant]
    carries, heading = trait(c.carries, ant), trait(c.heading, ant)
    moves = action <= RIGHT
    goes, filled, event, enters = cell, 0, FAILED, False
    takes = False
    if ti.static(v.traffic.shared):
        goes, filled, event, enters = settle(c, v, base, ant, cell, wanted, carries, moves)
        takes = not moves and wanted != cell
        put(c.filled, ant, filled)
    else:
        won = prevails(c, v, base, cell, wanted, tick)
        enters, takes = won & moves, won & (not moves)
        goes = ti.select(enters, wanted, cell)
        event = ti.select(enters, move_event(code_in_view(percept, ti.min(action, RIGHT))), FAILED)
    if filled == 0:
        c.ground[base + cell] = EMPTY
    c.want[ant] = cell  # where its mark is
    if carries == 1:
        carried = c.carried[ant]
        if goes != cell:
            deposit(c, v, base + goes, clock, carried)
        elif action == GIVE and goals_in_view(percept) != 0:
            event, carries, carried = DELIVERED, 0, -1
            put(c.carries, ant, 0)
            if c.turns_at_queen == 1:
                put(c.heading, ant, turn_round(heading))
            tally(c, Tally.DELIVERIES, chunk, 1)
        c.carried[ant] = carried + 1
    elif takes:
        event, carries = PICKED_UP, 1
        put(c.carries, ant, 1)
        c.carried[ant] = 1
        c.ground[base + wanted] = EMPTY
        take_from_home(c, base + wanted, tick)
        deposit(c, v, base + wanted, clock, 0)
        deposit(c, v, base + cell, clock, 0)
        put(c.heading, ant, turn_round(heading))
    c.ground[base + goes] = ground_under(carries) if ti.static(v.sees_ants) else ANT_GROUND
    c.cell[ant] = goes
    put(c.event, ant, event)
    tally(c, Tally.MOVES, chunk, ti.cast(moves, ti.i32))
    tally(c, Tally.BLOCKED, chunk, ti.cast(moves & (not enters), ti.i32))
    tally(c, Tally.RETURNS, chunk, c.rewards[event])


@ti.func
def tally(c: ti.template(), row, chunk, n):
    """Count in a chunk, whose ants one thread moves; `+=` would be atomic, which takes longer."""
    c.tallies[chunk * TALLY_WIDTH + row] = c.tallies[chunk * TALLY_WIDTH + row] + n


@ti.func
def take_from_home(c: ti.template(), place, tick):
    """If the food of a home lay there, the home waits from now on."""
    if c.n_homes > 0:
        home = c.home_of[place]
        if home >= 0:
            c.homes[HomeRow.TAKEN, home] = tick
            c.home_of[place] = -1
