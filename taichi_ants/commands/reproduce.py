"""Repeat the study in an archive, and compare all of its tables and figures byte for byte.

FILE is an archive that `taichi-ants archive` wrote. The command computes the study again in a new
folder, and prints a line for each file. It exits with status 1 if a file differs. See
docs/archives.md.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from taichi_ants.errors import AntsError
from taichi_ants.studies import command_line

STOPPED = command_line.AGAIN


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    add = parser.add_argument
    add("file", type=Path, metavar="FILE", help="archive (.zip)")
    place = "write the new results here (default: results/reproduced-NAME)"
    add("--out", type=Path, metavar="FOLDER", help=place)
    trust = "run the Python code in the archive: plugins, and the module of the study"
    add("--trust-code", action="store_true", help=trust)
    command_line.add_threads(parser)
    command_line.add_machines(parser)
    return parser.parse_args(arguments)


def run(settings: argparse.Namespace) -> None:
    """Repeat the study, print the comparison, and exit with status 1 if a file differs."""
    from taichi_ants.studies import archive, folder
    from taichi_ants.studies.command import opened, run_study

    out = settings.out or Path("results", f"reproduced-{settings.file.stem}")
    if (out / folder.MANIFEST).exists():
        raise AntsError(f"{str(out)!r} has finished results; choose another --out.")
    with archive.unpacked(settings.file) as path:
        manifest = archive.finished(path)
        if code := sorted(path.glob(f"{folder.INPUTS}/*/**/*.py")):
            names = ", ".join(f"results/{file.relative_to(path)}" for file in code)
            if not settings.trust_code:
                raise AntsError(
                    f"the study runs code of the archive, {names}; read it, for example with "
                    "`unzip -p`, and give --trust-code to run it."
                )
            command_line.notice(f"Running code of the archive: {names}.")
        if versions := archive.other_versions(manifest):
            command_line.notice(f"These versions differ from those of the archive: {versions}.")
        with opened(path) as planned:
            more = {"no_figures": not manifest["figures"], "parquet": manifest["parquet"]}
            more |= {"out": out, "force": False, "arch": planned.facts["arch"]}
            if not run_study(argparse.Namespace(**vars(settings) | more), planned, report=False):
                return
        found = dict(archive.differences(path, out))
    for name, words in found.items():
        print(f"DIFFERENT  {name} ({words})" if words else f"equal      {name}")
    if different := sum(map(bool, found.values())):
        print(f"{different} of {len(found)} files differ: the study is not reproduced.")
        sys.exit(1)
    print(f"All {len(found)} files are equal: the study is reproduced.")
