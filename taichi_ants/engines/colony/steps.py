"""What each ant of a colony does in a tick, phase by phase; see `rules` for what it means.

The conflict rule: a cell to enter must be empty at the start of the tick. Of several ants that want
one cell (to enter it, or to take the food in it) the one with the smallest key wins, a hash of the
cell it stands on and the tick. So neither ant numbers nor threads matter, and nothing is atomic:
each ant writes what it wants into its own cell, and looks at the six cells around what it wants.
"""

import taichi as ti
from taichi.math import popcnt

from taichi_ants.engines.colony.arrays import (
    ACTION,
    AGE,
    CARRIES,
    CELL,
    DYING,
    EVENT,
    HEADING,
    HOME_TAKEN,
    LIFE,
    LIVING,
    STATE,
    T_BLOCKED,
    T_DIED,
    T_GIVES,
    T_MOVES,
    WANT,
)
from taichi_ants.engines.colony.trail import deposit, level_in_view
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task.constants import (
    DELIVERED,
    EMPTY,
    FAILED,
    FOOD,
    FORWARD,
    GIVE,
    LEFT,
    OBSTACLE,
    PICK_UP,
    PICKED_UP,
    RIGHT,
)
from taichi_ants.task.rules.actions import (
    is_open,
    move_event,
    step_towards,
    turn_round,
    turned_by,
)
from taichi_ants.task.rules.policy import bit_number, lowest_bit_number
from taichi_ants.task.rules.random_bits import advance, below, bits_of, high_word
from taichi_ants.task.rules.vision import (
    code_in_view,
    goals_in_view,
    see_carrying,
    see_foraging,
    state_index,
)

_ENTER, _TAKE = 1, 9  # what an ant wants, plus the heading towards it


@ti.func
def observe(c: ti.template(), k: ti.template(), dense: ti.template(), base, ant, clock):
    """The state that an ant sees; the cells of its world begin at `base`."""
    heading = c.ants[HEADING, ant]
    here = base + c.ants[CELL, ant]
    left = here + step_towards(c.compass, heading, LEFT)
    forward = here + step_towards(c.compass, heading, FORWARD)
    right = here + step_towards(c.compass, heading, RIGHT)
    ground_left = ti.cast(c.ground[left] & 15, ti.i32)
    ground_forward = ti.cast(c.ground[forward] & 15, ti.i32)
    ground_right = ti.cast(c.ground[right] & 15, ti.i32)
    state = 0
    if c.ants[CARRIES, ant] == 1:
        # Six bits, one for each heading, written twice so that the turns need no wrap.
        nearer = ti.cast(c.closer[here], ti.i32)
        nearer = (nearer | nearer << N_HEADINGS) >> heading
        state = state_index(
            1,
            see_carrying(ground_left, nearer >> (N_HEADINGS - 1) & 1),
            see_carrying(ground_forward, nearer & 1),
            see_carrying(ground_right, nearer >> 1 & 1),
        )
    else:
        trail_left = level_in_view(c, k, dense, left, clock)
        trail_forward = level_in_view(c, k, dense, forward, clock)
        trail_right = level_in_view(c, k, dense, right, clock)
        strongest = ti.max(trail_left, ti.max(trail_forward, trail_right))
        state = state_index(
            0,
            see_foraging(ground_left, trail_left, strongest),
            see_foraging(ground_forward, trail_forward, strongest),
            see_foraging(ground_right, trail_right, strongest),
        )
    return state


@ti.func
def want(c: ti.template(), base, ant, action):
    """Turn, and write down what the action needs: a cell to enter, or a food to take.

    Hardly a branch: what the next ant does cannot be predicted from what this one did.
    """
    state, cell = c.ants[STATE, ant], c.ants[CELL, ant]
    heading = turned_by(c.compass, c.ants[HEADING, ant], action)
    enters = is_open(code_in_view(state, ti.min(action, RIGHT))) and action <= RIGHT
    wanted = ti.select(enters, cell + step_towards(c.compass, heading, FORWARD), -1)
    mark = ti.select(enters, _ENTER + heading, 0)
    if action == PICK_UP and c.ants[CARRIES, ant] == 0:
        foods = goals_in_view(state)
        if foods != 0:
            position = lowest_bit_number(foods)
            if foods & (foods - 1) != 0:  # several foods in view
                c.streams[ant] = advance(c.streams[ant])
                word = high_word(bits_of(c.streams[ant]))
                position = bit_number(foods, below(word, popcnt(foods)))
            wanted = cell + step_towards(c.compass, heading, position)
            mark = _TAKE + (heading + position + N_HEADINGS - 1) % N_HEADINGS
    c.ants[HEADING, ant] = heading
    c.ants[ACTION, ant] = action
    c.ants[WANT, ant] = wanted
    c.ground[base + cell] = ti.cast(OBSTACLE | mark << 4, ti.u8)


@ti.func
def conflict_key(cell, tick):
    """The smallest key wins."""
    inner = bits_of(advance(ti.cast(cell, ti.u64)))
    return bits_of(advance(inner ^ ti.cast(tick, ti.u64)))


@ti.func
def resolve(c: ti.template(), base, ant, tick):
    """Give up what another ant wins."""
    wanted = c.ants[WANT, ant]
    if wanted >= 0:
        kind = ti.cast(c.ground[base + c.ants[CELL, ant]] >> 4, ti.i32) & 8  # 8 to take, else 0
        rivals = -1  # the ant itself is found too
        for heading in ti.static(range(N_HEADINGS)):
            mark = c.ground[base + wanted + c.compass[heading + 1]] >> 4
            rivals += ti.cast(mark == wanting(kind, heading), ti.i32)
        if rivals > 0 and not wins(c, base, c.ants[CELL, ant], wanted, kind, tick):
            c.ants[WANT, ant] = -1


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
def commit(c: ti.template(), k: ti.template(), dense: ti.template(), base, ant, chunk, tick):
    """Do what was won: move, take, give, deposit; the event."""
    clock = tick * k.evaporates
    action, cell, wanted = c.ants[ACTION, ant], c.ants[CELL, ant], c.ants[WANT, ant]
    moves = action <= RIGHT
    enters = moves and wanted >= 0
    destination = ti.select(enters, wanted, cell)
    code = code_in_view(c.ants[STATE, ant], ti.min(action, RIGHT))
    event = ti.select(enters, move_event(code), FAILED)
    c.ground[base + cell] = EMPTY
    c.ground[base + destination] = OBSTACLE  # and nothing wanted any more
    c.ants[CELL, ant] = destination
    c.tallies[T_MOVES, chunk] += ti.cast(moves, ti.i32)
    c.tallies[T_BLOCKED, chunk] += ti.cast(moves and not enters, ti.i32)
    if c.ants[CARRIES, ant] == 1:
        if enters:
            deposit(c, k, dense, base + destination, clock)
        elif action == GIVE and goals_in_view(c.ants[STATE, ant]) != 0:
            event = DELIVERED
            c.ants[CARRIES, ant] = 0
            c.tallies[T_GIVES, chunk] += 1
    elif action == PICK_UP and wanted >= 0:
        event = PICKED_UP
        c.ground[base + wanted] = EMPTY
        take_from_home(c, k, base, wanted, tick)
        deposit(c, k, dense, base + wanted, clock)
        deposit(c, k, dense, base + cell, clock)
        c.ants[HEADING, ant] = turn_round(c.ants[HEADING, ant])
        c.ants[CARRIES, ant] = 1
    c.ants[EVENT, ant] = event
    return event


@ti.func
def take_from_home(c: ti.template(), k: ti.template(), base, cell, tick):
    """If the food of a place lay there, the place waits from now on."""
    if k.homes > 0:
        home = c.home_of[base + cell]
        if home >= 0:
            c.homes[HOME_TAKEN, home] = tick
            c.home_of[base + cell] = -1


@ti.func
def grow_old(c: ti.template(), k: ti.template(), base, ant, chunk):
    """Age by one tick; at the end of its life an ant leaves its cell, and its food there."""
    if c.ants[LIFE, ant] == LIVING:
        c.ants[AGE, ant] += 1
        if c.ants[AGE, ant] >= k.lifespan:
            c.ants[LIFE, ant] = DYING
            c.tallies[T_DIED, chunk] += 1
            left_behind = EMPTY
            if c.ants[CARRIES, ant] == 1:
                left_behind = FOOD
            c.ground[base + c.ants[CELL, ant]] = ti.cast(left_behind, ti.u8)
