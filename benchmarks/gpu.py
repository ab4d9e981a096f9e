"""Compare the results of a GPU with those of a CPU, and measure its speed.

Results are those of trainings, environments and colonies with each feature of the model. Those of
trainings and colonies have hashes recorded on a CPU, in tests/golden. They are compared in several
processes, because kernels take long to compile; after `--seconds`, the command leaves out those
that have not ended, and says so. Speeds are those of a second call, by the wall clock. It prints
each line when it has it, then tables.

Without a GPU, `--on-cpu` compares the results of kernels for a GPU, which run on the CPU.
"""

from __future__ import annotations

import ctypes
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, wait
from functools import partial
from multiprocessing import active_children, get_context

import numpy as np
from cores import COLONIES, Q_LEARNING, colony_of
from measuring import ROOT, a_ratio, machine, pace, show

from taichi_ants import AntsError, Task, runtime, train, worlds
from taichi_ants.analysis.tables import Table, figure
from taichi_ants.engines.colony import stepping
from taichi_ants.envs.forage import HexForageVectorEnv, Rollout
from taichi_ants.studies.command_line import Parser, run_command

os.environ.setdefault("TI_ADVANCED_OPTIMIZATION", "1")  # `record` would choose 0, to compile faster
sys.path.insert(0, str(ROOT / "tests" / "golden"))
import record  # type: ignore[import-not-found]

_H200 = 4.8e12  # bytes/s, of the GPU for which goals are stated
MANY = 65_536  # runs, or environments


def card() -> tuple[str, float]:
    """Return the name of the GPU, and bytes/s of its memory; AntsError without one."""
    device, kilohertz, bits = ctypes.c_int(), ctypes.c_int(), ctypes.c_int()
    try:
        driver = ctypes.CDLL("libcuda.so")
        status = driver.cuInit(0) or driver.cuDeviceGet(ctypes.byref(device), 0)
    except OSError:
        status = -1
    if status:
        raise AntsError("no CUDA device is usable here; --on-cpu compares results without one.")
    name = ctypes.create_string_buffer(99)
    driver.cuDeviceGetName(name, 99, device)
    driver.cuDeviceGetAttribute(ctypes.byref(kilohertz), 36, device)
    driver.cuDeviceGetAttribute(ctypes.byref(bits), 37, device)
    return name.value.decode(), 2e3 * kilohertz.value * bits.value / 8


def environments() -> str:
    """Return the hash of steps and rollouts of environments."""
    digest = record.Digest()
    for mode in ("NextStep", "SameStep"):
        task = Task().replace(noise={"slip": 0.1, "misread": 0.1}, pheromone={"deposit": "fading"})
        env = HexForageVectorEnv(600, task=task, max_steps=60, autoreset_mode=mode)
        env.reset(seed=4)
        for action in (1, 0, 1, 2, 1):
            digest.add(*env.step(np.full(600, action))[:4])
        digest.add(*env.rollout("trail_follower", 130, epsilon=0.3))
        digest.add(*env.rollout(np.random.default_rng(1).integers(5, size=(70, 600))))
        digest.add(env._ants.batched.snapshot(7).trail)
    return digest.text()


def training(learner: str) -> Iterator[str]:
    """Yield the hash of a training, and the one recorded."""
    for name, made in record.drawing.random_trainings(learner, 1, learner in ("sarsa", "dyna_q")):
        yield from (record.of_training(made), record.recorded()[1][name])


def colony(group: str, most_in_one_loop: int) -> Iterator[str]:
    """Yield the hash of a colony, and the one recorded."""
    stepping._MOST_IN_ONE_LOOP = most_in_one_loop
    for name, drawn in record.drawing.colonies_of(group, 1):
        yield from (record.of_colony(drawn, "by_ant"), record.recorded()[1][name])


def speed_of_colony(ants: int, n_worlds: int) -> float:
    """Return million steps/s of ants that learn while they forage."""
    alive = colony_of(ants, n_worlds)

    def ticks() -> int:
        alive.tick(64)
        return 64 * ants * n_worlds

    ticks()
    return pace(ticks, 2.0)[0] / 1e6


def speed_of_training(threads_of_block: int) -> float:
    """Return million steps/s of runs that learn by Q-learning in the paper's world."""
    from taichi_ants.engines.runs import kernels

    kernels.THREADS_OF_BLOCK = threads_of_block
    kernels.run_kernel.cache_clear()
    for _ in range(2):
        done = train(worlds.paper(), Q_LEARNING, range(MANY), 30, task=Task(delivery="truncates"))
    return float(done.steps.sum(dtype=np.int64) / done.seconds / 1e6)


def speed_of_environments(act: Callable[[HexForageVectorEnv, int], object], length: int) -> float:
    """Return million steps/s of environments with random actions."""
    env = HexForageVectorEnv(MANY, observation_format="index")
    env.reset(seed=0)

    def steps() -> int:
        act(env, length)
        return length * MANY

    steps()
    return pace(steps, 2.0)[0] / 1e6


def roll(env: HexForageVectorEnv, length: int) -> Rollout:
    """Take steps at random; the results stay on the GPU."""
    return env.rollout("random", length, epsilon=1.0)


def roll_and_read(env: HexForageVectorEnv, length: int) -> object:
    """Take steps at random, and read all results."""
    return [*roll(env, length)]


def step(env: HexForageVectorEnv, length: int) -> None:
    """Take one step at random."""
    env.step(env.np_random.integers(5, size=MANY))


# Their goals, or None.
SPEEDS: dict[str, tuple[float | None, Callable[[], float]]] = {
    "colony, 1 000 000 ants": (1500, partial(speed_of_colony, *COLONIES[0])),
    "`train`, 65 536 runs": (3000, partial(speed_of_training, 32)),
    "`rollout`, 65 536 environments": (2000, partial(speed_of_environments, roll, 256)),
    "`rollout`, and all results read": (None, partial(speed_of_environments, roll_and_read, 256)),
    "colony, 100 000 ants": (400, partial(speed_of_colony, *COLONIES[1])),
    "colony, 4 096 worlds of 64 ants": (1000, partial(speed_of_colony, *COLONIES[3])),
    "colony, 10 000 ants": (None, partial(speed_of_colony, *COLONIES[2])),
    "`step`, 65 536 environments": (None, partial(speed_of_environments, step, 1)),
    "`train`, blocks of 1 thread": (None, partial(speed_of_training, 1)),
    "`train`, blocks of 128 threads": (None, partial(speed_of_training, 128)),
}


def cases(expected: str) -> dict[str, Callable[[], Iterator[str]]]:
    """Return functions that yield a hash and that of a CPU; `expected` is that of environments."""
    groups = record.drawing.GROUPS
    return {
        "environments": lambda: iter((environments(), expected)),
        **{f"training: {name}": partial(training, name) for name in record.TRAINED},
        **{f"colony: {group}": partial(colony, group, 10**9) for group in groups},
        **{f"colony by loops: {group}": partial(colony, group, 0) for group in groups},
    }


def start(on_cpu: bool) -> None:
    """Start Taichi for kernels for a GPU."""
    if on_cpu:
        runtime.gpu_kernels_on_cpu = True
    else:
        runtime.start(arch="cuda")


def compared(case: str, expected: str) -> str:
    """Return whether the results of a case have the hash of a CPU."""
    try:
        ours, theirs = cases(expected)[case]()
    except Exception as error:  # the others are worth the time on a GPU
        return f"FAILED: {error}"
    return "equal" if ours == theirs else "DIFFERENT"


def comparisons(seconds: float, on_cpu: bool, word: str) -> Iterator[list[str]]:
    """Yield the name of each case that contains a word, and its result, when it has ended."""
    expected = environments() if word in "environments" else ""
    chosen = [case for case in cases(expected) if word in case]
    if not chosen:
        raise AntsError(f"--only is {word!r}; choose a word such as training, colony or life.")
    workers = min(runtime.available_threads(), len(chosen))
    end = time.perf_counter() + seconds
    with ProcessPoolExecutor(workers, get_context("spawn"), start, (on_cpu,)) as pool:
        results = {case: pool.submit(compared, case, expected) for case in chosen}
        try:
            for case, result in results.items():
                done, _ = wait([result], max(0.0, end - time.perf_counter()))
                yield [case, result.result() if done else "left out"]
        finally:  # also after Ctrl-C; what is left out would disturb the speeds
            pool.shutdown(wait=False, cancel_futures=True)
            for worker in active_children():
                worker.terminate()


def speeds(bandwidth: float) -> Iterator[list[str]]:
    """Yield the name of each measure, million steps/s, the goal for this GPU, and the share."""
    start(on_cpu=False)
    for name, (goal, measure) in SPEEDS.items():
        try:
            found = measure()
        except Exception as error:
            yield [name, f"FAILED: {error}", "", ""]
            continue
        wanted = goal and goal * bandwidth / _H200
        yield [
            name,
            figure(found),
            *((figure(wanted), figure(found / wanted)) if wanted else ("", "")),
        ]


def measured(seconds: float, on_cpu: bool, word: str) -> list[Table]:
    """Return a table of results that are equal or not, and one of speeds."""
    name, bandwidth = ("Without a GPU, on a CPU", 0.0) if on_cpu else card()
    rows, paces = [], []
    for row in comparisons(seconds, on_cpu, word):
        print(*row, sep="  ", flush=True)
        rows.append(row)
    if not on_cpu:
        name += f", {figure(bandwidth / 1e12)} TB/s"
        for row in speeds(bandwidth):
            print(*row, sep="  ", flush=True)
            paces.append(row)
    kinds = "environments", "training", "colony:", "colony by loops"
    results = [summary(kind, dict(rows)) for kind in kinds]
    about = f"{name}: {machine(('taichi', 'numpy'))}"
    columns = ["", "cases", "equal to a CPU's", "others"]
    made = [Table("Results of kernels for a GPU", columns, results, [about])]
    if paces:
        made.insert(0, Table("Speed", ["M steps/s", "measured", "goal", "share of it"], paces))
    return made


def summary(kind: str, results: dict[str, str]) -> list[str]:
    """Return the row of all cases of a kind: how many are equal, and the others."""
    found = {case: result for case, result in results.items() if case.startswith(kind)}
    others = [f"{case}: {result}" for case, result in found.items() if result != "equal"]
    return [kind.rstrip(":"), str(len(found)), str(len(found) - len(others)), "; ".join(others)]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    add("--seconds", type=a_ratio, default=200.0, help="compare no longer")
    add("--only", metavar="WORD", default="", help="compare results whose name has this word")
    add("--on-cpu", action="store_true", help="run kernels for a GPU on the CPU")
    add("--publish", action="store_true", help="write the tables to docs/results/performance.md")

    def command() -> None:
        given = parser.parse_args(arguments)
        if given.publish and (given.on_cpu or given.only):
            raise AntsError("--publish needs all results of a GPU; leave out --on-cpu and --only.")
        if not given.on_cpu:
            card()
        tables = measured(given.seconds, given.on_cpu, given.only)
        show("performance_gpu", tables, given.publish)
        if any(word in str(tables) for word in ("DIFFERENT", "FAILED")):
            raise AntsError("some parts failed, or differ from those of a CPU.")

    run_command(command)


if __name__ == "__main__":
    main()
