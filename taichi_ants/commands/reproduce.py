"""Repeat the study in an archive, and compare all of its tables and figures byte for byte.

FILE is an archive that `taichi-ants archive` wrote. The command computes the study again in a new
folder, and prints a line for each file. It exits with status 1 if a file differs. See
docs/archives.md.
"""

from __future__ import annotations

import argparse
import platform
import re
import sys
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
# Pages name the command, the time and the machine of a run, which may differ.
_SOURCE = re.compile(rb"(<dt>(Command|Finished|Commit|Versions|Machine|Time)</dt><dd>).*?</dd>")


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    add = parser.add_argument
    add("file", type=Path, metavar="FILE", help="archive (.zip)")
    about = "write the new results here (default: results/reproduced-NAME)"
    add("--out", type=Path, metavar="FOLDER", help=about)
    about = "run the Python code in the archive: plugins, and the module of the study"
    add("--trust-code", action="store_true", help=about)
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
        if code := sorted(folder.glob(f"{INPUTS}/*/**/*.py")):
            names = ", ".join(f"results/{file.relative_to(folder)}" for file in code)
            if not settings.trust_code:
                raise AntsError(
                    f"the study runs code of the archive, {names}; read it, for example with "
                    "`unzip -p`, and give --trust-code to run it."
                )
            command_line.notice(f"Running code of the archive: {names}.")
        there = {"Python": manifest["python"], **manifest["packages"]}
        here = {"Python": platform.python_version(), **packages(there)}
        if differ := [name for name, version in there.items() if here.get(name) != version]:
            others = (f"{n} {here.get(n, 'is missing')} instead of {there[n]}" for n in differ)
            command_line.notice(
                f"These versions differ from those of the archive: {', '.join(others)}."
            )
        with opened(folder) as planned:
            more = {"no_figures": not manifest["figures"], "parquet": manifest["parquet"]}
            more |= {"out": out, "force": False, "arch": planned.asked["arch"]}
            if not run_study(argparse.Namespace(**vars(settings) | more), planned, report=False):
                return
        every = sorted({*manifest["files"], *finished(out)["files"]})
        different = {name: _difference(name, folder, out) for name in every}
    for name, words in different.items():
        print(f"DIFFERENT  {name} ({words})" if words else f"equal      {name}")
    if number := sum(map(bool, different.values())):
        print(f"{number} of {len(different)} files differ: the study is not reproduced.")
        sys.exit(1)
    print(f"All {len(different)} files are equal: the study is reproduced.")


def unpack(path: Path, folder: str) -> None:
    """Unpack an archive; AntsError if the file is not one, or is damaged or too large."""
    with files.opened(path) as file:
        try:
            with zipfile.ZipFile(file) as archive:
                if sum(member.file_size for member in archive.infolist()) > MOST_BYTES:
                    raise ValueError(f"it unpacks to more than {MOST_BYTES} bytes")
                archive.extractall(folder)  # below the folder, whatever names members have
        except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, ValueError) as error:
            raise AntsError(
                f"{files.named(path)} is not an archive that `taichi-ants archive` wrote, or it is "
                f"damaged ({error!r}); name another file."
            ) from error


def _difference(name: str, old: Path, new: Path) -> str:
    """Return in words how a table or figure of two folders differs; "" if it is equal."""
    if not all((folder / name).is_file() for folder in (old, new)):
        return f"only in the {'archive' if (old / name).is_file() else 'new results'}"
    texts = [(folder / name).read_bytes() for folder in (old, new)]
    if name == PAGE:
        texts = [_SOURCE.sub(rb"\1", text) for text in texts]
    return "" if texts[0] == texts[1] else "other content"
