"""Sweep any settings of the world, the task, the learner or the colony, from a TOML file.

FILE lists fixed settings, the values or ranges of settings to vary, seeds, and measures. The
command runs every combination of values, or the points of a design, with every seed, and writes
tables and figures to a folder. See docs/sweeps.md and docs/designs.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from taichi_ants.studies import command_line


def parse_arguments(
    arguments: list[str] | None = None, file: Path | None = None, about: str | None = None
) -> argparse.Namespace:
    """Return the settings of the command line; a script for one sweep gives `file` and `about`."""
    parser = command_line.Parser(about or __doc__)
    if file is None:
        parser.add_argument("file", type=Path, metavar="FILE", help="sweep to run (.toml)")
    parser.set_defaults(**({"file": file} if file else {}))
    command_line.add_common(parser)
    command_line.add_machines(parser)
    name = f"sweep-{file.stem}" if file else "sweep-NAME for the file NAME.toml"
    command_line.add_results(parser, name, quick=False)
    also = "write the tables as Parquet, too, while the sweep runs and at the end (extra parquet)"
    parser.add_argument("--parquet", action="store_true", help=also)
    settings = parser.parse_args(arguments)
    settings.command, settings.text = "sweep", None
    return command_line.with_folder(settings, f"sweep-{settings.file.stem}")


def sweep(settings: argparse.Namespace) -> None:
    """Run the sweep, or show its results if it is finished."""
    from taichi_ants.files import read_text
    from taichi_ants.files.inputs import recorded
    from taichi_ants.files.parquet import check_installed
    from taichi_ants.studies.machines import chosen
    from taichi_ants.studies.result_folder import work_or_show
    from taichi_ants.studies.sweep import read_sweep

    with recorded() as inputs:
        command_line.load_plugin(settings.plugin)
        settings.text = settings.text or read_text(settings.file)
        with command_line.progress_bar("settings") as progress:
            asked = read_sweep(settings.file, settings.text, progress)
    if settings.parquet:
        check_installed()

    def work(blocks: Path, ready: Path) -> None:
        bar = command_line.progress_bar
        with chosen(settings) as how, bar("sweep", how.get("executor")) as progress:
            values = asked.measured(blocks, progress, settings.parquet, **how)
        if settings.shard:
            return
        asked.write(values, ready, draws=not settings.no_figures)
        asked.write_series(blocks, ready)

    more: dict[str, Any] = {"study": asked.study, "take": asked.take, "inputs": inputs}
    more |= {"as_parquet": asked.write_parquet}
    work_or_show(settings, asked.facts(), work, **more)


def main(
    arguments: list[str] | None = None, file: Path | None = None, about: str | None = None
) -> None:
    """Run the command; the arguments are those of `parse_arguments`."""
    command_line.run_command(
        lambda: sweep(parse_arguments(arguments, file, about)), command_line.AGAIN
    )
