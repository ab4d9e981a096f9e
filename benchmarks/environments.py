"""Compare the speed of vector environments with that of the engine of `taichi_ants.train`.

All ants act at random in the paper's world. Environments get actions that were drawn before; the
engine draws them itself, with epsilon 1. The command measures both in turn, several times. The
table contains medians, and the ratio of each median to that of the engine.
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
_BATCHES = 16  # of actions that are drawn before the measurement


def engine() -> tuple[int, float]:
    """Return steps and wall-clock seconds of random ants in the engine of independent runs."""
    rollouts = _STEPS // 600
    began = time.perf_counter()
    outcome = evaluate(worlds.paper(), random_policy()[None], rollouts, epsilon=1.0)
    return int(outcome.steps.sum()), time.perf_counter() - began


def vector(num_envs: int) -> Callable[[], tuple[int, float]]:
    """Return a function that steps a vector environment, and returns steps and seconds."""
    env = gymnasium.make_vec(ID, num_envs=num_envs)
    env.reset(seed=0)
    actions = np.random.default_rng(0).integers(0, 5, (_BATCHES, num_envs))
    for batch in actions:  # compiles kernels and spreads the ants
        env.step(batch)

    def measured() -> tuple[int, float]:
        steps = max(1, _STEPS // num_envs)
        began = time.perf_counter()
        for step in range(steps):
            env.step(actions[step % _BATCHES])
        return steps * num_envs, time.perf_counter() - began

    return measured


def single() -> tuple[int, float]:
    """Return steps and seconds of one environment, with all wrappers of `gymnasium.make`."""
    env = gymnasium.make(ID)
    env.reset(seed=0)
    actions = np.random.default_rng(0).integers(0, 5, 20_000).tolist()
    began = time.perf_counter()
    for action in actions:
        _, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            env.reset()
    return len(actions), time.perf_counter() - began


def measure(num_envs: list[int], rounds: int, threads: int | None) -> None:
    """Print a line for the engine, and for each number of environments."""
    runtime.start(threads)
    import taichi_ants.envs  # noqa: F401 (registers)

    subjects: dict[str, Callable[[], tuple[int, float]]] = {"engine": engine, "1": single}
    subjects |= {str(n): vector(n) for n in num_envs if n > 1}
    engine(), single()
    paces: dict[str, list[float]] = {name: [] for name in subjects}
    for _ in range(rounds):
        for name, subject in subjects.items():
            steps, seconds = subject()
            paces[name].append(steps / seconds / 1e6)
    medians = {name: float(np.median(values)) for name, values in paces.items()}
    print(f"{'environments':>14}{'M steps/s':>11}{'lowest':>9}{'highest':>9}{'of engine':>11}")
    for name, values in paces.items():
        share = medians[name] / medians["engine"]
        print(f"{name:>14}{medians[name]:11.3f}{min(values):9.3f}{max(values):9.3f}{share:11.3f}")


def main(arguments: list[str] | None = None) -> None:
    """Run the command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    add(
        "--num-envs",
        type=whole_number(1),
        nargs="+",
        default=[256, 4096, 65536],
        metavar="N",
        help="measure N environments that step together",
    )
    add("--rounds", type=whole_number(1), default=5, metavar="N", help="measure each N times")
    add("--threads", type=whole_number(1, 1024), metavar="N", help="use N threads (default: all)")
    run_command(lambda: measure(**vars(parser.parse_args(arguments))))


if __name__ == "__main__":
    main()
