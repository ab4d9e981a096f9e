"""Measure how speed and memory depend on the number of runs, ants, cells, states and threads.

Runs learn by Q-learning in the paper's world, for 500 episodes. Ants of colonies forage in open
worlds and learn into one table. The command measures all sizes in turn, with 1 thread and with all
threads, several times, by the wall clock; the tables contain medians. For memory, it doubles the
size, and reports by how much the arrays and the peak memory of the process grow per run, ant or
cell.
"""

from __future__ import annotations

import ctypes
import gc
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from measuring import FIGURES, Work, count_in_powers, machine, pace, show
from systems.ours import SARSA

from taichi_ants import Task, TrainingConfig, World, runtime, train, worlds
from taichi_ants.analysis import style
from taichi_ants.analysis.sweeps import draw_lines
from taichi_ants.analysis.tables import MISSING, Table, figure, interval, thousands
from taichi_ants.engines.colony.colony import Colony
from taichi_ants.studies.command_line import Parser, progress_bar, run_command, whole_number
from taichi_ants.task import foraging, observations

Q_LEARNING = TrainingConfig("q_learning", 0.01, 0.9, 0.3, 0.99)
_STATUS = Path("/proc/self/status")  # of this process, on Linux


class Direction(NamedTuple):
    """A quantity that grows.

    Attributes:
        of: The name in tables.
        step: A description of one step.
        make: A function that returns the work for a size.
        sizes: The sizes to measure.
    """

    of: str
    step: str
    make: Callable[[int], Work]
    sizes: tuple[int, ...]


def runs(n: int, observation: str = "paper", episodes: int = 500) -> Work:
    """Return work that trains n runs."""
    task = Task(delivery="truncates", observation=observation)

    def work() -> int:
        came = train(worlds.paper(), Q_LEARNING, range(n), episodes, task=task)
        return int(came.steps.sum(dtype=np.int64))

    return work


def states(n_states: int) -> Work:
    """Return work that trains 64 runs with the observation of `n_states` states."""
    named = {observations.get(name).n_states: name for name in STATES}
    return runs(64, named[n_states], 100)


def ants(n: int) -> Work:
    """Return work: ticks of n ants with four cells per ant."""
    return ticks(n, max(10, round((4 * n / 3) ** 0.5)))


def cells(side: int) -> Work:
    """Return work: ticks of 10 000 ants in a world of the ranges (side, side, side)."""
    return ticks(10_000, side)


def ticks(n: int, side: int) -> Work:
    """Return work: ticks of a colony of n ants in a world of the ranges (side, side, side)."""
    colony, several = colony_of(n, side), max(1, 50_000 // n)

    def work() -> int:
        colony.tick(several)
        return several * n

    return work


@cache
def open_world(side: int) -> World:
    """Return an open world of the ranges (side, side, side), the same one at each call."""
    return worlds.open_world(0, (side, side, side))


def colony_of(n: int, side: int) -> Colony:
    """Return a colony of n foraging ants, at the start of an episode."""
    colony = Colony(open_world(side), foraging(), SARSA, ants=n, start="spread")
    colony.begin_episode()
    return colony


def n_cells(side: int) -> int:
    """Return the number of cells of a world of the ranges (side, side, side)."""
    return 3 * side * (side - 1) + 1


STATES = ("paper", "trail_levels", "five_cells", "six_cells")
DIRECTIONS = (
    Direction("runs", "of a run", runs, (1, 4, 16, 64, 256, 1024)),
    Direction("ants", "of an ant", ants, (100, 1000, 10_000, 100_000, 1_000_000)),
    Direction("cells", "of an ant, 10 000 ants", cells, (100, 200, 400, 800, 1600)),
    Direction("states", "of a run, 64 runs", states, (128, 432, 2048, 8192)),
)
SMALL = (
    Direction("runs", "of a run", lambda n: runs(n, episodes=2), (1, 4)),
    Direction("ants", "of an ant", ants, (50, 100)),
)

# By direction, threads and size: steps per second, CPU nanoseconds per step.
Paces = dict[tuple[Direction, int, int], list[tuple[float, float]]]


def measured(directions: Sequence[Direction], rounds: int, seconds: float) -> Paces:
    """Return the paces of all sizes, with 1 thread and with all threads."""
    every = [(one, size) for one in directions for size in one.sizes]
    threads = sorted({1, runtime.available_threads()})
    found: Paces = {(one, k, size): [] for one, size in every for k in threads}
    total, done = len(every) * len(threads) * rounds, 0
    with progress_bar("Measuring") as progress:
        works = [one.make(size) for one, size in every]
        for _ in range(rounds):
            for k in threads:
                runtime.start(k)
                for (one, size), work in zip(every, works, strict=True):
                    work()  # loads kernels, because Taichi has been restarted
                    found[one, k, size].append(pace(work, seconds))
                    done += 1
                    progress(done / total)
    return found


class Memory(NamedTuple):
    """Bytes per unit of a quantity: of stored arrays, and of the peak of the process."""

    of: str
    arrays: float
    process: float


def memory(small: bool) -> list[Memory]:
    """Return the memory per run without its outcomes, per ant and per cell."""
    few = 200 if small else 20_000
    side = 20 if small else 600
    n_ants = 200 if small else 600_000  # so many that sums per thread matter little
    episodes, outcomes = 20, 3 * np.dtype(np.int32).itemsize

    def training(n: int) -> Callable[[], list[np.ndarray]]:
        def work() -> list[np.ndarray]:
            came = train(worlds.paper(), Q_LEARNING, range(n), episodes, 100)
            return list(vars(came.state).values())

        return work

    def colony(n: int, side: int) -> Callable[[], list[np.ndarray]]:
        made = colony_of(n, side)

        def work() -> list[np.ndarray]:
            made.begin_episode()
            made.tick(1)
            return [*made.arrays.values(), *made.at_start.values()]

        return work

    sides = {n_cells(one): one for one in (side, 2 * side)}
    for one in sides.values():
        open_world(one)  # cached, and not counted
    with progress_bar("Memory") as progress:
        kept, taken = growth(training, few, 2 * few)
        found = [Memory("run", kept, taken - episodes * outcomes)]
        progress(0.3)
        found.append(Memory("ant", *growth(lambda n: colony(n, 2 * side), n_ants, 2 * n_ants)))
        progress(0.8)
        found.append(Memory("cell", *growth(lambda n: colony(100, sides[n]), *sides)))
    return found


def growth(
    prepare: Callable[[int], Callable[[], list[np.ndarray]]], few: int, many: int
) -> tuple[float, float]:
    """Return bytes per additional unit: of stored arrays, and of the peak of the process."""
    prepare(few)()  # compiles kernels and fills caches
    (kept, peak), (kept_more, higher_peak) = (_measure(prepare, n) for n in (few, many))
    return (kept_more - kept) / (many - few), (higher_peak - peak) / (many - few)


def _measure(prepare: Callable[[int], Callable[[], list[np.ndarray]]], n: int) -> tuple[int, float]:
    _give_back()
    before, work = _kilobytes("VmRSS"), prepare(n)
    _give_back()
    if _STATUS.exists():
        Path("/proc/self/clear_refs").write_text("5")  # resets the peak
    kept = sum(array.nbytes for array in work())
    return kept, (_kilobytes("VmHWM") - before) * 1024


def _give_back() -> None:
    """Return free memory to the system, so that it does not count for the process."""
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None) if _STATUS.exists() else None
    if trim is not None:
        trim(0)


def _kilobytes(name: str) -> float:
    """Return a memory value of this process in kB, or nan if the system is not Linux."""
    if not _STATUS.exists():
        return float("nan")
    lines = _STATUS.read_text().splitlines()
    return next(float(line.split()[1]) for line in lines if line.startswith(f"{name}:"))


def tables(found: Paces, memories: Sequence[Memory], rounds: int) -> list[Table]:
    """Return the tables of throughput and of memory."""
    rows = []
    for (one, threads, size), values in found.items():
        steps, cpu = np.array(values).T
        shown = thousands(n_cells(size) if one.of == "cells" else size)
        spread = interval(steps.min() / 1e6, steps.max() / 1e6)
        numbers = figure(np.median(steps) / 1e6), spread, figure(np.median(cpu))
        rows.append([one.of, one.step, shown, str(threads), *numbers])
    columns = ["size", "one step", "number", "threads", "M steps/s", "lowest, highest", "CPU ns"]
    about = f"Medians of {rounds} rounds. {machine(('taichi', 'numpy'))}"
    paces = Table("Throughput by size", columns, rows, [about], text_columns=2)
    bytes_each = [[one.of, *map(_whole, one[1:])] for one in memories]
    columns = ["bytes per", "stored arrays", "peak of the process"]
    note = "Runs are counted without their outcomes, which take 12 bytes per episode."
    return [paces, Table("Memory per run, ant and cell", columns, bytes_each, [note])]


def _whole(value: float) -> str:
    return MISSING if np.isnan(value) else thousands(round(value))


def draw(found: Paces) -> None:
    """Draw the throughput into docs/figures/growth.png.

    Raises:
        AntsError: The file cannot be written.
    """
    directions = list(dict.fromkeys(one for one, *_ in found))
    with style.styled():
        drawn = style.new_figure(3.1)
        panels = drawn.subplots(1, len(directions), squeeze=False)[0]
        for axes, one in zip(panels, directions, strict=True):
            lines: dict[str, list[tuple[float, ...]]] = {}
            for (which, threads, size), values in found.items():
                if which is one:
                    steps = np.array(values)[:, 0] / 1e6
                    label = f"{threads} thread{'s' * (threads > 1)}"
                    place = n_cells(size) if one.of == "cells" else size
                    point = (place, float(np.median(steps)), steps.min(), steps.max())
                    lines.setdefault(label, []).append(point)
            draw_lines(axes, lines)
            count_in_powers(axes.xaxis)
            axes.set(title=one.of.capitalize(), xlabel=f"number of {one.of}\n(steps {one.step})")
            axes.set_ylim(0)
        panels[0].set_ylabel("million steps per second")
        caption = "Medians, with the lowest and highest. Runs learn by Q-learning, ants by SARSA."
        title = "Throughput by the number of runs, ants, cells and states"
        style.frame(drawn, title, caption, style.legend_entries(panels))
    style.save(drawn, FIGURES / "growth.png")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    add("--rounds", type=whole_number(1), default=5, metavar="N", help="measure each N times")
    add("--small", action="store_true", help="do little work, to test this command")
    add("--publish", action="store_true", help="write them to docs/results/performance.md")

    def command() -> None:
        given = parser.parse_args(arguments)
        memories = memory(given.small)
        found = measured(
            SMALL if given.small else DIRECTIONS, given.rounds, 0.3 * (not given.small)
        )
        made = tables(found, memories, given.rounds)
        if given.publish:
            draw(found)
        show("performance_growth", made, given.publish)

    run_command(command)


if __name__ == "__main__":
    main()
