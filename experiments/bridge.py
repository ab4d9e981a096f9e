"""Train colonies on a double bridge, and measure which branch they use.

Colonies learn on a bridge with branches of 23 and 36 steps. The script evaluates them on that
bridge, on its mirror image, on one with equal branches, and on one whose short branch opens late.
It prints the share of ants that cross by the short branch, without food and with it, and writes
counts and two figures to a folder. See docs/results/bridge.md.
"""

from __future__ import annotations

from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    from collections.abc import Mapping, Sequence
    from dataclasses import dataclass, replace
    from functools import partial
    from typing import Any

    import bridge_report as shown
    import numpy as np
    import published
    from bridge_report import BRIDGES, CASES, LATE, LOADS, WINDOWS, Case, bridges
    from colony import LEARNING, scheduled

    from taichi_ants import AntsError, Colony, Life, Task, files
    from taichi_ants.analysis.tables import plain_text
    from taichi_ants.engines.colony.interventions import Interventions
    from taichi_ants.interventions import Clear, Place
    from taichi_ants.studies import command_line
    from taichi_ants.studies.command import planned, run_study
    from taichi_ants.studies.command_line import whole_number
    from taichi_ants.studies.folder import Results
    from taichi_ants.studies.points import ColonyPoint
    from taichi_ants.studies.study import Study
    from taichi_ants.task import foraging, queueing
    from taichi_ants.worlds import double_bridge
    from taichi_ants.worlds.double_bridge import ROOM_RADIUS, bridge_paths

VERSION = 1  # of the arrays that are kept of each run
REACH = 50  # number of ticks for which an ant lays a trail
QUICK = {"seeds": 4, "episodes": 20, "ticks": 500, "evaluation_ticks": 1000}
_LOOK_EVERY = 4  # ticks; all branches are longer, so no crossing is missed
_QUEEN_ROOM, _FOOD_ROOM, _SHORT, _LONG = range(4)


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    add = parser.add_argument
    add("--seeds", type=whole_number(1, 1000), default=40, metavar="N", help="number of seeds")
    add("--seed", type=whole_number(), default=0, metavar="N", help="first seed")
    counts: dict[str, Any] = {"type": whole_number(1, 10_000_000), "metavar": "N"}
    add("--episodes", **counts, default=60, help="number of training episodes")
    add("--ticks", **counts, default=1000, help="ticks per training episode")
    add("--evaluation-ticks", **counts, default=3000, help="ticks per evaluation")
    quick = (
        f"use {QUICK['seeds']} seeds, too few for intervals, and fewer episodes and ticks: to see "
        "that the study runs, not for conclusions"
    )
    command_line.add_study(parser, "bridge", quick)
    settings, given = parser.parse_given(arguments)
    for name in QUICK.keys() - given.keys() if settings.quick else ():
        setattr(settings, name, QUICK[name])
    return command_line.with_folder(settings, "bridge")


def task(design: Case) -> Task:
    """Return the rules of a design; food grows back at once."""
    rules, kind = {"queueing": queueing, "foraging": foraging}[design.rules](), design.evaporation
    evaporation: dict[str, Any] = {"evaporation": kind}
    if kind.isdecimal():
        evaporation = {"evaporation": "exponential", "half_life": float(kind)}
    trail = replace(rules.pheromone, level=REACH * design.slope, slope=design.slope, **evaporation)
    return replace(rules, pheromone=trail, life=Life(regrowth=0))


def point(design: Case, episodes: int, ticks: int) -> ColonyPoint:
    """Return the training of colonies of a design.

    The short branch is on the right in about half of the episodes and on the left in the others, so
    colonies cannot learn its side.
    """
    right, left, *_ = bridges(design).values()
    pool = double_bridge(**right), double_bridge(**left)
    several = pool[0], task(design), scheduled(LEARNING, episodes), pool, design.ants
    return ColonyPoint(*several, episodes=episodes, ticks=ticks, rollouts=1)


@dataclass(frozen=True)
class Plan:
    """The study, with a point for each of `CASES`, and the ticks of an evaluation."""

    study: Study
    ticks: int


def plan(options: Mapping[str, Any]) -> Plan:
    """Return the study."""
    seeds = tuple(range(options["seed"], options["seed"] + options["seeds"]))
    ticks, lengths = options["evaluation_ticks"], (options["episodes"], options["ticks"])
    designs = {point(design, *lengths): design for design in CASES}
    followed = partial(crossed, designs, ticks)
    return Plan(Study(tuple(designs), seeds, (f"crossings_{ticks}",), followed), ticks)


def crossed(
    designs: Mapping[ColonyPoint, Case],
    ticks: int,
    points: Sequence[ColonyPoint],
    seeds: Sequence[int],
    outcome: Mapping[str, np.ndarray],
) -> dict[str, np.ndarray]:
    """Return the `crossings` of trained colonies on each bridge, by its number in `BRIDGES`.

    Arrays are int64 (1, seeds, WINDOWS, loads, branches). An episode has `ticks`, twice as many on
    `LATE`.
    """
    (learned,), q_values, found = points, outcome["q_values"][0], {}
    for name, bridge in bridges(designs[learned]).items():
        late, parts, world = name == LATE, [], double_bridge(**bridge)
        # Interventions need a colony with a single world.
        each = [slice(s, s + 1) for s in range(len(seeds))] if late else [slice(None)]
        for some in each:
            colony = learned.colony(world, seeds[some], q_values[some], False, schedule="by_world")
            parts.append(crossings(colony, bridge, *((2 * ticks, ticks) if late else (ticks, 0))))
        array = np.moveaxis(np.concatenate(parts, axis=-1), -1, 0)[None]
        found[f"crossings_{ticks}.{BRIDGES.index(name)}"] = array
    return found


def tables(plan: Plan, results: Results) -> str:
    """Return the report, which needs all runs, after writing counts and figures."""
    if not results.present.all():
        raise AntsError("not all runs are there yet, and the report compares all designs; wait.")
    arrays = results.read(results.study.keys, arrays=[f"crossings_{plan.ticks}"])
    found = {
        design: {
            name: np.moveaxis(arrays[f"crossings_{plan.ticks}.{BRIDGES.index(name)}"][row], 0, -1)
            for name in bridges(design)
        }
        for row, design in enumerate(CASES)
    }
    table = shown.rows(found, plan.study.seeds, plan.ticks)
    files.write_csv(results.folder / "shares.csv", table, list(table[0]))
    if results.figures:
        folder = results.folder / "figures"
        shown.draw(folder / "bridge.png", found, plan.ticks)
        shown.draw_late(folder / "late.png", found, plan.ticks)
    report = shown.tables(found, plan.ticks)
    for name, one in report.items():
        published.write(results.folder / "tables" / f"bridge_{name}.json", [one])
    return plain_text(list(report.values()), 120)


def crossings(colony: Colony, bridge: dict[str, Any], ticks: int, opens: int = 0) -> np.ndarray:
    """Run an episode, and count the crossings of the bridge by branch.

    An ant crosses when it enters one room and was in the other before; its branch is the last one
    that it was in. Only foragers that enter the food room and carriers that enter the queen's room
    count. Rock closes the short branch until tick `opens`, which must be 0 if there are several
    worlds. The colony has the schedule "by_world", in which ants keep their slots; `bridge` has the
    arguments of `double_bridge`.

    Returns:
        int64 (WINDOWS, loads, branches, worlds): foragers then carriers, short branch then long.
    """
    # The room or branch of each cell; a junction belongs to its room.
    grid, (junctions, branches) = double_bridge(**bridge).grid, bridge_paths(**bridge)
    pile = grid.distances(tuple((junctions[1] + junctions[0]).tolist()))
    zone = np.where(pile <= ROOM_RADIUS + 1, _FOOD_ROOM, _QUEEN_ROOM)
    for number, cells in zip((_SHORT, _LONG), branches, strict=True):
        zone[grid.index(cells)] = number
    n_worlds = len(colony.seeds)
    world = np.repeat(np.arange(n_worlds), colony.capacity)
    counts = np.zeros((WINDOWS, len(LOADS), 2, n_worlds), np.int64)
    room, branch = np.full(len(world), _QUEEN_ROOM), np.full(len(world), _SHORT)
    colony.begin_episode(ticks)
    if opens:
        short, interventions = colony.grid.index(branches[0]).tolist(), Interventions(colony)
        interventions.apply(Place("rock", short))
    while colony.ticks < ticks:
        if opens and colony.ticks == opens:
            interventions.apply(Clear(short))
        window = colony.ticks * WINDOWS // ticks
        until = opens if colony.ticks < opens else ticks
        colony.tick(min(_LOOK_EVERY, until - colony.ticks))
        now = zone[colony.cells.ravel()]
        carries, inside = colony.carrying.ravel(), now <= _FOOD_ROOM
        useful = inside & (now != room) & (carries == (now == _QUEEN_ROOM))
        where = carries[useful].astype(int), branch[useful] - _SHORT, world[useful]
        np.add.at(counts[window], where, 1)
        room = np.where(inside, now, room)
        branch = np.where(inside, branch, now)
    return counts


def main(arguments: list[str] | None = None) -> None:
    """Run the study, or show its results if it is finished."""
    with command_line.reporting(command_line.AGAIN):
        settings = parse_arguments(arguments)
        run_study(settings, planned(__file__, settings))


if __name__ == "__main__":
    main()
