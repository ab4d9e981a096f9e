"""Repeat the study in an archive, and compare all files of its results byte for byte.

FILE is an archive that `taichi-ants archive` wrote. The command checks its checksums, computes the
study again in a new folder, and prints a line for each file. It exits with status 1 if a file
differs. See docs/archives.md.
"""

from __future__ import annotations

import argparse
import io
import sys
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

from taichi_ants.commands.merge import started
from taichi_ants.errors import AntsError
from taichi_ants.studies import command_line


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    add = parser.add_argument
    add("file", type=Path, metavar="FILE", help="archive (.zip)")
    place = "write the new results here (default: results/reproduced-NAME)"
    add("--out", type=Path, metavar="FOLDER", help=place)
    trust = "run the plugins in the archive, which are Python code"
    add("--trust-plugins", action="store_true", help=trust)
    add(
        "--threads", type=command_line.whole_number(1, 1024), metavar="N", help=command_line.THREADS
    )
    return parser.parse_args(arguments)


def reproduce(settings: argparse.Namespace) -> None:
    """Repeat the study, print the comparison, and exit with status 1 if a file differs."""
    from taichi_ants.files import bundles
    from taichi_ants.files.results import MANIFEST
    from taichi_ants.studies import reproduction

    out = settings.out or Path("results", f"reproduced-{settings.file.stem}")
    if (out / MANIFEST).exists():
        raise AntsError(f"{str(out)!r} has finished results; choose another --out.")
    with bundles.reading(settings.file) as bundle:
        manifest = reproduction.manifest_of(bundle)
        if plugins := reproduction.plugins_of(manifest):
            words = reproduction.plugins_in_words(bundle, plugins)
            if not settings.trust_plugins:
                raise AntsError(
                    f"the study runs code of the archive, {words}; read it, for example with "
                    f"`unzip -p`, and give --trust-plugins to run it."
                )
            command_line.notice(f"Running code of the archive: {words}.")
        if versions := reproduction.other_versions(manifest):
            command_line.notice(f"These versions differ from those of the archive: {versions}.")
        of_run = {"shard": None, "workers": None, "ray": None, "force": False, "text": None}
        with reproduction.unpacked(bundle, manifest) as options, redirect_stdout(io.StringIO()):
            asked: dict[str, Any] = {**options, **of_run, "threads": settings.threads, "out": out}
            try:
                started(manifest["asked"]["command"], asked)
            except (TypeError, AttributeError, LookupError) as error:  # of options in the manifest
                raise AntsError(
                    f"the study in {str(settings.file)!r} cannot run here "
                    f"({type(error).__name__}: {error}); install the versions in its "
                    "requirements.txt, or get another copy of it."
                ) from error
        files = list(reproduction.compare(bundle, manifest, out))
    _print(files)


def _print(files: list[Any]) -> None:
    """Print a line for each file and the verdict; exit with status 1 if a file differs."""
    for name, difference, note in files:
        words = f"({difference})" if difference else note and f"({note})"
        print(f"{'DIFFERENT' if difference else 'equal':9}  {name} {words}".rstrip())
    different = sum(bool(one.difference) for one in files)
    if different:
        print(f"{different} of {len(files)} files differ: the study is not reproduced.")
        sys.exit(1)
    print(f"All {len(files)} files are equal: the study is reproduced.")


def main(arguments: list[str] | None = None) -> None:
    """Run the command."""
    command_line.run_command(lambda: reproduce(parse_arguments(arguments)), command_line.AGAIN)
