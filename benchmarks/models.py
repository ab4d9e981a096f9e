"""Measure what the features of a model cost: pheromones, nests, castes, choice and noise.

Colonies of ants forage in an open world with four cells per ant, and learn by SARSA into a table
for each group. Each row adds one feature to the first; the last one has all of them. The command
measures all rows in turn, with one thread, several times, by the wall clock; the table contains
medians, and the ratio to the first row in the same round.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from measuring import machine, pace, show
from systems.ours import SARSA

from taichi_ants import Task, World, runtime, worlds
from taichi_ants.analysis.tables import Table, figure, interval, thousands
from taichi_ants.engines.colony.colony import Colony
from taichi_ants.studies.command_line import Parser, progress_bar, run_command, whole_number
from taichi_ants.task import foraging
from taichi_ants.task.constants import EMPTY

NESTS = "two nests"
FEATURES: dict[str, dict[str, Any]] = {
    "two pheromones": {
        "fields": {"from_nest": {"deposited_when": "without_food"}},
        "homing_cue": "from_nest",
    },
    NESTS: {},
    "two castes": {"castes": {"bold": {"epsilon": 0.3}, "careful": {"epsilon": 0.01}}},
    "softmax": {"choice": "softmax"},
    "slips and misread cells": {"noise": {"slip": 0.05, "misread": 0.05}},
}


def task_with(features: Sequence[str]) -> Task:
    """Return the foraging task with some features."""
    task = foraging()
    for name in features:
        task = task.replace(**FEATURES[name])
    return task


def world_of(n: int, nests: int) -> World:
    """Return an open world with four cells per ant, and one or two nests."""
    side = max(10, round((4 * n / 3) ** 0.5))
    world = worlds.open_world(0, (side, side, side))
    if nests == 1:
        return world
    free = np.flatnonzero(world.ground() == EMPTY)
    queens = [world.queen, world.grid.cells(free[len(free) // 4]).tolist()]
    return World(world.ranges, queens, world.foods, world.obstacles)


def colony_of(n: int, features: Sequence[str]) -> Colony:
    """Return a colony of n ants whose model has some features, after its kernels are compiled."""
    world = world_of(n, 1 + (NESTS in features))
    colony = Colony(world, task_with(features), SARSA, ants=n, start="spread")
    colony.begin_episode()
    colony.tick(1)
    return colony


def measured(n: int, rounds: int, seconds: float) -> dict[str, list[float]]:
    """Return the ant-steps per second of each model, by its features and round."""
    models = {"foraging": (), **{name: (name,) for name in FEATURES}, "all of these": (*FEATURES,)}
    found: dict[str, list[float]] = {name: [] for name in models}
    several = max(1, 50_000 // n)
    with progress_bar("Measuring") as progress:
        runtime.start(1)
        colonies = {name: colony_of(n, features) for name, features in models.items()}
        for number in range(rounds):
            for place, (name, colony) in enumerate(colonies.items(), start=1):

                def work(colony: Colony = colony) -> int:
                    colony.tick(several)
                    return several * n

                found[name].append(pace(work, seconds)[0])
                progress((number + place / len(colonies)) / rounds)
    return found


def table(found: dict[str, list[float]], n: int) -> Table:
    """Return the table of all models."""
    first, *_ = paces = np.array(list(found.values()))
    rows = [
        [name, figure(np.median(own) / 1e6), figure(np.median(own / first))]
        + [interval((own / first).min(), (own / first).max(), 2)]
        for name, own in zip(found, paces, strict=True)
    ]
    about = f"{thousands(n)} ants, 1 thread, medians of {len(first)} rounds."
    return Table(
        "Models with more features",
        ["model", "M steps/s", "to foraging", "lowest, highest"],
        rows,
        [f"{about} {machine(('taichi', 'numpy'))}"],
        text_columns=1,
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    add("--ants", type=whole_number(1), default=100_000, metavar="N", help="ants of each colony")
    add("--rounds", type=whole_number(1), default=5, metavar="N", help="measure each N times")
    add("--publish", action="store_true", help="write the table to docs/results/performance.md")

    def command() -> None:
        given = parser.parse_args(arguments)
        made = table(measured(given.ants, given.rounds, 0.5), given.ants)
        show("performance_models", [made], given.publish)

    run_command(command)


if __name__ == "__main__":
    main()
