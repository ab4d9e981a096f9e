"""Repeat the study in an archive, and compare all of its tables and figures byte for byte.

The command computes the study in a new folder, prints a line for each file, and exits with status 1
if one differs. See docs/how-to/clusters.md.
"""

import argparse
import filecmp
import platform
import tempfile
import zipfile
import zlib
from pathlib import Path

from taichi_ants import files
from taichi_ants.commands.archive import RESULTS
from taichi_ants.errors import AntsError
from taichi_ants.studies import command_line
from taichi_ants.studies.command import opened, run_study
from taichi_ants.studies.folder import INPUTS, MANIFEST, PAGE, finished, packages

STOPPED = command_line.AGAIN
MOST_BYTES = 1 << 34  # of all unpacked files


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    add = parser.add_argument
    add("file", type=Path, metavar="FILE", help="archive that `taichi-ants archive` wrote")
    add("--out", type=Path, metavar="FOLDER", help="new folder (default: results/reproduced-NAME)")
    add("--trust-code", action="store_true", help="run plugins and other code in the archive")
    command_line.add_threads(parser)
    command_line.add_machines(parser)
    return parser.parse_args(arguments)


def run(settings: argparse.Namespace) -> None:
    """Repeat the study, print the comparison, and exit with status 1 if a file differs."""
    out = settings.out or Path("results", f"reproduced-{settings.file.stem}")
    if (out / MANIFEST).exists():
        raise AntsError(f"{str(out)!r} has finished results; choose another --out.")
    with tempfile.TemporaryDirectory() as temporary:
        unpack(settings.file, temporary)
        folder = Path(temporary, RESULTS)
        manifest = finished(folder)
        code = [str(path.relative_to(temporary)) for path in folder.glob(f"{INPUTS}/*/**/*.py")]
        if code and not settings.trust_code:
            raise AntsError(
                f"the study runs code of the archive, {', '.join(sorted(code))}; read it, for "
                "example with `unzip -p`, and give --trust-code to run it."
            )
        here = {"python": platform.python_version(), **packages(manifest["packages"])}
        for name, there in {"python": manifest["python"], **manifest["packages"]}.items():
            if here.get(name) != there:
                command_line.notice(f"The archive has {name} {there}, here is {here.get(name)}.")
        with opened(folder) as planned:
            more = {"no_figures": not manifest["figures"], "parquet": manifest["parquet"]}
            more |= {"out": out, "force": False, "arch": planned.asked["arch"]}
            if not run_study(argparse.Namespace(**vars(settings) | more), planned, report=False):
                return
        names = sorted({*manifest["files"], *finished(out)["files"]} - {PAGE})
        equal, *_ = filecmp.cmpfiles(folder, out, names, shallow=False)
    for name in names:
        print(f"{'equal      ' if name in equal else 'DIFFERENT  '}{name}")
    if number := len(names) - len(equal):
        print(f"{number} of {len(names)} files differ: the study is not reproduced.")
        raise SystemExit(1)
    print(f"All {len(names)} files are equal: the study is reproduced.")


def unpack(path: Path, folder: str) -> None:
    """Unpack an archive; AntsError if the file is not one, or is damaged or too large."""
    try:
        with files.opened(path) as file, zipfile.ZipFile(file) as archive:
            if sum(member.file_size for member in archive.infolist()) > MOST_BYTES:
                raise ValueError(f"it unpacks to more than {MOST_BYTES} bytes")
            archive.extractall(folder)  # below the folder, whatever names members have
    except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError) as error:
        raise AntsError(
            f"{files.named(path)} is not an archive that `taichi-ants archive` wrote, or it is "
            f"damaged ({error!r}); name another file."
        ) from error
