"""Ants with a fixed rule: what a colony delivers that learns nothing.

All ants follow `trail_follower`, a table written by hand, but with probability epsilon do anything.
Prints deliveries per 1000 ticks with their 95 % interval over seeds, the tick of the first
delivery, and the share of blocked moves, for some rules in three kinds of worlds. See
docs/baselines.md.
"""

from __future__ import annotations

from taichi_ants.studies.interruption import stoppable

with stoppable():  # these imports take a moment, in which Ctrl-C shall be heard too
    import argparse
    import math
    from collections.abc import Sequence
    from dataclasses import replace
    from itertools import product
    from typing import TYPE_CHECKING

    import numpy as np

    from taichi_ants import Colony, Life, Pheromone, Task, TrainingConfig, World, task, worlds
    from taichi_ants.analysis.statistics import bootstrap_interval
    from taichi_ants.learners.policies import trail_follower
    from taichi_ants.studies.command_line import Parser, progress_bar, run_command, whole_number

    if TYPE_CHECKING:
        from taichi_ants.engines.colony.colony import ColonyEpisodes

SIZE = (30, 30, 30)
WORLDS = {
    "paper": lambda seed: worlds.paper(),
    "open": lambda seed: worlds.open_world(seed, SIZE),
    "piles": lambda seed: worlds.open_world(seed, SIZE, food_share=0.0),
}
# NetLogo's model Ants: in each tick 10 % of a trail evaporates and half of it spreads. An ant there
# adds 60, and smells 0.05; here it smells 1.
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
    "netlogo": Task(pheromone=NETLOGO),
    "netlogo, in queues": replace(task.queueing(), pheromone=NETLOGO),
}
TICKS, EPISODES = 1000, 4
HEAD = "world  rules              epsilon  deliveries  interval      first  blocked"


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """The settings of the command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    add("--ants", type=whole_number(1), default=64, metavar="N", help="of each colony")
    add("--seeds", type=whole_number(2), default=20, metavar="N", help="how many, from 0 on")
    add("--epsilon", type=float, nargs="+", default=[0.01, 0.1], metavar="X", help="one or more")
    add("--threads", type=whole_number(1, 1024), metavar="N", help="CPU threads (default: all)")
    return parser.parse_args(arguments)


def print_table(settings: argparse.Namespace) -> None:
    """A row for each kind of world, task and epsilon, once all are known to be allowed."""
    choices = list(product(WORLDS, TASKS, settings.epsilon))
    places = {kind: [build(n) for n in range(settings.seeds)] for kind, build in WORLDS.items()}
    rows: list[str] = []
    with progress_bar("Ants with a fixed rule") as progress:
        for kind, name, epsilon in choices:
            outcome = evaluate(settings, places[kind], TASKS[name], epsilon)
            rows.append(f"{kind:6} {name:18} {epsilon:7g} {row(outcome)}")
            progress(len(rows) / len(choices))
    print(HEAD, *rows, sep="\n")


def row(outcome: ColonyEpisodes) -> str:
    """What the ants do in one kind of world."""
    deliveries = outcome.deliveries.mean(axis=0) * 1000 / TICKS
    (low,), (high,) = bootstrap_interval(deliveries[None])
    # An episode without any delivery counts with all its ticks.
    first = np.where(outcome.first_delivery < 0, TICKS, outcome.first_delivery).mean()
    blocked = 100 * outcome.blocked.sum() / outcome.moves.sum()
    return (
        f"{deliveries.mean():11.0f}  {f'{low:.0f} to {high:.0f}':12} {first:6.0f} {blocked:6.0f} %"
    )


def evaluate(
    settings: argparse.Namespace, places: Sequence[World], rules: Task, epsilon: float
) -> ColonyEpisodes:
    """Four episodes of 1000 ticks in each world; food grows back at once."""
    colony = Colony(
        places,
        replace(rules, life=Life(regrowth=0)),
        TrainingConfig("sarsa", 0.1, 0.9, epsilon, 1.0),
        range(settings.seeds),
        settings.ants,
        sharing="fixed",
        q_values=trail_follower(rules.observation),
        threads=settings.threads,
    )
    return colony.run(EPISODES, TICKS)


if __name__ == "__main__":
    run_command(lambda: print_table(parse_arguments()))
