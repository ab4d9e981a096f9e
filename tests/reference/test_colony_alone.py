"""A colony of one ant, whose episodes end at the delivery, is an ant that trains alone."""

from __future__ import annotations

import numpy as np
import pytest
from random_worlds import random_world
from taichi_ants.task.colony import ColonyConfig, Pheromone

from taichi_ants import TrainingConfig
from taichi_ants.reference import ReferenceColony, train
from taichi_ants.worlds import World, paper

LEARNERS = [("q_learning", 0), ("sarsa", 0), ("expected_sarsa", 0), ("dyna_q", 3)]


def assert_same_run(world, learning, seed, episodes, ticks, evaporation, sharing="shared"):
    """Compare each step to the bit; returns the run."""
    plain = train(
        world, learning, seed, episodes, ticks, evaporation, trace=True, trace_tables=True
    )
    pheromone = Pheromone(evaporation="linear" if evaporation else "none")
    config = ColonyConfig(pheromone=pheromone, ends_at_delivery=True)
    colony = ReferenceColony(world, config, learning, seed, sharing)
    for episode in range(episodes):
        colony.begin_episode()
        steps = [step for step in plain.trace if step.episode == episode]
        for step in steps:
            ant = colony.ants[0]
            assert (ant.cell, ant.heading, ant.state) == (step.cell, step.heading, step.state)
            colony.tick()
            [transition] = colony.transitions
            assert transition.pair == (step.state, step.action)
            assert transition.outcome == (step.reward, step.next_state, step.terminated)
            assert colony.td_errors == [step.td_error]
            assert (ant.cell, ant.heading) == (step.next_cell, step.next_heading)
            assert ant.stream.state == step.rng_state
            tables = colony.snapshot().q_values.reshape(128, 5)
            np.testing.assert_array_equal(tables, step.q_values)
        assert colony.over == (plain.deliveries[episode] == 1)
        record = colony.end_episode()
        assert record.episode_return == plain.returns[episode]
        assert record.ticks == plain.steps[episode]
        assert record.deliveries == plain.deliveries[episode]
        assert record.first_delivery == (record.ticks if record.deliveries else -1)
    assert list(colony.minds.tables[0].model.items()) == list(plain.model.items())
    assert colony.epsilon == plain.epsilon
    return plain


@pytest.mark.parametrize("sharing", ["shared", "own"])
@pytest.mark.parametrize("delivery", ["absorbing", "continuing"])
@pytest.mark.parametrize(("learner", "planning_steps"), LEARNERS)
def test_in_the_papers_world(learner, planning_steps, delivery, sharing):
    learning = TrainingConfig(learner, 0.01, 0.99, 0.3, 0.9, 0.01, planning_steps, delivery)
    plain = assert_same_run(paper(), learning, 3, 6, 120, True, sharing)
    assert sum(plain.deliveries) >= 1
    assert max(plain.steps) == 120


@pytest.mark.parametrize("delivery", ["absorbing", "continuing"])
@pytest.mark.parametrize(("learner", "planning_steps"), LEARNERS)
def test_in_small_worlds(learner, planning_steps, delivery):
    n_deliveries = 0
    for seed in range(12):
        learning = TrainingConfig(learner, 0.37, 0.9, 0.6, 0.9, 0.05, planning_steps, delivery)
        world, evaporation = random_world(seed), seed % 2 == 0
        n_deliveries += sum(assert_same_run(world, learning, seed, 3, 40, evaporation).deliveries)
    assert n_deliveries >= 3


def test_run_stops_at_the_delivery_and_decays_epsilon():
    # Food ahead, the queen behind, as in the training of one ant: 2 ticks at best.
    world = World((3, 3, 3), (0, 0, 1), foods=[(1, 1, 0)], ants=[((0, 0, 0), 1)])
    learning = TrainingConfig("sarsa", 0.1, 0.9, 0.8, 0.5, 0.3)
    colony = ReferenceColony(world, ColonyConfig(ends_at_delivery=True), learning, 7)
    colony.run(2, 100)
    records = colony.run(1, 100)
    plain = train(world, learning, 7, 3, 100, evaporation=True)
    assert [record.ticks for record in colony.records] == plain.steps
    assert len(records) == 1
    assert records[0] is colony.records[2]
    assert colony.epsilon == plain.epsilon == 0.3
    assert min(plain.steps) < 100


def test_a_delivery_does_not_end_the_episode_of_a_colony():
    world = World((3, 3, 3), (0, 0, 1), foods=[(1, 1, 0)], ants=[((0, 0, 0), 1)])
    learning = TrainingConfig("sarsa", 0.1, 0.9, 0.3, 1.0)
    colony = ReferenceColony(world, ColonyConfig(regrowth=0), learning, 7)
    [record] = colony.run(1, 2000)
    assert record.ticks == 2000
    assert record.deliveries > 1
    assert record.deliveries_per_tick[record.first_delivery - 1] == 1
    assert sum(record.deliveries_per_tick[: record.first_delivery]) == 1
    assert sum(record.deliveries_per_tick) == record.deliveries
    assert record.living_per_tick == [1] * 2000


def test_after_the_end_there_is_no_tick():
    world = World((3, 3, 3), (0, 0, 1), foods=[(1, 1, 0)], ants=[((0, 0, 0), 1)])
    learning = TrainingConfig("q_learning", 0.1, 0.9, 1.0, 1.0)
    colony = ReferenceColony(world, ColonyConfig(ends_at_delivery=True), learning, 7)
    with pytest.raises(AssertionError, match="no episode"):
        colony.tick()
    colony.run(1, 10_000)
    assert colony.over
    with pytest.raises(AssertionError, match="no episode"):
        colony.tick()
