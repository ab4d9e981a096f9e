"""Check the consistency of a colony of 10 000 ants for 20 000 ticks, under two sets of rules.

Under the rules "paper", ants and food sources do not change. Under the rules "lively", ants are
born and die, food grows back and wanders, trails evaporate and spread, and ants queue. The command
checks regularly that no food has appeared or vanished, that ants have different cells, that numbers
are finite, and that clocks agree. At the end it checks that the memory of the process has not
grown. It stops at the first fault. `--ticks 1000000` takes about half an hour on two cores.
"""

from __future__ import annotations

import time

import numpy as np

from taichi_ants import AntsError, Colony, Life, Pheromone, Task, TrainingConfig, runtime, worlds
from taichi_ants.engines.colony.layout import FoodSourceRow, NestRow, Stage, WorldRow
from taichi_ants.studies.command_line import Parser, progress_bar, run_command, whole_number
from taichi_ants.task import Traffic
from taichi_ants.task.constants import EMPTY, FOOD, QUEEN

RULES = {
    "paper": Task(delivery="truncates", evaporation_in_training=True),
    "lively": Task(
        "queues",
        pheromone=Pheromone("exponential", 50.0, 0.1, "fading", 500, view="strongest"),
        traffic=Traffic.named()["following"],
        delivery="truncates",
        evaporation_in_training=True,
        life=Life(births=True, lifespan=40_000, regrowth=50, pile_move_interval=100),
    ),
}
RANGES = (100, 100, 100)
_MOST_GROWTH = 16.0  # MB of process memory, after the first tenth of the ticks


def new_colony(rules: str, ants: int) -> Colony:
    """Return a colony at the start of an episode, with ants that learn into one table."""
    world = worlds.open_world(1, RANGES)
    training = TrainingConfig("sarsa", 0.1, 0.9, 0.1, 1.0, 0.1)
    colony = Colony(world, RULES[rules], training, 1, ants, start="spread")
    colony.begin_episode()
    if (lifespan := colony.task.life.lifespan) is not None:  # so that ants die at different times
        colony.arrays["age"][:ants] = np.arange(ants) * lifespan // ants
    for array in colony.arrays.values():
        array[...] = array.copy()  # so that the process already uses all its memory
    return colony


def faults(colony: Colony) -> list[str]:
    """Return the faults of a colony at the end of a tick, as text."""
    arrays, world = colony.arrays, colony.arrays["worlds"][:, 0]
    taken = arrays["stage"] != Stage.VACANT
    ants = {name: arrays[name][taken] for name in colony._columns()}
    cells, numbers, ground = ants["cell"], ants["number"], colony.snapshot().ground
    stored = arrays["nests"][NestRow.STORE, 0] + world[WorldRow.BIRTHS]
    foods = np.count_nonzero(ground == FOOD) + ants["carries"].sum(dtype=int)
    came, walls = len(colony.worlds[0].foods) + world[WorldRow.REGROWN], arrays["walls"] != 0
    trails = arrays["level"] if colony.pheromones[0].dense else arrays["trail"]
    food_sources = arrays["food_sources"][:, : world[WorldRow.FOOD_SOURCES]]
    ages, lifespan = ants.get("age", np.zeros(1)), colony.task.life.lifespan
    outcome = colony.outcome()  # checks that action values are finite
    moves, blocked = outcome.moves[0, 0], outcome.blocked[0, 0]
    holds = {
        "food has vanished or appeared": foods + world[WorldRow.DELIVERIES] == came,
        "the queen's food differs from the deliveries": not colony.task.life.births
        or stored == world[WorldRow.DELIVERIES],
        "ants share a cell": len(np.unique(cells)) == len(cells),
        "ants share a number": len(np.unique(numbers)) == len(numbers),
        "ants were lost": (ants["stage"] == Stage.LIVING).all()
        and len(cells) == world[WorldRow.LIVING]
        and len(cells) == colony.ants + world[WorldRow.BIRTHS] - world[WorldRow.DEATHS],
        "cells and ants differ": (np.flatnonzero(arrays["ground"] > 15) == np.sort(cells)).all(),
        "an ant's cell is not empty": not walls[cells].any() and (ground[cells] == EMPTY).all(),
        "the queen is missing or misplaced": np.flatnonzero(ground == QUEEN).tolist()
        == [arrays["nests"][NestRow.QUEEN_CELL, 0]],
        "a heading is not between 0 and 5": ((ants["heading"] >= 0) & (ants["heading"] < 6)).all(),
        "a trail is not finite, is negative, or is on rock": np.isfinite(trails).all()
        and trails.min() >= 0
        and not trails[walls].any(),
        "the clocks of world and colony differ": world[WorldRow.TICKS] == colony.ticks,
        "an ant is too old": lifespan is None or ages.max(initial=0) < lifespan,
        "food was taken in a future tick": food_sources[FoodSourceRow.TAKEN].max(initial=-1)
        < colony.ticks,
        "a counter has overflowed": 0 <= blocked <= moves <= colony.capacity * colony.ticks,
    }
    return [words for words, true in holds.items() if not true]


def megabytes() -> float:
    """Return the present memory of the process in MB."""
    with open("/proc/self/status", encoding="utf-8") as status:
        (line,) = (line for line in status if line.startswith("VmRSS:"))
    return int(line.split()[1]) / 1000


def soak(rules: list[str], ants: int, ticks: int, every: int, threads: int | None) -> None:
    """Print a line for each tenth of the ticks, under each set of rules.

    Raises:
        AntsError: A check has failed.
    """
    runtime.start(threads)
    print(f"{'rules':8}{'tick':>9}{'ants':>8}{'delivered':>11}{'MB':>8}{'ticks/s':>9}")
    for name in rules:
        colony, began, first = new_colony(name, ants), time.perf_counter(), 0.0
        with progress_bar(name) as progress:
            while colony.ticks < ticks:
                colony.tick(min(every, ticks - colony.ticks))
                if wrong := faults(colony):
                    raise AntsError(f"{name}, tick {colony.ticks}: {'; '.join(wrong)}.")
                progress(colony.ticks / ticks)
                if colony.ticks % (-(-ticks // 10)) < every or colony.ticks == ticks:
                    first = first or megabytes()
                    world = colony.arrays["worlds"][:, 0]
                    pace = colony.ticks / (time.perf_counter() - began)
                    print(
                        f"{name:8}{colony.ticks:9}{world[WorldRow.LIVING]:8}"
                        f"{world[WorldRow.DELIVERIES]:11}{megabytes():8.1f}{pace:9.0f}",
                        flush=True,
                    )
        if megabytes() - first > _MOST_GROWTH:
            raise AntsError(
                f"{name}: the memory of the process has grown from {first:.1f} to "
                f"{megabytes():.1f} MB; at most {_MOST_GROWTH:g} MB more are allowed."
            )
    print("All checks passed.")


def main(arguments: list[str] | None = None) -> None:
    """Run the command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    rules, ants, ticks = RULES, whole_number(1, 20_000), whole_number(1, 10_000_000)
    add("--rules", choices=rules, nargs="+", default=tuple(rules), help="use these rules")
    add("--ants", type=ants, default=10_000, metavar="N", help="start with N ants")
    add("--ticks", type=ticks, default=20_000, metavar="N", help="run N ticks")
    add("--every", type=whole_number(1), default=100, metavar="N", help="check every N ticks")
    add("--threads", type=whole_number(1, 1024), metavar="N", help="use N threads (default: all)")
    run_command(lambda: soak(**vars(parser.parse_args(arguments))))


if __name__ == "__main__":
    main()
