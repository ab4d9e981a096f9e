"""Run ants whose pheromones are utilities (Panait and Luke 2004) on the maps of the package.

The script prints a row for each kind of world and each --room. It has the deliveries per 1000 ticks
with their 95 % interval over seeds, and the tick of the first delivery. The other columns describe
the path of a colony, a walk from the nest to food and back that always follows the highest utility.
They are the number of colonies that ever had a shortest path, and the median of the ticks when they
first had it. The last two columns are the mean length of paths at the end, as a multiple of the
shortest, and the number of colonies with a path. See docs/models/utility.md.
"""

# No `from __future__ import annotations`, because Taichi reads the annotations of kernels.
from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    import math
    from dataclasses import dataclass
    from itertools import product
    from typing import Annotated

    import numpy as np
    import published
    import taichi as ti
    from ant_system import first_true, open_cells
    from taichi.math import popcnt

    from taichi_ants import World, runtime, worlds
    from taichi_ants.analysis.tables import Table
    from taichi_ants.arithmetic.random_bits import advance, below, bits_of, high_word, low_word
    from taichi_ants.grid.constants import N_HEADINGS, STREAM_FORAGER
    from taichi_ants.grid.randomness import stream_state
    from taichi_ants.settings import Count, Seed, Setting, Share, checked_arguments
    from taichi_ants.studies import command_line
    from taichi_ants.studies.command_line import whole_number
    from taichi_ants.task.rules.policy import bit_number

SIZE = (30, 30, 30)
WORLDS = {
    "paper": lambda seed: worlds.paper(),
    "open": lambda seed: worlds.open_world(seed, SIZE),
    "piles": lambda seed: worlds.open_world(seed, SIZE, food_share=0.0),
    "bridge": lambda seed: worlds.double_bridge(mirrored=bool(seed % 2)),
}
EPISODES = 4  # of each seed, as in fixed_rules.py
EVERY = 10  # ticks between measurements of the path
COLUMNS = "World", "room", "deliveries", "first", "found by", "tick", "length", "at the end"

NEST, PILE = 0, 1  # goals; an ant comes from one and looks for the other
CELL, HEADING, ORIGIN = 0, 1, 2  # columns of `ants`
i32_2d, i32_3d = (ti.types.ndarray(dtype=ti.i32, ndim=n) for n in (2, 3))
f64_3d = ti.types.ndarray(dtype=ti.f64, ndim=3)
u64_2d = ti.types.ndarray(dtype=ti.u64, ndim=2)


@ti.func
def best_headings(neighbours: ti.template(), utilities: ti.template(), colony, goal, cell, among):
    """Return the headings in `among` with the highest utility, and this utility; or 0 and -1."""
    headings, best = 0, ti.f64(-1.0)
    for h in ti.static(range(N_HEADINGS)):
        if neighbours[cell, h] >= 0 and (among >> h) & 1:
            level = utilities[colony, goal, neighbours[cell, h]]
            if level > best:
                headings, best = 0, level
            if level == best:
                headings |= 1 << h
    return headings, best


@ti.kernel
def live(
    neighbours: i32_2d,
    goals: i32_2d,
    capacity: ti.i32,
    discount: ti.f64,
    kept: ti.f64,
    exploration: ti.f64,
    momentum: ti.f64,
    first: ti.i32,
    last: ti.i32,
    states: u64_2d,
    ants: i32_3d,
    standing: i32_2d,
    utilities: f64_3d,
    deliveries: i32_2d,
):
    """Advance all colonies, in parallel, through the ticks range(first, last), see `forage`.

    `goals` (2, n) are 1 in cells of a goal; each tick multiplies all utilities by `kept`. Draws one
    random number per ant and tick from the random streams `states`. Updates `ants` (colonies, ants,
    3), which hold cell, heading and the goal that the ant comes from; the number of ants `standing`
    in each cell; and `utilities` (colonies, 2, n). Writes `deliveries` (colonies, ticks). Ants of a
    colony act one after the other. Sets of headings are bitsets.
    """
    ti.loop_config(block_dim=1)
    for colony in range(states.shape[0]):
        for tick in range(first, last):
            delivered = 0
            for ant in range(states.shape[1]):
                cell, heading = ants[colony, ant, CELL], ants[colony, ant, HEADING]
                origin = ants[colony, ant, ORIGIN]
                _, level = best_headings(neighbours, utilities, colony, origin, cell, 63)
                level = discount * ti.max(level, 0.0)
                utilities[colony, origin, cell] = ti.max(
                    utilities[colony, origin, cell], goals[origin, cell] + level
                )

                free = 0
                for h in ti.static(range(N_HEADINGS)):
                    there = neighbours[cell, h]
                    # Two tests, because the second one reads the cell.
                    if there >= 0:  # noqa: SIM102
                        if goals[NEST, there] == 1 or standing[colony, there] < capacity:
                            free |= 1 << h
                options, best = best_headings(neighbours, utilities, colony, 1 - origin, cell, free)
                state = advance(states[colony, ant])
                states[colony, ant] = state
                bits = bits_of(state)
                chance = ti.cast(high_word(bits), ti.f64) / 4294967296.0
                if best > 0.0 and chance < exploration:
                    options = free
                else:
                    straight = 1 << heading
                    ahead = straight | 1 << (heading + 5) % 6 | 1 << (heading + 1) % 6
                    if options & ahead:
                        options &= ahead
                    if best == 0.0 and chance < momentum and options & straight:
                        options = straight

                if options:
                    heading = bit_number(options, below(low_word(bits), popcnt(options)))
                    there = neighbours[cell, heading]
                    standing[colony, cell] -= 1
                    standing[colony, there] += 1
                    ants[colony, ant, CELL] = there
                    ants[colony, ant, HEADING] = heading
                    if goals[1 - origin, there] == 1:
                        ants[colony, ant, ORIGIN] = 1 - origin
                        delivered += origin
            deliveries[colony, tick] = delivered
            for goal, cell in ti.ndrange(2, utilities.shape[2]):
                utilities[colony, goal, cell] *= kept


def path_lengths(
    neighbours: np.ndarray, goals: np.ndarray, nest: int, utilities: np.ndarray
) -> np.ndarray:
    """Return the steps to food and back by the highest utility, int32 (colonies,); 0 if no path."""
    lengths = np.zeros(len(utilities), np.int32)
    for colony, of_goals in enumerate(utilities):
        cell, steps = nest, 0
        for goal in (PILE, NEST):
            levels = np.append(of_goals[goal], -1.0)  # the last one is for missing neighbours
            for _ in neighbours:  # a path with more steps is a circle
                cell = neighbours[cell][levels[neighbours[cell]].argmax()]
                steps += 1
                if levels[cell] <= 0 or goals[goal, cell]:
                    break
            if not goals[goal, cell]:
                break
        else:
            lengths[colony] = steps
    return lengths


@dataclass(frozen=True)
class Foraging:
    """Results of colonies.

    Attributes:
        shortest: Steps from the queen to the nearest food and back.
        deliveries: int32 (colonies, ticks), the food items delivered in each tick.
        lengths: int32 (colonies, ticks // 10), the length, every 10 ticks, of the path to food and
            back that always takes the highest utility; 0 if there is none.
        utilities: float64 (colonies, 2, grid.size), of the nest and of food, at the end.
    """

    shortest: int
    deliveries: np.ndarray
    lengths: np.ndarray
    utilities: np.ndarray

    @property
    def first_delivery(self) -> np.ndarray:
        """int64 (colonies,): the tick of the first delivery, from 1; 0 if there is none."""
        return first_true(self.deliveries > 0)

    @property
    def found(self) -> np.ndarray:
        """int64 (colonies,): the first measured tick with a shortest path; 0 if there is none."""
        return EVERY * first_true(self.lengths == self.shortest)


@checked_arguments
def forage(
    world: World,
    *,
    ticks: Count = 1000,
    ants: Count = 64,
    colonies: Count = 20,
    capacity: Count = 10,
    discount: Annotated[float, Setting(above=0, most=math.nextafter(1, 0))] = 0.9,
    evaporation: Share = 0.001,
    exploration: Share = 0.1,
    momentum: Share = 0.8,
    seed: Seed = 0,
    threads: int | None = None,
) -> Foraging:
    """Return results of independent colonies that collect food, which grows back at once.

    The rules are those of L. Panait, S. Luke. A pheromone-based utility model for collaborative
    foraging. AAMAS 2004, 36-43. The *utility* U_p(s) is larger the nearer cell s is to goal p, nest
    or food. In each tick an ant in cell s backs up the utility of the goal p that it has left,

        U_p(s) <- max(U_p(s), R_p(s) + discount * max over the neighbours s' of U_p(s')),

    where the reward R_p is 1 in a cell of goal p, else 0. Then it moves to the neighbour with the
    highest utility of the other goal. `docs/models/utility.md` lists sources and deviations.

    All `ants` of a colony start in the nest, which has room for all; a cell has room for
    `capacity`. `evaporation` is the share of utilities that evaporates per tick. `exploration` is
    the probability of a random step if a neighbour has a utility above 0. Where none has,
    `momentum` is that of a step straight ahead, if possible. More colonies do not change the first.
    """
    cells, neighbours, is_food, nest, steps = open_cells(world)
    numbers = np.arange(colonies)[:, None] * 2**32 + np.arange(ants)
    states = stream_state(seed, STREAM_FORAGER, numbers)

    runtime.start(threads)
    goals = np.stack([np.arange(len(cells)) == nest, is_food == 1]).astype(np.int32)
    settings = capacity, discount, 1 - evaporation, exploration, momentum
    of_ants = np.zeros((colonies, ants, 3), np.int32)
    of_ants[..., CELL] = nest
    of_ants[..., HEADING] = np.arange(ants) % N_HEADINGS
    standing = np.zeros((colonies, len(cells)), np.int32)
    standing[:, nest] = ants
    utilities = np.zeros((colonies, 2, len(cells)))
    deliveries = np.zeros((colonies, ticks), np.int32)
    lengths = np.zeros((colonies, ticks // EVERY), np.int32)
    with runtime.quiet():
        for first in range(0, ticks, EVERY):
            last = min(first + EVERY, ticks)
            state = states, of_ants, standing, utilities, deliveries
            live(neighbours, goals, *settings, first, last, *state)
            if last == first + EVERY:
                lengths[:, first // EVERY] = path_lengths(neighbours, goals, nest, utilities)
    spread = np.zeros((colonies, 2, world.grid.size))
    spread[..., cells] = utilities
    return Foraging(2 * steps, deliveries, lengths, spread)


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    add = parser.add_argument
    number = whole_number(1, 100_000)
    room = "largest number of ants in a cell; several are run in turn"
    add("--ants", type=number, default=64, metavar="N", help="number of ants per colony")
    add("--room", type=number, nargs="+", default=[1, 10], metavar="N", help=room)
    add("--ticks", type=number, default=1000, metavar="N", help="number of ticks to run")
    seeds = "number of seeds, starting at 0"
    add("--seeds", type=whole_number(2), default=20, metavar="N", help=seeds)
    shares = {
        "--discount": (0.9, "discount factor of utilities per step"),
        "--evaporation": (0.001, "share of a utility that evaporates per tick"),
        "--exploration": (0.1, "probability of a random step"),
        "--momentum": (0.8, "probability of going straight on if no utility is known"),
    }
    for flag, (default, words) in shares.items():
        add(flag, type=float, default=default, metavar="X", help=words)
    add("--publish", action="store_true", help="write the table to the docs")
    command_line.add_threads(parser)
    return parser.parse_args(arguments)


def print_table(settings: argparse.Namespace) -> None:
    """Print a row for each kind of world and each --room, after building all worlds."""
    maps = {kind: [build(n) for n in range(settings.seeds)] for kind, build in WORLDS.items()}
    rows: list[list[str]] = []
    with command_line.progress_bar("Ants that back up utilities") as progress:
        for kind, room in product(WORLDS, settings.room):
            outcomes = [run(settings, world, n, room) for n, world in enumerate(maps[kind])]
            rows.append([kind, f"{room}", *row(outcomes)])
            progress(len(rows) / (len(WORLDS) * len(settings.room)))
    published.show("utility", [Table("", COLUMNS, rows)], settings.publish)


def run(settings: argparse.Namespace, world: World, seed: int, room: int) -> Foraging:
    """Return the outcome of four colonies in one world."""
    names = ("ticks", "ants", "discount", "evaporation", "exploration", "momentum", "threads")
    chosen = {name: getattr(settings, name) for name in names}
    return forage(world, colonies=EPISODES, capacity=room, seed=seed, **chosen)


def row(outcomes: list[Foraging]) -> list[str]:
    """Return the row of a kind of world."""
    deliveries = 1000 * np.array([one.deliveries.mean() for one in outcomes])
    first = np.concatenate([one.first_delivery for one in outcomes])
    # A colony without any delivery counts with all its ticks.
    first = np.where(first == 0, outcomes[0].deliveries.shape[1], first).mean()
    found = np.concatenate([one.found for one in outcomes])
    when = f"{np.median(found[found > 0]):.0f}" if found.any() else "-"
    ends = np.concatenate([one.lengths[:, -1:].ravel() / one.shortest for one in outcomes])
    has = ends > 0
    length = f"{ends[has].mean():.2f}" if has.any() else "-"
    share = f"{(found > 0).sum()}/{len(found)}"
    return [published.mean(deliveries), f"{first:.0f}", share, when, length, f"{has.sum()}"]


if __name__ == "__main__":
    command_line.run_command(lambda: print_table(parse_arguments()))
