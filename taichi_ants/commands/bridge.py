"""Train colonies on a double bridge, and measure which branch they use.

Colonies learn on a bridge with branches of 23 and 36 steps. The command evaluates them on that
bridge, on its mirror image, on one with equal branches, and on one whose short branch opens late.
It prints the share of ants that cross by the short branch, without food and with it, and writes
counts and two figures to a folder. See docs/bridge.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from taichi_ants.studies import command_line
from taichi_ants.studies.command_line import whole_number

QUICK = {"seeds": 4, "episodes": 20, "ticks": 500, "evaluation_ticks": 1000}


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
    add("--quick", action="store_true", help=quick)
    command_line.add_common(parser)
    command_line.add_results(parser, "bridge")
    settings, given = parser.parse_given(arguments)
    for name in QUICK.keys() - given.keys() if settings.quick else ():
        setattr(settings, name, QUICK[name])
    return command_line.with_folder(settings, "bridge")


def bridge(settings: argparse.Namespace) -> None:
    """Run the study, or show its results if it is finished."""
    from taichi_ants.analysis.bridge import DESIGNS, write_results
    from taichi_ants.studies.bridge import followed, point
    from taichi_ants.studies.result_folder import work_or_show
    from taichi_ants.studies.runner import Study

    command_line.load_plugin(settings.plugin)
    seeds = tuple(range(settings.seed, settings.seed + settings.seeds))
    points = {design: point(design, settings.episodes, settings.ticks) for design in DESIGNS}
    study = Study(tuple(points.values()), seeds)
    ticks, where = settings.evaluation_ticks, {"threads": settings.threads, "arch": settings.arch}

    def work(blocks: Path, ready: Path) -> None:
        found = {}
        with command_line.progress_bar("bridge") as progress:
            outcomes = study.run(blocks, lambda share: progress(0.6 * share), **where)
            for number, (design, one) in enumerate(points.items()):
                path, tables = blocks / f"followed-{number:06d}.npz", outcomes[one]["q_values"]
                found[design] = followed(path, design, one, seeds, tables, ticks, where)
                progress(0.6 + 0.4 * (number + 1) / len(points))
        write_results(ready, found, seeds, ticks, draws=not settings.no_figures)

    work_or_show(settings, {**study.settings(), "evaluation_ticks": ticks}, work)


def main(arguments: list[str] | None = None) -> None:
    """Run the command."""
    command_line.run_command(lambda: bridge(parse_arguments(arguments)), command_line.AGAIN)
