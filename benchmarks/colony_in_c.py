"""How fast a colony is, beside the same in C: scattered ants that learn into one table.

Ants stand all over open worlds, eight cells to an ant, and learn by Q-learning, by the
paper's rules and by those of foraging. colony.c does the same with as many threads, and its results
are equal to the bit. Both are measured in turn, several times; the table has medians, and the ratio
of each round's paces, more than 1 where ours is faster. On a busy machine take `--threads 1`, which
is measured by processor time: threads of C that wait for each other there wait long.
"""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import astuple
from pathlib import Path
from typing import NamedTuple

import numpy as np
from measuring import PAGE, Work, a_ratio, machine, pace, publish
from throughput import FLAGS, compiler

from taichi_ants import Task, TrainingConfig, runtime, worlds
from taichi_ants.analysis.tables import Table, figure, interval, plain_text, thousands
from taichi_ants.engines.colony.colony import Colony
from taichi_ants.engines.colony.stepping import kernel_numbers
from taichi_ants.errors import AntsError
from taichi_ants.studies.command_line import Parser, progress_bar, run_command, whole_number
from taichi_ants.task import foraging

SOURCE = Path(__file__).with_name("colony.c")
TASKS = {"the paper's": Task(), "foraging": foraging()}
Q_LEARNING = TrainingConfig("q_learning", 0.1, 0.9, 0.3, 0.97)
_SECONDS = 0.3  # of a measurement at least
_ANT_SHIFT = 4  # of colony.c


class CColony(ctypes.Structure):
    """The struct Colony of colony.c."""

    _fields_ = (
        *((name, ctypes.c_int32) for name in ("size", "n")),
        *((name, ctypes.c_void_p) for name in ("ground", "trail", "closer", "steps")),
        *((name, ctypes.c_void_p) for name in ("cells", "headings", "random", "q")),
        *((name, ctypes.c_int32) for name in ("states", "evaporates")),
        *((name, ctypes.c_int32) for name in ("level", "slope", "fades_after")),
        ("discount", ctypes.c_float),
        ("explore_below", ctypes.c_uint64),
        *((name, ctypes.c_void_p) for name in ("weights", "rewards")),
        ("counts", ctypes.c_int64 * 4),
    )


class Lived(NamedTuple):
    """What came of some ticks in C: the table (n_states, 5), and what was counted."""

    q_values: np.ndarray
    returns: int
    deliveries: int
    moves: int
    blocked: int


def load(command: str, folder: str | Path) -> ctypes.CDLL:
    """Compile colony.c in a folder and load it."""
    library = Path(folder) / "colony.so"
    given = [command, *FLAGS, "-fopenmp", "-o", library, SOURCE, "-lm"]
    subprocess.run(given, check=True, capture_output=True)
    loaded = ctypes.CDLL(str(library))
    loaded.run.argtypes = ctypes.POINTER(CColony), ctypes.c_int, ctypes.c_int, ctypes.c_int
    loaded.run.restype = ctypes.c_double
    return loaded


def scattered(task: Task, n: int) -> Colony:
    """n ants all over a world of eight cells to an ant."""
    side = 2 + round((n * 8 / 3) ** 0.5)
    world = worlds.open_world(1, (side, side, side))
    return Colony(world, task, Q_LEARNING, ants=n, start="spread")


def live_in_c(library: ctypes.CDLL, colony: Colony, ticks: int, threads: int) -> Lived:
    """Let ticks pass in C for a colony that has just begun an episode; it stays as it is.

    Only what the colonies of `scattered` have: one world, Q-learning into one table, no life.
    """
    arrays, numbers = colony.arrays, kernel_numbers(colony)
    ground, last = arrays["ground"] & 15, len(arrays["weights"]) - 1
    ground[arrays["cell"]] |= 1 << _ANT_SHIFT
    kept = {
        "ground": ground,
        "trail": arrays["trail"].copy(),
        "closer": arrays["closer"],
        "steps": arrays["compass"][:8].copy(),
        "cells": arrays["cell"].copy(),
        "headings": arrays["heading"].astype(np.uint8),
        "random": arrays["streams"].copy(),
        "q": arrays["q"].copy(),
        "weights": arrays["weights"][np.minimum(np.arange(colony.ants + 1), last)],
        "rewards": np.array(astuple(colony.task.rewards), np.int32),
    }
    names = ("evaporates", "slope", "fades_after", "discount")
    in_c = CColony(
        size=colony.grid.size,
        n=colony.ants,
        states=colony.task.n_states,
        level=numbers["deposit_level"],
        explore_below=int(numbers["explore_below"]),
        **{name: numbers[name] for name in names},
        **{name: array.ctypes.data for name, array in kept.items()},
    )
    library.run(ctypes.byref(in_c), int(colony.task.traffic.shared), ticks, threads)
    return Lived(kept["q"].reshape(colony.task.n_states, -1)[:, :5], *in_c.counts)


def check_same(library: ctypes.CDLL, colony: Colony, ticks: int, threads: int) -> None:
    """Let both live for some ticks from the start of an episode.

    Raises:
        AntsError: They differ, and so cannot be compared.
    """
    colony.begin_episode()
    lived = live_in_c(library, colony, ticks, threads)
    colony.tick(ticks)
    done = colony.outcome()
    ours = [int(one[0, 0]) for one in (done.returns, done.deliveries, done.moves, done.blocked)]
    if not (ours == list(lived[1:]) and np.array_equal(colony.q_values[0], lived.q_values)):
        raise AntsError("colony.c gives other results than the package; compare the two.")


def measured(
    library: ctypes.CDLL, sizes: Sequence[int], rounds: int, threads: int, seconds: float
) -> dict[tuple[str, int], np.ndarray]:
    """By rules and ants: million ant-steps a second of ours and of C, (rounds, 2)."""
    found: dict[tuple[str, int], np.ndarray] = {}
    with progress_bar("Measuring") as progress:
        for rules, task in TASKS.items():
            for n in sizes:
                colony, ticks, paces = scattered(task, n), max(64, 500_000 // n), []
                check_same(library, colony, min(ticks, 100), threads)

                def ours(colony: Colony = colony, ticks: int = ticks) -> int:
                    colony.begin_episode()
                    colony.tick(ticks)
                    return ticks * colony.ants

                def in_c(colony: Colony = colony, ticks: int = ticks) -> int:
                    live_in_c(library, colony, ticks, threads)
                    return ticks * colony.ants

                for _ in range(rounds):
                    paces.append([_millions(ours, seconds, threads)])
                    colony.begin_episode()
                    paces[-1].append(_millions(in_c, seconds, threads))
                    progress((len(found) + len(paces) / rounds) / len(TASKS) / len(sizes))
                found[rules, n] = np.array(paces)
    return found


def _millions(work: Work, seconds: float, threads: int) -> float:
    """Million steps a second; of one thread by processor time, which others hardly disturb."""
    steps, nanoseconds = pace(work, seconds)
    return 1e3 / nanoseconds if threads == 1 else steps / 1e6


def table(found: dict[tuple[str, int], np.ndarray], threads: int) -> Table:
    """The medians, and the ratios within the rounds."""
    rows = []
    for (rules, n), paces in found.items():
        ratios = paces[:, 0] / paces[:, 1]
        shown = [figure(one) for one in np.median(paces, axis=0)]
        spread = interval(ratios.min(), ratios.max(), 2)
        rows.append([rules, thousands(n), *shown, figure(np.median(ratios)), spread])
    columns = ["rules", "ants", "ours, M steps/s", "C", "ours to C", "lowest, highest"]
    rounds = len(next(iter(found.values())))
    about = f"Medians of {rounds} rounds, with {threads} threads. {machine(('taichi', 'numpy'))}"
    return Table("A colony beside C", columns, rows, [about], text_columns=1)


def compare(
    ants: Sequence[int], rounds: int, threads: int | None, least: float, publishes: bool
) -> None:
    """Print the table.

    Raises:
        AntsError: A ratio is below `least`, or results differ.
    """
    threads = runtime.start(threads).threads
    if (command := compiler()) is None:
        print("There is no C compiler (cc, gcc, clang or CC), so no comparison with C.")
        return
    with tempfile.TemporaryDirectory() as folder:
        found = measured(load(command, folder), ants, rounds, threads, _SECONDS)
    made = table(found, threads)
    print(plain_text([made], 120), end="")
    if publishes:
        publish("colony", [made], PAGE)
    for (rules, n), paces in found.items():
        ratio = float(np.median(paces[:, 0] / paces[:, 1]))
        if ratio < least:
            raise AntsError(
                f"{n} ants by {rules} rules go at {ratio:.2f} of the pace of C; at least {least:g} "
                "is expected, so look for what has made them slower."
            )


def main(arguments: Sequence[str] | None = None) -> None:
    """The command line."""
    parser = Parser(__doc__.split("\n", 1)[0], epilog=__doc__.split("\n", 1)[1])
    add = parser.add_argument
    sizes = [10_000, 100_000, 1_000_000]
    several = {"type": whole_number(1), "nargs": "+", "default": sizes, "metavar": "N"}
    add("--ants", **several, help="in one world (default: 10000 100000 1000000)")
    add("--rounds", type=whole_number(1), default=5, metavar="N", help="measurements of each")
    add("--threads", type=whole_number(1, 1024), metavar="N", help="CPU threads (default: all)")
    add("--least", type=a_ratio, default=0.0, metavar="RATIO", help="fail below this ratio to C")
    add("--publish", action="store_true", help="put the table into docs/performance.md")

    def command() -> None:
        given = parser.parse_args(arguments)
        compare(given.ants, given.rounds, given.threads, given.least, given.publish)

    run_command(command)


if __name__ == "__main__":
    main()
