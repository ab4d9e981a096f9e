"""A folder of results: finished once, never mixed, never lost.

While the work goes on, everything lies in the subfolder `unfinished`: finished blocks, what is
ready, and a manifest with the settings. At the end the results move up, the manifest last of all:
where it lies tells whether the work is finished.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import sys
import tempfile
import time
from argparse import Namespace
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

from taichi_ants import files
from taichi_ants.errors import AntsError
from taichi_ants.studies.provenance import provenance

MANIFEST = "manifest.json"
UNFINISHED, BLOCKS, READY = "unfinished", "blocks", "ready"
REPORT = "report.txt"  # what commands print
PAGE = "report.html"  # what tells the whole result
_SEAL = "sha256"  # of all else in a manifest


Results = TypeVar("Results")
# Makes the page, as HTML, from a folder of results, from what the work gave, if that was done just
# now, and from the manifest.
Pages = Callable[[Path, Results | None, Mapping[str, Any]], str]


def work_or_show(
    settings: Namespace,
    determines: Mapping[str, Any],
    work: Callable[[Path, Path], Results],
    leading: Sequence[str] = (),
    page: Pages[Results] | None = None,
) -> None:
    """Do the work of a command, or show what its folder holds already; print the report.

    A page that is gone from finished results is made again from the rest of them.

    Args:
        settings: The command's `out`, `force`, `no_figures`, `plugin` and `arch`.
        determines: What determines the results besides these.
        work: Called with a folder for blocks and one for the results, among them the report.
        leading: Settings from which others follow, see `ResultFolder`.
        page: Makes the page of the results, if they have one.

    Raises:
        AntsError: The folder holds something else, cannot be written, or was altered.
    """
    plugin = _hash(Path(settings.plugin)) if settings.plugin else None
    facts = {**determines, "arch": settings.arch, "plugin": plugin}
    folder = ResultFolder(settings.out, facts, leading)
    if not settings.force and folder.is_finished():
        folder.check_whole(but=PAGE if page else None)
        folder.tidy()
        gone = page and not (settings.out / PAGE).exists()
        if page and gone:
            folder.add(PAGE, page(settings.out, None, _manifest_in(settings.out)))
        print(files.read_text(settings.out / REPORT))
        print(f"{settings.out}/ holds these results already; --force makes them again.")
        if not (settings.no_figures or _manifest_in(settings.out).get("figures", True)):
            print("They were made with --no-figures; to have figures, too, give --force.")
        if gone:
            print(f"{PAGE} was gone, and is written again from the other files.")
    else:
        began = time.perf_counter()
        with folder.work(settings.force) as (blocks, ready):
            results = work(blocks, ready)
            report = files.read_text(ready / REPORT)
            seconds = folder.seconds_before + time.perf_counter() - began
            drawn = not settings.no_figures
            made = {**provenance(sys.argv), "seconds": seconds, "figures": drawn}
            if page:
                files.write_text(ready / PAGE, page(ready, results, made))
            folder.publish(ready, made)
        print(f"{report}\n{seconds:.1f} s; everything is in {settings.out}/")
    if page:
        print(settings.out / PAGE)


class ResultFolder:
    """The folder of one piece of work.

    Args:
        path: The folder; it need not exist.
        settings: All that determines the results, as `files.to_json` knows it.
        leading: Settings from which others follow: where these differ, only they are named.

    Attributes:
        seconds_before: Of the processes that stopped, each until its last block, known in `work`.
    """

    def __init__(
        self, path: str | Path, settings: Mapping[str, Any], leading: Sequence[str] = ()
    ) -> None:
        self.path = Path(path)
        self.seconds_before = 0.0
        self._leading = leading
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
            different = [key for key in different if key in self._leading] or different
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

    def check_whole(self, but: str | None = None) -> None:
        """Raises AntsError if a file of finished results is gone, all but one, or was altered."""
        for name, digest in self._listed().items():
            path = self.path / name
            if name == but and not path.exists():
                continue
            if not path.is_file() or _hash(path) != digest:
                raise AntsError(
                    f"{str(path)!r}, a part of the results, is gone or was altered since they were "
                    "finished; put it back, or give --force to run all again."
                )

    @contextmanager
    def work(self, replace: bool = False) -> Iterator[tuple[Path, Path]]:
        """A folder for blocks of work, which survive an interruption, and one for results.

        With `replace` the work starts anew, whatever the folder holds; old results stay until the
        new ones are complete. Two processes at the same work cannot spoil it: blocks appear
        whole, each has its own folder for results, and one whose folder is gone ends with an error.

        Raises:
            AntsError: The folder cannot be written.
        """
        self._listed()  # if it is damaged, it is so before the work
        manifest, blocks = self._unfinished / MANIFEST, self._unfinished / BLOCKS
        begun = False
        new = [part for part in (self.path, *self.path.parents) if not part.exists()]
        try:
            # Without a manifest nobody knows whose blocks these are.
            if replace or not manifest.exists():
                self._clear()
            # What a kill leaves in these two is removed with them.
            for folder in (blocks, self._unfinished / READY):
                files.check_writable_folder(folder, self.path)
            self.seconds_before = self._seconds_so_far()
            contents = {"settings": self._settings, "seconds": self.seconds_before}
            _write_manifest(self._unfinished, contents)
            begun = True
            with tempfile.TemporaryDirectory(dir=self._unfinished / READY) as ready:
                yield blocks, Path(ready)
        except (AntsError, OSError) as error:
            if not begun or (self._unfinished / READY).exists():
                raise
            raise AntsError(
                f"another process has done the same work in {str(self.path)!r} and finished it, or "
                "its folder was removed; give the command again to see, or to go on."
            ) from error
        finally:
            if not any(blocks.rglob("*.npz")):
                self._clear()
            for folder in new:
                with suppress(OSError, ValueError):  # it holds something, or was never made
                    folder.rmdir()

    def publish(self, ready: Path, manifest: Mapping[str, Any]) -> None:
        """Move what is ready into the folder, then write the manifest with the settings in it.

        What an older manifest lists is removed; other files stay, but for those of the same name.
        """
        paths = sorted(path.relative_to(ready) for path in ready.rglob("*") if path.is_file())
        hashes = {path.as_posix(): _hash(ready / path) for path in paths}
        for name in self._listed():
            self._remove(name)
        for path in paths:
            (self.path / path).parent.mkdir(parents=True, exist_ok=True)
            (ready / path).replace(self.path / path)
        contents = {**manifest, "files": hashes, "settings": self._settings}
        _write_manifest(ready, contents)
        (ready / MANIFEST).replace(self.path / MANIFEST)
        self._clear()  # now it is finished

    def add(self, name: str, text: str) -> None:
        """Write one more file of finished results, or one again, and list it among them."""
        folder = files.check_writable_folder(self._unfinished / READY)
        with tempfile.TemporaryDirectory(dir=folder) as place:
            files.write_text(Path(place, name), text)
            manifest = _manifest_in(self.path)
            manifest["files"][name] = _hash(Path(place, name))
            _write_manifest(Path(place), manifest)
            for one in (MANIFEST, name):  # who finds the first alone makes the other again
                Path(place, one).replace(self.path / one)
        self.tidy()

    def tidy(self) -> None:
        """Remove what a process has left that was killed when it had finished."""
        if not (self._unfinished / MANIFEST).exists():
            self._clear()

    def _seconds_so_far(self) -> float:
        """The seconds of the processes that have worked in `unfinished`, even if they were killed.

        Each writes the manifest when it begins, with the seconds of those before it; its own are
        from then to its last block.
        """
        manifest = self._unfinished / MANIFEST
        if not manifest.exists():
            return 0.0
        begun = manifest.stat().st_mtime
        blocks = (self._unfinished / BLOCKS).rglob("*.npz")
        last = max((block.stat().st_mtime for block in blocks), default=begun)
        return _manifest_in(self._unfinished)["seconds"] + max(0.0, last - begun)

    def _clear(self) -> None:
        """Remove what is ours in `unfinished`, and the folder if that was all."""
        if not self._unfinished.is_dir():
            return
        (self._unfinished / MANIFEST).unlink(missing_ok=True)
        for half in self._unfinished.glob(files.HALF_WRITTEN):
            half.unlink(missing_ok=True)
        for name in (BLOCKS, READY):
            shutil.rmtree(self._unfinished / name, ignore_errors=True)
        with suppress(OSError):
            self._unfinished.rmdir()

    def _listed(self) -> dict[str, str]:
        """The files of finished results, with their hashes."""
        return _manifest_in(self.path)["files"] if (self.path / MANIFEST).exists() else {}

    def _remove(self, name: str) -> None:
        """Remove a file that an older manifest lists, if it lies in here."""
        file = self.path / name
        if file.is_file() and file.resolve().is_relative_to(self.path.resolve()):
            file.unlink()
            with suppress(OSError):  # it holds something else
                file.parent.rmdir()


def _manifest_in(folder: Path) -> dict[str, Any]:
    """What the manifest in a folder says; AntsError if it is damaged."""
    try:
        manifest = files.read_json(folder / MANIFEST)
        seal = manifest.pop(_SEAL, None)  # older ones have none
        if seal is not None and seal != _seal_of(manifest):
            raise ValueError("it is not as it was written")
        parts = {name: dict(manifest.get(name, {})) for name in ("settings", "files")}
        return {**manifest, **parts, "seconds": float(manifest.get("seconds", 0.0))}
    except (ValueError, TypeError, AttributeError) as error:
        raise AntsError(
            f"{str(folder / MANIFEST)!r} is damaged, so nobody knows what here is ours; choose "
            "another --out."
        ) from error


def _write_manifest(folder: Path, contents: Mapping[str, Any]) -> None:
    """Write a manifest with a seal, which tells whether it was altered."""
    plain = json.loads(files.to_json(contents))
    files.write_json(folder / MANIFEST, {**plain, _SEAL: _seal_of(plain)})


def _seal_of(manifest: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(manifest, sort_keys=True).encode()).hexdigest()


def _hash(path: Path) -> str:
    with files.opened(path) as file:
        return files.hash_of(file)
