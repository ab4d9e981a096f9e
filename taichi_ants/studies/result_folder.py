"""A folder of results: finished once, never mixed, never lost.

While the work goes on, everything lies in the folder's subfolder `unfinished`, with the settings
that it belongs to. When all results exist they move up and the manifest is written; the work is
finished once those settings are gone.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import time
from argparse import Namespace
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from taichi_ants import files
from taichi_ants.errors import AntsError
from taichi_ants.studies.interruption import held
from taichi_ants.studies.provenance import provenance

try:
    import fcntl
except ImportError:  # not on Windows: there nobody checks for a second process
    fcntl = None  # type: ignore[assignment]

MANIFEST = "manifest.json"
_UNFINISHED = "unfinished"
_SETTINGS = "settings.json"
_LOCK = "lock"
BLOCKS, READY = "blocks", "ready"
REPORT = "report.txt"  # what commands print
PICTURES = ("figures", "renders")  # can be drawn again from the other results


def work_or_show(
    settings: Namespace,
    determines: Mapping[str, Any],
    work: Callable[[Path, Path], Mapping[str, Any] | None],
    pictures: Mapping[str, Callable[[Path, Path], None]],
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
    plugin = files.file_hash(settings.plugin) if settings.plugin else None
    folder = ResultFolder(settings.out, {**determines, "arch": settings.arch, "plugin": plugin})
    if folder.is_finished() and not settings.force:
        folder.check_whole(apart_from=PICTURES)
        print(files.read_text(folder.path / REPORT))
        for name, draw in pictures.items():
            if folder.lacks(name):
                with folder.addition() as place:
                    draw(folder.path, place)
        print(f"{settings.out}/ holds these results already; --force makes them again.")
        return
    began = time.perf_counter()
    with folder.work(settings.force) as (blocks, ready):
        manifest = work(blocks, ready) or {}
        for draw in pictures.values():
            draw(ready, ready)
        report = files.read_text(ready / REPORT)
        seconds = time.perf_counter() - began
        folder.publish({**provenance(sys.argv), "seconds": seconds, **manifest})
    print(f"{report}\n{seconds:.1f} s; everything is in {settings.out}/")


class ResultFolder:
    """The folder of one piece of work.

    Args:
        path: The folder; it need not exist.
        settings: All that determines the results, as JSON knows it.
    """

    def __init__(self, path: str | Path, settings: Mapping[str, Any]) -> None:
        self.path = Path(path)
        self._settings = json.loads(files.to_json(settings))
        self._unfinished = self.path / _UNFINISHED

    def is_finished(self) -> bool:
        """Whether the folder holds finished results of these settings, and nothing unfinished."""
        same = _settings_in(self.path / MANIFEST) == self._settings
        return same and not os.path.exists(self._unfinished / _SETTINGS)

    def lacks(self, name: str) -> bool:
        """Whether a file or a folder was left out of the results, or some of it is gone."""
        listed = [path for path in self._published() if path.parts[0] == name]
        return not listed or any(self._is_gone(path) for path in listed)

    def check_whole(self, apart_from: Collection[str] = ()) -> None:
        """Make sure that finished results are still what they were, and clean up behind a kill.

        Args:
            apart_from: Files and folders that may be gone.

        Raises:
            AntsError: A file is gone or empty, or was altered.
        """
        published = self._published()
        if not published:
            raise AntsError(
                f"{str(self.path / MANIFEST)!r} is damaged; give --force to run all again."
            )
        for path, facts in published.items():
            gone = self._is_gone(path)
            if gone and path.parts[0] in apart_from:
                continue
            if gone or _facts(self.path / path) != facts:
                what = "is gone or empty" if gone else "was altered since they were finished"
                raise AntsError(
                    f"{str(self.path / path)!r}, a part of the results, {what}; put it back, or "
                    "give --force to run all again."
                )
        if os.path.exists(self._unfinished):  # left by a kill; or another process adds something
            with suppress(AntsError), self._locked():
                pass

    def _is_gone(self, path: Path) -> bool:
        file = self.path / path
        return not file.is_file() or file.stat().st_size == 0

    @contextmanager
    def work(self, replace: bool = False) -> Iterator[tuple[Path, Path]]:
        """Lock the folder and hold the work in progress.

        Args:
            replace: Start anew, even if the folder holds results or work of other settings. Old
                results stay until the new ones are complete.

        Yields:
            The folder for blocks of work, which survive an interruption, and an empty one for
            results that are ready. Both are gone once `publish` was called.

        Raises:
            AntsError: The folder cannot be written, another process works in it, or it holds
                something else.
        """
        if not replace:
            self._check_nothing_else()
        with self._locked():
            yield self._prepare(replace)

    @contextmanager
    def _locked(self) -> Iterator[None]:
        """Make the folders that are missing and keep others away.

        At the end all goes again that is of no use: empty folders, work without blocks, and what a
        killed process has left.
        """
        new = [part for part in (self.path, *self.path.parents) if not os.path.exists(part)]
        lock = None
        try:
            with held():
                files.check_writable_folder(self.path)
                files.check_writable_folder(self._unfinished)
                lock = self._lock()
            yield
        finally:
            with held():
                if lock is not None:
                    self._drop_what_is_of_no_use()
                    lock.close()
                for folder in (self._unfinished, *new):
                    with suppress(OSError, ValueError):  # it is not empty, or was never made
                        folder.rmdir()

    def publish(self, manifest: Mapping[str, Any]) -> None:
        """Move what is ready into the folder, and write the manifest with the settings in it.

        What an older manifest lists is replaced or removed; other files stay.
        """
        hashes = _files_in(self._unfinished / READY)
        contents = {**manifest, "files": hashes, "settings": self._settings}
        with held():
            self._move_up(self._published(), contents)
            (self._unfinished / _SETTINGS).unlink(missing_ok=True)  # now the work is finished
        shutil.rmtree(self._unfinished, ignore_errors=True)

    @contextmanager
    def addition(self) -> Iterator[Path]:
        """Hold a folder for what is added to finished results; it moves up when it is complete.

        Raises:
            AntsError: The folder cannot be written, or another process works in it.
        """
        with self._locked():
            shutil.rmtree(self._unfinished / READY, ignore_errors=True)
            yield files.check_writable_folder(self._unfinished / READY)
            hashes = _files_in(self._unfinished / READY)
            added = {Path(file).parts[0] for file in hashes}
            old = self._published()
            replaced = [file for file in old if file.parts[0] in added]
            kept = {file.as_posix(): old[file] for file in old if file not in replaced}
            manifest = json.loads((self.path / MANIFEST).read_text("utf-8"))
            with held():
                self._move_up(
                    replaced, {**manifest, "files": dict(sorted({**kept, **hashes}.items()))}
                )

    def _move_up(self, old: Iterable[Path], manifest: Mapping[str, Any]) -> None:
        """Put what is ready, and the manifest, in the place of old files.

        The manifest comes before the files: what a kill leaves is noticed as gone, never as ours.
        """
        ready = self._unfinished / READY
        try:
            for file in old:
                self._remove(file)
            files.write_json(self.path / MANIFEST, manifest)
            for name in _files_in(ready):
                target = self._make_way(Path(name))
                (ready / name).replace(target)
        except OSError as error:
            raise _cannot_write(error.filename or self.path, error) from error

    def _remove(self, file: Path) -> None:
        """Remove a file of ours, and folders that are empty then; behind a link nothing is ours."""
        folders = [self.path / folder for folder in file.parents[:-1]]
        if any(folder.is_symlink() for folder in folders):
            return
        with suppress(FileNotFoundError, NotADirectoryError, IsADirectoryError):
            (self.path / file).unlink()
        for folder in folders:
            with suppress(OSError):  # it holds something else
                folder.rmdir()

    def _make_way(self, file: Path) -> Path:
        """The place of a file, in folders of its own; OSError if a folder that is full is there."""
        for folder in reversed([self.path / folder for folder in file.parents[:-1]]):
            if folder.is_symlink() or not folder.is_dir():
                folder.unlink(missing_ok=True)
                folder.mkdir()
        target = self.path / file
        if target.is_dir() and not target.is_symlink():
            target.rmdir()
        return target

    def _prepare(self, replace: bool) -> tuple[Path, Path]:
        """Folders for blocks and for what is ready; blocks of other settings are removed."""
        if replace or _settings_in(self._unfinished / _SETTINGS) != self._settings:
            shutil.rmtree(self._unfinished / BLOCKS, ignore_errors=True)
        shutil.rmtree(self._unfinished / READY, ignore_errors=True)
        blocks = files.check_writable_folder(self._unfinished / BLOCKS)
        ready = files.check_writable_folder(self._unfinished / READY)
        files.write_json(self._unfinished / _SETTINGS, {"settings": self._settings})
        return blocks, ready

    def _published(self) -> dict[Path, Any]:
        """The files that the manifest lists, relative to the folder, with their facts."""
        with suppress(OSError, ValueError, TypeError, KeyError, AttributeError):
            files = json.loads((self.path / MANIFEST).read_text("utf-8"))["files"].items()
            return {Path(file): facts for file, facts in files if _lies_below(Path(file))}
        return {}

    def _check_nothing_else(self) -> None:
        begun = _settings_in(self._unfinished / _SETTINGS)
        if begun is not None:
            if begun != self._settings:
                raise AntsError(self._holds("unfinished work", begun))
            return
        done = _settings_in(self.path / MANIFEST)
        if done is not None and done != self._settings:
            raise AntsError(self._holds("results", done))
        if done is None and self._has_foreign_files():
            raise AntsError(
                f"{str(self.path)!r} holds files that no finished results go with; "
                "choose another --out, or give --force to write among them."
            )

    def _has_foreign_files(self) -> bool:
        if not os.path.isdir(self.path):
            return False
        left = (_UNFINISHED, *(item.name for item in files.left_overs(self.path)))
        return any(item.name not in left for item in self.path.iterdir())

    def _holds(self, what: str, other: Mapping[str, Any]) -> str:
        if not other:
            return (
                f"{str(self.path)!r} holds {what} whose settings are damaged; "
                "choose another --out, or give --force to replace them."
            )
        keys = dict.fromkeys([*self._settings, *other])
        different = [key for key in keys if self._settings.get(key) != other.get(key)]
        return (
            f"{str(self.path)!r} holds {what} of other settings ({', '.join(different)} differ); "
            "choose another --out, or give --force to replace them."
        )

    def _lock(self) -> IO[str]:
        """The file whose lock keeps other processes away."""
        try:
            lock = open(self._unfinished / _LOCK, "w")  # noqa: SIM115 - closed by `_locked`
        except OSError as error:
            raise _cannot_write(self.path, error) from error
        try:
            if fcntl is not None:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            lock.close()
            raise AntsError(
                f"another process is writing to {str(self.path)!r}; wait for it, or choose "
                "another --out."
            ) from None
        return lock

    def _drop_what_is_of_no_use(self) -> None:
        for left in files.left_overs(self.path):
            left.unlink(missing_ok=True)
        blocks = self._unfinished / BLOCKS
        done = blocks.is_dir() and len(list(blocks.iterdir())) > len(files.left_overs(blocks))
        if not done or not os.path.exists(self._unfinished / _SETTINGS):
            shutil.rmtree(self._unfinished, ignore_errors=True)


def _settings_in(path: Path) -> dict[str, Any] | None:
    """The settings that a file names; None if there is no such file."""
    if not os.path.exists(path):
        return None
    with suppress(OSError, ValueError, TypeError, KeyError):
        return dict(json.loads(path.read_text("utf-8"))["settings"])
    return {}  # damaged: of other settings than any


def _files_in(folder: Path) -> dict[str, dict[str, Any]]:
    """All files below a folder, relative to it, with their facts."""
    paths = sorted(path for path in folder.rglob("*") if not path.is_dir())
    return {path.relative_to(folder).as_posix(): _facts(path) for path in paths}


def _facts(path: Path) -> dict[str, Any]:
    return {"bytes": path.stat().st_size, "sha256": files.file_hash(path)}


def _lies_below(path: Path) -> bool:
    return bool(path.parts) and not path.is_absolute() and ".." not in path.parts


def _cannot_write(path: str | Path, error: OSError) -> AntsError:
    reason = (error.strerror or str(error)).lower()
    return AntsError(
        f"cannot write to {str(path)!r}: {reason}; make room for it or choose another."
    )
