"""Archives: folders of results in a zip file, with everything that they were made from."""

from __future__ import annotations

import platform
import re
import stat
import tempfile
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from importlib import metadata
from pathlib import Path
from typing import Any

from taichi_ants import files
from taichi_ants.errors import AntsError
from taichi_ants.studies import folder
from taichi_ants.studies.folder import MANIFEST, PAGE
from taichi_ants.studies.provenance import packages

RESULTS = "results"  # the folder of results in an archive
MOST_BYTES = 1 << 34  # of all unpacked files
_DATE = (1980, 1, 1, 0, 0, 0)  # of all files, because dates would change the bytes
_SOURCE = re.compile(rb"(<dt>(Command|Finished|Commit|Versions|Machine|Time)</dt><dd>).*?</dd>")
_README = """# Archive of a study with Taichi Ants

The results come from this command, which finished {finished}:

    {command}

To compute them again and compare every table and figure, install the versions in `requirements.txt`
and run `taichi-ants reproduce FILE` with the name of this archive.

- `ODD.md` describes the model of this study by the ODD protocol (Grimm et al. 2020).
- `results/` has the results, the runs from which they were computed, and in `inputs/` the files
  that the study has read. `manifest.json` has the settings, the machine and the checksums.
"""


def finished(path: Path) -> dict[str, Any]:
    """Return the manifest of a folder of finished results, none of whose tables has changed.

    Raises:
        AntsError: The results are not finished, or a file is missing or has changed.
    """
    asked, manifest = folder.asked_in(path), folder.json_in(path / MANIFEST)
    if not manifest or not folder.is_finished(path, asked, False, False):
        raise AntsError(
            f"{files.named(path)} has no finished results, or some of them have changed; run the "
            "command of this folder again, which writes what is missing."
        )
    return manifest


def write(path: Path, results: Path, manifest: Mapping[str, Any], odd: str) -> int:
    """Return the number of files of an archive of finished results, after writing it.

    The same folder gives the same bytes. `odd` is the description of the model.
    """
    contents = {
        f"{RESULTS}/{file.relative_to(results).as_posix()}": file.read_bytes()
        for file in results.rglob("[!.]*")
        if file.is_file()
    }
    texts = {"ODD.md": odd, "requirements.txt": lock(manifest)}
    texts["README.md"] = _README.format(**manifest)
    contents |= {name: text.encode() for name, text in texts.items()}

    def save(file: Any) -> None:
        with zipfile.ZipFile(file, "w") as archive:
            for name, content in sorted(contents.items()):
                entry = zipfile.ZipInfo(name, _DATE)
                entry.compress_type, entry.create_system = zipfile.ZIP_DEFLATED, 3
                entry.external_attr = (stat.S_IFREG | 0o644) << 16
                archive.writestr(entry, content)

    files.write_atomically(path, save)
    return len(contents)


@contextmanager
def unpacked(path: Path) -> Iterator[Path]:
    """Yield the folder of results of an archive, unpacked to a temporary folder.

    Raises:
        AntsError: The file is not an archive of a study, or is damaged or too large.
    """
    with tempfile.TemporaryDirectory() as temporary, files.opened(path) as file:
        try:
            with zipfile.ZipFile(file) as archive:
                if sum(member.file_size for member in archive.infolist()) > MOST_BYTES:
                    raise ValueError(f"it unpacks to more than {MOST_BYTES} bytes")
                archive.extractall(temporary)  # below the folder, whatever names members have
        except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, ValueError) as error:
            raise AntsError(
                f"{files.named(path)} is not an archive that `taichi-ants archive` wrote, or it is "
                f"damaged ({error!r}); name another file."
            ) from error
        finished(Path(temporary, RESULTS))
        yield Path(temporary, RESULTS)


def lock(manifest: Mapping[str, Any]) -> str:
    """Return the packages of a run with exact versions, in the format of pip's requirements."""
    versions = dict(manifest["packages"])
    own = f"taichi-ants=={versions.pop('taichi_ants')}"
    if manifest["commit"]:
        changed = "" if manifest["clean"] else ", with changes that are not committed"
        own = f"# {own} ran from its source, commit {manifest['commit']}{changed}"
    lines = [f"# Python {manifest['python']}", own, *(f"{n}=={v}" for n, v in versions.items())]
    return "\n".join([*lines, ""])


def other_versions(manifest: Mapping[str, Any]) -> str:
    """Return which versions of this process differ from those of a run, in words; "" if none do."""
    there = {"Python": manifest["python"], **manifest["packages"]}
    here = {"Python": platform.python_version(), **packages()}
    for name in there.keys() - here.keys():  # those that this process has not imported yet
        with suppress(metadata.PackageNotFoundError):
            here[name] = metadata.version(name)
    differ = (name for name, version in there.items() if here.get(name) != version)
    return ", ".join(f"{n} {here.get(n, 'is missing')} instead of {there[n]}" for n in differ)


def differences(old: Path, new: Path) -> Iterator[tuple[str, str]]:
    """Yield the name of each table and figure of two folders, and in words how they differ.

    The words are "" for equal files. Pages name the command, the time and the machine of a run,
    which may differ.
    """
    first, second = ((folder.json_in(path / MANIFEST) or {})["files"] for path in (old, new))
    for name in sorted({*first, *second}):
        if name not in first or name not in second:
            yield name, f"only in the {'archive' if name in first else 'new results'}"
            continue
        texts = [(path / name).read_bytes() for path in (old, new)]
        if name == PAGE:
            texts = [_SOURCE.sub(rb"\1", text) for text in texts]
        yield name, "" if texts[0] == texts[1] else "other content"
