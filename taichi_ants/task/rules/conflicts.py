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
from taichi.math import popcnt

from taichi_ants.arithmetic.random_bits import advance, bits_of
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task.constants import Event

# The mark of an ant (u8): 0 for nothing, ENTER or TAKE plus a heading. If ants can enter cells with
# ants, an ant that wants nothing has the mark STANDS, so that every ant has one.
ENTER, TAKE, STANDS = 1, 9, 7
MARK = 15
# The bits above the mark are further facts about the ant.
HAS_FOOD, TAKES_FOOD, WINS = 16, 32, 64

# Bytes of a u64, one for each heading: 1; and ENTER plus the opposite heading, which is in the mark
# of an ant at this heading of a cell that it wants.
_EACH = sum(1 << 8 * heading for heading in range(N_HEADINGS))
_WANTING = sum(ENTER + (heading + 3) % N_HEADINGS << 8 * heading for heading in range(N_HEADINGS))


@ti.func
def conflict_key(cell, tick):
    """Return the key of the ant on a cell; the smallest key wins."""
    inner = bits_of(advance(ti.cast(cell, ti.u64)))
    return bits_of(advance(inner ^ ti.cast(tick, ti.u64)))


@ti.func
def wins_cell(c: ti.template(), traffic: ti.template(), base, cell, wanted, tick):
    """Return whether the ant on `cell` wins the cell `wanted`; False if that is its own cell."""
    kind = c.wants[base + cell] & 8  # 8 to take, else 0
    rivals = who_want(c, base, wanted, MARK, kind)  # the ant itself is one of them
    won = wanted != cell
    if won & (rivals & (rivals - ti.u64(1)) != 0):
        won = wins(c, traffic, base, cell, wanted, rivals, tick)
    return won


@ti.func
def who_want(c: ti.template(), base, cell, bits: ti.template(), mark):
    """Return which ants around a cell want it, and have these `bits` of `mark` in their marks.

    Returns:
        A u64 with bit 7 of byte h set for the ant at heading h, seen from the cell.
    """
    # One byte after the other, because the compiler would move them into a vector and back.
    marks = ti.u64(0)
    for i in ti.static(range(N_HEADINGS)):
        index = base + cell + c.compass[N_HEADINGS - i]
        marks = marks << ti.u64(8) | ti.cast(c.wants[index], ti.u64)
    others = marks & ti.u64(bits * _EACH) ^ (
        ti.u64(_WANTING) | ti.cast(mark, ti.u64) * ti.u64(_EACH)
    )
    # Bytes are below 128, so that adding 127 sets bit 7 where a byte differs.
    return ~(others + ti.u64(127 * _EACH)) & ti.u64(128 * _EACH)


@ti.func
def first_heading(ants):
    """Return the lowest heading in a non-zero result of `who_want`."""
    return ti.cast(popcnt((ants & -ants) - ti.u64(1)), ti.i32) >> 3


@ti.func
def wins(c: ti.template(), traffic: ti.template(), base, cell, wanted, rivals, tick):
    """Return whether the ant on `cell` precedes all others that want the same, see `who_want`."""
    key, won, rivals_left = conflict_key(cell, tick), True, rivals
    while rivals_left != 0:
        other = wanted + c.compass[first_heading(rivals_left) + 1]
        rivals_left &= rivals_left - ti.u64(1)
        if other != cell:
            after = conflict_key(other, tick) > key
            if ti.static(traffic.carriers_first):
                loaded = c.wants[base + cell] & HAS_FOOD
                other_loaded = c.wants[base + other] & HAS_FOOD
                after = loaded > other_loaded or (loaded == other_loaded and after)
            won = won and after
    return won


@ti.func
def had_ant(c: ti.template(), index):
    """Return whether an ant was on a cell at the start of the tick, if all ants have a mark."""
    return c.wants[index] != 0


@ti.func
def heading_wanted(c: ti.template(), index):
    """Return the heading at which the ant on a cell wants to enter the next cell."""
    return (ti.cast(c.wants[index], ti.i32) & MARK) - ENTER


@ti.func
def heading_taken(c: ti.template(), index):
    """Return the heading at which the ant on a cell takes food, if it does; 0 to 5 in any case."""
    return ti.max((ti.cast(c.wants[index], ti.i32) & MARK) - TAKE, 0)


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
    origin, winner = -1, who_want(c, base, cell, MARK | WINS, WINS)
    if winner != 0:
        origin = cell + c.compass[first_heading(winner) + 1]
    return origin


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
def resolve_move(
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
    # Conditions are nested because Taichi evaluates both sides of an `and`. The first ones decide
    # most cases, so that the processor predicts the others.
    enters, goes, filled = False, cell, False
    event = ti.select(moves, Event.BLOCKED, Event.FAILED)
    if (wanted != cell) & moves:
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
            if gives_way(c, traffic, base, cell):
                follower = entering(c, base, cell)
                if follower >= 0:
                    if c.wants[base + follower] & HAS_FOOD != 0:
                        goes, filled, event = follower, True, Event.PUSHED
                        if ti.static(traffic.reward_pushed):
                            if moves & (ahead == follower):
                                enters, event = True, entered
    return goes, filled, event, enters
