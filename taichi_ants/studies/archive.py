"""Archives: folders of results in a zip file, with everything that they were made from."""

from __future__ import annotations

import itertools
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
    contents: dict[str, Path | bytes] = {
        f"{RESULTS}/{file.relative_to(results).as_posix()}": file
        for file in results.rglob("*")
        if file.is_file() and not file.name.startswith(".")
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
        AntsError: The file is not an archive of a study, or is damaged or too large.
    """
    with tempfile.TemporaryDirectory() as temporary, files.opened(path) as file:
        try:
            with zipfile.ZipFile(file) as archive:
                if sum(member.file_size for member in archive.infolist()) > MOST_BYTES:
                    raise ValueError(f"it unpacks to more than {MOST_BYTES} bytes")
                archive.extractall(temporary)  # below the folder, whatever names members have
        except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, ValueError) as error:
            why = " ".join(str(error).split()).rstrip(".") or type(error).__name__
            raise AntsError(
                f"{files.named(path)} is not an archive that `taichi-ants archive` wrote, or it is "
                f"damaged ({why}); name another file."
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
    return "".join(f"{line}\n" for line in lines)


def other_versions(manifest: Mapping[str, Any]) -> str:
    """Return which versions of this process differ from those of a run, in words; "" if none do."""
    there = {"Python": manifest["python"], "the source": manifest["commit"], **manifest["packages"]}
    here = {"Python": platform.python_version(), "the source": source()["commit"], **packages()}
    for name in there.keys() - here.keys():  # those that this process has not imported yet
        with suppress(metadata.PackageNotFoundError):
            here[name] = metadata.version(name)
    differ = [
        f"{name} {here.get(name, 'is missing')} instead of {version}"
        for name, version in there.items()
        if here.get(name) != version and (name != "the source" or (version and here[name]))
    ]
    more = f" and {len(differ) - _SHOWN} more" if len(differ) > _SHOWN else ""
    return f"{', '.join(differ[:_SHOWN])}{more}"


def compare(old: Path, new: Path) -> Iterator[tuple[str, str, str]]:
    """Yield the name of each table and figure of two folders, their difference, and a note.

    The difference is "" if they are equal. Pages name the command, the time and the machine of a
    run, which may differ.
    """
    first, second = ((folder.json_in(path / MANIFEST) or {})["files"] for path in (old, new))
    for name in sorted({*first, *second}):
        if name not in first or name not in second:
            yield name, f"is only in the {'archive' if name in first else 'new results'}", ""
        elif first[name] == second[name]:
            yield name, "", ""
        else:
            texts = [(path / name).read_bytes() for path in (old, new)]
            if name == PAGE and _SOURCE.sub(rb"\1", texts[0]) == _SOURCE.sub(rb"\1", texts[1]):
                yield name, "", "except the time and the machine of the run"
                continue
            lines = zip(*(text.splitlines() for text in texts), strict=False)
            same = list(itertools.takewhile(lambda pair: pair[0] == pair[1], lines))
            yield name, f"first difference in line {len(same) + 1}", ""
