"""Folders of results, which never mix results of different settings.

Work in progress is in the subfolder `unfinished`: blocks, ready results, and a manifest with the
settings, in two copies. At the end the results move up. The manifest moves last, which marks the
work as finished.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import tempfile
from collections.abc import Container, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from taichi_ants import files
from taichi_ants.errors import AntsError, count, shown

MANIFEST = "manifest.json"
SPARE = "manifest-copy.json"  # in UNFINISHED, because blocks are of no use without a manifest
REPORT = "report.txt"  # the text that commands print
PAGE = "report.html"  # the whole result as a page
INPUTS = "inputs"  # in finished results: copies of the files that the study has read
UNFINISHED, BLOCKS = "unfinished", "blocks"  # the folder of work in progress, and that of blocks
ROWS, FAILED = "rows", "failed.json"  # in UNFINISHED: tables of finished blocks, failed blocks
# Settings that results of the same runs can differ in, with checksums of plugins.
_OF_ALL_RUNS = ("version", "kind", "measures", "measure_every", "arch", "plugin")
_SHOWN = 3  # values of a setting, at most, in a message


class ResultFolder:
    """The folder of one piece of work.

    Args:
        path: The folder; it need not exist.
        settings: Everything that determines the results, in types that `files.to_json` accepts.
        leading: Settings that determine others; if they differ, messages name only these.
        runs: The result of `Study.runs`, if the work is a study.
        grows: Whether finished results of a part of these runs can become a part of the results.
    """

    def __init__(
        self,
        path: str | Path,
        settings: Mapping[str, Any],
        leading: Sequence[str] = (),
        runs: Mapping[str, Any] | None = None,
        grows: bool = False,
    ) -> None:
        self.path = Path(path)
        self._runs, self._grows = {"runs": runs} if runs else {}, grows
        self.seconds_before = 0.0
        self._leading = leading
        self._settings = json.loads(files.to_json(settings))
        self._unfinished = self.path / UNFINISHED
        self._blocks, self._ready = self._unfinished / BLOCKS, self._unfinished / "ready"

    def is_finished(self) -> bool:
        """Return whether the folder contains finished results of these settings.

        Raises AntsError if it contains anything other than these results, a part of them, or work
        on them.
        """
        for place, what in ((self._unfinished, "unfinished work"), (self.path, "results")):
            manifest = manifest_in(place)
            if not manifest:
                continue
            other = manifest["settings"]
            if other == self._settings:
                return place == self.path
            if place == self.path and self.part():
                return False
            if place == self._unfinished and self._is_part(manifest):
                continue
            if place == self._unfinished and self._has_results():
                return True
            lost = self._lost(manifest)
            which = f"of other settings ({self._differences(other)});"
            if lost:
                which = f"that this study lacks ({', '.join(lost)}); add them,"
            others = "give --force to replace them"
            if place == self._unfinished:
                others = f"remove {files.named(self._unfinished)} to give it up"
            raise AntsError(
                f"{files.named(self.path)} contains {what} {which} choose another --out, or "
                f"{others}."
            )
        if self.path.is_dir() and any(item != self._unfinished for item in self.path.iterdir()):
            raise AntsError(
                f"{str(self.path)!r} contains files, but no finished results; "
                "choose another --out, or give --force to add results to them."
            )
        return False

    def _has_results(self) -> bool:
        """Return whether the folder has finished results of these settings."""
        return (manifest_in(self.path) or {"settings": None})["settings"] == self._settings

    def has_other_work(self) -> bool:
        """Return whether the folder has unfinished work of other settings."""
        manifest = manifest_in(self._unfinished)
        return manifest is not None and manifest["settings"] != self._settings

    def part(self) -> dict[str, Any] | None:
        """Return the manifest of finished results that are all or a part of these, or None."""
        manifest = manifest_in(self.path) if self._grows else None
        return manifest if manifest and self._is_part(manifest) else None

    def _is_part(self, manifest: Mapping[str, Any]) -> bool:
        """Return whether all that a manifest has is also a part of this work."""
        settings, own, theirs = manifest["settings"], self._runs.get("runs"), manifest.get("runs")
        if any(settings.get(name) != self._settings.get(name) for name in _OF_ALL_RUNS):
            return False
        if not (own and theirs):
            return False
        wanted, nothing = seeds_by_point(own), frozenset[str]()
        found = seeds_by_point(theirs).items()
        return all(seeds <= wanted.get(point, nothing) for point, seeds in found)

    def _lost(self, manifest: Mapping[str, Any]) -> list[str]:
        """Return in words what a manifest has that this study lacks, if it has runs of both."""
        runs, others = self._runs.get("runs"), manifest.get("runs")
        if not (runs and others and {*runs["points"]} & {*others["points"]}):
            return []
        theirs, found = manifest["settings"], list[str]()
        if self._settings.get("design") != theirs.get("design"):
            return []
        here, there = (_varied(one, self._leading) for one in (self._settings, theirs))
        for name, values in there.items():
            lost = [shown(one) for text, one in values.items() if text not in here.get(name, {})]
            if lost and name == "vary":
                if not here[name].keys() <= values.keys():  # the ranges are others
                    return []
                found.append(count(len(lost), "sample"))
            elif lost:
                more = " ..." if len(lost) > _SHOWN else ""
                found.append(f"{name} {', '.join(lost[:_SHOWN])}{more}")
        return found

    def _differences(self, other: Mapping[str, Any]) -> str:
        """Return in words how settings differ from those of this work."""
        own, rest, parts = self._settings, list[str](), list[str]()
        if own.get("design") != other.get("design"):
            own, other = ({"design": "grid"} | (one.get("design") or {}) for one in (own, other))
        names = [name for name in dict.fromkeys([*own, *other]) if own.get(name) != other.get(name)]
        for name in [one for one in names if one in self._leading] or names:
            one, others = own.get(name), other.get(name)
            is_short = not {type(one), type(others)} & {list, dict} and name != "plugin"
            if not (is_short and name in own and name in other):
                rest.append(name)
            else:
                parts.append(f"{name} is {shown(others)} instead of {shown(one)}")
        return ", ".join([*parts, *([f"not the same {', '.join(rest)}"] if rest else [])])

    def check(self, may_lack: Container[str] = ()) -> None:
        """Check that no file of finished results is altered or missing, except `may_lack`."""
        for name, checksum in self._listed().items():
            path = self.path / name
            if name in may_lack and not path.exists():
                continue
            if not path.is_file() or checksum_of(path) != checksum:
                raise AntsError(
                    f"{str(path)!r}, a part of the results, is missing or has changed since they "
                    "were finished; restore it, or run their command again with --force."
                )

    @contextmanager
    def work(
        self, replace: bool = False, more: Mapping[str, Any] | None = None
    ) -> Iterator[tuple[Path, Path]]:
        """Yield a folder for blocks of work, which survive an interruption, and one for results.

        With `replace`, the work starts over; old results stay until the new ones are complete. Two
        processes can do the same work at once, because blocks are written atomically and each
        process has its own folder for results. `more` is added to the manifest of the unfinished
        work. Raises AntsError if the folder cannot be written or another process has finished the
        work.
        """
        if not replace:
            self._listed()  # if the manifest is damaged, this raises before the work
        new = [part for part in (self.path, *self.path.parents) if not part.exists()]
        try:
            if replace:
                self._clear()
            elif not manifest_in(self._unfinished) and self._has_blocks():
                shutil.rmtree(self._blocks)  # the settings of the blocks are unknown
            for folder in (self._blocks, self._ready):
                files.check_writable_folder(folder, self.path)
            self.seconds_before = seconds_of(self._unfinished)
            if not (replace or self.seconds_before):
                self.seconds_before = (self.part() or {}).get("seconds", 0.0)
            with tempfile.TemporaryDirectory(dir=self._ready) as name:
                ready = Path(name)
                contents = {"settings": self._settings, "seconds": self.seconds_before}
                contents |= {**self._runs, **(more or {})}
                for copy in (SPARE, MANIFEST):  # one after the other, so that one is always whole
                    _write_manifest(contents, ready).replace(self._unfinished / copy)
                try:
                    yield self._blocks, ready
                except (AntsError, OSError) as error:
                    if self._ready.exists():
                        raise
                    raise AntsError(
                        f"another process has finished the same work in {str(self.path)!r}, or its "
                        "folder was removed; run the command again to see the results, or to "
                        "resume."
                    ) from error
        finally:
            # Another process can have begun the same work.
            if not self._has_blocks() and not (self._ready.is_dir() and any(self._ready.iterdir())):
                self._clear()
            for folder in new:
                with suppress(OSError, ValueError):  # it is not empty, or was never created
                    folder.rmdir()

    def publish(self, ready: Path, manifest: Mapping[str, Any]) -> None:
        """Move ready results into the folder, then a manifest with the settings.

        Removes the files that an older manifest lists, and replaces others of the same name.
        """
        paths = sorted(path.relative_to(ready) for path in ready.rglob("*") if path.is_file())
        checksums = {path.as_posix(): checksum_of(ready / path) for path in paths}
        listed = dict[str, str]()
        with suppress(AntsError):  # a damaged manifest is replaced
            listed = self._listed()
        for name in listed:
            file = self.path / name
            if file.is_file() and file.resolve().is_relative_to(self.path.resolve()):
                file.unlink()
                with suppress(OSError):  # the folder contains other files
                    file.parent.rmdir()
        for path in paths:
            (self.path / path).parent.mkdir(parents=True, exist_ok=True)
            (ready / path).replace(self.path / path)
        contents = {**manifest, "files": checksums, "settings": self._settings, **self._runs}
        _write_manifest(contents, ready).replace(self.path / MANIFEST)
        self._clear()

    def add(self, name: str, text: str) -> None:
        """Add a file to finished results, or replace it."""
        with files.writing(self.path):
            self._ready.mkdir(parents=True, exist_ok=True)
        with files.writing(self.path), tempfile.TemporaryDirectory(dir=self._ready) as place:
            file = Path(place, name)
            files.write_text(file, text)
            manifest = read_manifest(self.path)
            manifest["files"][name] = checksum_of(file)
            # The manifest first, so that the file can be missing but never differ from it.
            _write_manifest(manifest, Path(place)).replace(self.path / MANIFEST)
            file.replace(self.path / name)
        self.tidy()

    def tidy(self) -> None:
        """Remove the files that a process left if it was killed after it had finished the work."""
        if not manifest_in(self._unfinished):
            self._clear()

    def _has_blocks(self) -> bool:
        return self._blocks.is_dir() and any(self._blocks.rglob("*.npz"))

    def _clear(self) -> None:
        """Remove the files of this class in `unfinished`, and the folder if it is then empty."""
        if not self._unfinished.is_dir():
            return
        for name in (SPARE, MANIFEST):
            (self._unfinished / name).unlink(missing_ok=True)
        for folder in (self._blocks, self._ready, self._unfinished / ROWS):
            shutil.rmtree(folder, ignore_errors=True)
        (self._unfinished / FAILED).unlink(missing_ok=True)
        with suppress(OSError):
            self._unfinished.rmdir()

    def _listed(self) -> dict[str, str]:
        return (manifest_in(self.path) or {"files": {}})["files"]


def _varied(settings: Mapping[str, Any], leading: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Return the seeds of a study and the values of each setting that varies, by their texts.

    A design other than a grid has its samples, as "vary", instead of the values of each setting.
    """
    several = {"seed": settings["seeds"]}
    if settings.get("design"):
        several["vary"] = settings["vary"]
    elif rows := settings.get("vary"):
        every = dict.fromkeys(name for row in rows for name in row)
        several |= {name: [row.get(name) for row in rows] for name in every}
    else:
        names = [one for one in leading if one in settings] or [n for n in settings if "." in n]
        several |= {n: settings[n] for n in names if isinstance(settings[n], list)}
    return {n: {files.to_json(one): one for one in values} for n, values in several.items()}


def seconds_of(unfinished: Path) -> float:
    """Return the time that all processes have worked on unfinished work.

    A process starts by writing a manifest with the time before, and ends with its last block.
    """
    manifest = manifest_in(unfinished)
    if not manifest:
        return 0.0
    started = start_of(unfinished)
    times = [block.stat().st_mtime for block in (unfinished / BLOCKS).rglob("*.npz")]
    return manifest["seconds"] + max([started, *times]) - started


def start_of(unfinished: Path) -> float:
    """Return when the last process began with unfinished work, in seconds since the epoch."""
    with suppress(FileNotFoundError):
        return (unfinished / MANIFEST).stat().st_mtime
    return (unfinished / SPARE).stat().st_mtime


def seeds_by_point(runs: Mapping[str, Any]) -> dict[str, frozenset[str]]:
    """Return the names of the seeds of each point, from the result of `Study.runs`."""
    seeds = [frozenset(names) for names in runs["seeds"]]
    return {point: seeds[n] for point, n in zip(runs["points"], runs["seeds_of"], strict=True)}


def manifest_in(folder: Path) -> dict[str, Any] | None:
    """Return the contents of the manifest in a folder, or of its copy; None without any.

    Raises:
        AntsError: All that there is of the two is damaged.
    """
    there = [folder / name for name in (MANIFEST, SPARE) if (folder / name).exists()]
    for path in there:
        with suppress(AntsError):
            return _contents_of(path)
    return _contents_of(there[0]) if there else None


def read_manifest(folder: Path) -> dict[str, Any]:
    """Return the contents of the manifest in a folder; AntsError if it is missing or damaged."""
    return manifest_in(folder) or _contents_of(folder / MANIFEST)


def _contents_of(path: Path) -> dict[str, Any]:
    try:
        manifest = json.loads(files.read_text(path))
        if manifest.pop("checksum") != files.checksum_of_json(manifest):
            raise ValueError("the checksum differs")
        return manifest
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise AntsError(
            f"{files.named(path)} is damaged or of another version of the package; restore it, or "
            "run the command of this folder again with --force."
        ) from error


def _write_manifest(contents: Mapping[str, Any], folder: Path) -> Path:
    """Write a manifest with its own checksum into a folder; return its path."""
    text = files.to_json({**contents, "checksum": files.checksum_of_json(contents)}, indent=2)
    files.write_text(folder / MANIFEST, text + "\n")
    return folder / MANIFEST


def checksum_of(path: Path) -> str:
    """Return the hexadecimal SHA-256 of a file."""
    digest = hashlib.sha256()
    with files.opened(path) as file:
        while chunk := file.read(1 << 20):
            digest.update(chunk)
    return digest.hexdigest()
