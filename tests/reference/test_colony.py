"""The colony: when its episodes end, for the colony and for those who learn."""

import pytest
from colonies import act, begun, load, training

from taichi_ants.reference import ReferenceColony
from taichi_ants.task import Task
from taichi_ants.task.constants import GIVE, Event
from taichi_ants.worlds import World


@pytest.mark.parametrize(
    ("delivery", "ends_at_delivery", "terminated", "truncated"),
    [
        ("terminates", True, True, False),
        ("truncates", True, False, True),
        ("terminates", False, True, False),  # of the colony's ant; its episode goes on
        ("truncates", False, False, False),
    ],
)
def test_what_a_delivery_ends(delivery, ends_at_delivery, terminated, truncated):
    ready = World((5, 5, 5), (1, 0, 0), ants=[((0, 0, 0), 0)])
    colony = begun(ready, delivery=delivery, ends_at_delivery=ends_at_delivery)
    load(colony, 0)
    act(colony, GIVE)
    [step] = colony.transitions
    assert (step.event, step.terminated) == (Event.DELIVERED, terminated)
    assert step.truncated == truncated
    assert colony.over == ends_at_delivery


@pytest.mark.parametrize(("sharing", "level"), [("independent", 10), ("shared", 10), ("frozen", 9)])
def test_by_default_trails_fall_only_where_nobody_learns(sharing, level):
    world = World((5, 5, 5), (0, 0, 4), trails=[((1, 0, 0), 10)], ants=[((0, 0, 0), 0)])
    colony = ReferenceColony(world, None, training(), 0, sharing=sharing)
    colony.begin_episode()
    act(colony, GIVE)
    assert colony.world.trail.level((1, 0, 0)) == level
    task = Task(evaporation_in_training=True, evaporation_in_evaluation=False)
    colony = ReferenceColony(world, task, training(), 0, sharing=sharing)
    colony.begin_episode()
    act(colony, GIVE)
    assert colony.world.trail.level((1, 0, 0)) == 19 - level
