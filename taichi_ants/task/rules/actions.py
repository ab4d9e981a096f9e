"""The effects of actions: steps, turns, the event of a move, and deliveries of food to the queen.

The reward is that of the event, in `Rewards.by_event`. The task's `delivery` determines how a
delivery ends an episode.
"""

import taichi as ti

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task.constants import FORWARD, GIVE, LEFT, RIGHT, Event
from taichi_ants.task.rules.vision import goals_in_view

# A compass is an i32 array of 294 entries. First, at h, h + 1 and h + 2, are the index steps to the
# cells left, forward and right of heading h. Then follows the heading after each action, by action
# and heading; picking up counts as no turn, because it turns only if it succeeds. Last, in rows of
# eight, is the number of the k-th set bit of each mask of five bits, by mask and k.
_TURNS_AT, _BITS_AT = 8, 38

MOVES = 1 << LEFT | 1 << FORWARD | 1 << RIGHT  # a bit for each action that moves an ant


@ti.func
def step_towards(compass: ti.template(), heading, position):
    """Return the index step to the cell at position 0 (left), 1 (forward) or 2 (right)."""
    return compass[heading + position]


@ti.func
def step_around(compass: ti.template(), heading, turns: ti.template()):
    """Return the index step to the cell `turns` (from -3 to 3) clockwise from a heading."""
    towards = heading
    if ti.static(abs(turns) > 1):
        towards += ti.static(turns % N_HEADINGS)
        towards -= N_HEADINGS * ti.cast(towards >= N_HEADINGS, ti.i32)
    return compass[towards + 1 + ti.static(turns if abs(turns) <= 1 else 0)]


@ti.func
def turn(compass: ti.template(), heading, move):
    """Return the heading after a move, by branches for the reason in `policy.choose`."""
    turned = heading
    if move == LEFT:
        turned = turned_by(compass, heading, LEFT)
    elif move == RIGHT:
        turned = turned_by(compass, heading, RIGHT)
    return turned


@ti.func
def turned_by(compass: ti.template(), heading, action):
    """Return the heading after any action. A branch would be slow, because ants act differently."""
    return compass[_TURNS_AT + N_HEADINGS * action + heading]


@ti.func
def turn_round(heading):
    return ti.select(heading < 3, heading + 3, heading - 3)


@ti.func
def is_open(code):
    """Return whether an ant can enter a cell with this code: E, T or S."""
    return code & 1 == 0


@ti.func
def move_event(code):
    return ti.select(is_open(code), code + Event.ENTERED_EMPTY, Event.BLOCKED)


@ti.func
def bit_number_in(compass: ti.template(), mask, k):
    """Return the number of the k-th set bit (from 0, ascending) of a mask of five bits."""
    return compass[_BITS_AT + 8 * mask + k]


@ti.func
def can_give(action, paper_state):
    return (action == GIVE) & (goals_in_view(paper_state) != 0)


@ti.func
def heading_after_delivery(heading, turns_at_queen):
    return ti.select(turns_at_queen == 1, turn_round(heading), heading)


@ti.func
def terminates(event, delivery_terminates):
    """Return 1 if the episode terminates, so that the update does not bootstrap, else 0."""
    return ti.cast(event == Event.DELIVERED, ti.i32) & delivery_terminates


@ti.func
def step_end(event, delivery_terminates, delivery_truncates, is_last):
    """Return whether a step terminates the episode, and whether it truncates it: 1 or 0 each.

    `is_last` is 1 in the last step before the step limit.
    """
    delivered = ti.cast(event == Event.DELIVERED, ti.i32)
    terminated = delivered & delivery_terminates
    return terminated, (is_last | delivered & delivery_truncates) & (1 - terminated)
