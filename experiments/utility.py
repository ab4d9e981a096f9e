"""Run ants whose pheromones are utilities (Panait and Luke 2004) on the maps of the package.

The script prints a row for each kind of world and each --room. It has the deliveries per 1000 ticks
with their 95 % interval over seeds, and the tick of the first delivery. The other columns describe
the path of a colony, a walk from the nest to food and back that always follows the highest utility.
They are the number of colonies that ever had a shortest path, and the median of the ticks when they
first had it. The last two columns are the mean length of paths at the end, as a multiple of the
shortest, and the number of colonies with a path. See docs/baselines.md.
"""

from __future__ import annotations

from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    from itertools import product

    import numpy as np

    from taichi_ants import World, worlds
    from taichi_ants.analysis.statistics import bootstrap_interval
    from taichi_ants.baselines.utility import Foraging, forage
    from taichi_ants.studies.command_line import (
        THREADS,
        Parser,
        progress_bar,
        run_command,
        whole_number,
    )

SIZE = (30, 30, 30)
WORLDS = {
    "paper": lambda seed: worlds.paper(),
    "open": lambda seed: worlds.open_world(seed, SIZE),
    "piles": lambda seed: worlds.open_world(seed, SIZE, food_share=0.0),
    "bridge": lambda seed: worlds.double_bridge(mirrored=bool(seed % 2)),
}
EPISODES = 4  # of each seed, as in fixed_rules.py
HEAD = "world   room  deliveries  interval      first  found by  tick  length  at the end"


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    number, room = whole_number(1), "largest number of ants in a cell; several are run in turn"
    add("--ants", type=number, default=64, metavar="N", help="number of ants per colony")
    add("--room", type=number, nargs="+", default=[1, 10], metavar="N", help=room)
    add("--ticks", type=number, default=1000, metavar="N", help="number of ticks to run")
    seeds = "number of seeds, starting at 0"
    add("--seeds", type=whole_number(2), default=20, metavar="N", help=seeds)
    discount = "discount factor of utilities per step"
    add("--discount", type=float, default=0.9, metavar="X", help=discount)
    evaporation = "share of a utility that evaporates per tick"
    add("--evaporation", type=float, default=0.001, metavar="X", help=evaporation)
    add("--exploration", type=float, default=0.1, metavar="X", help="probability of a random step")
    momentum = "probability of going straight on if no utility is known"
    add("--momentum", type=float, default=0.8, metavar="X", help=momentum)
    add("--threads", type=whole_number(1, 1024), metavar="N", help=THREADS)
    return parser.parse_args(arguments)


def print_table(settings: argparse.Namespace) -> None:
    """Print a row for each kind of world and each --room, after building all worlds."""
    places = {kind: [build(n) for n in range(settings.seeds)] for kind, build in WORLDS.items()}
    rows: list[str] = []
    with progress_bar("Ants that back up utilities") as progress:
        for kind, room in product(WORLDS, settings.room):
            outcomes = [run(settings, world, n, room) for n, world in enumerate(places[kind])]
            rows.append(f"{kind:6} {room:5} {row(outcomes)}")
            progress(len(rows) / (len(WORLDS) * len(settings.room)))
    print(HEAD, *rows, sep="\n")


def run(settings: argparse.Namespace, world: World, seed: int, room: int) -> Foraging:
    """Return the outcome of four colonies in one world."""
    names = ("ticks", "ants", "discount", "evaporation", "exploration", "momentum", "threads")
    given = {name: getattr(settings, name) for name in names}
    return forage(world, colonies=EPISODES, capacity=room, seed=seed, **given)


def row(outcomes: list[Foraging]) -> str:
    """Return the row of a kind of world."""
    deliveries = 1000 * np.array([one.deliveries.mean() for one in outcomes])
    (low,), (high,) = bootstrap_interval(deliveries[None])
    first = np.concatenate([one.first_delivery for one in outcomes])
    # A colony without any delivery counts with all its ticks.
    first = np.where(first == 0, outcomes[0].deliveries.shape[1], first).mean()
    found = np.concatenate([one.found for one in outcomes])
    when = f"{np.median(found[found > 0]):.0f}" if found.any() else "-"
    ends = np.concatenate([one.lengths[:, -1:].ravel() / one.shortest for one in outcomes])
    has = ends > 0
    length = f"{ends[has].mean():.2f}" if has.any() else "-"
    return (
        f"{deliveries.mean():11.0f}  {f'{low:.0f} to {high:.0f}':12} {first:6.0f} "
        f"{(found > 0).sum():5}/{len(found):<3} {when:>5} {length:>7} {has.sum():8}"
    )


if __name__ == "__main__":
    run_command(lambda: print_table(parse_arguments()))
