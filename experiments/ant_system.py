"""Measure how soon Ant System and MAX-MIN Ant System find a shortest path on maps of the package.

For each method and world, the script prints the number of colonies that find a shortest path from
the queen to food, and the median of the iterations in which they find it. It also prints the mean
length of the ants' tours in the first and the last iteration. See docs/baselines.md.
"""

from __future__ import annotations

from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    from itertools import product

    import numpy as np

    from taichi_ants import World, worlds
    from taichi_ants.baselines.ant_system import METHODS, Method, search
    from taichi_ants.studies.command_line import (
        THREADS,
        Parser,
        progress_bar,
        run_command,
        whole_number,
    )

HEAD = f"{'world':20} {'method':11} shortest  found by  iteration  first and last mean length"


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    places = ("paper", "double_bridge")
    add("--worlds", nargs="+", default=places, metavar="WORLD", help="worlds or map files")
    number = whole_number(1)
    iterations = "number of iterations per colony"
    add("--iterations", type=number, default=500, metavar="N", help=iterations)
    add("--ants", type=number, default=32, metavar="N", help="number of ants per colony")
    add("--colonies", type=number, default=20, metavar="N", help="number of colonies per world")
    evaporation = "share that evaporates per iteration (default: 0.5; for MAX-MIN, 0.02)"
    add("--evaporation", type=float, metavar="RHO", help=evaporation)
    add("--seed", type=whole_number(), default=0, metavar="N", help="seed of all colonies")
    add("--threads", type=whole_number(1, 1024), metavar="N", help=THREADS)
    return parser.parse_args(arguments)


def print_table(settings: argparse.Namespace) -> None:
    """Print a row for each world and method, after checking all of them."""
    places = {name: worlds.build(name, settings.seed) for name in settings.worlds}
    rows: list[str] = []
    with progress_bar("Ant colony optimisation") as progress:
        for (name, world), method in product(places.items(), METHODS):
            rows.append(f"{name:20} {method:11} {row(settings, world, method)}")
            progress(len(rows) / (len(places) * len(METHODS)))
    print(HEAD, *rows, sep="\n")


def row(settings: argparse.Namespace, world: World, method: Method) -> str:
    """Return the row of a method in a world."""
    names = ("iterations", "ants", "colonies", "evaporation", "seed", "threads")
    result = search(world, method, **{name: getattr(settings, name) for name in names})
    found = result.found[result.found > 0]
    when = f"{np.median(found):.0f}" if len(found) else "-"
    first, last = np.nanmean(result.mean[:, [0, -1]], axis=0)
    return (
        f"{result.shortest:8} {len(found):5}/{settings.colonies:<4}"
        f"{when:>9} {first:11.1f} {last:8.1f}"
    )


if __name__ == "__main__":
    run_command(lambda: print_table(parse_arguments()))
