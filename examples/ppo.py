"""Train an ant to fetch food by proximal policy optimisation (PPO), on many environments at once.

The task rewards only a pick-up (3) and a delivery (10). A network learns from one-hot observations.
After training, it is converted to a table, evaluated and saved as a policy file. Then
`taichi-ants render episode --policy ppo.npz --out ppo.gif` draws an animation of the ant.

Requires torch: `pip install -e ".[torch]"`. A seed takes about 30 seconds on one core. Prints the
mean reward per step five times, then how many greedy rollouts deliver, and their mean return and
steps; the best is 13 in 34 steps.
"""

import argparse

import gymnasium
import numpy as np
import torch
from gymnasium.vector import VectorEnv
from torch import nn
from torch.distributions import Categorical

import taichi_ants
import taichi_ants.envs  # registers the environments
from taichi_ants import task, worlds

N_ENVS, N_STEPS = 64, 32  # environments, and steps in each between two updates
EPOCHS, MINIBATCHES = 5, 4
LEARNING_RATE, DISCOUNT, GAE_LAMBDA = 1e-3, 0.99, 0.95
CLIP, ENTROPY, VALUE, LARGEST_GRADIENT = 0.2, 0.1, 0.5, 0.5


class Agent(nn.Module):
    """Two networks: the actor returns logits of the actions, the critic the value of a state."""

    def __init__(self, n_inputs: int, n_actions: int) -> None:
        super().__init__()
        # A small gain makes all actions about equally probable at first.
        self.actor = perceptron(n_inputs, n_actions, gain=0.01)
        self.critic = perceptron(n_inputs, 1, gain=1.0)

    def value(self, seen: np.ndarray | torch.Tensor) -> torch.Tensor:
        return self.critic(torch.as_tensor(seen)).squeeze(-1)

    def policy(self, seen: np.ndarray | torch.Tensor) -> Categorical:
        return Categorical(logits=self.actor(torch.as_tensor(seen)))


def perceptron(n_inputs: int, n_outputs: int, gain: float) -> nn.Module:
    layers = nn.Linear(n_inputs, 64), nn.Linear(64, 64), nn.Linear(64, n_outputs)
    for layer, its_gain in zip(layers, (2**0.5, 2**0.5, gain), strict=True):
        nn.init.orthogonal_(layer.weight, its_gain)
        nn.init.zeros_(layer.bias)
    return nn.Sequential(layers[0], nn.Tanh(), layers[1], nn.Tanh(), layers[2])


def train(
    envs: VectorEnv,
    seed: int,
    steps: int,
    n_steps: int = N_STEPS,
    entropy: float = ENTROPY,
    discount: float = DISCOUNT,
) -> Agent:
    """Return an agent, trained for `steps` steps in all environments together.

    It is updated after every `n_steps` steps in each environment. `entropy` is the weight of the
    entropy bonus; with a larger one, the agent explores longer.
    """
    torch.manual_seed(seed)
    n, n_inputs = envs.num_envs, envs.single_observation_space.shape[0]
    agent = Agent(n_inputs, envs.single_action_space.n)
    optimizer = torch.optim.Adam(agent.parameters(), lr=LEARNING_RATE, eps=1e-5)
    seen = torch.zeros(n_steps, n, n_inputs)
    actions = torch.zeros(n_steps, n, dtype=torch.int64)
    log_probs, rewards, values, ends = torch.zeros(4, n_steps, n)
    now, _ = envs.reset(seed=seed)
    updates = max(1, steps // (n_steps * n))
    for update in range(updates):
        paid_now = 0.0
        for t in range(n_steps):
            seen[t] = torch.as_tensor(now)
            with torch.no_grad():
                policy, values[t] = agent.policy(now), agent.value(now)
            actions[t] = policy.sample()
            log_probs[t] = policy.log_prob(actions[t])
            now, reward, terminated, truncated, infos = envs.step(actions[t].numpy())
            paid_now += reward.mean() / n_steps
            if truncated.any():  # bootstrap from the last observation of the episode
                with torch.no_grad():
                    after = agent.value(np.stack(infos["final_obs"][truncated])).numpy()
                reward[truncated] += discount * after
            rewards[t], ends[t] = torch.as_tensor(reward), torch.as_tensor(terminated | truncated)
        # Generalised advantage estimation.
        advantages, advantage = torch.zeros_like(rewards), torch.zeros(n)
        with torch.no_grad():
            following = agent.value(now)
        for t in reversed(range(n_steps)):
            goes_on = 1 - ends[t]
            error = rewards[t] + discount * following * goes_on - values[t]
            advantage = error + discount * GAE_LAMBDA * advantage * goes_on
            advantages[t], following = advantage, values[t]
        batch = seen, actions, log_probs, advantages, advantages + values
        learn(agent, optimizer, entropy, *(part.flatten(0, 1) for part in batch))
        if (update + 1) % max(1, updates // 5) == 0:
            print(f"  {(update + 1) * n_steps * n} steps: mean reward {paid_now:.2f}", flush=True)
    return agent


def learn(
    agent: Agent, optimizer: torch.optim.Optimizer, entropy: float, *batch: torch.Tensor
) -> None:
    """Update the agent by a batch of steps."""
    for _ in range(EPOCHS):
        for picked in torch.randperm(len(batch[0])).chunk(MINIBATCHES):
            seen, actions, log_probs, advantages, targets = (part[picked] for part in batch)
            policy = agent.policy(seen)
            ratio = (policy.log_prob(actions) - log_probs).exp()
            advantages = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
            clipped = ratio.clamp(1 - CLIP, 1 + CLIP)
            policy_loss = -torch.min(advantages * ratio, advantages * clipped).mean()
            value_loss = 0.5 * (agent.value(seen) - targets).pow(2).mean()
            loss = policy_loss - entropy * policy.entropy().mean() + VALUE * value_loss
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(agent.parameters(), LARGEST_GRADIENT)
            optimizer.step()


def table(agent: Agent, observation: str = "paper") -> np.ndarray:
    """Return the logits of each action in each state, as a table (n_states, 5)."""
    with torch.no_grad():
        return taichi_ants.tabulate(lambda seen: agent.policy(seen).logits, observation)


if __name__ == "__main__":
    formatter = argparse.ArgumentDefaultsHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=formatter)
    add = parser.add_argument
    add("--seeds", type=int, nargs="+", default=[0], metavar="N", help="train these seeds")
    add("--steps", type=int, default=400_000, metavar="N", help="take N steps per seed")
    add("--entropy", type=float, default=ENTROPY, metavar="X", help="weight of the entropy bonus")
    add("--out", default="ppo.npz", metavar="FILE", help="save the policy of the last seed")
    args = parser.parse_args()
    torch.set_num_threads(1)  # the networks are small
    envs = gymnasium.make_vec(
        "taichi_ants/HexForage-v0",
        num_envs=N_ENVS,
        task="fetching",
        observation_format="one_hot",
        autoreset_mode="SameStep",
    )
    for seed in args.seeds:
        logits = table(train(envs, seed, args.steps, entropy=args.entropy))
        greedy = taichi_ants.evaluate(worlds.paper(), logits, rollouts=100, task=task.fetching())
        print(
            f"seed {seed}: {greedy.deliveries.sum()} of 100 rollouts deliver, "
            f"{greedy.returns.mean():.1f} in {greedy.steps.mean():.1f} steps"
        )
    made_by = {"made by": "PPO", "seed": seed, "task": task.fetching().as_dict()}
    taichi_ants.save_policy(args.out, logits, made_by)
    print(f"The policy of the last seed is in {args.out}.")
