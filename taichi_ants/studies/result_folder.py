"""A folder of results: finished once, never mixed, never lost.

While the work goes on, everything lies in the subfolder `unfinished`: finished blocks, what is
ready, and a manifest with the settings. At the end the results move up, the manifest last of all:
where it lies tells whether the work is finished.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import sys
import time
from argparse import Namespace
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from taichi_ants import files
from taichi_ants.errors import AntsError
from taichi_ants.studies.provenance import provenance

try:
    import fcntl
except ImportError:  # not on Windows: there nobody checks for a second process
    fcntl = None  # type: ignore[assignment]

MANIFEST = "manifest.json"
UNFINISHED, BLOCKS, READY = "unfinished", "blocks", "ready"
REPORT = "report.txt"  # what commands print
PICTURES = ("figures", "renders")  # can be drawn again from the other results

Draw = Callable[[Path, Path], None]


def work_or_show(
    settings: Namespace,
    determines: Mapping[str, Any],
    work: Callable[[Path, Path], Mapping[str, Any] | None],
    pictures: Mapping[str, Draw],
) -> None:
    """Do the work of a command, or show what its folder holds already; print the report.

    Args:
        settings: The command's `out`, `force`, `plugin` and `arch`.
        determines: What determines the results besides these.
        work: Called with a folder for blocks and one for the results, among them the report.
            Returns what the manifest says besides where the results come from.
        pictures: What is drawn from the results, at once or later: the folder's name, and a
            function of the folder of the results and of the one in which to make it.

    Raises:
        AntsError: The folder holds something else, cannot be written, or was altered.
    """
    plugin = _hash(Path(settings.plugin)) if settings.plugin else None
    folder = ResultFolder(settings.out, {**determines, "arch": settings.arch, "plugin": plugin})
    if not settings.force and folder.is_finished():
        folder.show(pictures)
        print(f"{settings.out}/ holds these results already; --force makes them again.")
        return
    began = time.perf_counter()
    with folder.work(settings.force) as (blocks, ready):
        manifest = work(blocks, ready) or {}
        for draw in pictures.values():
            draw(ready, ready)
        report = (ready / REPORT).read_text("utf-8")
        seconds = time.perf_counter() - began
        folder.publish({**provenance(sys.argv), "seconds": seconds, **manifest})
    print(f"{report}\n{seconds:.1f} s; everything is in {settings.out}/")


class ResultFolder:
    """The folder of one piece of work.

    Args:
        path: The folder; it need not exist.
        settings: All that determines the results, as `files.to_json` knows it.
    """

    def __init__(self, path: str | Path, settings: Mapping[str, Any]) -> None:
        self.path = Path(path)
        self._settings = json.loads(files.to_json(settings))
        self._unfinished = self.path / UNFINISHED

    def is_finished(self) -> bool:
        """Whether the folder holds finished results of these settings.

        Raises:
            AntsError: It holds something else than these, or the work on them.
        """
        for place, what in ((self._unfinished, "unfinished work"), (self.path, "results")):
            if not (place / MANIFEST).exists():
                continue
            other = _manifest_in(place)["settings"]
            keys = dict.fromkeys([*self._settings, *other])
            different = [key for key in keys if self._settings.get(key) != other.get(key)]
            if different:
                raise AntsError(
                    f"{str(self.path)!r} holds {what} of other settings ({', '.join(different)} "
                    "differ); choose another --out, or give --force to replace them."
                )
            return place == self.path
        if self.path.is_dir() and any(item.name != UNFINISHED for item in self.path.iterdir()):
            raise AntsError(
                f"{str(self.path)!r} holds files, but no finished results; "
                "choose another --out, or give --force to write among them."
            )
        return False

    def show(self, pictures: Mapping[str, Draw]) -> None:
        """Print the report of finished results, and draw the pictures that are not there.

        Raises:
            AntsError: A file of the results, apart from pictures, is gone or was altered.
        """
        manifest = _manifest_in(self.path)
        for name, digest in manifest["files"].items():
            path = self.path / name
            whole = path.is_file() and _hash(path) == digest
            if not whole and name.partition("/")[0] not in PICTURES:
                raise AntsError(
                    f"{str(path)!r}, a part of the results, is gone or was altered since they were "
                    "finished; put it back, or give --force to run all again."
                )
        print((self.path / REPORT).read_text("utf-8"))
        for name, draw in pictures.items():
            drawn = [file for file in manifest["files"] if file.startswith(f"{name}/")]
            if drawn and all((self.path / file).is_file() for file in drawn):
                continue
            with self._working() as (_, ready):
                draw(self.path, ready)
                hashes = self._ready_beside(manifest["files"])
                for file in drawn:
                    del manifest["files"][file]
                manifest["files"] = dict(sorted({**manifest["files"], **hashes}.items()))
                self._move_up(hashes)
                files.write_json(self.path / MANIFEST, manifest)

    @contextmanager
    def work(self, replace: bool = False) -> Iterator[tuple[Path, Path]]:
        """Hold a folder for blocks of work, which survive an interruption, and one for results.

        With `replace` the work starts anew, whatever the folder holds; old results stay until the
        new ones are complete.

        Raises:
            AntsError: The folder cannot be written, or another process works in it.
        """
        self._listed()  # if it is damaged, it is so before the work
        with self._working(replace) as places:
            if not (self._unfinished / MANIFEST).exists():
                files.write_json(self._unfinished / MANIFEST, {"settings": self._settings})
            yield places

    def publish(self, manifest: Mapping[str, Any]) -> None:
        """Move what is ready into the folder, then the manifest with the settings in it.

        What an older manifest lists is replaced or removed; other files stay.

        Raises:
            AntsError: A file that is not ours is in the way.
        """
        half_moved = _manifest_in(self._unfinished)["files"]  # where a kill has left some
        old = {**half_moved, **self._listed()}
        hashes = self._ready_beside(old)
        for name, digest in old.items():
            self._remove(name, digest)
        contents = {**manifest, "files": hashes, "settings": self._settings}
        files.write_json(self._unfinished / MANIFEST, contents)
        self._move_up(hashes)
        os.replace(self._unfinished / MANIFEST, self.path / MANIFEST)  # now it is finished
        self._clear()

    @contextmanager
    def _working(self, replace: bool = False) -> Iterator[tuple[Path, Path]]:
        """Make the folders for blocks and for what is ready, and keep other processes away.

        At the end all goes again that is of no use, that is if there is no block.
        """
        new = [part for part in (self.path, *self.path.parents) if not part.exists()]
        blocks, ready = self._unfinished / BLOCKS, self._unfinished / READY
        try:
            files.check_writable_folder(self.path)
            self._unfinished.mkdir(exist_ok=True)
            with _locked(self._unfinished):
                # Without a manifest nobody knows whose blocks these are.
                if replace or not (self._unfinished / MANIFEST).exists():
                    self._clear()
                shutil.rmtree(ready, ignore_errors=True)
                try:
                    yield files.check_writable_folder(blocks), files.check_writable_folder(ready)
                finally:
                    if not any(blocks.rglob("*.npz")):
                        self._clear()
        finally:
            for folder in (self._unfinished, *new):
                with suppress(OSError, ValueError):  # it is not empty, or was never made
                    folder.rmdir()

    def _clear(self) -> None:
        """Remove what is ours in `unfinished`."""
        (self._unfinished / MANIFEST).unlink(missing_ok=True)
        for name in (BLOCKS, READY):
            shutil.rmtree(self._unfinished / name, ignore_errors=True)

    def _listed(self) -> dict[str, str]:
        """The files of finished results, with their hashes."""
        return _manifest_in(self.path)["files"] if (self.path / MANIFEST).exists() else {}

    def _ready_beside(self, old: Collection[str]) -> dict[str, str]:
        """The hashes of all files that are ready; AntsError if another than an old one is there."""
        ready = self._unfinished / READY
        paths = (path.relative_to(ready) for path in ready.rglob("*") if path.is_file())
        names = sorted(path.as_posix() for path in paths)
        for name in names:
            if (self.path / name).exists() and name not in old:
                raise AntsError(
                    f"{str(self.path / name)!r} is in the way of results and none of ours; move it "
                    "away, and the same command without --force goes on."
                )
        return {name: _hash(ready / name) for name in names}

    def _move_up(self, names: Iterable[str]) -> None:
        for name in names:
            (self.path / name).parent.mkdir(parents=True, exist_ok=True)
            (self._unfinished / READY / name).replace(self.path / name)

    def _remove(self, name: str, digest: str) -> None:
        """Remove a file that an older manifest lists, if it is still that one and lies in here."""
        file, own = self.path / name, self.path.resolve()
        if file.is_file() and file.resolve().is_relative_to(own) and _hash(file) == digest:
            file.unlink()
            with suppress(OSError):  # it holds something else
                file.parent.rmdir()


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Keep other processes out of a folder."""
    if fcntl is None:
        yield
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise AntsError(
                f"another process is writing to {str(folder)!r}; wait for it, or choose another "
                "--out."
            ) from None
        yield
    finally:
        os.close(handle)


def _manifest_in(folder: Path) -> dict[str, Any]:
    """What the manifest in a folder says; AntsError if it is damaged."""
    try:
        manifest = json.loads((folder / MANIFEST).read_text("utf-8"))
        parts = {name: dict(manifest.get(name, {})) for name in ("settings", "files")}
        return {**manifest, **parts}
    except (OSError, ValueError, TypeError, AttributeError) as error:
        raise AntsError(
            f"{str(folder / MANIFEST)!r} is damaged, so nobody knows what here is ours; choose "
            "another --out."
        ) from error


def _hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
