"""Show what is done, what failed, and how long is left in folders of results.

The command reads only files, so it also works while another process, or another machine with the
same disk, computes. See docs/many_machines.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from taichi_ants.studies import command_line


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    parser.add_argument("folders", type=Path, nargs="+", metavar="FOLDER", help="folder of results")
    return parser.parse_args(arguments)


def run(settings: argparse.Namespace) -> None:
    """Print the state of each folder."""
    from taichi_ants.studies.folder import status as status_of

    for folder in settings.folders:
        print(folder, *(f"  {line}" for line in status_of(folder)), sep="\n")
