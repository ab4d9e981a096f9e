"""How fast the paper's grid trains: environment steps per second, beside the same in plain C.

Trains 64 configurations with 100 seeds each, delivery continuing, after a short run that
compiles. CPU time is that of all threads together, so other processes hardly disturb it. The
yardstick is ant.c, one thread, compiled with -O3 for this processor; it learns by Q-learning only.
"""

from __future__ import annotations

import ctypes
import itertools
import os
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

from taichi_ants import Task, TrainingConfig, World, train, worlds
from taichi_ants.analysis.paper.published import GRID
from taichi_ants.errors import AntsError
from taichi_ants.grid.constants import STREAM_ANT
from taichi_ants.grid.randomness import stream_state
from taichi_ants.studies.command_line import Parser, run_command, whole_number
from taichi_ants.task.constants import EPISODE_STEPS, EPISODES

SOURCE = Path(__file__).with_name("ant.c")
FLAGS = ("-O3", "-march=native", "-std=c11", "-ffp-contract=off", "-shared", "-fPIC")
LEARNERS = (("q_learning", 0), ("sarsa", 0), ("dyna_q", 3), ("dyna_q", 5))
SEEDS_IN_C = 10  # as many of the seeds, since it runs on one thread


class CWorld(ctypes.Structure):
    """The struct World of ant.c."""

    _fields_ = (
        ("size", ctypes.c_int32),
        *((name, ctypes.c_void_p) for name in ("ground", "trail", "closer", "offsets")),
        *((name, ctypes.c_int32) for name in ("cell", "heading")),
    )


def compiler() -> str | None:
    """The C compiler of this machine: CC, cc, gcc or clang; None if there is none."""
    names = (os.environ.get("CC"), "cc", "gcc", "clang")
    return next((found for name in names if name and (found := shutil.which(name))), None)


def load_yardstick(command: str, folder: str) -> ctypes.CDLL:
    """Compile ant.c in a folder and load it."""
    library = Path(folder) / "ant.so"
    subprocess.run([command, *FLAGS, "-o", library, SOURCE], check=True, capture_output=True)
    loaded = ctypes.CDLL(str(library))
    real, whole, pointer = ctypes.c_double, ctypes.c_int, ctypes.c_void_p
    loaded.train.argtypes = (
        *(CWorld, ctypes.c_uint64, ctypes.c_float, ctypes.c_float, real, real, real),
        *(whole, whole, whole, pointer, pointer, pointer),
    )
    loaded.train.restype = ctypes.c_int64
    return loaded


def train_in_c(
    yardstick: ctypes.CDLL,
    world: World,
    config: TrainingConfig,
    continuing: bool,
    seed: int,
    episodes: int,
    max_steps: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """One run of Q-learning: returns, steps (episodes,), action values (128, 5), CPU seconds."""
    cells, headings = world.start(seed)
    offsets = world.grid.offsets[(np.arange(8) - 1) % 6]
    arrays = (world.ground(), world.trail_levels(), world.closer(), offsets)
    kept = [np.ascontiguousarray(array) for array in arrays]
    pointers = (array.ctypes.data for array in kept)
    in_c = CWorld(world.grid.size, *pointers, int(cells[0]), int(headings[0]))
    q_values = np.zeros((128, 5), np.float32)
    returns, steps = np.zeros((2, episodes), np.int32)
    began = time.process_time()
    yardstick.train(
        *(in_c, stream_state(seed, STREAM_ANT, 0), config.learning_rate, config.discount),
        *(config.epsilon, config.epsilon_decay, config.min_epsilon),
        *(continuing, episodes, max_steps),
        *(array.ctypes.data for array in (q_values, returns, steps)),
    )
    return returns, steps, q_values, time.process_time() - began


def grid(learner: str, planning_steps: int) -> list[TrainingConfig]:
    """The paper's 16 configurations of a learner."""
    more = {"planning_steps": planning_steps} if planning_steps else {}
    return [TrainingConfig(learner, *point, hyperparameters=more) for point in GRID]


def measure_c(command: str, seeds: int) -> float:
    """CPU nanoseconds of a step of Q-learning in C."""
    total, seconds = 0, 0.0
    with tempfile.TemporaryDirectory() as folder:
        yardstick = load_yardstick(command, folder)
        for config, seed in itertools.product(grid("q_learning", 0), range(seeds)):
            run = train_in_c(yardstick, worlds.paper(), config, True, seed, EPISODES, EPISODE_STEPS)
            total += int(run[1].sum(dtype=np.int64))
            seconds += run[3]
    return seconds * 1e9 / total


def measure(seeds: int, threads: int | None, least: float) -> None:
    """Print a line for each learner, and for C.

    Raises:
        AntsError: C is so much faster that the ratio is below `least`.
    """
    print(
        f"{'':16}{'runs':>6}{'steps':>13}{'wall s':>9}{'CPU s':>9}{'M steps/s':>11}{'ns/step':>9}"
    )
    line = "{:16}{:6}{:13,}{:9.2f}{:9.2f}{:11.1f}{:9.1f}"
    fastest, task = 0.0, Task(delivery="continuing")
    for learner, planning_steps in LEARNERS:
        configs = grid(learner, planning_steps)
        train(worlds.paper(), configs, 0, 1, 1, threads=threads)
        began = time.perf_counter()
        result = train(worlds.paper(), configs, range(seeds), task=task)
        wall, steps = time.perf_counter() - began, int(result.steps.sum(dtype=np.int64))
        nanoseconds = result.seconds * 1e9 / steps
        fastest = fastest or nanoseconds
        label = learner + (f" (p{planning_steps})" if planning_steps else "")
        counts = len(configs) * seeds, steps, wall, result.seconds
        print(line.format(label, *counts, steps / wall / 1e6, nanoseconds))
    if (command := compiler()) is None:
        print("There is no C compiler (cc, gcc, clang or CC), so no comparison with plain C.")
        return
    in_c = measure_c(command, min(seeds, SEEDS_IN_C))
    print(f"Q-learning in plain C takes {in_c:.1f} ns a step: {in_c / fastest:.2f} times ours.")
    if in_c / fastest < least:
        raise AntsError(
            f"training goes at {in_c / fastest:.2f} of the pace of C; at least {least:g} is "
            "expected, so look for what has made it slower."
        )


def main(arguments: list[str] | None = None) -> None:
    """The command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    add("--seeds", type=whole_number(1), default=100, metavar="N", help="seeds of each setting")
    add("--threads", type=whole_number(1, 1024), metavar="N", help="CPU threads (default: all)")
    add("--least", type=float, default=0.0, metavar="RATIO", help="fail below this ratio to C")
    run_command(lambda: measure(**vars(parser.parse_args(arguments))))


if __name__ == "__main__":
    main()
