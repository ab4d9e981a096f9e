"""Conflicts of ants that want the same cell, or the food in it, in one tick.

An ant can enter a cell that is empty at the start of the tick, or occupied if the task's `Traffic`
allows it. If several ants want to enter a cell, or to take the food in it, the ant with the
smallest key wins; with `carriers_first`, ants with food win over others. The key is a hash of its
own cell and the tick, so results do not depend on ant numbers or threads. No operation is atomic:
each ant writes its intention as a mark into `wants` at its own cell, and reads the marks of the six
cells around the cell that it wants.

`c` has the arrays `wants` and `compass` (see `rules.actions`). `base` is the offset of a world in
`wants`; all other cells are indices within the world.
"""

import taichi as ti

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task.events import Event
from taichi_ants.task.rules.actions import turn_round
from taichi_ants.task.rules.policy import lowest_bit_number
from taichi_ants.task.rules.random_bits import advance, bits_of

# The mark of an ant (u8): 0 for nothing, ENTER or TAKE plus a heading. If ants can enter cells with
# ants, an ant that wants nothing has the mark STANDS, so that every ant has one.
ENTER, TAKE, STANDS = 1, 9, 7
MARK = 15
# The bits above the mark are further facts about the ant.
HAS_FOOD, TAKES_FOOD, WINS = 16, 32, 64


@ti.func
def conflict_key(cell, tick):
    """Return the key of the ant on a cell; the smallest key wins."""
    inner = bits_of(advance(ti.cast(cell, ti.u64)))
    return bits_of(advance(inner ^ ti.cast(tick, ti.u64)))


@ti.func
def wanting(kind, heading):
    """Return the mark of an ant that wants a cell; seen from this cell, the ant is at `heading`."""
    return kind | 1 + turn_round(heading)


@ti.func
def prevails(c: ti.template(), traffic: ti.template(), base, cell, wanted, tick):
    """Return whether the ant on `cell` wins the cell `wanted`; False if that is its own cell."""
    kind = ti.cast(c.wants[base + cell], ti.i32) & 8  # 8 to take, else 0
    wanting_it = 0  # a bit for each heading; the ant itself is one of them
    for heading in ti.static(range(N_HEADINGS)):
        other = ti.cast(c.wants[base + wanted + c.compass[heading + 1]], ti.i32) & MARK
        wanting_it |= ti.cast(other == wanting(kind, heading), ti.i32) << heading
    won = wanted != cell
    if won & (wanting_it & (wanting_it - 1) != 0):
        won = wins(c, traffic, base, cell, wanted, wanting_it, tick)
    return won


@ti.func
def wins(c: ti.template(), traffic: ti.template(), base, cell, wanted, wanting_it, tick):
    """Return whether the ant on `cell` precedes all others that want the same.

    `wanting_it` has a bit for the heading, seen from the cell `wanted`, of each of these ants.
    """
    own, won, rest = conflict_key(cell, tick), True, wanting_it
    while rest != 0:
        other = wanted + c.compass[lowest_bit_number(rest) + 1]
        rest &= rest - 1
        if other != cell:
            after = conflict_key(other, tick) > own
            if ti.static(traffic.carriers_first):
                loaded = c.wants[base + cell] & HAS_FOOD
                other_loaded = c.wants[base + other] & HAS_FOOD
                after = loaded > other_loaded or (loaded == other_loaded and after)
            won = won and after
    return won


@ti.func
def had_ant(c: ti.template(), place):
    """Return whether an ant was on a cell at the start of the tick, if all ants have a mark."""
    return c.wants[place] != 0


@ti.func
def heading_wanted(c: ti.template(), place):
    """Return the heading at which the ant on a cell wants to enter the next cell."""
    return (ti.cast(c.wants[place], ti.i32) & MARK) - ENTER


@ti.func
def way_is_free(c: ti.template(), traffic: ti.template(), base, cell, wanted):
    """Return whether the winner on `cell` can enter its cell, which is empty or becomes empty.

    Winners of cells with ants form queues. A queue moves if its first ant enters an empty cell; a
    ring does not move.
    """
    ahead = wanted
    if ti.static(traffic.follow):
        moving = True
        while moving:
            moving = had_ant(c, base + ahead) and ahead != cell
            moving = moving and c.wants[base + ahead] & (WINS | TAKES_FOOD) == WINS
            if moving:
                ahead += c.compass[heading_wanted(c, base + ahead) + 1]
    return not had_ant(c, base + ahead)


@ti.func
def entering(c: ti.template(), base, cell):
    """Return the cell of the ant that wins `cell`, or -1."""
    found = -1
    for heading in ti.static(range(N_HEADINGS)):
        other = cell + c.compass[heading + 1]
        mark = ti.cast(c.wants[base + other], ti.i32) & (MARK | WINS)
        found = ti.select(mark == wanting(WINS, heading), other, found)
    return found


@ti.func
def gives_way(c: ti.template(), traffic: ti.template(), base, cell):
    """Return whether the ant on a cell gives way to an ant with food that wins the cell.

    With `follow`, this is not called for ants that move, because the other ant then moves as well.
    """
    mark = c.wants[base + cell]
    stays = mark & (HAS_FOOD | TAKES_FOOD) == 0
    if ti.static(not traffic.follow):
        if stays and mark & WINS != 0:
            ahead = cell + c.compass[heading_wanted(c, base + cell) + 1]
            stays = had_ant(c, base + ahead)
    return stays


@ti.func
def settle(
    c: ti.template(), traffic: ti.template(), base, cell, wanted, ahead, carries, moves, entered
):
    """Return the result of a tick for an ant.

    It moves to a free cell; or, with food, changes places with the ant there; or gives way to an
    ant with food that wins its cell; or stays. `wanted` is the cell that it wins, else its own;
    `ahead` is the cell that it faces. The event of a successful move is `entered`.

    Returns:
        Its new cell; whether another ant enters the cell that it leaves; its event; whether it
        enters the cell that it wanted.
    """
    # Conditions are nested because Taichi evaluates both sides of an `and`.
    enters, goes, filled = False, cell, False
    event = ti.select(moves, Event.BLOCKED, Event.FAILED)
    if moves & (wanted != cell):
        enters = way_is_free(c, traffic, base, cell, wanted)
        if ti.static(traffic.follow):
            filled = enters and entering(c, base, cell) >= 0
        if ti.static(traffic.swap):
            if not enters:
                if carries == 1:
                    if gives_way(c, traffic, base, wanted):
                        enters, filled = True, True
        if enters:
            goes, event = wanted, entered
    if ti.static(traffic.swap):
        if not enters and gives_way(c, traffic, base, cell):
            follower = entering(c, base, cell)
            if follower >= 0:
                if c.wants[base + follower] & HAS_FOOD != 0:
                    goes, filled, event = follower, True, Event.PUSHED
                    if ti.static(traffic.grant):
                        if moves & (ahead == follower):
                            enters, event = True, entered
    return goes, filled, event, enters
