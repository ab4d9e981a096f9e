"""Measure the deliveries of ants that follow a fixed rule and do not learn.

All ants follow `trail_follower`, a rule written by hand, and explore with the rate of
--epsilon. The script prints that rule, then deliveries per 1000 ticks with their 95 % interval over
seeds, the worst seed, the tick of the first delivery, and the share of blocked moves. Worlds, seeds
and random numbers are those of the evaluation in `colony.py study`. With --study, it also prints
the deliveries of that study's ants, and the difference, learned minus fixed, paired by seed. See
docs/results/foraging.md.
"""

from __future__ import annotations

from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    import csv
    import math
    from collections.abc import Mapping, Sequence
    from dataclasses import replace
    from itertools import product
    from pathlib import Path
    from typing import TYPE_CHECKING, Any

    import numpy as np
    import published
    from colony import LARGE_SIZE, task_in, world_of
    from colony_findings import ABROAD, EVALUATION_EPSILON, JOINT, WORLD_KINDS, WORLDS
    from colony_findings import RULES as AS_NAMED

    from taichi_ants import AntsError, Colony, Pheromone, Task, TrainingConfig, World, files, task
    from taichi_ants.analysis.tables import Table
    from taichi_ants.learners.policies import FOLLOWED, RULES, trail_follower
    from taichi_ants.studies import command_line
    from taichi_ants.studies.command_line import whole_number
    from taichi_ants.studies.points import EVALUATION_SEEDS, Drawn

    if TYPE_CHECKING:
        from taichi_ants.engines.colony.colony import ColonyEpisodes

# NetLogo's model Ants: in each tick, 10 % of a trail evaporates and half of it spreads. Ants there
# add 60 and smell 0.05. Here they smell 1, so they add 1200.
NETLOGO = Pheromone(
    evaporation="exponential",
    half_life=math.log(0.5) / math.log(0.9),
    diffusion=0.5,
    deposit="add",
    level=1200,
    cap=1_000_000,
    view="strongest",
)
TASKS = {
    "paper": task.paper(),
    "foraging": task.foraging(),
    "queueing": task.queueing(),
    "NetLogo's trails": Task(pheromone=NETLOGO),
    "NetLogo's trails, in queues": replace(task.queueing(), pheromone=NETLOGO),
}
TICKS, EPISODES = 1000, 4
MEASURES = {EVALUATION_EPSILON: "deliveries", 0.0: "greedy"}  # study's, by exploration rate
COLUMNS = "World", "rules", "epsilon", "by hand", "worst", "first", "blocked"
COMPARED = "learned", "learned - by hand"
# Deliveries of each seed, by kind of world, rules, number of ants and measure.
Learned = Mapping[tuple[str, str, int, str], Mapping[int, float]]


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    add = parser.add_argument
    worlds = {"nargs": "+", "choices": tuple(WORLDS), "metavar": "NAME"}
    worlds["default"] = tuple(WORLD_KINDS)
    add("--worlds", **worlds, help="kinds of world, as in colony.py study --world-kinds")
    add("--ants", type=whole_number(1), default=64, metavar="N", help="number of ants per colony")
    seeds = "number of seeds, starting at 0"
    add("--seeds", type=whole_number(2), default=20, metavar="N", help=seeds)
    epsilons = "exploration rates to compare"
    add("--epsilon", type=float, nargs="+", default=[0.0, 0.01], metavar="X", help=epsilons)
    study = "results folder of colony.py study to compare with"
    add("--study", type=Path, metavar="FOLDER", help=study)
    publishes = "write the table to the docs, by this name"
    add("--publish", metavar="NAME", help=publishes)
    command_line.add_threads(parser)
    return parser.parse_args(arguments)


def print_table(settings: argparse.Namespace) -> None:
    """Print the rules, and a row for each kind of world, task and epsilon."""
    learned = read_study(settings.study) if settings.study else {}
    rows: list[list[str]] = []
    choices = list(product(settings.worlds, TASKS, settings.epsilon))
    with command_line.progress_bar("Ants with a fixed rule") as progress:
        for kind, name, epsilon in choices:
            ants = LARGE_SIZE if kind == "large" else settings.ants
            world, seeds = world_of(kind), range(settings.seeds)
            places = [world.of(one) if isinstance(world, Drawn) else world for one in seeds]
            outcome = evaluate(settings, places, task_in(kind, TASKS[name]), epsilon, ants)
            taught = learned.get((kind, name, ants, MEASURES.get(epsilon, "")), {})
            words = WORLDS[kind], AS_NAMED.get(name, name), f"{epsilon:g}"
            rows.append([*words, *row(outcome, taught)])
            progress(len(rows) / len(choices))
    columns = COLUMNS + COMPARED if learned else COLUMNS
    # No study has NetLogo's trails.
    rows = [[*cells, *[""] * (len(columns) - len(cells))] for cells in rows]
    print(*map(rule, FOLLOWED), sep="\n")
    made = Table("", columns, rows, text_columns=2)
    published.show(settings.publish or "", [made], bool(settings.publish))


def rule(observation: str) -> str:
    """Return the rule of an observation as text."""
    without, with_food = (
        ", ".join(f"{letters} {action}" for letters, action in one) for one in RULES[observation]
    )
    return f"{observation}: without food {without}, else left; with food {with_food}, else left"


def read_study(folder: Path) -> Learned:
    """Return the deliveries of the study's ants that were trained together, by seed.

    They were trained in worlds of the same kind, or in open worlds if that kind has none.
    """
    learned: dict[tuple[str, str, int, str], dict[int, float]] = {}
    for row in csv.DictReader(files.read_text(folder / "seeds.csv").splitlines()):
        if row["regime"] == (JOINT if row["world_kind"] in WORLD_KINDS else ABROAD):
            for name in MEASURES.values():
                key = row["world_kind"], row["rules"], int(row["ants"]), name
                learned.setdefault(key, {})[int(row["seed"])] = float(row[name])
    return learned


def row(outcome: ColonyEpisodes, learned: Mapping[int, float]) -> list[str]:
    """Return a row of the table; `learned` has deliveries of the study's ants by seed."""
    deliveries = outcome.deliveries.mean(axis=0) * 1000 / TICKS
    # An episode without any delivery counts with all its ticks.
    first = np.where(outcome.first_delivery < 0, TICKS, outcome.first_delivery).mean()
    blocked = 100 * outcome.blocked.sum() / outcome.moves.sum()
    cells = [
        published.mean(deliveries),
        f"{deliveries.min():.0f}",
        f"{first:.0f}",
        f"{blocked:.0f} %",
    ]
    if not learned:
        return cells
    missing = set(range(len(deliveries))) - learned.keys()
    if missing:
        raise AntsError(
            f"the study has no seed {min(missing)}; reduce --seeds to its number of seeds, or run "
            "the study with more."
        )
    taught = np.array([learned[seed] for seed in range(len(deliveries))])
    return [*cells, f"{taught.mean():.0f}", published.mean(taught - deliveries)]


def evaluate(
    settings: argparse.Namespace, places: Sequence[World], rules: Task, epsilon: float, ants: int
) -> ColonyEpisodes:
    """Return four episodes of 1000 ticks in each world."""
    seeds = [seed + EVALUATION_SEEDS for seed in range(settings.seeds)]
    follow: dict[str, Any] = {"sharing": "frozen", "q_values": trail_follower(rules.observation)}
    calm = TrainingConfig.frozen(epsilon)
    colony = Colony(places, rules, calm, seeds, ants, **follow, threads=settings.threads)
    return colony.run(EPISODES, TICKS)


if __name__ == "__main__":
    command_line.run_command(lambda: print_table(parse_arguments()))
