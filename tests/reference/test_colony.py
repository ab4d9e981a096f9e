"""The colony: when its episodes end, for the colony and for those who learn."""

from __future__ import annotations

import pytest
from colonies import act, begun, load, training
from plain_runs import train
from random_worlds import random_world

from taichi_ants import TrainingConfig
from taichi_ants.reference import LEARNERS, ReferenceColony
from taichi_ants.task import Life, Task
from taichi_ants.task.constants import FORWARD, GIVE
from taichi_ants.task.events import Event
from taichi_ants.worlds import World

# Food ahead, the queen behind, as in the training of one ant: 2 ticks at best.
TWO_STEPS = World((3, 3, 3), (0, 0, 1), foods=[(1, 1, 0)], ants=[((0, 0, 0), 1)])
SHARING = [name for name in LEARNERS if LEARNERS[name].shares]


@pytest.mark.parametrize("delivery", ["terminates", "truncates"])
@pytest.mark.parametrize("learner", SHARING)
def test_one_ant_learns_into_a_shared_table_what_it_learns_into_its_own(learner, delivery):
    learning = TrainingConfig(learner, 0.37, 0.9, 0.6, 0.9, 0.05)
    n_deliveries = 0
    for seed in range(12):
        world, task = random_world(seed), Task(delivery=delivery)
        alone = train(world, learning, seed, 3, 40, task)
        colony = ReferenceColony(world, task, learning, seed, ends_at_delivery=True)
        assert colony.run(3, 40) == alone.trace
        assert colony.learners.tables[0].rows == alone.learner.rows
        assert list(colony.learners.tables[0].model.items()) == list(alone.model.items())
        n_deliveries += sum(alone.deliveries)
    assert n_deliveries >= 3


def test_run_stops_at_the_delivery_and_decays_epsilon():
    learning = TrainingConfig("sarsa", 0.1, 0.9, 0.8, 0.5, 0.3)
    colony = ReferenceColony(TWO_STEPS, None, learning, 7, ends_at_delivery=True)
    colony.run(3, 100)
    assert len(colony.records) == 3
    assert colony.epsilon == 0.3
    for record in colony.records:
        assert record.deliveries == (record.ticks < 100)
        assert record.first_delivery == (record.ticks if record.deliveries else -1)
    assert min(record.ticks for record in colony.records) < 100


def test_a_delivery_does_not_end_the_episode_of_a_colony():
    learning = TrainingConfig("sarsa", 0.1, 0.9, 0.3, 1.0)
    colony = ReferenceColony(TWO_STEPS, Task(life=Life(regrowth=0)), learning, 7)
    trace = colony.run(1, 2000)
    [record] = colony.records
    assert record.ticks == len(trace) == 2000
    assert record.deliveries > 1
    gives = [step.step for step in trace if step.event is Event.DELIVERED]
    assert len(gives) == record.deliveries
    assert gives[0] == record.first_delivery - 1


def test_after_the_end_there_is_no_tick():
    learning = TrainingConfig("q_learning", 0.1, 0.9, 1.0, 1.0)
    colony = ReferenceColony(TWO_STEPS, None, learning, 7, ends_at_delivery=True)
    with pytest.raises(AssertionError, match="no episode"):
        colony.tick()
    colony.run(1, 10_000)
    assert colony.over
    with pytest.raises(AssertionError, match="no episode"):
        colony.tick()


def test_the_last_tick_of_a_run_truncates_for_all():
    world = World((5, 5, 5), (0, 0, 4), ants=[((0, 0, 0), 0), ((2, 0, 0), 3)])
    colony = ReferenceColony(world, None, training(), 0, ants=2)
    ticks = [[step.truncated for step in steps] for steps in colony.run_episode(3)]
    assert ticks == [[False, False], [False, False], [True, True]]


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


@pytest.mark.parametrize("learner", ["sarsa_lambda", "n_step_sarsa"])
def test_what_a_learner_remembers_of_an_episode_ends_with_it(learner):
    # Two steps of the first episode wait, or leave traces. The first step of the second one, from
    # an untouched state, moves its own value alone, or none yet.
    world = World((5, 5, 5), (0, 0, 4), obstacles=[(1, 0, 0)], ants=[((0, 0, 0), 0)])
    colony = begun(world, training(learner), sharing="independent")
    act(colony, GIVE)
    act(colony, FORWARD)
    before = colony.q_values[0]
    colony.begin_episode()
    act(colony, 3)
    changed = colony.q_values[0] != before
    assert changed.sum() == (learner == "sarsa_lambda")
    assert changed[:, 3].sum() == changed.sum()
