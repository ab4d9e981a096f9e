"""Train an ant to fetch food by PPO of Stable-Baselines3.

The task rewards only a pick-up (3) and a delivery (10). Requires Stable-Baselines3: `pip install
"stable-baselines3>=2.4"`. Prints for each seed how many of 100 rollouts deliver food, first with
sampled actions, then with greedy actions. A seed takes about 40 seconds.
"""

import argparse

import gymnasium
import numpy as np
import torch
from sb3_vec_env import SB3VecEnv
from stable_baselines3 import PPO

import taichi_ants
from taichi_ants import task, worlds

N_ENVS, ROLLOUTS = 64, 100


def environments(n: int) -> SB3VecEnv:
    how = {"task": "fetching", "observation_format": "one_hot", "autoreset_mode": "SameStep"}
    return SB3VecEnv(gymnasium.make_vec("taichi_ants/HexForage-v0", num_envs=n, **how))


def train(seed: int, steps: int) -> PPO:
    model = PPO(
        "MlpPolicy",
        environments(N_ENVS),
        gamma=0.99,
        # The settings below are faster than SB3's defaults.
        learning_rate=1e-3,
        n_steps=32,
        batch_size=512,
        ent_coef=0.1,
        seed=seed,
        device="cpu",
    )
    return model.learn(steps)


def deliveries(model: PPO, seed: int) -> int:
    """Return how many of the first episodes of new environments end with a delivery."""
    envs = environments(ROLLOUTS)
    envs.seed(seed)
    seen, over, delivered = envs.reset(), np.zeros(ROLLOUTS, bool), 0
    while not over.all():
        actions, _ = model.predict(seen, deterministic=False)
        seen, _, ends, infos = envs.step(actions)
        for number in np.flatnonzero(ends & ~over):
            delivered += infos[number]["deliveries"]
        over |= ends
    return delivered


def tabulated(model: PPO) -> np.ndarray:
    """Return the greedy policy as a table."""
    return taichi_ants.tabulate(lambda seen: model.predict(seen, deterministic=True)[0])


if __name__ == "__main__":
    formatter = argparse.ArgumentDefaultsHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=formatter)
    add = parser.add_argument
    add("--seeds", type=int, nargs="+", default=range(5), metavar="N", help="train these seeds")
    add("--steps", type=int, default=400_000, metavar="N", help="take N steps per seed")
    add("--out", default="sb3_ppo.npz", metavar="FILE", help="save the policy of the last seed")
    args = parser.parse_args()
    torch.set_num_threads(1)  # the networks are small
    for seed in args.seeds:
        model = train(seed, args.steps)
        table = tabulated(model)
        how = {"rollouts": ROLLOUTS, "task": task.fetching()}
        greedy = taichi_ants.evaluate(worlds.paper(), table, **how)
        print(
            f"seed {seed}: {deliveries(model, 10_000 + seed)} of {ROLLOUTS} rollouts deliver; "
            f"greedily {greedy.deliveries.sum()}, "
            f"with {greedy.returns.mean():.1f} in {greedy.steps.mean():.1f} steps",
            flush=True,
        )
    made_by = {"made by": "PPO of Stable-Baselines3", "seed": seed}
    made_by["task"] = task.fetching().as_dict()
    taichi_ants.save_policy(args.out, table, made_by)
