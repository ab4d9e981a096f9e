"""Where the five actions lead: steps, turns, and the event of a move."""

import taichi as ti

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task.constants import LEFT, RIGHT
from taichi_ants.task.events import Event

# A compass is an i32 array of 294: the index steps to the left, forward and right cell of heading h
# at h, h + 1 and h + 2; the heading after each of the five actions, by action and heading (picking
# up turns round only if it succeeds, so that it stands there as no turn); then the number of the
# k-th set bit of each mask of five bits, by mask and k, in rows of eight.
_TURNS_AT, _BITS_AT = 8, 38


@ti.func
def step_towards(compass: ti.template(), heading, position):
    """The index step to the cell in view at position 0 (left), 1 (forward) or 2 (right)."""
    return compass[heading + position]


@ti.func
def step_around(compass: ti.template(), heading, turns: ti.template()):
    """The index step to the cell at so many turns (from -3 to 3) clockwise from a heading."""
    towards = heading
    if ti.static(abs(turns) > 1):
        towards += ti.static(turns % N_HEADINGS)
        towards -= N_HEADINGS * ti.cast(towards >= N_HEADINGS, ti.i32)
    return compass[towards + 1 + ti.static(turns if abs(turns) <= 1 else 0)]


@ti.func
def turn(compass: ti.template(), heading, move):
    """The heading after a move (LEFT, FORWARD or RIGHT).

    A branch with a look-up, not arithmetic: then the processor goes on with the predicted action,
    which a learned policy repeats, instead of waiting for the comparison of the action values.
    """
    turned = heading
    if move == LEFT:
        turned = turned_by(compass, heading, LEFT)
    elif move == RIGHT:
        turned = turned_by(compass, heading, RIGHT)
    return turned


@ti.func
def turned_by(compass: ti.template(), heading, action):
    """The same by look-up alone, for any action: for crowds, whose actions nobody can predict."""
    return compass[_TURNS_AT + N_HEADINGS * action + heading]


@ti.func
def turn_round(heading):
    """The opposite heading."""
    return ti.select(heading < 3, heading + 3, heading - 3)


@ti.func
def is_open(code):
    """Whether a cell that looks like this can be entered: E, T and S can."""
    return code & 1 == 0


@ti.func
def move_event(code):
    """The event of a move to a cell that looks like this."""
    return ti.select(is_open(code), code + Event.ENTERED_EMPTY, Event.BLOCKED)


@ti.func
def bit_number_in(compass: ti.template(), mask, k):
    """The number of the k-th set bit (from 0, ascending) of a mask of five bits, by look-up."""
    return compass[_BITS_AT + 8 * mask + k]
