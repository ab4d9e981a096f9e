"""Offline learning and off-policy evaluation in plain Python.

Data are a list of episodes. An episode is a list of steps (state, action, reward, next state,
terminated) of Python numbers.
"""

from collections import Counter, defaultdict
from collections.abc import Sequence

import numpy as np

from taichi_ants import Dataset, record
from taichi_ants.task import Task
from taichi_ants.task.constants import N_ACTIONS
from taichi_ants.worlds import World

Step = tuple[int, int, int, int, bool]
Episodes = Sequence[Sequence[Step]]


def batch_q_learning(
    episodes: Episodes,
    n_states: int,
    discount: float,
    learning_rate: float,
    sweeps: int,
    initial_q: float,
) -> np.ndarray:
    """Return a table of Q-learning, `sweeps` times over all steps; float32 (n_states, 5)."""
    q = np.full((n_states, N_ACTIONS), initial_q, np.float32)
    for _ in range(sweeps):
        for episode in episodes:
            for state, action, reward, next_state, terminated in episode:
                target = np.float32(reward)
                if not terminated:
                    target += np.float32(discount) * max(q[next_state])
                q[state, action] += np.float32(learning_rate) * (target - q[state, action])
    return q


def q_iteration(
    episodes: Episodes,
    n_states: int,
    discount: float,
    initial_q: float,
    tolerance: float,
    policy: np.ndarray | None = None,
    penalty: float = 0.0,
    lowest: float = -np.inf,
) -> np.ndarray:
    """Return action values, float64 (n_states, 5), in the model that the data imply.

    The values are those of `policy` or, without one, the optimal ones.
    """
    led_to: defaultdict[tuple[int, int], Counter[int]] = defaultdict(Counter)
    rewards: Counter[tuple[int, int]] = Counter()
    counts: Counter[tuple[int, int]] = Counter()
    for episode in episodes:
        for state, action, reward, next_state, terminated in episode:
            counts[state, action] += 1
            rewards[state, action] += reward
            if not terminated:
                led_to[state, action][next_state] += 1
    q: list[list[float]] = [[initial_q] * N_ACTIONS for _ in range(n_states)]
    change = np.inf
    while change > tolerance:
        values: list[float] = [max(row) for row in q]
        if policy is not None:
            values = []
            for row, chances in zip(q, policy.tolist(), strict=True):
                values.append(0.0)
                for value, chance in zip(row, chances, strict=True):
                    values[-1] += chance * value
        change = 0.0
        for (state, action), n in counts.items():
            later = 0.0
            for successor, times in sorted(led_to[state, action].items()):
                later += times / n * values[successor]
            expected = rewards[state, action] / n - penalty / float(np.sqrt(n))
            backed_up = max(expected + discount * later, lowest)
            change = max(change, abs(backed_up - q[state][action]))
            q[state][action] = backed_up
    return np.array(q)


def importance_sampling(
    episodes: Episodes,
    target: np.ndarray,
    behaviour: Sequence[Sequence[float]],
    discount: float,
    weighted: bool,
) -> float:
    """Return the per-decision estimate of the value of a policy (n_states, 5).

    `behaviour` has the probability of each action that was taken. An episode that has ended has no
    further rewards, and keeps its weight.
    """
    weights = []
    for episode, chances in zip(episodes, behaviour, strict=True):
        weight, of_episode = 1.0, []
        for (state, action, *_), chance in zip(episode, chances, strict=True):
            weight *= float(target[state, action]) / chance
            of_episode.append(weight)
        weights.append(of_episode)
    value, factor, of_ended = 0.0, 1.0, 0.0
    for t in range(max(map(len, episodes))):
        total, of_others = 0.0, 0.0
        for episode, of_episode in zip(episodes, weights, strict=True):
            if t < len(episode):
                total += of_episode[t] * episode[t][2]
                of_others += of_episode[t]
        of_ended += sum((w[-1] for w in weights if len(w) == t), 0.0)
        mass = of_others + of_ended if weighted else float(len(episodes))
        if mass > 0:
            value += factor * (total / mass)
        factor *= discount
    return value


COLUMNS = ("state", "action", "reward", "next_state", "terminated")


def episodes_of(data: Dataset) -> list[list[tuple]]:
    """Return steps (state, action, reward, next state, terminated) by episode."""
    rows = list(zip(*(getattr(data, name).tolist() for name in COLUMNS), strict=True))
    return [rows[a:b] for a, b in zip(data.begins, data.begins[1:], strict=False)]


def behaviour_of(data: Dataset) -> list[list[float]]:
    """Return the probabilities of the actions by episode."""
    chances = data.behaviour_probability.tolist()
    return [chances[a:b] for a, b in zip(data.begins, data.begins[1:], strict=False)]


def random_data(world: World, seed: int, episodes: int = 6, runs: int = 2) -> Dataset:
    """Return data of ants that follow random tables; some of their episodes end by delivery."""
    rng = np.random.default_rng(seed)
    tables = rng.normal(size=(runs, 128, 5))
    delivery = "truncates" if seed % 2 else "terminates"
    return record(
        world, tables, episodes, range(seed, seed + runs), 60, Task(delivery=delivery), epsilon=0.7
    )
