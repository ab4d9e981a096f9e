"""Join the shards of a sweep, a comparison or a colony study into the results of the whole.

FOLDER are the folders that commands with --shard have written. The results are those of one command
without --shard. See docs/many_machines.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import taichi_ants
from taichi_ants.errors import AntsError
from taichi_ants.studies import command_line

# The functions of commands and scripts that compute or show results from their settings, with their
# modules and the arguments without which the command line is not complete.
STARTS = {
    "sweep": ("taichi_ants.commands.sweep", "sweep", ["FILE"]),
    "compare": ("compare", "compare", []),
    "colony": ("colony", "study", ["study"]),
}
# Of scripts, which are not part of the package.
EXPERIMENTS = Path(taichi_ants.__file__).parents[1] / "experiments"


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    add = parser.add_argument
    add("folders", type=Path, nargs="+", metavar="FOLDER", help="folders of shards")
    add("--out", type=Path, required=True, metavar="FOLDER", help="write the results here")
    add("--force", action="store_true", help="replace other results in the folder of --out")
    return parser.parse_args(arguments)


def merge(settings: argparse.Namespace) -> None:
    """Join the blocks of shards, then run their command, which finds all blocks."""
    from taichi_ants.studies.shards import join

    manifest = join(settings.folders, settings.out, settings.force)
    options = {**manifest["options"], "shard": None, "workers": None, "ray": None, "force": False}
    options |= {name: Path(options[name]) for name in ("file",) if options.get(name)}
    started(manifest["command"], {**options, "out": settings.out})


def started(name: str, options: Mapping[str, Any]) -> None:
    """Run the command with this name and these options, which a manifest contained.

    Options that another version of the package did not have get their defaults.
    """
    place, function, arguments = STARTS[name]
    if "." not in place and str(EXPERIMENTS) not in sys.path:
        if not (EXPERIMENTS / f"{place}.py").exists():
            raise AntsError(
                f"the results are those of experiments/{place}.py, which only a clone of the "
                "repository has; install taichi-ants from one, with `pip install -e .`."
            )
        sys.path.append(str(EXPERIMENTS))
    module = import_module(place)
    start: Callable[[argparse.Namespace], None] = getattr(module, function)
    usual = vars(module.parse_arguments(arguments))
    start(argparse.Namespace(**{**usual, **options, "command": name}))


def main(arguments: list[str] | None = None) -> None:
    """Run the command."""
    command_line.run_command(lambda: merge(parse_arguments(arguments)), command_line.AGAIN)
