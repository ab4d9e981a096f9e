"""What an ant sees in the three cells in front of it: the percept, as an index from 0 to 127."""

import taichi as ti

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task.constants import EMPTY, SEES_LURE


@ti.func
def see_foraging(half: ti.template(), ground, level, strongest):
    """The code of a cell for an ant without food; `ground` is what the cell holds.

    An empty cell is a trail if its `level` (else 0 or less) is at least 1 and, if `half`, at least
    half of the `strongest` in view that counts, else as much.
    """
    lure = 0
    if ti.static(half):
        lure = ti.cast(2 * level >= ti.max(strongest, 2), ti.i32)
    else:
        lure = ti.cast(level >= ti.max(strongest, 1), ti.i32)
    return ground & 3 | lure * SEES_LURE  # what is empty looks 0


@ti.func
def see_carrying(ground, nearer):
    """The code of a cell for an ant with food; `nearer` is 1 if the cell is nearer to the queen."""
    return ground >> 2 | (ti.cast(ground == EMPTY, ti.i32) & nearer) * SEES_LURE


@ti.func
def percept_foraging(
    half: ti.template(), left, forward, right, trail_left, trail_forward, trail_right, strongest
):
    """The percept of an ant without food, from what the three cells hold and their levels."""
    return state_index(
        0,
        see_foraging(half, left, trail_left, strongest),
        see_foraging(half, forward, trail_forward, strongest),
        see_foraging(half, right, trail_right, strongest),
    )


@ti.func
def percept_carrying(left, forward, right, nearer):
    """The percept of an ant with food, from what the three cells hold; `nearer` is as below."""
    return state_index(
        1,
        see_carrying(left, nearer >> (N_HEADINGS - 1) & 1),
        see_carrying(forward, nearer & 1),
        see_carrying(right, nearer >> 1 & 1),
    )


@ti.func
def nearer_from(closer, heading):
    """A bit for each cell around, the first the one forward, clockwise: is it nearer the queen?

    `closer` has a bit for each heading, the first that of heading 0.
    """
    # Six bits, written twice so that the turns need no wrap.
    nearer = ti.cast(closer, ti.i32)
    return (nearer | nearer << N_HEADINGS) >> heading


@ti.func
def state_index(carries, left, forward, right):
    """The index of a state, 0 to 127."""
    return ((carries << 2 | left) << 2 | forward) << 2 | right


@ti.func
def code_in_view(state, position):
    """What is seen at position 0 (left), 1 (forward) or 2 (right) in a state."""
    return (state >> (4 - 2 * position)) & 3


@ti.func
def goals_in_view(state):
    """A bit for each cell in view that is food or queen: 0 left, 1 forward, 2 right."""
    both = state & (state >> 1)  # bits 4, 2 and 0 are set where a code is 3
    return (both >> 4) & 1 | (both >> 1) & 2 | (both & 1) << 2
