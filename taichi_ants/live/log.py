"""The log of a session: how it began, and all interventions. It replays the session."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from taichi_ants import files
from taichi_ants.errors import AntsError, checked_whole, expect
from taichi_ants.files.archives import Kind
from taichi_ants.live.setup import Setup
from taichi_ants.task.constants import N_ACTIONS

MOST_TICKS = 1_000_000_000
MOST_EDITS = 10_000
MOST_CELLS = 400_000  # that edits name, all together
# Sessions within these limits fit into `most`, so reading a file takes little time and memory.
_WRITER = "Session.save, or Save on its page,"
KIND = Kind("session", 3, _WRITER, most=5_000_000, most_lists=100_000)


def cells_of(edit: Any) -> int:
    """The number of cells that an edit names, which may be none."""
    cells = edit.get("cells") if isinstance(edit, dict) else None
    return len(cells) if isinstance(cells, list) else 0


def check_room(n_edits: int, n_cells: int) -> None:
    """Raises AntsError if a session has more edits, or cells in them, than one may have."""
    if n_edits > MOST_EDITS or n_cells > MOST_CELLS:
        raise AntsError(
            f"the session has {n_edits} edits of {n_cells} cells, and at most {MOST_EDITS} edits "
            f"of {MOST_CELLS} cells are allowed; begin another session."
        )


@dataclass(frozen=True, eq=False)
class Log:
    """What a session was up to some moment; see `Session.replay`."""

    setup: Setup
    edits: tuple[tuple[int, Any], ...]  # (steps, edit) of each, in order, see `edits`
    steps: int  # that time has made, see `Session`
    ticks: int | None  # that have passed, if that is known
    state: str | None  # of `Interventions.state` then, if that is known
    name: str = "the session"  # in messages
    changes: tuple[int, ...] = ()  # as in `Session`

    def write(self, path: files.PathLike) -> None:
        """Write the log; raises as `archives.write` does."""
        table = np.zeros((0, N_ACTIONS)) if self.setup.learns else self.setup.policy
        facts = {
            "task": self.setup.task.as_dict(),
            "setup": self.setup.to_json(),
            **{"edits": self.edits, "changes": self.changes},
            **{"steps": self.steps, "ticks": self.ticks, "state": self.state},
        }
        KIND.write(path, facts, {"table": np.asarray(table, np.float32)})

    @classmethod
    def read(cls, path: files.PathLike, content: bytes | None = None) -> Log:
        """The log in a file; arguments and errors are those of `archives.read`."""
        with KIND.reading(path, content) as (arrays, facts):
            expect("state", facts["state"], str)
            steps = checked_whole("steps", facts["steps"], 0, MOST_TICKS)
            edits, before = [], 0
            for at, edit in facts["edits"]:
                before = checked_whole("steps", at, before, steps)
                edits.append((before, edit))
            changes = [
                checked_whole("changes", first, 0, max(len(edits) - 1, 0))
                for first in facts["changes"]
            ]
            if changes[:1] != [0][: len(edits)] or changes != sorted(set(changes)):
                raise ValueError("changes")
            log = cls(
                *(Setup.from_json(facts["setup"], arrays["table"]), tuple(edits), steps),
                checked_whole("ticks", facts["ticks"], 0, steps),
                *(facts["state"], str(path), tuple(changes)),
            )
        check_room(len(edits), sum(cells_of(edit) for _, edit in edits))
        log.setup.check_size()
        return log

    @classmethod
    def from_bytes(cls, content: bytes) -> Log:
        """As `read`, of what a file holds that somebody has sent."""
        return cls.read("the loaded file", content)
