"""Measure how soon Ant System and MAX-MIN Ant System find a shortest path on maps of the package.

For each method and world, the script prints the number of colonies that find a shortest path from
the queen to food, and the median of the iterations in which they find it. It also prints the mean
length of the ants' tours in the first and the last iteration. See docs/models/ant_system.md.
"""

# No `from __future__ import annotations`, because Taichi reads the annotations of kernels.
from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    from dataclasses import dataclass
    from itertools import product
    from typing import Annotated, Literal, get_args

    import numpy as np
    import published
    import taichi as ti
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    from taichi_ants import AntsError, World, runtime, worlds
    from taichi_ants.analysis.tables import Table
    from taichi_ants.arguments import checked_world
    from taichi_ants.arithmetic.numbers import power
    from taichi_ants.arithmetic.random_bits import advance, bits_of, high_word
    from taichi_ants.grid.constants import N_HEADINGS, STREAM_TOUR
    from taichi_ants.grid.randomness import stream_state
    from taichi_ants.settings import Count, Seed, Setting, checked_arguments
    from taichi_ants.studies import command_line
    from taichi_ants.studies.command_line import whole_number
    from taichi_ants.task.constants import EMPTY, FOOD, QUEEN

Method = Literal["ant_system", "max_min"]
METHODS: tuple[str, ...] = get_args(Method)
# Default shares of evaporation, from the papers.
EVAPORATION = {"ant_system": 0.5, "max_min": 0.02}
# MAX-MIN: probability of the best tour after convergence, from the paper.
P_BEST = 0.05
COLUMNS = "World", "method", "shortest", "found by", "iteration", "first mean", "last mean"

f64_1d, f64_2d = (ti.types.ndarray(dtype=ti.f64, ndim=n) for n in (1, 2))
i32_1d, i32_2d = (ti.types.ndarray(dtype=ti.i32, ndim=n) for n in (1, 2))
u64_1d = ti.types.ndarray(dtype=ti.u64, ndim=1)


@ti.func
def next_heading(neighbours: ti.template(), tau: ti.template(), colony, cell, back, alpha, word):
    """Draw the heading of the next arc by its weight; straight back only out of a dead end."""
    weights = ti.Vector.zero(ti.f64, N_HEADINGS)
    total = ti.f64(0.0)
    n_ways = 0
    for h in ti.static(range(N_HEADINGS)):
        if neighbours[cell, h] >= 0 and h != back:
            weights[h] = power(tau[colony, N_HEADINGS * cell + h], ti.cast(alpha, ti.f64))
            total += weights[h]
            n_ways += 1
    if total == 0.0:  # in a dead end, or if all pheromone has evaporated
        for h in ti.static(range(N_HEADINGS)):
            if neighbours[cell, h] >= 0 and (h != back or n_ways == 0):
                weights[h] = 1.0
                total += 1.0
    left = ti.cast(word, ti.f64) / 4294967296.0 * total
    chosen = -1
    for h in ti.static(range(N_HEADINGS)):
        # If rounding leaves a remainder, the last possible heading is chosen.
        if weights[h] > 0.0 and (chosen < 0 or left >= 0.0):
            chosen = h
            left -= weights[h]
    return chosen


@ti.kernel
def walk(
    neighbours: i32_2d,
    is_food: i32_1d,
    start: ti.i32,
    tau: f64_2d,
    alpha: ti.i32,
    max_steps: ti.i32,
    states: u64_1d,
    tours: i32_2d,
    lengths: i32_1d,
):
    """Walk with all ants, in parallel, from the start to food, and write their tours without loops.

    Advances the streams `states`; writes the arcs of the `tours` (ants, n) and their `lengths`, 0
    for an ant that gave up. The arc from a cell in the direction of a heading has the index
    6 * cell + heading.
    """
    ti.loop_config(block_dim=1)
    for ant in range(states.shape[0]):
        colony = ant // (states.shape[0] // tau.shape[0])
        state = states[ant]
        cell, back, length, step = start, -1, 0, 0
        while step < max_steps and is_food[cell] == 0:
            state = advance(state)
            heading = next_heading(
                neighbours, tau, colony, cell, back, alpha, high_word(bits_of(state))
            )
            tours[ant, length] = N_HEADINGS * cell + heading
            cell = neighbours[cell, heading]
            back = (heading + 3) % N_HEADINGS
            length += 1
            onward = length
            for k in range(length):
                if tours[ant, k] // N_HEADINGS == cell:  # a loop
                    onward = k
            length = onward
            step += 1
        lengths[ant] = ti.select(is_food[cell] == 1, length, 0)
        states[ant] = state


@ti.kernel
def lay(
    tau: f64_2d,
    evaporation: ti.f64,
    tours: i32_2d,
    lengths: i32_1d,
    deposits: f64_1d,
    lowest: f64_1d,
    highest: f64_1d,
):
    """Evaporate, add the deposit of each ant to the arcs of its tour, and clip to the bounds."""
    for colony in range(tau.shape[0]):
        n_ants = lengths.shape[0] // tau.shape[0]
        for arc in range(tau.shape[1]):
            tau[colony, arc] *= 1.0 - evaporation
        for ant in range(colony * n_ants, (colony + 1) * n_ants):
            if deposits[ant] > 0.0:
                for k in range(lengths[ant]):
                    tau[colony, tours[ant, k]] += deposits[ant]
        for arc in range(tau.shape[1]):
            tau[colony, arc] = ti.min(ti.max(tau[colony, arc], lowest[colony]), highest[colony])


def open_cells(world: World) -> tuple[np.ndarray, np.ndarray, np.ndarray, int, int]:
    """Return the graph of cells without rock, which include the queen and food.

    Returns:
        Flat indices of the cells, int64 (n,); the numbers of their neighbours, int32 (n, 6), -1 if
        missing; 1 for cells with food, int32 (n,); the queen's number; steps to the nearest food.

    Raises:
        AntsError: `world` is not a World, or no food is reachable.
    """
    ground = checked_world(world, True, "the ant system", ()).ground()
    cells = np.flatnonzero(np.isin(ground, (EMPTY, FOOD, QUEEN)))
    number = np.full(ground.size, -1, np.int32)
    number[cells] = np.arange(len(cells), dtype=np.int32)
    neighbours = number[cells[:, None] + world.grid.offsets]
    is_food = (ground[cells] == FOOD).astype(np.int32)
    start = int(number[world.grid.index(world.queen)])

    ways = np.nonzero(neighbours >= 0)
    edges = ways[0], neighbours[ways]
    graph = coo_array((np.ones(len(ways[0])), edges), shape=(len(cells), len(cells)))
    steps = dijkstra(graph.tocsr(), indices=start, unweighted=True)[is_food == 1].min()
    if np.isinf(steps):
        raise AntsError("no food can be reached from the queen; use a world with a free path.")
    return cells, neighbours, is_food, start, int(steps)


@dataclass(frozen=True)
class Search:
    """Results of colonies, as arrays (colonies, iterations).

    `shortest` is the number of steps from the queen to the nearest food. `best`, int32, is the
    length of the shortest tour in each iteration, 0 if there was none. `mean`, float64, is the mean
    length, NaN if there was none. `lost`, int32, is the number of ants that gave up.
    """

    shortest: int
    best: np.ndarray
    mean: np.ndarray
    lost: np.ndarray

    @property
    def found(self) -> np.ndarray:
        """int64 (colonies,): the first iteration, from 1, with a shortest tour; 0 if none has."""
        return first_true(self.best == self.shortest)


def first_true(hits: np.ndarray) -> np.ndarray:
    """Return the first true column of each row, from 1; 0 if there is none."""
    return np.pad(hits, ((0, 0), (1, 0))).argmax(axis=1)


@checked_arguments
def search(
    world: World,
    method: Annotated[Method, Setting()] = "max_min",
    *,
    iterations: Count = 200,
    ants: Count = 32,
    colonies: Count = 20,
    alpha: Annotated[int, Setting(least=1, most=8)] = 1,
    evaporation: Annotated[float | None, Setting(above=0, most=1)] = None,
    max_steps: Count = 100_000,
    seed: Seed = 0,
    threads: int | None = None,
) -> Search:
    """Return results of independent colonies that search for the shortest path to food.

    The methods are Ant System (Dorigo, Maniezzo and Colorni 1996) and MAX-MIN Ant System (Stuetzle
    and Hoos 2000); docs/models/ant_system.md has their rules and papers. Every ant walks at random
    from the queen until it reaches food. Its walk without loops is its *tour*.

    With "ant_system", all ants deposit. With "max_min", the best ant of the iteration does, and tau
    stays between bounds that depend on the shortest tour so far. `alpha` is the exponent of
    pheromone in the choice of arcs, and `evaporation` is rho: by default 0.5, with "max_min" 0.02.
    An ant gives up after `max_steps`. More colonies do not change the first ones.
    """
    rho = EVAPORATION[method] if evaporation is None else evaporation
    _, neighbours, is_food, start, shortest = open_cells(world)
    n = len(neighbours)
    numbers = np.arange(colonies)[:, None] * 2**32 + np.arange(ants)
    states = stream_state(seed, STREAM_TOUR, numbers).reshape(-1)

    runtime.start(threads)
    tau = np.ones((colonies, N_HEADINGS * n))
    tours, lengths = np.zeros((colonies * ants, n), np.int32), np.zeros(colonies * ants, np.int32)
    ways = max(2.0, float((neighbours >= 0).sum(axis=1).mean()) - 1)  # mean choices per cell
    so_far = np.zeros(colonies)  # the shortest tours, 0 for none
    best, lost = np.zeros((2, colonies, iterations), np.int32)
    mean = np.full((colonies, iterations), np.nan)
    with runtime.quiet():
        for i in range(iterations):
            walk(neighbours, is_food, start, tau, alpha, max_steps, states, tours, lengths)
            by_colony = lengths.reshape(colonies, ants)
            lost[:, i] = (by_colony == 0).sum(axis=1)
            has = lost[:, i] < ants
            now = np.where(has, np.where(by_colony, by_colony, n).min(axis=1), 0)
            best[:, i] = now
            mean[has, i] = by_colony[has].sum(axis=1) / (ants - lost[has, i])
            first = (so_far == 0) & has
            so_far = np.where(first | (has & (now < so_far)), now, so_far)
            start_tau, lowest, highest = limits(method, rho, ants, ways, so_far)
            tau[first] = start_tau[first, None]
            deposits = np.where(by_colony > 0, 1 / np.maximum(by_colony, 1), 0)
            if method == "max_min":
                winner = by_colony == now[:, None]
                deposits[~(winner & (winner.cumsum(axis=1) == 1))] = 0  # the first one on a tie
            lay(tau, rho, tours, lengths, deposits.reshape(-1), lowest, highest)
    return Search(shortest, best, mean, lost)


def limits(
    method: str, rho: float, ants: int, ways: float, shortest: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return initial tau and its lower and upper bounds, from the `shortest` tours so far.

    The initial tau is the equilibrium if all ants take that tour. tau is 1 until food is found.
    """
    found = shortest > 0
    length = np.where(found, shortest, 1.0)
    if method == "ant_system":
        return ants / length, np.zeros(len(length)), np.full(len(length), np.inf)
    highest = 1 / (rho * length)
    right = P_BEST ** (1 / length)  # probability of the right choice at one cell
    lowest = np.minimum(highest * (1 - right) / ((ways - 1) * right), highest)
    return highest, np.where(found, lowest, 1), np.where(found, highest, 1)


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    add = parser.add_argument
    maps = ("paper", "double_bridge")
    add("--worlds", nargs="+", default=maps, metavar="WORLD", help="worlds or map files")
    number = whole_number(1, 100_000)
    iterations = "number of iterations per colony"
    add("--iterations", type=number, default=500, metavar="N", help=iterations)
    add("--ants", type=number, default=32, metavar="N", help="number of ants per colony")
    add("--colonies", type=number, default=20, metavar="N", help="number of colonies per world")
    evaporation = "share that evaporates per iteration (default: 0.5; for MAX-MIN, 0.02)"
    add("--evaporation", type=float, metavar="RHO", help=evaporation)
    add("--seed", type=whole_number(), default=0, metavar="N", help="seed of all colonies")
    add("--publish", action="store_true", help="write the table to the docs")
    command_line.add_threads(parser)
    return parser.parse_args(arguments)


def print_table(settings: argparse.Namespace) -> None:
    """Print a row for each world and method, after checking all of them."""
    maps = {name: worlds.build(name, settings.seed) for name in settings.worlds}
    rows: list[list[str]] = []
    with command_line.progress_bar("Ant colony optimisation") as progress:
        for (name, world), method in product(maps.items(), METHODS):
            rows.append([name, method, *row(settings, world, method)])
            progress(len(rows) / (len(maps) * len(METHODS)))
    published.show("ant_system", [Table("", COLUMNS, rows, text_columns=2)], settings.publish)


def row(settings: argparse.Namespace, world: World, method: Method) -> list[str]:
    """Return the row of a method in a world."""
    names = ("iterations", "ants", "colonies", "evaporation", "seed", "threads")
    result = search(world, method, **{name: getattr(settings, name) for name in names})
    found = result.found[result.found > 0]
    when = f"{np.median(found):.0f}" if len(found) else "-"
    first, last = np.nanmean(result.mean[:, [0, -1]], axis=0)
    share = f"{len(found)}/{settings.colonies}"
    return [f"{result.shortest}", share, when, f"{first:.1f}", f"{last:.1f}"]


if __name__ == "__main__":
    command_line.run_command(lambda: print_table(parse_arguments()))
