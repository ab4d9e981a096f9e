"""Who gets a cell, or the food in it, that several ants want in one tick.

A cell to enter must be empty at the start of the tick, unless the task's `Traffic` lets ants in. Of
several ants that want one cell (to enter it, or to take the food in it) the one with the smallest
key wins, a hash of the cell it stands on and the tick. So neither ant numbers nor threads matter,
and nothing is atomic: each ant writes a mark, what it wants, into `wants` at its own cell, and
reads the marks of the six cells around what it wants.

`c` has the arrays `wants` and `compass`, see `rules.actions`; `base` is where the cells of a world
begin in `wants`; other cells are numbers within the world.
"""

import taichi as ti

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task.events import Event
from taichi_ants.task.rules.actions import turn_round
from taichi_ants.task.rules.random_bits import advance, bits_of

# The mark of an ant (u8): nothing (0), to enter the cell at a heading, or to take the food there.
# Where cells with ants can be entered, an ant that wants nothing has STANDS for its mark, so that
# every ant has one.
ENTER, TAKE, STANDS = 1, 9, 7  # the first two plus the heading
MARK = 15
# Above the mark is what else the others need to know of the ant.
HAS_FOOD, TAKES_FOOD, WINS = 16, 32, 64


@ti.func
def conflict_key(cell, tick):
    """The smallest key wins."""
    inner = bits_of(advance(ti.cast(cell, ti.u64)))
    return bits_of(advance(inner ^ ti.cast(tick, ti.u64)))


@ti.func
def wanting(kind, heading):
    """The mark of an ant at `heading` from a cell that wants that cell: it looks back."""
    return kind | 1 + turn_round(heading)


@ti.func
def prevails(c: ti.template(), traffic: ti.template(), base, cell, wanted, tick):
    """Whether the ant on a cell gets what it wants; one that wants nothing wants its own cell."""
    kind = ti.cast(c.wants[base + cell], ti.i32) & 8  # 8 to take, else 0
    rivals = -1  # the ant itself is found too
    for heading in ti.static(range(N_HEADINGS)):
        other = ti.cast(c.wants[base + wanted + c.compass[heading + 1]], ti.i32) & MARK
        rivals += ti.cast(other == wanting(kind, heading), ti.i32)
    won = wanted != cell
    if rivals > 0:
        won = won and wins(c, traffic, base, cell, wanted, kind, tick)
    return won


@ti.func
def wins(c: ti.template(), traffic: ti.template(), base, cell, wanted, kind, tick):
    """Whether no other ant that wants the same comes before the one on `cell`."""
    own, won = conflict_key(cell, tick), True
    for heading in range(N_HEADINGS):
        other = wanted + c.compass[heading + 1]
        mark = ti.cast(c.wants[base + other], ti.i32) & MARK
        if mark == wanting(kind, heading) and other != cell:
            after = conflict_key(other, tick) > own
            if ti.static(traffic.carriers_first):
                loaded = c.wants[base + cell] & HAS_FOOD
                other_loaded = c.wants[base + other] & HAS_FOOD
                after = loaded > other_loaded or (loaded == other_loaded and after)
            won = won and after
    return won


@ti.func
def had_ant(c: ti.template(), place):
    """Whether an ant stood on a cell at the start of the tick; there all have a mark."""
    return c.wants[place] != 0


@ti.func
def heading_wanted(c: ti.template(), place):
    """The heading at which the ant on a cell wants to enter the next one."""
    return (ti.cast(c.wants[place], ti.i32) & MARK) - ENTER


@ti.func
def way_is_free(c: ti.template(), traffic: ti.template(), base, cell, wanted):
    """Whether the winner on `cell` enters a cell that is empty, or whose ant moves on as it does.

    Winners of cells with ants form queues; one moves if its head enters an empty cell; a ring
    stays.
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
    """The cell of the ant that wins the cell of another one, -1 if nobody does."""
    found = -1
    for heading in ti.static(range(N_HEADINGS)):
        other = cell + c.compass[heading + 1]
        mark = ti.cast(c.wants[base + other], ti.i32) & (MARK | WINS)
        found = ti.select(mark == wanting(WINS, heading), other, found)
    return found


@ti.func
def gives_way(c: ti.template(), traffic: ti.template(), base, cell):
    """Whether the ant on a cell gives way to one with food that wins its cell.

    Where ants follow, one that moves is never asked: then the other one moves as well.
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
    """Return the cell of an ant after the tick, whether it is filled again, and the event.

    It moves on an empty way; or, with food, it changes places with the ant in its way; or it gives
    way to an ant with food that wins its cell; or it stays. `wanted` is the cell that it wins, else
    its own; `ahead` the one that it faces. If its action `moves` and succeeds, the event is
    `entered`.

    Returns:
        Its cell; whether another ant enters the cell that it leaves; its event; whether it enters
        the cell that it wanted.
    """
    # Conditions one inside the other: Taichi works out both sides of an `and`.
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
        if not enters:
            follower = entering(c, base, cell)
            if follower >= 0:
                if c.wants[base + follower] & HAS_FOOD != 0 and gives_way(c, traffic, base, cell):
                    goes, filled, event = follower, True, Event.PUSHED
                    if ti.static(traffic.grant):
                        if moves & (ahead == follower):
                            enters, event = True, entered
    return goes, filled, event, enters
