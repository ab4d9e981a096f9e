"""Put a finished study into one file with everything that repeats it.

The archive has the folder, with the runs and all files that the study has read, the versions of all
packages, and a description of the model. See docs/how-to/clusters.md.
"""

import argparse
import io
import zipfile
from pathlib import Path
from typing import Any

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
    add("folder", type=Path, metavar="FOLDER", help="folder of finished results")
    add("--out", type=Path, metavar="FILE", help="write the archive here (default: FOLDER.zip)")
    add("--force", action="store_true", help="replace an existing FILE")
    return parser.parse_args(arguments)


def run(settings: argparse.Namespace) -> None:
    """Write the archive, and print what it contains; the same folder gives the same bytes."""
    folder, out = settings.folder, settings.out or Path(f"{settings.folder.resolve()}.zip")
    manifest = finished(folder)
    if out.exists() and not settings.force:
        raise AntsError(f"{str(out)!r} exists; choose another --out, or give --force.")
    contents: dict[str, Any] = {"ODD.md": odd_of(folder, manifest)}
    contents |= {"README.md": _README.format(**manifest), "requirements.txt": _pins(manifest)}
    for path in filter(Path.is_file, folder.rglob("[!.]*")):
        contents[f"{RESULTS}/{path.relative_to(folder).as_posix()}"] = path.read_bytes()
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, content in sorted(contents.items()):
            entry = zipfile.ZipInfo(name)  # of 1980, because dates would change the bytes
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, content, zipfile.ZIP_DEFLATED)
    files.write_bytes(out, packed.getvalue())
    print(f"{out}: {len(contents)} files ({packed.tell() / 1e6:.1f} MB)")
    print(f"To repeat the study and compare: taichi-ants reproduce {out}")


def _pins(manifest: dict[str, Any]) -> str:
    """Return the packages of a run with exact versions, in the format of pip's requirements."""
    pins = [f"{name}=={version}" for name, version in manifest["packages"].items()]
    if commit := manifest["commit"]:
        changed = "" if manifest["clean"] else ", with changes that are not committed"
        pins[0] = f"# Taichi Ants ran from its source, commit {commit}{changed}"
    return "\n".join([f"# Python {manifest['python']}", *pins, ""])
