"""Train one network for all ants of a colony by PPO, and compare it with a shared table.

The trainer of `ppo.py` treats each ant as a separate environment, although 64 ants share a world.
Other ants learn a shared table by SARSA under the same rules, from the same number of steps, as in
`python experiments/colony.py study`. Afterwards both policies are evaluated without learning.

Requires torch: `pip install -e ".[torch]"`. A seed takes about three minutes on one core. Prints
the food items that 64 ants deliver per 1000 ticks: by the network with sampled actions, by the
network with greedy actions, and by the shared table.
"""

import argparse
from dataclasses import replace

import gymnasium
import numpy as np
import torch
from gymnasium.vector import VectorEnv
from ppo import Agent, table, train

import taichi_ants.envs  # noqa: F401  # registers the environments
from taichi_ants import Colony, Life, TrainingConfig, save_policy, task, worlds

ANTS, TICKS, WORLDS, EPISODES = 64, 1000, 4, 60
FORAGING = replace(task.foraging(), life=Life(regrowth=0))  # food grows back at once
TEST_SEED = 10_000


def environments() -> VectorEnv:
    return gymnasium.make_vec(
        "taichi_ants/HexColony-v0",
        num_envs=WORLDS * ANTS,
        task=FORAGING,
        ants=ANTS,
        max_steps=TICKS,
        observation_format="one_hot",
    )


def neural(seed: int, episodes: int) -> Agent:
    """Return a network that 64 ants in each of four worlds have trained together."""
    steps = episodes * TICKS * ANTS
    return train(environments(), seed, steps, n_steps=64, entropy=0.03, discount=0.9)


def foods_by_chance(agent: Agent) -> float:
    """Return the deliveries of a colony per 1000 ticks with sampled actions, as in training."""
    envs, foods = environments(), 0
    seen, _ = envs.reset(seed=TEST_SEED)
    for _ in range(TICKS):
        with torch.no_grad():
            actions = agent.policy(seen).sample().numpy()
        seen, _, delivered, _, _ = envs.step(actions)
        foods += delivered.sum()
    return foods / WORLDS * 1000 / TICKS


def tabular(seed: int, episodes: int) -> np.ndarray:
    """Return a table that 64 ants in one world have learned together."""
    fading = 1 / max(1, round(0.7 * episodes))  # epsilon and the learning rate decrease in 70 %
    decays = (0.01 / 0.3) ** fading, 0.01, 0.1**fading, 0.01
    training = TrainingConfig("sarsa", 0.1, 0.9, 0.3, *decays, initial_q=10.0)
    colony = Colony(worlds.paper(), FORAGING, training, seed, ANTS, sharing="shared")
    colony.run(episodes, TICKS)
    return colony.q_values[0]


def foods(q_values: np.ndarray) -> float:
    """Return the deliveries of a colony per 1000 ticks by a table, with epsilon 0.01."""
    follow = TrainingConfig("sarsa", 0.1, 0.9, epsilon=0.01, epsilon_decay=1.0)
    seeds = range(TEST_SEED, TEST_SEED + WORLDS)
    colony = Colony(
        *(worlds.paper(), FORAGING, follow, seeds, ANTS), sharing="frozen", q_values=q_values
    )
    return float(colony.run(4, TICKS).deliveries.mean()) * 1000 / TICKS


if __name__ == "__main__":
    formatter = argparse.ArgumentDefaultsHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=formatter)
    add = parser.add_argument
    add("--seeds", type=int, nargs="+", default=range(3), metavar="N", help="train these seeds")
    add("--episodes", type=int, default=EPISODES, metavar="N", help="N episodes of 1000 ticks")
    add("--out", default="shared_policy.npz", metavar="FILE", help="save the last network")
    args = parser.parse_args()
    torch.set_num_threads(1)  # the networks are small
    for seed in args.seeds:
        agent = neural(seed, args.episodes)
        network, learned = table(agent, FORAGING.observation), tabular(seed, args.episodes)
        print(
            f"seed {seed}: network {foods_by_chance(agent):.0f}, greedily {foods(network):.0f}, "
            f"table {foods(learned):.0f}",
            flush=True,
        )
    made_by = {"made by": "PPO", "seed": seed, "task": FORAGING.as_dict()}
    save_policy(args.out, network, made_by, FORAGING.observation)
