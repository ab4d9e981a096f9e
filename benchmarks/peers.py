"""Compare the speed of Taichi Ants with NumPy, numba, JAX, Mesa and others on this machine.

Each system runs as its users would run it. The command measures all systems in turn, several times,
by the wall clock; the tables contain medians. Compare only rows of the same table, and read the
column "one step": only the first rows of the first table do exactly the same work. To install all
systems, run `pip install -e ".[bench]"`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from typing import NamedTuple

import numpy as np
from measuring import FIGURES, Work, count_in_powers, machine, pace, show

from taichi_ants.analysis import style
from taichi_ants.analysis.tables import Table, figure, interval, thousands
from taichi_ants.studies.command_line import Parser, progress_bar, run_command, whole_number


class Sizes(NamedTuple):
    """The sizes of the systems: seeds per configuration, environments, ants."""

    seeds: int = 100
    environments: int = 4096
    ants: int = 256
    many_ants: int = 100_000


SMALL = Sizes(1, 16, 16, 200)


class System(NamedTuple):
    """A system to measure.

    Attributes:
        name: The name in tables.
        step: A description of one step.
        call: Module in `systems`, function, and arguments; "?name" is a field of `Sizes`.
        needs: The packages that must be installed.
    """

    name: str
    step: str
    call: tuple[str, ...]
    needs: tuple[str, ...] = ()


_SAME = "paper's world and grid, Q-learning:"
_COLONY = "hexagonal grid,"
# The others of a group are compared with its first system.
Groups = dict[str, tuple[System, ...]]
GROUPS: Groups = {
    "Steps with learning": (
        System("Taichi Ants", f"{_SAME} `train`", ("ours", "training", "?seeds")),
        System("numba, prange", f"{_SAME} loops", ("numba_runs", "in_parallel"), ("numba",)),
        System("numba", f"{_SAME} loops, one thread", ("numba_runs", "one_by_one"), ("numba",)),
        System("JAX", f"{_SAME} vmap and scan", ("jax_runs", "training", "?seeds"), ("jax",)),
        System("NumPy", f"{_SAME} all runs at once", ("numpy_runs", "training", "?seeds")),
        System(
            "Gymnasium, FrozenLake",
            "4 x 4 squares, one agent, Q-learning in Python",
            ("tabular", "frozen_lake"),
        ),
        System(
            "Taichi Ants, HexForage",
            "paper's world, one ant, the same Q-learning in Python",
            ("tabular", "hex_forage"),
        ),
    ),
    "Steps of environments with random actions": (
        System(
            "Taichi Ants, HexForage",
            "paper's world, one `step` of a vector environment for all",
            ("ours", "environments", "?environments"),
        ),
        System(
            "gymnax, FourRooms",
            "13 x 13 squares, 100 steps of all environments in one compiled scan",
            ("gymnax_rooms", "environments", "?environments"),
            ("jax", "gymnax"),
        ),
        System(
            "Taichi Ants, colony_v0",
            "64 ants in an open world, each an agent of PettingZoo",
            ("parallel_agents", "ants"),
            ("pettingzoo",),
        ),
        System(
            "PettingZoo, knights",
            "2 archers and 2 knights against zombies, continuous space, no rendering",
            ("parallel_agents", "knights"),
            ("pettingzoo", "pygame"),
        ),
    ),
    "Steps of ants in a colony": (
        System(
            "Taichi Ants",
            f"{_COLONY} {{ants}} ants, trails, right of way, SARSA into one table",
            ("ours", "colony", "?ants"),
        ),
        System(
            "Taichi Ants, large colony",
            f"{_COLONY} {{many_ants}} ants, the same",
            ("ours", "colony", "?many_ants"),
        ),
        System(
            "Mesa",
            f"{_COLONY} {{ants}} ants, trails, a fixed rule, no learning",
            ("mesa_ants", "colony", "?ants"),
            ("mesa",),
        ),
    ),
}
_PACKAGES = ("taichi", "numpy", "numba", "jax", "gymnax", "mesa", "gymnasium", "pettingzoo")

Paces = dict[System, list[tuple[float, float]]]


def missing(system: System) -> list[str]:
    """Return the required packages of a system that are not installed."""
    return [name for name in system.needs if find_spec(name) is None]


def prepared(system: System, sizes: Sizes) -> Work:
    """Return the work of a system, with all code compiled."""
    module, function, *given = system.call
    make = getattr(import_module(f"systems.{module}"), function)
    return make(*(getattr(sizes, name[1:]) for name in given))


def measured(sizes: Sizes, rounds: int, seconds: float) -> dict[str, Paces]:
    """Return the paces of all installed systems, by group."""
    there = {name: [one for one in some if not missing(one)] for name, some in GROUPS.items()}
    every = [(name, one) for name, some in there.items() for one in some]
    found: dict[str, Paces] = {name: {one: [] for one in some} for name, some in there.items()}
    with progress_bar("Measuring") as progress:
        works, total = [], len(every) * (1 + rounds)
        for _, system in every:
            works.append(prepared(system, sizes))
            progress(len(works) / total)
        for turn in range(rounds):
            for place, ((name, system), work) in enumerate(zip(every, works, strict=True)):
                found[name][system].append(pace(work, seconds))
                progress(((1 + turn) * len(every) + place + 1) / total)
    return found


def tables(found: dict[str, Paces], groups: Groups, sizes: Sizes, rounds: int) -> list[Table]:
    """Return a table for each group, the last with notes on the machine and skipped systems."""
    words = {name: thousands(size) for name, size in sizes._asdict().items()}
    made = []
    for name, paces in found.items():
        first, rows = np.array(next(iter(paces.values())))[:, 0], []
        for system, values in paces.items():
            steps, cpu = np.array(values).T
            spread = interval(steps.min() / 1e6, steps.max() / 1e6, 3)
            numbers = figure(np.median(steps) / 1e6) if np.median(steps) >= 1e5 else ""
            numbers = numbers or f"{np.median(steps) / 1e6:.4f}"
            times = figure(float(np.median(first / steps)))
            step = system.step.format(**words)
            rows.append([system.name, step, numbers, spread, figure(np.median(cpu)), times])
        columns = ["system", "one step", "M steps/s", "lowest, highest", "CPU ns", "first / this"]
        made.append(Table(name, columns, rows, text_columns=2))
    lacking = [
        f"{one.name} is skipped, because it requires {' and '.join(missing(one))}."
        for some in groups.values()
        for one in some
        if missing(one)
    ]
    about = f"Medians of {rounds} rounds. {machine(_PACKAGES)}"
    return [*made[:-1], replace(made[-1], notes=[about, *lacking])]


def draw(found: dict[str, Paces]) -> None:
    """Draw all paces into docs/figures/peers.png.

    Raises:
        AntsError: The file cannot be written.
    """
    with style.styled():
        drawn = style.new_figure(1.2 + 0.24 * sum(map(len, found.values())))
        panels = drawn.subplots(len(found), sharex=True, height_ratios=[*map(len, found.values())])
        for axes, (name, paces) in zip(panels, found.items(), strict=True):
            for place, (system, values) in enumerate(paces.items()):
                steps = np.array(values)[:, 0]
                ours = system.name.startswith("Taichi Ants")
                colour = style.BLUE if ours else style.ORANGE
                label = "Taichi Ants" if ours else "others"
                axes.plot(np.median(steps), place, "o", color=colour, label=label)
                axes.hlines(place, steps.min(), steps.max(), color=colour)
            axes.set_yticks(range(len(paces)), [system.name for system in paces])
            axes.set(title=name, ylim=(len(paces) - 0.5, -0.5))
            axes.grid(visible=False, axis="y")
        panels[-1].set(xlabel="steps per second")
        count_in_powers(panels[-1].xaxis)
        title = "Steps per second on one machine"
        caption = "Medians, with the lowest and highest. Compare within a panel."
        style.frame(drawn, title, caption, style.legend_entries(panels))
    style.save(drawn, FIGURES / "peers.png")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    add("--rounds", type=whole_number(1), default=5, metavar="N", help="measure each N times")
    add("--small", action="store_true", help="do little work, to test this command")
    add("--publish", action="store_true", help="write them to docs/results/performance.md")

    def command() -> None:
        given = parser.parse_args(arguments)
        sizes, seconds = (SMALL, 0.0) if given.small else (Sizes(), 1.0)
        found = measured(sizes, given.rounds, seconds)
        made = tables(found, GROUPS, sizes, given.rounds)
        if given.publish:
            draw(found)
        show("performance_peers", made, given.publish)

    run_command(command)


if __name__ == "__main__":
    main()
