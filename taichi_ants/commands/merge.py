"""Join the shards of a sweep, a comparison or a colony study into the results of the whole.

FOLDER are the folders that commands with --shard have written. The results are those of one command
without --shard. See docs/many_machines.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from taichi_ants.studies import command_line

# The functions of commands that compute or show results from their settings.
STARTS = {"sweep": "sweep", "compare": "compare", "colony": "start"}


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    add = parser.add_argument
    add("folders", type=Path, nargs="+", metavar="FOLDER", help="folders of shards")
    add("--out", type=Path, required=True, metavar="FOLDER", help="write the results here")
    return parser.parse_args(arguments)


def merge(settings: argparse.Namespace) -> None:
    """Join the blocks of shards, then run their command, which finds all blocks."""
    from taichi_ants.studies.shards import join

    manifest = join(settings.folders, settings.out)
    options = {**manifest["options"], "shard": None, "workers": None, "ray": None, "force": False}
    options |= {name: Path(options[name]) for name in ("file",) if options.get(name)}
    name = manifest["command"]
    start: Callable[[argparse.Namespace], None] = getattr(
        import_module(f"taichi_ants.commands.{name}"), STARTS[name]
    )
    start(argparse.Namespace(**{**options, "out": settings.out}))


def main(arguments: list[str] | None = None) -> None:
    """Run the command."""
    command_line.run_command(lambda: merge(parse_arguments(arguments)), command_line.AGAIN)
