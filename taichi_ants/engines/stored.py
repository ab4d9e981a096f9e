"""What the files of colonies and of training results have in common."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from taichi_ants import archives, files
from taichi_ants.errors import AntsError, shown
from taichi_ants.task import observations
from taichi_ants.worlds.world import World

_WORLD_PARTS = ("foods", "obstacles", "trails", "ants")


@dataclass(frozen=True)
class FileKind:
    """A kind of .npz file: arrays, and the facts about them as JSON.

    Attributes:
        mark: What its facts hold under "format"; another version has another one.
        what: What it holds, for messages.
        writer: What writes it, for messages.
        most: How many bytes a file may have, unpacked.
        most_text: How many characters its facts may have, as JSON.
        most_lists: How many lists and objects these may hold.
    """

    mark: str
    what: str
    writer: str
    most: int = archives.MOST_BYTES
    most_text: int = archives.MOST_BYTES
    most_lists: int = archives.MOST_BYTES

    def write(
        self,
        path: files.PathLike,
        facts: Mapping[str, Any],
        arrays: Mapping[str, np.ndarray],
        compress: bool,
    ) -> None:
        """Write a file; raises as `archives.write` does."""
        sees = observations.get(facts["task"]["observation"])
        known = {"format": self.mark, "rows": {sees.name: sees.n_states}}
        text = files.to_json({**known, **facts})
        archives.write(path, {**arrays, "facts": np.array(text)}, compress=compress)

    def read(
        self, path: files.PathLike, content: bytes | None = None
    ) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """The arrays and the facts of a file; arguments as of `archives.read`.

        Raises:
            AntsError: The file is missing, damaged, of another kind, or its observation is unknown.
        """
        stored = archives.read(path, content, self.most)
        try:
            text = str(stored["facts"][()])
            self._check_room(path, text)
            facts = json.loads(text)
            if facts["format"] != self.mark:
                raise ValueError(facts["format"])
        except AntsError:
            raise
        except (KeyError, ValueError, TypeError, RecursionError) as error:
            raise AntsError(
                f"{str(path)!r} holds no {self.what} of this version; name a file that "
                f"{self.writer} wrote."
            ) from error
        with self.rebuilding(path):
            ((name, rows),) = facts["rows"].items()
        if name not in observations.names() or observations.get(name).n_states != rows:
            raise AntsError(
                f"{str(path)!r} is of the observation {shown(name)} with {rows} rows, which is not "
                "registered; name the file that registers it with --plugin, or import it."
            )
        return stored, facts

    def _check_room(self, path: files.PathLike, text: str) -> None:
        """Refuse facts that would take much time and memory, before they are parsed."""
        lists = text.count("[") + text.count("{")
        if len(text) > self.most_text or lists > self.most_lists:
            raise AntsError(
                f"{str(path)!r} holds {len(text)} characters of facts with {lists} lists, and at "
                f"most {self.most_text} characters with {self.most_lists} lists are allowed; name "
                "a smaller file."
            )

    @contextmanager
    def rebuilding(self, path: files.PathLike) -> Iterator[None]:
        """Turns what goes wrong while an object is built from a file into one AntsError."""
        try:
            yield
        except Exception as error:  # numbers that mean nothing fail in many ways
            missing = isinstance(error, KeyError)
            text = f"{error} is missing" if missing else " ".join(str(error).rstrip(".").split())
            raise AntsError(
                f"the {self.what} in {str(path)!r} is damaged ({text or type(error).__name__}); "
                f"name a file that {self.writer} wrote."
            ) from error


def world_arrays(world: World, name: str) -> dict[str, np.ndarray]:
    """The arrays of a world, to be written under names that begin with `name`."""
    return {f"{name}_{part}": getattr(world, part) for part in _WORLD_PARTS}


def world_facts(world: World) -> dict[str, Any]:
    """What a world is besides its arrays."""
    return {"ranges": world.ranges, "queen": world.queen}


def world_from(stored: Mapping[str, np.ndarray], name: str, facts: Mapping[str, Any]) -> World:
    """The world of `world_arrays` and `world_facts`; raises AntsError, KeyError or TypeError."""
    parts = {part: stored[f"{name}_{part}"] for part in _WORLD_PARTS}
    return World(tuple(facts["ranges"]), tuple(facts["queen"]), **parts)
