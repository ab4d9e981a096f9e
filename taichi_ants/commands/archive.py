"""Put a finished study into one file with everything that repeats it.

FOLDER is a folder of finished results. The archive has the folder, with the runs and all files that
the study has read, the versions of all packages, and a description of the model. See
docs/archives.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from taichi_ants.errors import AntsError
from taichi_ants.studies import command_line


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    add = parser.add_argument
    add("folder", type=Path, metavar="FOLDER", help="folder of results")
    add("--out", type=Path, metavar="FILE", help="write the archive here (default: FOLDER.zip)")
    add("--force", action="store_true", help="replace an existing FILE")
    return parser.parse_args(arguments)


def run(settings: argparse.Namespace) -> None:
    """Write the archive, and print what it contains."""
    from taichi_ants.files import check_writable_file, check_writable_folder
    from taichi_ants.report.odd import odd_of
    from taichi_ants.studies.archive import finished, write

    out = settings.out or Path(f"{settings.folder.resolve()}.zip")
    manifest = finished(settings.folder)
    if out.exists() and not settings.force:
        raise AntsError(f"{str(out)!r} exists; choose another --out, or give --force.")
    check_writable_folder(out.parent, out)
    odd = odd_of(settings.folder, manifest)
    number = write(check_writable_file(out), settings.folder, manifest, odd)
    print(f"{out}: {number} files ({out.stat().st_size / 1e6:.1f} MB)")
    print(f"To repeat the study and compare: taichi-ants reproduce {out}")
