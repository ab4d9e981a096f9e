"""One neural policy for all ants of a colony, beside the table that they can share; needs torch.

Every ant is an environment of its own for the trainer of `ppo.py`, which knows nothing of colonies;
but they live in one world, see each other, and follow each other's trails. Ants under the same
rules learn a shared table by SARSA, as in `python experiments/colony.py study`, from as many steps
in all. Then nobody learns any more, and all policies are tried as tables, in colonies of their own.

Prints foods delivered per 1000 ticks by 64 ants, of each seed. A seed takes about ten minutes.
"""

import argparse
from dataclasses import replace

import numpy as np
import torch
from ppo import table, train

from taichi_ants import Colony, Life, TrainingConfig, save_policy, task, worlds
from taichi_ants.envs.colony_vector import HexColonyVectorEnv
from taichi_ants.studies.colony_study import scheduled

ANTS, TICKS, WORLDS, EPISODES = 64, 1000, 4, 60
FORAGING = replace(task.foraging(), life=Life(regrowth=0))  # food grows back at once
TRIAL_SEEDS = range(10_000, 10_004)


def neural(seed: int, episodes: int) -> np.ndarray:
    """The table of a network that 64 ants in each of four worlds have trained together."""
    envs = HexColonyVectorEnv(
        num_envs=WORLDS * ANTS,
        task=FORAGING,
        ants=ANTS,
        max_steps=TICKS,
        observation_format="one_hot",
    )
    agent = train(envs, seed, episodes * TICKS * ANTS, n_steps=64)
    return table(agent, FORAGING.observation)


def tabular(seed: int, episodes: int) -> np.ndarray:
    """The table that 64 ants in one world have learned together."""
    training = scheduled(TrainingConfig("sarsa", 0.1, 0.9, 0.3, 1.0), episodes)
    colony = Colony(worlds.paper(), FORAGING, training, seed, ANTS, sharing="shared")
    colony.run(episodes, TICKS)
    return colony.q_values[0]


def deliveries(q_values: np.ndarray) -> float:
    """Foods per 1000 ticks of colonies that follow a table, but for one action in a hundred."""
    follow = TrainingConfig("sarsa", 0.1, 0.9, epsilon=0.01, epsilon_decay=1.0)
    options = {"ants": ANTS, "sharing": "fixed", "q_values": q_values}
    colony = Colony(worlds.paper(), FORAGING, follow, TRIAL_SEEDS, **options)
    return float(colony.run(4, TICKS).deliveries.mean()) * 1000 / TICKS


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=range(3))
    parser.add_argument("--episodes", type=int, default=EPISODES, help="of 1000 ticks")
    parser.add_argument(
        "--out", default="shared_policy.npz", help="the policy file of the last network"
    )
    args = parser.parse_args()
    torch.set_num_threads(1)  # the networks are small
    for seed in args.seeds:
        network = neural(seed, args.episodes)
        learned = tabular(seed, args.episodes)
        print(
            f"seed {seed}: network {deliveries(network):.0f}, table {deliveries(learned):.0f}",
            flush=True,
        )
    made_by = {"made by": "PPO", "seed": seed, "task": FORAGING.as_dict()}
    save_policy(args.out, network, made_by, FORAGING.observation)
