"""Environments whose actions slip and whose observations fail, compared with the reference."""

from __future__ import annotations

import numpy as np
import pytest
from random_choices import NOISE, random_noise
from random_worlds import random_world

from taichi_ants import TrainingConfig
from taichi_ants.envs.forage import HexForageEnv
from taichi_ants.reference import ReferenceColony
from taichi_ants.task import Task

TRAINING = TrainingConfig("q_learning", 0.1, 0.9, 0.0, 1.0)


@pytest.mark.parametrize("observation", ["paper", "trail_levels"])
def test_each_step_of_a_lone_ant(observation):
    """Two episodes each: the second one continues the random numbers of the first one."""
    slipped = 0
    for seed in range(12):
        rng = np.random.default_rng([seed, 3])
        world, noise = random_world(seed), random_noise(seed, NOISE)
        task = Task(observation, evaporation_in_training=True, noise=noise)
        env = HexForageEnv(world, task, max_steps=40, observation_format="index")
        table = np.zeros((task.n_states, 5), np.float32)
        plain = ReferenceColony(
            world, task, TRAINING, seed, ends_at_delivery=True, sharing="frozen", q_values=table
        )
        for episode in range(2):
            seen, info = env.reset(seed=seed if episode == 0 else None)
            plain.begin_episode()
            [ant] = plain.ants.values()
            assert seen == info["state"] == ant.state
            ended = False
            while not ended:
                ant.chosen = action = int(rng.integers(5))
                plain.tick()
                seen, reward, terminated, truncated, info = env.step(action)
                assert (seen, info["event"], reward) == (ant.state, ant.event, ant.reward)
                slipped += ant.executed != action
                ended = terminated or truncated
            plain.end_episode()
    assert slipped > 50
