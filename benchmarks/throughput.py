"""Compare the speed of training the paper's grid with two programs in C that do the same.

The command trains the paper's 16 configurations of each learner with several seeds; a delivery
truncates the episode. The program ant.c is C without vector instructions, compiled to do four runs
at a time and to do one, of which the faster counts in each round. The program ant_vector.c does
sixteen runs at a time, in the lanes of AVX-512 vectors. All are compiled with -O3 for this
processor, and their results are bit-for-bit equal to those of Taichi Ants. The
command measures all three in turn, several times. The table contains medians, and ratios above 1
where Taichi Ants is faster. One thread is measured by processor time, which other programs hardly
change; several threads are measured by the wall clock.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from measuring import a_ratio, machine, show
from systems.paper_world import GRID

from taichi_ants import Task, TrainingConfig, World, runtime, train, worlds
from taichi_ants.analysis.tables import MISSING, Table, figure, thousands
from taichi_ants.engines.runs.results import TrainingResult
from taichi_ants.errors import AntsError, count
from taichi_ants.grid.constants import STREAM_ANT
from taichi_ants.grid.randomness import stream_state
from taichi_ants.studies.command_line import Parser, progress_bar, run_command, whole_number
from taichi_ants.task.constants import EPISODE_STEPS, EPISODES

ENGINE = Path(__file__).resolve().parent.parent / "lab" / "engine"  # the C that the lab shares
SOURCES = [ENGINE / "ant.c", Path(__file__).with_name("ant_vector.c")]
FLAGS = ("-O3", "-march=native", "-std=c11", "-ffp-contract=off", "-shared", "-fPIC")
LEARNERS = {
    "Q-learning": ("q_learning", 0),
    "SARSA": ("sarsa", 0),
    "Dyna-Q (p3)": ("dyna_q", 3),
    "Dyna-Q (p5)": ("dyna_q", 5),
}
YARDSTICKS = {"train": "C", "train_vector": "vector C"}  # functions in C, and their names in tables
_NUMBERS_IN_C = ("q_learning", "sarsa", "dyna_q")  # learners by their number in C

_RUN = np.dtype(  # the struct Run of ant.h
    [
        ("random", np.uint64),
        *((name, np.float64) for name in ("epsilon", "epsilon_decay", "min_epsilon")),
        *((name, np.float32) for name in ("learning_rate", "discount")),
        *((name, np.int32) for name in ("cell", "heading")),
    ]
)


class CWorld(ctypes.Structure):
    """The struct World of ant.h."""

    _fields_ = (
        ("size", ctypes.c_int32),
        *((name, ctypes.c_void_p) for name in ("ground", "trail", "closer", "offsets")),
    )


class CJob(ctypes.Structure):
    """The struct Job of ant.h."""

    _fields_ = (
        *(
            (name, ctypes.c_int32)
            for name in ("n", "learner", "planning_steps", "delivery_truncates")
        ),
        *((name, ctypes.c_int32) for name in ("episodes", "max_steps", "threads")),
        *((name, ctypes.c_void_p) for name in ("q", "returns", "steps", "deliveries")),
    )


class Trained(NamedTuple):
    """The results of a program in C, by configuration and seed, and its seconds.

    `returns` and `steps` are int32 (c, s, episodes), `q_values` float32 (c, s, 128, 5).
    """

    returns: np.ndarray
    steps: np.ndarray
    q_values: np.ndarray
    seconds: float


Yardstick = Callable[[Any, Any, Any], int]  # a function of C


def compiler(threads: int) -> str | None:
    """Return the C compiler of this machine: CC, or else the first of clang, gcc and cc.

    For several threads, it is the first that has OpenMP, if there is one. None if there is no
    compiler. AntsError if CC is not a program; else it is not checked.
    """
    if chosen := os.environ.get("CC"):
        if own := shutil.which(chosen):
            return own
        raise AntsError(f"CC is {chosen!r}; it must be the name or path of a compiler, or unset.")
    found = [one for name in ("clang", "gcc", "cc") if (one := shutil.which(name))]
    usable = (one for one in found if threads == 1 or _has_openmp(one))
    return next(usable, found[0] if found else None)


def checked_compiler(threads: int, publishes: bool) -> str | None:
    """Return the C compiler. Without one, print that there is none; AntsError to publish."""
    command = compiler(threads)
    if command is None and publishes:
        raise AntsError("--publish requires a C compiler, CC, clang, gcc or cc; install one.")
    if command is None:
        print("There is no C compiler (CC, clang, gcc or cc), so the comparison is skipped.")
    return command


def _has_openmp(command: str) -> bool:
    """Return whether a compiler can compile and link OpenMP, which clang has as its own package."""
    with tempfile.TemporaryDirectory() as folder:
        source, library = Path(folder, "openmp.c"), Path(folder, "openmp.so")
        source.write_text("#include <omp.h>\nint threads(void) { return omp_get_max_threads(); }\n")
        built = [command, "-fopenmp", "-shared", "-fPIC", "-o", library, source]
        return subprocess.run(built, capture_output=True).returncode == 0


def compile_c(
    command: str, sources: Sequence[Path], library: Path, threads: int, *more: str
) -> ctypes.CDLL:
    """Return C sources as a library, compiled into a file; with OpenMP for several threads.

    Raises:
        AntsError: The compiler fails, for example because it has no OpenMP.
    """
    parallel = ["-fopenmp"] if threads > 1 else []
    done = subprocess.run(
        [command, *FLAGS, *more, *parallel, f"-I{ENGINE}", "-o", library, *sources, "-lm"],
        capture_output=True,
        text=True,
    )
    if done.returncode:
        said = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr)
        advice = "install its OpenMP, use `--threads 1`, or " if parallel else ""
        raise AntsError(
            f"{command} cannot compile {', '.join(one.name for one in sources)}: {said.strip()}; "
            f"{advice}set CC to another compiler."
        )
    return ctypes.CDLL(str(library))


def compiler_note(command: str, threads: int) -> str:
    """Return the version of a compiler and the flags, for tables."""
    done = subprocess.run([command, "--version"], capture_output=True, text=True)
    name = next(iter(done.stdout.splitlines()), command)
    parallel = " -fopenmp" if threads > 1 else ""
    return f"C by {name}, {' '.join(FLAGS[:-2])}{parallel}."


def load_yardsticks(command: str, folder: str | Path, threads: int) -> dict[str, list[Yardstick]]:
    """Return functions in C by name, compiled in a folder; vector C requires AVX-512."""
    loaded = [
        compile_c(command, sources, Path(folder) / f"{runs}.so", threads, f"-DTOGETHER={runs}")
        for runs, sources in ((1, SOURCES[:1]), (4, SOURCES))
    ]
    found = {n: [getattr(c, f) for c in loaded if hasattr(c, f)] for f, n in YARDSTICKS.items()}
    return {name: functions for name, functions in found.items() if functions}


def clock(threads: int) -> float:
    """Return processor time for one thread, or wall-clock time for several, in seconds."""
    return time.process_time() if threads == 1 else time.perf_counter()


def train_in_c(
    yardstick: Yardstick,
    world: World,
    configs: Sequence[TrainingConfig],
    seeds: Sequence[int],
    delivery_truncates: bool,
    episodes: int = EPISODES,
    max_steps: int = EPISODE_STEPS,
    threads: int = 1,
) -> Trained:
    """Return the results of training in C, for configurations that differ only in the grid.

    Raises:
        AntsError: There is too little memory for C.
    """
    offsets = world.grid.offsets[(np.arange(8) - 1) % 6]
    arrays = (world.ground(), world.trail_levels(), world.closer(), offsets)
    kept = [np.ascontiguousarray(array) for array in arrays]
    runs = np.array([_run(world, config, seed) for config in configs for seed in seeds], _RUN)
    shape = len(configs), len(seeds)
    q_values = np.zeros((*shape, 128, 5), np.float32)
    returns, steps = np.zeros((2, *shape, episodes), np.int32)
    planning_steps = dict(configs[0].hyperparameters).get("planning_steps", 0)
    job = CJob(
        *(
            len(runs),
            _NUMBERS_IN_C.index(configs[0].learner),
            int(planning_steps),
            delivery_truncates,
        ),
        *(episodes, max_steps, threads),
        *(array.ctypes.data for array in (q_values, returns, steps)),
    )
    in_c = CWorld(world.grid.size, *(array.ctypes.data for array in kept))
    began = clock(threads)
    enough = yardstick(ctypes.byref(in_c), ctypes.byref(job), ctypes.c_void_p(runs.ctypes.data))
    seconds = clock(threads) - began
    if not enough:
        raise AntsError(f"C cannot allocate memory for {len(runs)} runs; choose fewer seeds.")
    return Trained(returns, steps, q_values, seconds)


def _run(world: World, config: TrainingConfig, seed: int) -> tuple[float, ...]:
    cells, headings = world.start(seed)
    settings = (getattr(config, name) for name in _RUN.names[1:-2])
    return (stream_state(seed, STREAM_ANT, 0), *settings, cells[0], headings[0])


def grid(learner: str, planning_steps: int) -> list[TrainingConfig]:
    """Return the paper's 16 configurations of a learner."""
    more = {"planning_steps": planning_steps} if planning_steps else {}
    return [TrainingConfig(learner, *point, hyperparameters=more) for point in GRID]


def check_same(trained: Trained, result: TrainingResult) -> None:
    """Check that the results of C are the same as those of the package.

    Raises:
        AntsError: They differ, so the paces cannot be compared.
    """
    for name in ("returns", "steps", "q_values"):
        if not np.array_equal(getattr(trained, name), getattr(result, name)):
            raise AntsError(f"C returns other {name} than the package; compare the two programs.")


def measured(
    yardsticks: dict[str, list[Yardstick]], seeds: Sequence[int], rounds: int, threads: int
) -> tuple[dict[str, int], dict[str, np.ndarray]]:
    """Return steps by learner, and seconds in the package and in n kinds of C, (rounds, 1 + n)."""
    steps, seconds = {}, {}
    world, task = worlds.paper(), Task(delivery="truncates")
    with progress_bar("Measuring") as progress:
        for label, learner in LEARNERS.items():
            configs, found = grid(*learner), []
            train(world, configs, 0, 1, 1, threads=threads)  # compiles kernels
            for number in range(rounds):
                began = time.perf_counter()
                result = train(world, configs, seeds, task=task, threads=threads)
                wall = time.perf_counter() - began
                steps[label] = int(result.steps.sum(dtype=np.int64))
                found.append([result.seconds if threads == 1 else wall])
                for functions in yardsticks.values():
                    every = [
                        train_in_c(one, world, configs, seeds, True, threads=threads)
                        for one in functions
                    ]
                    found[-1].append(min(trained.seconds for trained in every))
                    for trained in every[: len(every) * (number == 0)]:
                        check_same(trained, result)
                progress((len(seconds) + len(found) / rounds) / len(LEARNERS))
            seconds[label] = np.array(found)
    return steps, seconds


def table(
    names: Sequence[str],
    steps: dict[str, int],
    seconds: dict[str, np.ndarray],
    seeds: int,
    threads: int,
    compiled: Sequence[str] = (),
) -> Table:
    """Return a table with a row for each learner and one for all: paces, and medians of ratios."""
    rows, missing = [], [MISSING] * (len(YARDSTICKS) - len(names))
    for label in [*LEARNERS, "the grid"]:
        parts = [label] if label in LEARNERS else list(LEARNERS)
        done, taken = sum(steps[part] for part in parts), sum(seconds[part] for part in parts)
        paces = [figure(done / one / 1e6) for one in np.median(taken, axis=0)]
        ratios = [figure(one) for one in np.median(taken[:, 1:] / taken[:, :1], axis=0)]
        rows.append([label, thousands(done), *paces, *missing, *ratios, *missing])
    yardsticks = YARDSTICKS.values()
    columns = ["learner", "steps", "ours", *yardsticks, *(f"ours to {name}" for name in yardsticks)]
    what = "one thread, by processor time" if threads == 1 else f"{threads} threads, by wall clock"
    taken_of = f"{count(seeds, 'seed')}, medians of {count(len(taken), 'round')}"
    notes = [f"Million steps/s of {what}; {taken_of}. {machine(('taichi', 'numpy'))}"]
    notes += compiled
    if "C" in names and "vector C" not in names:
        notes.append("No vector C: this processor or its compiler has no AVX-512.")
    return Table("Training compared with C", columns, rows, notes)


def compare(seeds: int, rounds: int, threads: int, least: float, publishes: bool) -> None:
    """Print the table.

    Raises:
        AntsError: Training of a learner is slower than `least` times ant.c, or results differ.
    """
    threads = runtime.start(threads).threads
    command = checked_compiler(threads, publishes)
    with tempfile.TemporaryDirectory() as folder:
        yardsticks = load_yardsticks(command, folder, threads) if command else {}
        steps, seconds = measured(yardsticks, range(seeds), rounds, threads)
    compiled = [compiler_note(command, threads)] if command else []
    made = table(list(yardsticks), steps, seconds, seeds, threads, compiled)
    show("performance_training", [made], publishes)
    if not yardsticks:
        return
    ratios = {name: float(np.median(one[:, 1] / one[:, 0])) for name, one in seconds.items()}
    worst = min(ratios, key=ratios.__getitem__)
    if ratios[worst] < least:
        raise AntsError(
            f"{worst} has {ratios[worst]:.2f} times the pace of C, but at least {least:g} is "
            "expected; find out what has made it slower."
        )


def main(arguments: list[str] | None = None) -> None:
    """Run the command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    about = "train each configuration with N seeds"
    add("--seeds", type=whole_number(1), default=20, metavar="N", help=about)
    add("--rounds", type=whole_number(1), default=5, metavar="N", help="measure each N times")
    add("--threads", type=whole_number(1, 1024), default=1, metavar="N", help="use N CPU threads")
    about = "fail if the ratio of a learner to ant.c is below RATIO"
    add("--least", type=a_ratio, default=0.0, metavar="RATIO", help=about)
    add("--publish", action="store_true", help="write the table to docs/results/performance.md")

    def command() -> None:
        given = parser.parse_args(arguments)
        compare(given.seeds, given.rounds, given.threads, given.least, given.publish)

    run_command(command)


if __name__ == "__main__":
    main()
