"""Measure what Ray costs: the speed of two workers, and the head's time for each block.

    python benchmarks/ray_blocks.py             # about two minutes; requires taichi_ants[ray]

The first part computes the same sweep with one process of two threads and with two Ray workers of
one thread each, in turn, and prints the ratio of their speeds. The second part gives the head
blocks whose outcomes are already known, and prints the CPU time of the head for each block: without
Ray, and with Ray, whose workers return at once.
"""

from __future__ import annotations

import argparse
import os
import pickle
import resource
import statistics
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import Future
from operator import getitem
from pathlib import Path
from typing import Any

from taichi_ants.studies.ray_workers import RayWorkers

from taichi_ants.studies.points import ColonyPoint
from taichi_ants.studies.sweep import read_sweep

TRAINING = """
[training]
learner = "sarsa"
learning_rate = 0.1
discount = 0.9
epsilon = 0.3
epsilon_decay = 0.99
"""
RUNS = f"""
kind = "runs"
measures = ["return_all"]
seeds = 3000
episodes = 500
max_steps = 600
rollouts = 3
{TRAINING}
[vary]
training.initial_q = [0.0, 0.1, 0.2, 0.3]
"""
COLONIES = f"""
kind = "colony"
measures = ["deliveries", "blocked"]
seeds = 400
ants = 16
episodes = 3
ticks = 50
rollouts = 1
[world]
preset = "open"
ranges = [20, 20, 20]
per_seed = PER_SEED
[task]
evaporation_in_training = true
{TRAINING}
[vary]
task.rewards.shaping = [{", ".join(map(str, range(50)))}]
"""
SEEDS_OF_A_BLOCK = 20


def computed(text: str, **how: Any) -> int:
    """Return the number of blocks of a sweep, after computing all of them."""
    with tempfile.TemporaryDirectory() as folder:
        blocks = Path(folder, "work", "blocks")
        blocks.mkdir(parents=True)
        sweep = read_sweep(Path("sweep.toml"), text)
        sweep.measured(blocks, lambda share: None, threads=how.pop("threads", 1), **how)
        return len(list(blocks.iterdir()))


class Known:
    """An executor that computes one block, and has its outcome for all others."""

    num_workers = 50

    def __init__(self, executor: Any = None) -> None:
        self.executor, self.outcome, self.sent = executor, b"", 0
        self.began = 0.0, 0.0  # CPU time and time after the first block

    def submit(self, call: Callable[..., Any], /, *arguments: Any) -> Future[Any]:
        """Return the future of an outcome, from Ray if there is an executor."""
        if not self.outcome:
            self.outcome = pickle.dumps(call(*arguments), -1)
            self.began = cpu(), time.perf_counter()
        self.sent += len(arguments[-1])
        if self.executor:
            return self.executor.submit(getitem, (pickle.loads(self.outcome), arguments), 0)
        future: Future[Any] = Future()
        future.set_result(pickle.loads(self.outcome))
        return future


def cpu() -> float:
    """Return the CPU time of this process in seconds, without that of others."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Measure and print both parts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5, metavar="N", help="rounds in turn")
    settings = parser.parse_args()
    os.chdir(tempfile.gettempdir())  # which Ray adds to the paths of imports of its workers
    with RayWorkers() as workers:
        seconds: dict[str, list[float]] = {"process": [], "ray": []}
        for number in range(settings.rounds + 1):
            for name, how in (("process", {"threads": 2}), ("ray", {"executor": workers})):
                began = time.perf_counter()
                blocks = computed(RUNS, **how)
                if number:  # the first round compiles
                    seconds[name].append(time.perf_counter() - began)
        ratios = [a / b for a, b in zip(*seconds.values(), strict=True)]
        print(f"{blocks} blocks: {', '.join(f'{n} {min(s):.2f} s' for n, s in seconds.items())}")
        print(f"speed with Ray / without: {statistics.median(ratios):.3f} (median of rounds)")
        ColonyPoint.runs_of_a_block = SEEDS_OF_A_BLOCK  # type: ignore[assignment, method-assign]
        for per_seed in ("false", "true"):
            for name, executor in (("no executor", None), ("Ray", workers)):
                known, text = Known(executor), COLONIES.replace("PER_SEED", per_seed)
                blocks = computed(text, executor=known, in_flight=100)
                own, wall = cpu() - known.began[0], time.perf_counter() - known.began[1]
                print(
                    f"{blocks} blocks, a world for each seed {per_seed}, {name}: "
                    f"{own / blocks * 1e3:.2f} ms CPU, {wall / blocks * 1e3:.2f} ms, "
                    f"{known.sent / blocks:.0f} bytes sent, {len(known.outcome)} received"
                )


if __name__ == "__main__":
    main()
