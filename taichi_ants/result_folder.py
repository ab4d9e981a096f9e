"""A folder of results: finished once, never mixed, never lost.

While the work goes on, everything lies in the folder's subfolder `unfinished`, with the settings
that it belongs to. The results move up when all of them exist, the manifest last; a folder with a
manifest is finished.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from taichi_ants import results
from taichi_ants.errors import AntsError

try:
    import fcntl
except ImportError:  # not on Windows: there nobody checks for a second process
    fcntl = None  # type: ignore[assignment]

MANIFEST = "manifest.json"
_UNFINISHED = "unfinished"
_SETTINGS = "settings.json"
_LOCK = "lock"
BLOCKS, READY = "blocks", "ready"


class ResultFolder:
    """The folder of one piece of work.

    Args:
        path: The folder; it need not exist.
        settings: All that determines the results, as JSON knows it.
    """

    def __init__(self, path: str | Path, settings: Mapping[str, Any]) -> None:
        self.path = Path(path)
        self._settings = json.loads(results.to_json(settings))
        self._unfinished = self.path / _UNFINISHED

    def is_finished(self) -> bool:
        """Whether the folder holds finished results of these settings, and nothing unfinished."""
        same = self._settings_in(self.path / MANIFEST) == self._settings
        return same and not self._unfinished.exists()

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
        existed = self.path.exists()
        results.check_writable_folder(self._unfinished)
        with open(self._unfinished / _LOCK, "w") as lock:
            self._lock(lock)
            if replace and self._settings_in(self._unfinished / _SETTINGS) is not None:
                shutil.rmtree(self._unfinished / BLOCKS, ignore_errors=True)
            shutil.rmtree(self._unfinished / READY, ignore_errors=True)
            blocks = results.check_writable_folder(self._unfinished / BLOCKS)
            ready = results.check_writable_folder(self._unfinished / READY)
            results.write_json(self._unfinished / _SETTINGS, {"settings": self._settings})
            try:
                yield blocks, ready
            finally:
                self._leave_nothing_empty(existed)

    def publish(self, manifest: Mapping[str, Any]) -> None:
        """Move what is ready into the folder, then write the manifest with the settings in it."""
        (self.path / MANIFEST).unlink(missing_ok=True)
        for item in sorted((self._unfinished / READY).iterdir()):
            target = self.path / item.name
            if target.is_dir() and not target.is_symlink():
                shutil.rmtree(target)
            item.replace(target)
        results.write_json(self.path / MANIFEST, {**manifest, "settings": self._settings})
        shutil.rmtree(self._unfinished)

    def _check_nothing_else(self) -> None:
        begun = self._settings_in(self._unfinished / _SETTINGS)
        if begun is not None:
            if begun != self._settings:
                raise AntsError(f"{self._holds('unfinished work', begun)}")
            return
        done = self._settings_in(self.path / MANIFEST)
        if done is not None and done != self._settings:
            raise AntsError(f"{self._holds('results', done)}")
        if done is None and self.path.is_dir() and self._has_foreign_files():
            raise AntsError(
                f"{str(self.path)!r} holds files that no finished results go with; "
                "choose another --out, or give --force to write among them."
            )

    def _has_foreign_files(self) -> bool:
        return any(item.name != _UNFINISHED for item in self.path.iterdir())

    def _holds(self, what: str, other: Mapping[str, Any]) -> str:
        different = [key for key in self._settings if self._settings[key] != other.get(key)]
        return (
            f"{str(self.path)!r} holds {what} of other settings ({', '.join(different)} differ); "
            "choose another --out, or give --force to replace them."
        )

    def _settings_in(self, path: Path) -> dict[str, Any] | None:
        """The settings that a file names; None if there is no such file."""
        if not path.exists():
            return None
        with suppress(OSError, ValueError, TypeError, KeyError):
            return dict(json.loads(path.read_text("utf-8"))["settings"])
        return {}  # damaged: of other settings than any

    def _lock(self, lock: Any) -> None:
        if fcntl is None:
            return
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise AntsError(
                f"another process is writing to {str(self.path)!r}; wait for it, or choose "
                "another --out."
            ) from None

    def _leave_nothing_empty(self, existed: bool) -> None:
        """If no block was finished, leave the place as it was found."""
        blocks = self._unfinished / BLOCKS
        if blocks.is_dir() and not any(blocks.iterdir()):
            shutil.rmtree(self._unfinished, ignore_errors=True)
            if not existed:
                with suppress(OSError):
                    self.path.rmdir()
