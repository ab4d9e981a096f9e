"""Put a finished study into one file with everything that repeats it.

FOLDER is a folder of finished results. The archive has the folder, with the runs and all files that
the study has read, the versions of all packages, and a description of the model. See
docs/how-to/clusters.md.
"""

from __future__ import annotations

import argparse
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

from taichi_ants import files
from taichi_ants.errors import AntsError
from taichi_ants.report.odd import odd_of
from taichi_ants.studies import command_line
from taichi_ants.studies.folder import finished

RESULTS = "results"  # the folder of results in an archive
_README = """These results come from `{command}`, which finished {finished}. To compute them
again and compare every table and figure, install the versions in `requirements.txt`, and run
`taichi-ants reproduce FILE` with the name of this archive. `ODD.md` describes the model.
"""


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    add = parser.add_argument
    add("folder", type=Path, metavar="FOLDER", help="folder of results")
    add("--out", type=Path, metavar="FILE", help="write the archive here (default: FOLDER.zip)")
    add("--force", action="store_true", help="replace an existing FILE")
    return parser.parse_args(arguments)


def run(settings: argparse.Namespace) -> None:
    """Write the archive, and print what it contains; the same folder gives the same bytes."""
    folder, out = settings.folder, settings.out or Path(f"{settings.folder.resolve()}.zip")
    manifest = finished(folder)
    if out.exists() and not settings.force:
        raise AntsError(f"{str(out)!r} exists; choose another --out, or give --force.")
    texts = odd_of(folder, manifest), _requirements(manifest), _README.format(**manifest)
    names = "ODD.md", "requirements.txt", "README.md"
    contents = dict(zip(names, map(str.encode, texts), strict=True))
    for path in filter(Path.is_file, folder.rglob("[!.]*")):
        contents[f"{RESULTS}/{path.relative_to(folder).as_posix()}"] = path.read_bytes()

    def save(file: BinaryIO) -> None:
        with zipfile.ZipFile(file, "w") as archive:
            for name, content in sorted(contents.items()):
                entry = zipfile.ZipInfo(name)  # of 1980, because dates would change the bytes
                entry.external_attr = 0o644 << 16
                archive.writestr(entry, content, zipfile.ZIP_DEFLATED)

    files.write_atomically(out, save)
    print(f"{out}: {len(contents)} files ({out.stat().st_size / 1e6:.1f} MB)")
    print(f"To repeat the study and compare: taichi-ants reproduce {out}")


def _requirements(manifest: Mapping[str, Any]) -> str:
    """Return the packages of a run with exact versions, in the format of pip's requirements."""
    own, *others = (f"{name}=={version}\n" for name, version in manifest["packages"].items())
    if commit := manifest["commit"]:
        changed = "" if manifest["clean"] else ", with changes that are not committed"
        own = f"# Taichi Ants ran from its source, commit {commit}{changed}\n"
    return "".join([f"# Python {manifest['python']}\n", own, *others])
