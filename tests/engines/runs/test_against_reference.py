"""The engine of independent runs equals the plain reference: every step, every bit."""

from __future__ import annotations

import numpy as np
import pytest
from random_rewards import TELLING, random_rewards
from random_worlds import random_world

from taichi_ants import TrainingConfig, evaluate, reference, rollout, trace_training, train
from taichi_ants.task import Rewards, Task
from taichi_ants.worlds import World, paper

LEARNERS = [("q_learning", 0), ("sarsa", 0), ("expected_sarsa", 0), ("dyna_q", 3)]
DELIVERIES = ["absorbing", "continuing"]


def planning(steps: int) -> dict[str, int]:
    return {"planning_steps": steps} if steps else {}


def random_config(seed: int, learner: str, planning_steps: int) -> TrainingConfig:
    """A configuration with values far from each other and from round ones."""
    rng = np.random.default_rng([seed, 1])
    return TrainingConfig(
        learner=learner,
        learning_rate=float(rng.choice([0.001, 0.01, 0.37, 1.0])),
        discount=float(rng.choice([0.0, 0.9, 0.99, 1.0])),
        epsilon=float(rng.choice([0.0, 0.05, 0.3, 1.0])),
        epsilon_decay=float(rng.choice([0.3, 0.99, 1.0])),
        min_epsilon=float(rng.choice([0.0, 0.01, 0.2])),
        hyperparameters=planning(planning_steps),
    )


def assert_equal_steps(world, config, seed, episodes, max_steps, task):
    """Compare each step of a training run: what happened, the TD error, the whole Q-table."""
    ours = trace_training(world, config, seed, episodes, max_steps, task)
    plain = reference.train(
        world, config, seed, episodes, max_steps, task, trace=True, trace_tables=True
    )
    assert len(ours) == len(plain.trace) > 0
    for k, step in enumerate(plain.trace):
        assert (ours.episodes[k], ours.steps[k]) == (step.episode, step.step)
        assert (tuple(ours.cells[k]), ours.headings[k]) == (step.cell, step.heading)
        assert (ours.states[k], ours.actions[k]) == (step.state, step.action)
        assert (ours.rewards[k], ours.next_states[k]) == (step.reward, step.next_state)
        assert (ours.terminated[k], ours.delivered[k]) == (step.terminated, step.delivered)
        assert ours.td_errors[k] == step.td_error
        assert np.array_equal(ours.tables[k], step.q_values)
    return plain


@pytest.mark.parametrize("evaporation", [False, True])
@pytest.mark.parametrize("delivery", DELIVERIES)
@pytest.mark.parametrize(("learner", "planning_steps"), LEARNERS)
def test_every_step_in_the_papers_world(learner, planning_steps, delivery, evaporation):
    """Long enough to deliver, so that the end of an episode and the next one are compared too."""
    config = TrainingConfig(learner, 0.01, 0.99, 0.3, 0.9, 0.01, planning(planning_steps))
    task = Task(delivery=delivery, evaporation_in_training=evaporation)
    plain = assert_equal_steps(paper(), config, 3, 12, 120, task)
    assert sum(plain.deliveries) >= 3
    assert min(plain.steps) < 120


@pytest.mark.parametrize("delivery", DELIVERIES)
@pytest.mark.parametrize(("learner", "planning_steps"), LEARNERS)
def test_every_step_in_random_worlds(learner, planning_steps, delivery):
    """Several foods, rocks, trails of all strengths; deliveries and choices among foods occur."""
    delivered = 0
    for seed in range(60):
        config = random_config(seed, learner, planning_steps)
        world = random_world(seed)
        task = Task(
            rewards=random_rewards(seed),
            delivery=delivery,
            evaporation_in_training=seed % 2 == 0,
        )
        plain = assert_equal_steps(world, config, seed - 7, 4, 25, task)
        delivered += sum(plain.deliveries)
    assert delivered > 20


@pytest.mark.parametrize("delivery", DELIVERIES)
@pytest.mark.parametrize("table", [Rewards(), *TELLING])
def test_whole_trainings_of_a_mixed_sweep(table, delivery):
    """The kernel that trains equals the reference too, and runs do not disturb each other."""
    task = Task(rewards=table, delivery=delivery)
    configs = [random_config(seed, *LEARNERS[seed % 4]) for seed in range(8)]
    for world in (paper(), random_world(12), random_world(13, 8)):
        result = train(
            world, configs, seeds=(5, -1, 2**63 + 5), episodes=9, max_steps=70, task=task
        )
        for c, config in enumerate(configs):
            for s, seed in enumerate(result.seeds):
                plain = reference.train(world, config, seed, 9, 70, task)
                assert result.returns[c, s].tolist() == plain.returns
                assert result.steps[c, s].tolist() == plain.steps
                assert result.deliveries[c, s].tolist() == plain.deliveries
                assert np.array_equal(result.q_values[c, s], plain.q_values)
                assert result.state.random_states[c, s] == plain.rng_state
                assert result.state.exploration[c, s, 0] == plain.epsilon
                assert result.state.settings[c, s, 2] == len(plain.model)


@pytest.mark.parametrize("evaporation", [False, True])
def test_rollouts(evaporation):
    """Every step of rollouts, with ties, and the outcomes of `evaluate`."""
    rng = np.random.default_rng(0)
    task = Task(evaporation_in_evaluation=evaporation)
    for seed in range(40):
        world = random_world(seed + 1000) if seed else paper()
        table = rng.integers(0, 3, (128, 5)).astype(np.float32)
        outcome = evaluate(world, table, 4, seed, 40, task, epsilon=0.1)
        for number in range(4):
            plain = reference.rollout(world, table, seed, number, 40, task, 0.1)
            ours = rollout(world, table, seed, number, 40, task, 0.1)
            assert outcome.returns[number] == plain.episode_return == ours.rewards.sum()
            assert outcome.steps[number] == plain.steps == len(ours)
            assert outcome.deliveries[number] == plain.deliveries == ours.delivered.sum()
            for k, step in enumerate(plain.trace):
                assert (tuple(ours.cells[k]), ours.headings[k]) == (step.cell, step.heading)
                assert (ours.states[k], ours.actions[k]) == (step.state, step.action)
                assert (ours.rewards[k], ours.next_states[k]) == (step.reward, step.next_state)
                assert np.array_equal(ours.q_values[k], table[step.state])


def test_starts_of_ants():
    """Where ants start, listed or placed by the seed."""
    for seed in range(200):
        world = random_world(seed + 500)
        cells, headings = world.start(seed)
        [(cell, heading)] = reference.start(world, seed)
        assert tuple(world.grid.cells(cells[0])) == cell
        assert headings[0] == heading


def test_worlds_of_one_row():
    """The narrowest worlds: every side cell lies outside."""
    world = World((6, 1, 1), queen=(0, 0, 0), foods=[(5, 0, 0)], ants=[((1, 0, 0), 0)])
    config = TrainingConfig("q_learning", 0.1, 0.9, 0.5, 1.0)
    plain = assert_equal_steps(world, config, 0, 10, 60, Task(evaporation_in_training=True))
    assert sum(plain.deliveries) > 0
