"""Measure how fast colonies, training and rollouts are with 1, 2, 4, ... threads.

The rows that many threads change most come first. A colony is measured twice: its kernels alone
with each number of threads, and `Colony.tick`, which sorts ants and chooses the number of threads
itself, up to each number. All is measured several times, by the wall clock; tables have medians.
The command takes less than five minutes. On a machine with fewer processors it has fewer columns.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from measuring import machine, show

from taichi_ants import Colony, Task, TrainingConfig, runtime, train, worlds
from taichi_ants.analysis.tables import Table, figure, thousands
from taichi_ants.envs.forage import HexForageVectorEnv
from taichi_ants.studies.command_line import Parser, progress_bar, run_command, whole_number
from taichi_ants.task import foraging

SARSA = TrainingConfig("sarsa", 0.1, 0.9, 0.1, 1.0)
Q_LEARNING = TrainingConfig("q_learning", 0.01, 0.9, 0.3, 0.99)
# By size: ants, worlds.
COLONIES = (1_000_000, 1), (100_000, 1), (10_000, 1), (64, 4096)
_STEPS = 4_000_000  # of ants, in one measurement with one thread

Work = Callable[[int], float]  # does some work with a number of threads; million steps/s


def pace_of(work: Callable[[], int]) -> float:
    """Return million steps/s of work that returns its number of steps."""
    began = time.perf_counter()
    return work() / (time.perf_counter() - began) / 1e6


def colony_of(ants: int, n_worlds: int) -> Colony:
    """Return a colony whose ants learn while they forage, with eight cells for each of them."""
    side = max(6, round((8 * ants / 3) ** 0.5) + 1)
    world = worlds.open_world(1, (side, side, side))
    colony = Colony(world, foraging(), SARSA, range(n_worlds), ants, start="spread")
    colony.begin_episode()
    return colony


def kernels(ants: int, n_worlds: int) -> Work:
    """Return work: ticks without sorting, divided among exactly the given number of threads."""
    colony = colony_of(ants, n_worlds)
    ticks = ticks_of(ants, n_worlds)

    def work(threads: int) -> float:
        parts = threads
        if colony.schedule == "by_world":
            parts = threads * -(-n_worlds // threads)

        def several() -> int:
            colony._launch_parts("ticks", ticks * threads, parts, threads)
            return ticks * threads * ants * n_worlds

        return pace_of(several)

    return work


def tick(ants: int, n_worlds: int) -> Work:
    """Return work: `Colony.tick`, long enough to try numbers of threads."""
    colony = colony_of(ants, n_worlds)
    ticks = 2 * ticks_of(ants, n_worlds)

    def work(threads: int) -> float:
        def several() -> int:
            colony.tick(ticks * threads)
            return ticks * threads * ants * n_worlds

        return pace_of(several)

    return work


def ticks_of(ants: int, n_worlds: int) -> int:
    """Return the number of ticks in one measurement with one thread."""
    return max(2, _STEPS // (ants * n_worlds))


def training(threads: int) -> float:
    """Return million steps/s of 4096 runs that learn by Q-learning in the paper's world."""

    def work() -> int:
        done = train(worlds.paper(), Q_LEARNING, range(4096), 30, task=Task(delivery="truncates"))
        return int(done.steps.sum(dtype=np.int64))

    return pace_of(work)


def rollouts() -> Work:
    """Return work: random actions in 65 536 environments."""
    env = HexForageVectorEnv(num_envs=65_536, observation_format="index")
    env.reset(seed=0)
    length = 32

    def rollout(threads: int) -> float:
        def work() -> int:
            env.rollout("random", length, epsilon=1.0)
            return length * 65_536

        return pace_of(work)

    return rollout


def numbers() -> list[int]:
    """Return the numbers of threads: 1, 2, 4, ..., and all."""
    most = runtime.available_threads()
    return [*(2**i for i in range((most - 1).bit_length())), most]


def measured(rounds: int) -> dict[str, dict[int, list[float]]]:
    """Return million steps/s by row and number of threads."""
    found: dict[str, dict[int, list[float]]] = {}
    counts = numbers()
    restarting = {"training, 4 096 runs": lambda: training, "random rollouts, 65 536": rollouts}
    with progress_bar("Measuring") as progress:
        for size in COLONIES:
            name = name_of(*size)
            runtime.start(counts[-1])
            found[f"{name}: kernels"] = measure(kernels(*size), counts, rounds)
            found[f"{name}: `tick`"] = restarted(partial(tick, *size), counts, rounds)
            progress(len(found) / (2 * len(COLONIES) + 2))
        for name, make in restarting.items():
            found[name] = restarted(make, counts, rounds)
            progress(len(found) / (2 * len(COLONIES) + 2))
    return found


def name_of(ants: int, n_worlds: int) -> str:
    """Return the name of a colony in the table."""
    return f"{thousands(ants)} ants" + f", {thousands(n_worlds)} worlds" * (n_worlds > 1)


def restarted(
    make: Callable[[], Work], counts: Sequence[int], rounds: int
) -> dict[int, list[float]]:
    """Return paces of new work by number of threads, with which Taichi restarts."""
    paces: dict[int, list[float]] = {}
    for count in counts:
        runtime.start(count)
        paces |= measure(make(), [count], rounds)
    return paces


def measure(work: Work, counts: Sequence[int], rounds: int) -> dict[int, list[float]]:
    """Return paces by number of threads, in turn; the first round compiles kernels."""
    paces = [[work(count) for count in counts] for _ in range(1 + rounds)][1:]
    return dict(zip(counts, map(list, zip(*paces, strict=True)), strict=True))


def table(found: dict[str, dict[int, list[float]]], rounds: int) -> Table:
    """Return a table with a row for each work and a column for each number of threads."""
    counts, rows = numbers(), []
    for name, paces in found.items():
        rows.append([name, *(figure(np.median(paces[n])) for n in counts)])
    columns = ["M steps/s", *(f"{n} thread{'s' * (n > 1)}" for n in counts)]
    about = f"Medians of {rounds} rounds. {machine(('taichi', 'numpy'))}"
    return Table("With several threads", columns, rows, [about])


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    add("--rounds", type=whole_number(1), default=3, metavar="N", help="measure each N times")
    add("--publish", action="store_true", help="write the table to docs/results/performance.md")

    def command() -> None:
        given = parser.parse_args(arguments)
        made = table(measured(given.rounds), given.rounds)
        show("performance_cores", [made], given.publish)

    run_command(command)


if __name__ == "__main__":
    main()
