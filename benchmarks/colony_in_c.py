"""Compare the speed of a colony with a program in C that does the same.

Ants are spread over open worlds, with eight cells per ant, and learn into one table by Q-learning,
under the rules of `paper()`, `foraging()` and `queueing()`. The program colony.c does the same with
as many threads, and its results are bit-for-bit equal. CC sets its compiler. Otherwise it is clang,
which makes it faster than gcc does, or gcc if threads need OpenMP and clang has none. The command
measures both in turn, several times. The table contains medians, and ratios above 1 where Taichi
Ants is faster. On a busy machine, use `--threads 1`, which is measured by processor time; several
threads in C wait long for each other.
"""

from __future__ import annotations

import ctypes
import tempfile
from collections.abc import Sequence
from dataclasses import astuple
from pathlib import Path
from typing import NamedTuple

import numpy as np
from measuring import Work, a_ratio, machine, pace, show
from throughput import checked_compiler, compile_c, compiler_note

from taichi_ants import Task, TrainingConfig, runtime, worlds
from taichi_ants.analysis.tables import Table, figure, interval, thousands
from taichi_ants.engines.colony.colony import Colony
from taichi_ants.engines.colony.stepping import kernel_numbers
from taichi_ants.errors import AntsError, count
from taichi_ants.studies.command_line import Parser, progress_bar, run_command, whole_number
from taichi_ants.task import foraging, queueing

SOURCE = Path(__file__).with_name("colony_episode.c")  # it includes colony.c of the lab
TASKS = {"the paper's": Task(), "foraging": foraging(), "queueing": queueing()}
Q_LEARNING = TrainingConfig("q_learning", 0.1, 0.9, 0.3, 0.97)
_SECONDS = 0.3  # the shortest measurement
_ANT_SHIFT = 4  # of colony.c
RULES = {"paper": 0, "ants": 7, "queues": 15}  # of colony.c, by the observation of a task


class CColony(ctypes.Structure):
    """The struct Colony of colony.c."""

    _fields_ = (
        *((name, ctypes.c_int32) for name in ("size", "n")),
        *((name, ctypes.c_void_p) for name in ("ground", "trail", "closer", "steps")),
        ("q", ctypes.c_void_p),
        *((name, ctypes.c_int32) for name in ("states", "evaporates")),
        *((name, ctypes.c_int32) for name in ("level", "slope", "fades_after")),
        ("discount", ctypes.c_float),
        ("explore_below", ctypes.c_uint64),
        *((name, ctypes.c_void_p) for name in ("weights", "rewards")),
        ("counts", ctypes.c_int64 * 4),
        *((name, ctypes.c_int32) for name in ("regrowth", "sources")),
        *((name, ctypes.c_void_p) for name in ("source_at", "taken")),
    )


class Lived(NamedTuple):
    """The result of some ticks in C: the table (n_states, 5), and counts."""

    q_values: np.ndarray
    returns: int
    deliveries: int
    moves: int
    blocked: int


def load(command: str, folder: str | Path, threads: int) -> ctypes.CDLL:
    """Return the library of colony.c, compiled in a folder for some threads.

    Raises:
        AntsError: The compiler fails, for example because it has no OpenMP.
    """
    loaded = compile_c(command, [SOURCE], Path(folder) / "colony.so", threads)
    arrays, numbers = 3 * [ctypes.c_void_p], 3 * [ctypes.c_int]
    loaded.run.argtypes = [ctypes.POINTER(CColony), *arrays, *numbers]
    loaded.run.restype = None
    return loaded


def scattered(task: Task, n: int) -> Colony:
    """Return a colony of n ants spread over a world with eight cells per ant."""
    side = 2 + round((n * 8 / 3) ** 0.5)
    world = worlds.open_world(1, (side, side, side))
    return Colony(world, task, Q_LEARNING, ants=n, start="spread")


def live_in_c(library: ctypes.CDLL, colony: Colony, ticks: int, threads: int) -> Lived:
    """Return the result in C of some ticks of a colony at the start of an episode.

    The colony does not change. It must have one world, Q-learning into one table, and no births,
    deaths or changes of food, as in `scattered`.
    """
    arrays, numbers = colony.arrays, kernel_numbers(colony)
    ground, last = arrays["ground"] & 15, len(arrays["weights"]) - 1
    ground[arrays["cell"]] |= 1 << _ANT_SHIFT
    kept = {
        "ground": ground,
        "trail": arrays["trail"].copy(),
        "closer": arrays["closer"],
        "steps": arrays["compass"][:8].copy(),
        "q": arrays["q"].copy(),
        "weights": arrays["weights"][np.minimum(np.arange(colony.ants + 1), last)],
        "rewards": np.array([*astuple(colony.task.rewards), 0], np.int32),
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
    rules = RULES[colony.task.observation]
    ants = arrays["cell"].copy(), arrays["heading"].astype(np.uint8), arrays["streams"].copy()
    places = (array.ctypes.data for array in ants)
    library.run(ctypes.byref(in_c), *places, rules, ticks, threads)
    return Lived(kept["q"].reshape(colony.task.n_states, -1)[:, :5], *in_c.counts)


def check_same(library: ctypes.CDLL, colony: Colony, ticks: int, threads: int) -> None:
    """Check that both have the same results after some ticks of an episode.

    Raises:
        AntsError: The results differ, so the paces cannot be compared.
    """
    colony.begin_episode()
    lived = live_in_c(library, colony, ticks, threads)
    colony.tick(ticks)
    done = colony.outcome()
    ours = [int(one[0, 0]) for one in (done.returns, done.deliveries, done.moves, done.blocked)]
    if not (ours == list(lived[1:]) and np.array_equal(colony.q_values[0], lived.q_values)):
        raise AntsError("colony.c returns other results than the package; compare the two.")


def measured(
    library: ctypes.CDLL, sizes: Sequence[int], rounds: int, threads: int, seconds: float
) -> dict[tuple[str, int], np.ndarray]:
    """Return million ant steps/s of the package and of C, (rounds, 2), by rules and ants."""
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
    """Return million steps/s: of one thread by processor time, which is more stable."""
    steps, nanoseconds = pace(work, seconds)
    return 1e3 / nanoseconds if threads == 1 else steps / 1e6


def table(found: dict[tuple[str, int], np.ndarray], threads: int, compiled: str) -> Table:
    """Return a table of medians, and of ratios within the rounds; `compiled` is a note."""
    rows = []
    for (rules, n), paces in found.items():
        ratios = paces[:, 0] / paces[:, 1]
        shown = [figure(one) for one in np.median(paces, axis=0)]
        spread = interval(ratios.min(), ratios.max(), 2)
        rows.append([rules, thousands(n), *shown, figure(np.median(ratios)), spread])
    columns = ["rules", "ants", "ours, M steps/s", "C", "ours to C", "lowest, highest"]
    rounds = len(next(iter(found.values())))
    medians = f"Medians of {count(rounds, 'round')}, with {count(threads, 'thread')}."
    notes = [f"{medians} {machine(('taichi', 'numpy'))}", compiled]
    return Table("A colony compared with C", columns, rows, notes, text_columns=1)


def compare(
    ants: Sequence[int], rounds: int, threads: int | None, least: float, publishes: bool
) -> None:
    """Print the table.

    Raises:
        AntsError: A ratio is below `least`, or results differ.
    """
    threads = runtime.start(threads).threads
    if (command := checked_compiler(threads, publishes)) is None:
        return
    with tempfile.TemporaryDirectory() as folder:
        found = measured(load(command, folder, threads), ants, rounds, threads, _SECONDS)
    made = table(found, threads, compiler_note(command, threads))
    show("performance_colony", [made], publishes)
    for (rules, n), paces in found.items():
        ratio = float(np.median(paces[:, 0] / paces[:, 1]))
        if ratio < least:
            raise AntsError(
                f"{n} ants (rules: {rules}) have {ratio:.2f} times the pace of C, but at least "
                f"{least:g} is expected; find out what has made them slower."
            )


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    sizes = [64, 1000, 10_000, 100_000, 1_000_000]
    several = {"type": whole_number(1), "nargs": "+", "default": sizes, "metavar": "N"}
    add("--ants", **several, help="measure worlds with N ants")
    add("--rounds", type=whole_number(1), default=5, metavar="N", help="measure each N times")
    add("--threads", type=whole_number(1, 1024), metavar="N", help="use N threads (default: all)")
    about = "fail if a ratio to C is below RATIO"
    add("--least", type=a_ratio, default=0.0, metavar="RATIO", help=about)
    add("--publish", action="store_true", help="write the table to docs/results/performance.md")

    def command() -> None:
        given = parser.parse_args(arguments)
        compare(given.ants, given.rounds, given.threads, given.least, given.publish)

    run_command(command)


if __name__ == "__main__":
    main()
