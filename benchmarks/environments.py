"""Compare the speed of vector environments with that of the engine of `taichi_ants.train`.

All ants act at random in the paper's world. "1 step" is one environment of `gymnasium.make`, and
"CartPole" one of Gymnasium's own. `step` and `rollout` get actions that were drawn before. "policy"
is a rollout that draws them itself, as the engine does, with epsilon 1. Rollouts have up to two
million steps of all environments. The command measures all in turn, several times. The table
contains medians: steps per second by the wall clock, and processor time per step of all threads
together. Ratios are those of the engine's processor time, which other programs hardly change, and
of its wall-clock time.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import gymnasium
import numpy as np

from taichi_ants import evaluate, runtime, worlds
from taichi_ants.learners.policies import random_policy
from taichi_ants.studies.command_line import Parser, run_command, whole_number

ID = "taichi_ants/HexForage-v0"
_STEPS = 6_000_000  # of all ants in a measurement, roughly
_STEPS_OF_ROLLOUT = 1 << 21  # of all environments
_MOST_LENGTH = 1024


Measured = tuple[int, float, float]  # steps, wall-clock seconds, processor seconds


def timed(work: Callable[[], int]) -> Measured:
    """Return the steps of some work, and the time it takes."""
    began, cpu = time.perf_counter(), time.process_time()
    steps = work()
    return steps, time.perf_counter() - began, time.process_time() - cpu


def engine() -> int:
    """Return the steps of random ants in the engine of independent runs."""
    outcome = evaluate(worlds.paper(), random_policy()[None], _STEPS // 600, epsilon=1.0)
    return int(outcome.steps.sum())


def vector(num_envs: int) -> dict[str, Callable[[], int]]:
    """Return functions that step a vector environment in several ways."""
    env = gymnasium.make_vec(ID, num_envs=num_envs, observation_format="index")
    env.reset(seed=0)
    length = max(1, min(_MOST_LENGTH, _STEPS_OF_ROLLOUT // num_envs))
    actions = np.random.default_rng(0).integers(0, 5, (length, num_envs))
    env.rollout(actions)  # compiles the kernels
    env.rollout("random", length)
    rollouts = max(1, _STEPS // (length * num_envs))

    def step() -> int:
        for t in range(steps := max(1, _STEPS // num_envs)):
            env.step(actions[t % length])
        return steps * num_envs

    def rollout() -> int:
        for _ in range(rollouts):
            env.rollout(actions)
        return rollouts * length * num_envs

    def policy() -> int:
        for _ in range(rollouts):
            env.rollout("random", length, epsilon=1.0)
        return rollouts * length * num_envs

    return {f"{num_envs} {one.__name__}": one for one in (step, rollout, policy)}


def single(name: str) -> Callable[[], int]:
    """Return a function that steps one environment, with all wrappers of `gymnasium.make`."""
    env = gymnasium.make(name)
    actions = np.random.default_rng(0).integers(0, env.action_space.n, 20_000).tolist()

    def step() -> int:
        env.reset(seed=0)
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()
        return len(actions)

    return step


def measure(num_envs: list[int], rounds: int, threads: int | None) -> None:
    """Print a line for the engine, and for each way to step each number of environments."""
    runtime.start(threads)
    import taichi_ants.envs  # noqa: F401 (registers)

    subjects: dict[str, Callable[[], int]] = {
        "engine": engine,
        "1 step": single(ID),
        "CartPole": single("CartPole-v1"),
    }
    for n in num_envs:
        subjects |= vector(n) if n > 1 else {}
    for subject in subjects.values():
        subject()
    measured: dict[str, list[Measured]] = {name: [] for name in subjects}
    for _ in range(rounds):
        for name, subject in subjects.items():
            measured[name].append(timed(subject))
    print(
        f"{'':>14}{'M steps/s':>11}{'lowest':>9}{'highest':>9}{'of engine':>11}"
        f"{'CPU ns':>9}{'of engine':>11}"
    )
    paces = {name: [n / wall / 1e6 for n, wall, _ in given] for name, given in measured.items()}
    costs = {
        name: float(np.median([cpu / n * 1e9 for n, _, cpu in given]))
        for name, given in measured.items()
    }
    for name, values in paces.items():
        share = float(np.median(values) / np.median(paces["engine"]))
        print(
            f"{name:>14}{np.median(values):11.3f}{min(values):9.3f}{max(values):9.3f}"
            f"{share:11.3f}{costs[name]:9.1f}{costs['engine'] / costs[name]:11.3f}"
        )


def main(arguments: list[str] | None = None) -> None:
    """Run the command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    add(
        "--num-envs",
        type=whole_number(1),
        nargs="+",
        default=[64, 4096, 65536],
        metavar="N",
        help="measure N environments that step together",
    )
    add("--rounds", type=whole_number(1), default=5, metavar="N", help="measure each N times")
    add("--threads", type=whole_number(1, 1024), metavar="N", help="use N threads (default: all)")
    run_command(lambda: measure(**vars(parser.parse_args(arguments))))


if __name__ == "__main__":
    main()
