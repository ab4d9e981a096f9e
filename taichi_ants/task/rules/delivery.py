"""Deliveries of food to the queen, and the ends of episodes.

The reward is that of the event, in `Rewards.by_event`. The task's `delivery` determines how a
delivery ends an episode.
"""

import taichi as ti

from taichi_ants.task.constants import GIVE
from taichi_ants.task.events import Event
from taichi_ants.task.rules.actions import turn_round
from taichi_ants.task.rules.vision import goals_in_view


@ti.func
def can_give(action, paper_state):
    """Return whether an ant with food delivers it: its action is GIVE, and it sees the queen."""
    return (action == GIVE) & (goals_in_view(paper_state) != 0)


@ti.func
def heading_after_delivery(heading, turns_at_queen):
    """Return the heading of an ant after a delivery."""
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
