"""Giving food to the queen: when it can be done, and what it ends.

It is paid as any event, by `Rewards.by_event`. Whether it ends an episode, and how, is the task's
`delivery`.
"""

import taichi as ti

from taichi_ants.task.constants import GIVE
from taichi_ants.task.events import Event
from taichi_ants.task.rules.actions import turn_round
from taichi_ants.task.rules.vision import goals_in_view


@ti.func
def can_give(action, percept):
    """Whether an ant with food gives it: it wants to, and sees the queen."""
    return (action == GIVE) & (goals_in_view(percept) != 0)


@ti.func
def heading_after_delivery(heading, turns_at_queen):
    """The heading of an ant that has given its food."""
    return ti.select(turns_at_queen == 1, turn_round(heading), heading)


@ti.func
def terminates(event, delivery_terminates):
    """1 if the episode terminates, so that an update does not bootstrap, else 0."""
    return ti.cast(event == Event.DELIVERED, ti.i32) & delivery_terminates


@ti.func
def step_end(event, delivery_terminates, delivery_truncates, is_last):
    """Whether a step terminates the episode, and whether it truncates it: 1 or 0 each.

    `is_last` is 1 in the last step of an episode of limited length.
    """
    delivered = ti.cast(event == Event.DELIVERED, ti.i32)
    terminated = delivered & delivery_terminates
    return terminated, (is_last | delivered & delivery_truncates) & (1 - terminated)
