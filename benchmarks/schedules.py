"""Compare the ways to distribute the work of a tick over threads, for colonies of many sizes.

Each round measures all ways in turn. `benchmarks/growth.py` measures the way that a colony chooses.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
from measuring import PAGE, machine, publish

from taichi_ants import Colony, TrainingConfig, runtime, worlds
from taichi_ants.analysis.tables import Table, figure, plain_text, thousands
from taichi_ants.engines.colony import stepping
from taichi_ants.studies.command_line import Parser, progress_bar, run_command, whole_number

SIZES = ((64, 1), (1000, 1), (10_000, 1), (100_000, 1), (64, 256), (1000, 64), (20_000, 8))
# By way: the schedule; threads that share a tick, 0 for all. Threads take worlds that are far apart
# in memory, except in the second way.
NEIGHBOURS = "by world, neighbours"
WAYS = {
    "by world": ("by_world", 0),
    NEIGHBOURS: ("by_world", 0),
    "by chunk, one thread": ("by_chunk", 1),
    "by chunk, barrier": ("by_chunk", 0),
}
_STEPS = 2_000_000  # of ants, in one measurement


def colony_of(ants: int, n_worlds: int, schedule: str) -> Colony:
    """Return a colony at the start of an episode, with eight cells per ant."""
    side = max(6, round((8 * ants / 3) ** 0.5) + 1)
    training = TrainingConfig("q_learning", 0.1, 0.9, 0.1, 1.0)
    world, options = worlds.open_world(1, (side, side, side)), {"schedule": schedule}
    colony = Colony(world, None, training, range(n_worlds), ants, start="spread", **options)
    colony.begin_episode()
    return colony


def pace(colony: Colony, way: str) -> float:
    """Return million steps of ants per second."""
    _, threads = WAYS[way]
    stepping.ThreadChoice.plan = lambda choice, ticks, most: (ticks, threads or most)
    steps = colony.ants * len(colony.seeds)
    most = 100 if way.endswith("barrier") else 10_000  # threads can wait long
    ticks = max(2, min(most, _STEPS // steps))
    began = time.perf_counter()
    if way == NEIGHBOURS:
        colony._launch_ticks(ticks, parts=len(colony.seeds))
    else:
        colony.tick(ticks)
    return ticks * steps / (time.perf_counter() - began) / 1e6


def table(sizes: Sequence[tuple[int, int]], rounds: int) -> Table:
    """Return a table of all ways, without their first measurement, which compiles kernels."""
    rows = []
    with progress_bar("Measuring") as progress:
        for n, (ants, n_worlds) in enumerate(sizes):
            colonies = {way: colony_of(ants, n_worlds, WAYS[way][0]) for way in WAYS}
            paces = [[pace(colonies[way], way) for way in WAYS] for _ in range(rounds + 1)][1:]
            found = np.array(paces)
            ratios = np.median(found / found[:, :1], axis=0)
            for way, best, ratio in zip(WAYS, found.max(axis=0), ratios, strict=True):
                rows.append([way, thousands(ants), str(n_worlds), figure(best), figure(ratio)])
            progress((n + 1) / len(sizes))
    columns = [
        "ticks are shared",
        "ants",
        "worlds",
        "best M steps/s",
        "median ratio to by world",
    ]
    threads = runtime.start().threads
    about = f"{rounds} rounds, with {threads} threads. {machine(('taichi', 'numpy'))}"
    return Table("Ways to share ticks", columns, rows, [about])


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    add("--rounds", type=whole_number(1), default=15, metavar="N", help="measure each N times")
    add("--threads", type=whole_number(1, 1024), metavar="N", help="use N threads (default: all)")
    add("--publish", action="store_true", help="write the table to docs/performance.md")

    def command() -> None:
        given = parser.parse_args(arguments)
        runtime.start(given.threads)
        made = table(SIZES, given.rounds)
        print(plain_text([made], 120), end="")
        if given.publish:
            publish("schedules", [made], PAGE)

    run_command(command)


if __name__ == "__main__":
    main()
