"""Sweep any settings of the world, the task, the learner or the colony, from a TOML file.

FILE lists fixed settings, the values of settings to vary, seeds, and measures. The command runs
every combination of values with every seed, and writes tables and a figure to a folder. See
docs/sweeps.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path

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
    settings = parser.parse_args(arguments)
    settings.command, settings.text = "sweep", None
    return command_line.with_folder(settings, f"sweep-{settings.file.stem}")


def sweep(settings: argparse.Namespace) -> None:
    """Run the sweep, or show its results if it is finished."""
    from taichi_ants.files import read_text
    from taichi_ants.studies.machines import chosen
    from taichi_ants.studies.result_folder import work_or_show
    from taichi_ants.studies.sweep import read_sweep

    command_line.load_plugin(settings.plugin)
    settings.text = settings.text or read_text(settings.file)
    asked = read_sweep(settings.file, settings.text)

    def work(blocks: Path, ready: Path) -> None:
        bar = command_line.progress_bar
        with chosen(settings) as how, bar("sweep", how.get("executor")) as progress:
            values = asked.measured(blocks, progress, **how)
        if settings.shard:
            return
        asked.write(values, ready, draws=not settings.no_figures)
        asked.write_series(blocks, ready)

    work_or_show(settings, asked.facts(), work, study=asked.study, take=asked.take)


def main(
    arguments: list[str] | None = None, file: Path | None = None, about: str | None = None
) -> None:
    """Run the command; the arguments are those of `parse_arguments`."""
    command_line.run_command(
        lambda: sweep(parse_arguments(arguments, file, about)), command_line.AGAIN
    )
