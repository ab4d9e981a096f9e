"""Sweep any settings of the world, the task, the learner or the colony, from a TOML file.

FILE lists fixed settings, the values or ranges of settings to vary, seeds, and measures. The
command runs every combination of values, or the points of a design, with every seed, and writes
tables and figures to a folder. See docs/how-to/sweeps.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from taichi_ants.studies import command_line

STOPPED = command_line.AGAIN


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    parser.add_argument("file", type=Path, metavar="FILE", help="sweep to run (.toml)")
    command_line.add_study(parser, "sweep-NAME for the file NAME.toml")
    also = "write the tables as Parquet, too (extra parquet)"
    parser.add_argument("--parquet", action="store_true", help=also)
    settings = parser.parse_args(arguments)
    return command_line.with_folder(settings, f"sweep-{settings.file.stem}")


def run(settings: argparse.Namespace) -> None:
    """Run the sweep, or show its results if it is finished."""
    from taichi_ants.studies.command import planned, run_study

    run_study(settings, planned("taichi_ants.studies.sweep", settings))
