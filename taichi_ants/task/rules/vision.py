"""What an ant sees in the three cells in front of it, and the index of its state."""

import taichi as ti

from taichi_ants.task.constants import EMPTY, SEES_LURE


@ti.func
def see_foraging(half: ti.template(), ground, level, strongest):
    """The code of a cell for an ant without food.

    `ground` is what the cell holds, `level` its trail if it is empty, else 0, and `strongest` the
    largest level in view that counts. An empty cell is a trail if its level is at least 1 and, if
    `half`, at least half of the strongest, else as much.
    """
    code = ground & 3
    if ti.static(half):
        if 2 * level >= ti.max(strongest, 2):
            code = SEES_LURE
    elif level >= ti.max(strongest, 1):
        code = SEES_LURE
    return code


@ti.func
def see_carrying(ground, nearer):
    """The code of a cell for an ant with food; `nearer` is 1 if the cell is nearer to the queen."""
    code = ground >> 2
    if ground == EMPTY and nearer == 1:
        code = SEES_LURE
    return code


@ti.func
def state_index(carries, left, forward, right):
    """The index of a state, 0 to 127."""
    return carries << 6 | left << 4 | forward << 2 | right


@ti.func
def code_in_view(state, position):
    """What is seen at position 0 (left), 1 (forward) or 2 (right) in a state."""
    return (state >> (4 - 2 * position)) & 3


@ti.func
def goals_in_view(state):
    """A bit for each cell in view that is food or queen: 0 left, 1 forward, 2 right."""
    both = state & (state >> 1)  # bits 4, 2 and 0 are set where a code is 3
    return (both >> 4) & 1 | (both >> 1) & 2 | (both & 1) << 2
