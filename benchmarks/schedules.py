"""Each way to share the ticks of a colony among threads, forced on colonies of many sizes.

Each round measures all of them in turn. Compare `benchmarks/growth.py` for what a colony chooses.
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
# Of each way: the schedule; threads that share a tick, 0 for all; whether they have a barrier.
WAYS = {
    "by world": ("by_world", 0, True),
    "by chunk, one thread": ("by_chunk", 1, True),
    "by chunk, barrier": ("by_chunk", 0, True),
    "by chunk, loops": ("by_chunk", 0, False),
}
_STEPS = 400_000  # of ants, in one measurement


def colony_of(ants: int, n_worlds: int, schedule: str) -> Colony:
    """A colony in an episode, with eight cells for each ant."""
    side = max(6, round((8 * ants / 3) ** 0.5) + 1)
    training = TrainingConfig("q_learning", 0.1, 0.9, 0.1, 1.0)
    world, options = worlds.open_world(1, (side, side, side)), {"schedule": schedule}
    colony = Colony(world, None, training, range(n_worlds), ants, start="spread", **options)
    colony.begin_episode()
    return colony


def pace(colony: Colony, way: str) -> float:
    """Million steps of ants a second."""
    _, threads, barrier = WAYS[way]
    stepping.ThreadChoice.plan = lambda choice, ticks, most: (ticks, threads or most)
    stepping._has_barrier = lambda running: barrier
    steps = colony.ants * len(colony.seeds)
    most = 100 if way.endswith(("barrier", "loops")) else 10_000  # these can wait long
    ticks = max(2, min(most, _STEPS // steps))
    began = time.perf_counter()
    colony.tick(ticks)
    return ticks * steps / (time.perf_counter() - began) / 1e6


def table(sizes: Sequence[tuple[int, int]], rounds: int) -> Table:
    """Measure all ways in turn; the first measurement of each, which compiles, is left out."""
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
        "M steps/s at best",
        "median ratio to by world",
    ]
    threads = runtime.start().threads
    about = f"{rounds} rounds, with {threads} threads. {machine(('taichi', 'numpy'))}"
    return Table("Ways to share ticks", columns, rows, [about])


def main(arguments: Sequence[str] | None = None) -> None:
    """The command line."""
    parser = Parser(__doc__.split("\n", 1)[0], epilog=__doc__.split("\n", 1)[1])
    add = parser.add_argument
    add("--rounds", type=whole_number(1), default=15, metavar="N", help="measurements of each")
    add("--threads", type=whole_number(1, 1024), metavar="N", help="CPU threads (default: all)")
    add("--publish", action="store_true", help="put the table into docs/performance.md")

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
