"""Compare the speed of environments with that of the engine of `taichi_ants.train`, and CartPole.

All ants act at random in the paper's world. The first table has single environments, as
`gymnasium.make` returns them: ours; CartPole, one of Gymnasium's own; and the launch of an empty
kernel with one array, in the wrappers that `gymnasium.make` adds by default, and which ours does
without. The second has vector environments. `step` and `rollout` get actions that were drawn
before. "policy" is a rollout that draws them itself, as the engine does, with epsilon 1. Rollouts
have up to two million steps of all environments. The command measures all in turn, several times.
Ratios are medians of those within a round, by the processor time of all threads together, which
other programs hardly change; above 1, a row is faster.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from measuring import machine, show

from taichi_ants import evaluate, runtime, worlds
from taichi_ants.analysis.tables import Table, figure, interval, thousands
from taichi_ants.errors import count
from taichi_ants.learners.policies import random_policy
from taichi_ants.studies.command_line import Parser, run_command, whole_number

ID = "taichi_ants/HexForage-v0"
CARTPOLE, ENGINE = "CartPole", "the engine"
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

    calls = {"`step`": step, "`rollout`": rollout, "policy": policy}
    return {f"{thousands(num_envs)} environments, {name}": call for name, call in calls.items()}


class Nothing(gymnasium.Env):  # type: ignore[type-arg]
    """An environment whose steps launch an empty kernel with one array, and nothing else."""

    observation_space, action_space = gymnasium.spaces.Discrete(1), gymnasium.spaces.Discrete(1)

    def __init__(self) -> None:
        from taichi_ants.engines.launch import Launch

        self.launch, self.values = Launch(empty_kernel), {"array": np.zeros(1, np.int32)}

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Return an observation and info."""
        return 0, {}

    def step(self, action: Any) -> Any:
        """Launch the kernel."""
        self.launch.repeat(self.values)
        return 0, 0.0, False, False, {}


def empty_kernel(arguments: Any) -> Any:
    """Return a kernel that does nothing."""
    import taichi as ti

    def nothing(a):  # type: ignore[no-untyped-def]
        pass

    nothing.__annotations__ = {"a": arguments}
    return ti.kernel(nothing)


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


def table(title: str, measured: dict[str, list[Measured]], first: str, notes: list[str]) -> Table:
    """Return a table of medians, and of the ratio of processor time to that of a first row."""
    rows, costs_of = [], {k: np.array([c / n for n, _, c in v]) for k, v in measured.items()}
    for name, given in measured.items():
        paces, costs = np.array([n / wall for n, wall, _ in given]), costs_of[name]
        ratios = costs_of[first] / costs
        spread = interval(ratios.min(), ratios.max(), 2)
        shown = [figure(float(np.median(one))) for one in (paces / 1e3, costs * 1e9, ratios)]
        rows.append([name, *shown, spread])
    columns = ["one step of", "1000 steps/s", "CPU ns", f"to {first}", "lowest, highest"]
    return Table(title, columns, rows, notes, text_columns=1)


def measure(num_envs: list[int], rounds: int, threads: int | None, publishes: bool) -> None:
    """Print the tables."""
    threads = runtime.start(threads).threads
    import taichi_ants.envs  # noqa: F401 (registers)

    gymnasium.register("Nothing-v0", entry_point=Nothing)
    singles = {
        "HexForage": single(ID),
        CARTPOLE: single("CartPole-v1"),
        "an empty launch": single("Nothing-v0"),
    }
    several: dict[str, Callable[[], int]] = {ENGINE: engine}
    for n in num_envs:
        several |= vector(n)
    subjects = {**singles, **several}
    for subject in subjects.values():
        subject()
    measured: dict[str, list[Measured]] = {name: [] for name in subjects}
    for _ in range(rounds):
        for name, subject in subjects.items():
            measured[name].append(timed(subject))
    medians = f"Medians of {count(rounds, 'round')}, with {count(threads, 'thread')}."
    notes = [f"{medians} {machine(('taichi', 'numpy', 'gymnasium'))}"]
    made = [
        table(title, {name: measured[name] for name in some}, first, lines)
        for title, some, first, lines in (
            ("A single environment", singles, CARTPOLE, []),
            ("Vector environments", several, ENGINE, notes),
        )
    ]
    show("performance_environments", made, publishes)


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
    add("--publish", action="store_true", help="write the tables to docs/results/performance.md")

    def command() -> None:
        given = parser.parse_args(arguments)
        measure(given.num_envs, given.rounds, given.threads, given.publish)

    run_command(command)


if __name__ == "__main__":
    main()
