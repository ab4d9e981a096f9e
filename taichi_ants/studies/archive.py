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
from taichi_ants.studies.provenance import packages, source

RESULTS = "results"  # the folder of results in an archive
MOST_BYTES = 1 << 34  # of all unpacked files
_DATE = (1980, 1, 1, 0, 0, 0)  # of all files, because dates would change the bytes
_SOURCE = re.compile(rb"(<dt>(Command|Finished|Commit|Versions|Machine|Time)</dt><dd>).*?</dd>")
_SHOWN = 5  # versions that differ, at most, in a message
_README = """# Archive of a study with Taichi Ants

The results come from this command, which finished {finished}:

    {command}

To compute them again and compare every table and figure, install the versions in `requirements.txt`
and run this command with the name of this archive:

    taichi-ants reproduce FILE

- `ODD.md` describes the model of this study by the ODD protocol (Grimm et al. 2020).
- `requirements.txt` has the versions of all packages that the study used.
- `results/` has the results, the runs from which they were computed, and in `inputs/` the files
  that the study has read. `manifest.json` has the settings, the machine and the checksums.
"""


def finished(place: Path) -> dict[str, Any]:
    """Return the manifest of a folder of finished results, none of whose tables has changed.

    Raises:
        AntsError: The results are not finished, or a file is missing or has changed.
    """
    asked, manifest = folder.asked_in(place), folder.json_in(place / MANIFEST)
    if not manifest or not folder.is_finished(place, asked, False, False):
        raise AntsError(
            f"{files.named(place)} has no finished results, or some of them have changed; run the "
            "command of this folder again, which writes what is missing."
        )
    return manifest


def write(path: Path, place: Path, manifest: Mapping[str, Any], odd: str) -> int:
    """Return the number of files of an archive of finished results, after writing it.

    The same folder gives the same bytes. `odd` is the description of the model.
    """
    contents: dict[str, Path | bytes] = {
        f"{RESULTS}/{one.relative_to(place).as_posix()}": one
        for one in place.rglob("*")
        if one.is_file() and not one.name.startswith(".")
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
                content = content if isinstance(content, bytes) else content.read_bytes()
                archive.writestr(entry, content)

    files.write_atomically(path, save)
    return len(contents)


@contextmanager
def unpacked(path: Path) -> Iterator[Path]:
    """Yield the folder of results of an archive, unpacked to a temporary folder.

    Raises:
        AntsError: The file is not an archive of a study, is damaged or too large, or has paths that
            lead out of a folder.
    """
    with tempfile.TemporaryDirectory() as temporary, files.opened(path) as file:
        try:
            with zipfile.ZipFile(file) as archive:
                members = archive.infolist()
                if sum(one.file_size for one in members) > MOST_BYTES:
                    raise ValueError(f"it unpacks to more than {MOST_BYTES} bytes")
                for one in members:
                    if not _is_plain(one):
                        raise ValueError(f"it contains the odd file {one.orig_filename!r}")
                archive.extractall(temporary)
        except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, ValueError) as error:
            why = " ".join(str(error).split()).rstrip(".") or type(error).__name__
            raise AntsError(
                f"{files.named(path)} is not an archive that `taichi-ants archive` wrote, or it is "
                f"damaged ({why}); name another file."
            ) from error
        finished(Path(temporary, RESULTS))
        yield Path(temporary, RESULTS)


def _is_plain(one: zipfile.ZipInfo) -> bool:
    """Return whether a member is a file below the folder, on all operating systems."""
    name, kind = one.orig_filename, stat.S_IFMT(one.external_attr >> 16)
    is_odd = {"", ".", ".."} & {*name.split("/")} or re.search(r"[\\:\0]", name)
    return not is_odd and kind in (0, stat.S_IFREG)


def lock(manifest: Mapping[str, Any]) -> str:
    """Return the packages of a run with exact versions, in the format of pip's requirements."""
    others = {n: one for n, one in manifest["packages"].items() if n != "taichi_ants"}
    own = f"taichi-ants=={manifest['packages']['taichi_ants']}"
    if manifest["commit"]:
        changed = "" if manifest["clean"] else ", with changes that are not committed"
        own = f"# {own} ran from its source, commit {manifest['commit']}{changed}"
    lines = [f"# Python {manifest['python']}", own, *(f"{n}=={v}" for n, v in others.items())]
    return "".join(f"{line}\n" for line in lines)


def other_versions(manifest: Mapping[str, Any]) -> str:
    """Return which versions of this process differ from those of a run, in words; "" if none do."""
    there: dict[str, Any] = {"Python": manifest["python"], **manifest["packages"]}
    here: dict[str, Any] = {"Python": platform.python_version(), **packages()}
    for name in there.keys() - here.keys():  # those that this process has not imported yet
        with suppress(metadata.PackageNotFoundError):
            here[name] = metadata.version(name)
    own, other = source()["commit"], manifest["commit"]
    if own and other:
        there["the source"], here["the source"] = other[:12], own[:12]
    found = [
        f"{name} {here.get(name, 'is missing')} instead of {one}"
        for name, one in there.items()
        if here.get(name) != one
    ]
    more = f" and {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
    return f"{', '.join(found[:_SHOWN])}{more}"


def compare(one: Path, other: Path) -> Iterator[tuple[str, str, str]]:
    """Yield the name of each table and figure of two folders, their difference, and a note.

    The difference is "" if they are equal. Pages name the command, the time and the machine of a
    run, which may differ.
    """
    first, second = ((folder.json_in(place / MANIFEST) or {})["files"] for place in (one, other))
    for name in sorted({*first, *second}):
        if name not in first or name not in second:
            yield name, f"is only in the {'archive' if name in first else 'new results'}", ""
        elif first[name] == second[name]:
            yield name, "", ""
        else:
            texts = [(place / name).read_bytes() for place in (one, other)]
            if name == PAGE and _SOURCE.sub(rb"\1", texts[0]) == _SOURCE.sub(rb"\1", texts[1]):
                yield name, "", "except the time and the machine of the run"
                continue
            pairs = enumerate(zip(*texts, strict=False))
            same = next((n for n, (a, b) in pairs if a != b), min(map(len, texts)))
            line = texts[0].count(b"\n", 0, same) + 1
            yield name, f"first difference at byte {same}, line {line}", ""
