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
    number = command_line.whole_number(1, 1024)
    add("--threads", type=number, metavar="N", help=command_line.THREADS)
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
            names = ", ".join(f"{archive.RESULTS}/{file.relative_to(path)}" for file in code)
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
            if not run_study(argparse.Namespace(**vars(settings) | more), planned):
                return
        compared = list(archive.compare(path, out))
    for name, difference, note in compared:
        words = f"({difference or note})" if difference or note else ""
        print(f"{'DIFFERENT' if difference else 'equal':9}  {name} {words}".rstrip())
    if different := sum(bool(difference) for _, difference, _ in compared):
        print(f"{different} of {len(compared)} files differ: the study is not reproduced.")
        sys.exit(1)
    print(f"All {len(compared)} files are equal: the study is reproduced.")
