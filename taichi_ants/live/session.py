"""A colony that people watch and change, and its log, which replays it to the bit."""

from __future__ import annotations

import copy
import pickle
import tempfile
import time
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from taichi_ants import files
from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.errors import AntsError, checked_whole, expect
from taichi_ants.files.archives import Kind
from taichi_ants.learners.policies import save_policy
from taichi_ants.live import edits
from taichi_ants.live.setup import Setup
from taichi_ants.task.constants import N_ACTIONS
from taichi_ants.viewer import Recorder

MOST_TICKS = 1_000_000_000
MOST_EDITS = 10_000
MOST_CELLS = 400_000  # that edits name, all together
# Sessions within these limits fit into `most`, so reading a file takes little time and memory.
_WRITER = "Session.save, or Save on its page,"
KIND = Kind("session", 3, _WRITER, most=5_000_000, most_lists=100_000)
_PIECE = 0.02  # seconds, of a session that is replayed
_BETWEEN = 0.1  # seconds of simulation between two snapshots, which undoing has to replay at most
_MOST_KEPT = 1 << 28  # bytes of snapshots
_LARGEST = 1 << 26  # bytes of a colony of which snapshots are taken


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
            last = max(len(edits) - 1, 0)
            changes = [checked_whole("changes", first, 0, last) for first in facts["changes"]]
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


class _Snapshot(NamedTuple):
    """A session as it was before one of its changes."""

    edits: int  # that it had
    spent: float  # seconds of simulation
    content: bytes  # the session without its edits, pickled and compressed


class Session:
    """A colony in a world, from its first tick on, and all interventions.

    It depends on its setup and its edits alone: `load` replays them. AntsError if the world or the
    colony cannot be built.

    Attributes:
        colony: As it is now; nobody else may move it on.
        ticks: How many have passed in all episodes.
        steps: How many steps time has made: ticks, and episodes that began since one had ended.
        edits: (steps, edit) of each edit, in order.
        changes: Where in `edits` each change begins; the strokes of a brush are one change.
    """

    def __init__(self, setup: Setup) -> None:
        expect("setup", setup, Setup)
        self.setup, self.colony = setup, setup.build_colony()
        self.interventions = Interventions(self.colony)
        self.ticks = self.steps = 0
        self.edits: list[tuple[int, edits.Edit]] = []
        self.changes: list[int] = []
        self._cells = 0  # that the edits name
        self._snapshots: list[_Snapshot] = []
        self._spent = 0.0  # seconds of simulation so far
        self.interventions.begin_episode(self._length)
        self.colony.observe()  # changes nothing, but compiles what the first edit needs
        # Interventions change the number of ants.
        title = f"Ants in a world of {self.colony.grid.count} cells"
        self._recorder = Recorder(self.colony, title=title)
        self._recorder.progress.note()
        self._recorder.snapshot()
        self._named = set(self._recorder.names())

    @property
    def _length(self) -> int | None:
        return self.setup.ticks_per_episode or None

    @property
    def ended(self) -> bool:
        """Whether the episode has ended; the next step of time begins another one."""
        return self.colony.ticks == self._length

    def header(self) -> dict[str, Any]:
        """What all frames are about, see `Recorder.header`."""
        return self._recorder.header()

    def news(self) -> dict[int, tuple[str, str, list[str]]]:
        """The names of states that have been seen since this was asked last."""
        if len(self._named) == self.colony.task.n_states:
            return {}
        new = self._recorder.names(self._named)
        self._named |= new.keys()
        return new

    def snapshot(self) -> bytes:
        """A frame of all as it is now, for a page that has read none."""
        return self._recorder.whole()

    def advance(self, n: int = 1) -> bytes:
        """Let n ticks pass, fewer where the episode ends before; a frame of what has changed.

        If the episode has ended, the next one begins instead, and no tick passes.
        """
        return self._pass(checked_whole("n", n), self._recorder.tick) or self._recorder.snapshot()

    def leap(self, n: int) -> bytes:
        """Let time make n steps, also through several episodes; a frame of what has changed.

        What ants did between is in no frame, as it may be in those of `advance`.
        """
        until = self.steps + checked_whole("n", n)
        while self.steps < until:
            self._pass(until - self.steps, self.colony.tick)
        return self._recorder.snapshot()

    def _pass(self, n: int, tick: Callable[[int], Any]) -> Any:
        """As `advance`, by a function that lets ticks pass; what it gives, None without ticks."""
        progress = self._recorder.progress
        if self.ended:
            progress.note(ended=True)
            self.interventions.begin_episode(self._length)
            self.steps += 1
            return None
        n = min(n, self._length - self.colony.ticks if self._length else n)
        if self.ticks + n > MOST_TICKS:
            raise AntsError(f"a session has at most {MOST_TICKS} ticks; begin another one.")
        before, began = self.colony.ticks, time.perf_counter()
        try:
            frame = tick(n)
        finally:  # even if somebody interrupts it
            self.ticks += self.colony.ticks - before
            self.steps += self.colony.ticks - before
            self._spent += time.perf_counter() - began
        progress.note()
        return frame

    def apply(self, edit: object, goes_on: bool = False) -> bytes:
        """Do an edit now, see `edits`, and record it; a frame of what has changed.

        If the episode has ended, what is of this episode alone goes with it. An edit that `goes_on`
        belongs to the same change as the one before, see `undone`. AntsError if it is none, or
        there is no room for it; nothing has changed.
        """
        self._do(edit, goes_on)
        return self._recorder.snapshot()

    def _do(self, edit: object, goes_on: bool = False) -> None:
        plain = edits.checked(edit, self.interventions)
        check_room(len(self.edits) + 1, self._cells + cells_of(plain))
        begins = not (goes_on and self.changes)
        if begins:
            self._take_snapshot()
        began = time.perf_counter()
        if plain["kind"] == "episode":
            self._recorder.progress.note(ended=True)
        edits.apply(plain, self.interventions, self._length)
        if begins:
            self.changes.append(len(self.edits))
        self.edits.append((self.steps, plain))
        self._cells += cells_of(plain)
        self._spent += time.perf_counter() - began

    def _take_snapshot(self) -> None:
        """Keep the session as it is now, unless it can be made quickly from the last snapshot.

        If the snapshots take too much memory, drop the one that is missed least: its neighbours
        are the nearest to each other in time.
        """
        kept = self._snapshots
        is_near = kept and self._spent - kept[-1].spent < _BETWEEN
        if is_near or self.colony.nbytes > _LARGEST:
            return
        bare: Any = copy.copy(self)
        bare.setup, bare.edits, bare.changes, bare._snapshots = None, [], [], []
        content = zlib.compress(pickle.dumps(bare, pickle.HIGHEST_PROTOCOL), 1)
        kept.append(_Snapshot(len(self.edits), self._spent, content))
        while len(kept) > 1 and sum(len(one.content) for one in kept) > _MOST_KEPT:
            spent = [0.0, *(one.spent for one in kept)]
            gaps = [later - before for before, later in zip(spent, spent[2:], strict=False)]
            del kept[gaps.index(min(gaps))]

    def values(self) -> dict[str, dict[str, float]]:
        """What the edit "set" can change, by name: value, least, most and step."""
        return {name: value._asdict() for name, value in edits.values(self.interventions).items()}

    def log(self) -> Log:
        """How it began, the edits, and what its end is like."""
        state = self.interventions.state()
        done, changes = tuple(self.edits), tuple(self.changes)
        return Log(self.setup, done, self.steps, self.ticks, state, changes=changes)

    def save(self, path: files.PathLike) -> None:
        """Write the log; raises as `archives.write` does."""
        self.log().write(path)

    def to_bytes(self) -> bytes:
        """The log, as a file holds it."""
        return bytes_of("session.npz", self.save)

    @classmethod
    def load(cls, path: files.PathLike, progress: Callable[[float], None] | None = None) -> Session:
        """Replay a session that `save` wrote, up to its end.

        `progress` is called now and then with the share of the ticks that have passed. AntsError if
        the file is missing, damaged or altered, or its end is another one here.
        """
        log = Log.read(path)
        for session in cls.replay(log):
            if progress is not None:
                progress(session.steps / max(log.steps, 1))
        return session

    @classmethod
    def replay(cls, log: Log) -> Iterator[Session]:
        """Make the session of a log once more, in pieces, so that others get their turn.

        Yields the session as far as it has come, some times a second at least; at last all of it.
        AntsError if the log is damaged, or its end is another one here.
        """
        with KIND.building(log.name):
            session = cls(log.setup)
            yield from session._follow(log.edits, log.steps, log.changes)
            if log.state not in (None, session.interventions.state()):
                raise ValueError("replayed, it does not end as it did")

    def _follow(
        self, edits: Sequence[tuple[int, Any]], steps: int, changes: Sequence[int]
    ) -> Iterator[Session]:
        """Let time pass until it has made so many steps, with these edits, in short pieces."""
        for at, edit in edits:
            yield from self._pieces(at)
            self._do(edit)
            yield self
        yield from self._pieces(steps)
        self.changes = list(changes)
        self._recorder.snapshot()
        yield self

    def same(self, other: Session) -> bool:
        """Whether another one began alike, was changed alike, and stands where this one does."""
        one, two = ((it.steps, it.edits, it.setup.to_json()) for it in (self, other))
        return one == two and self.interventions.state() == other.interventions.state()

    def undone(self) -> Iterator[Session]:
        """Make the session as it was before its last change, from the last snapshot before it.

        Yields as `replay` does; this session stays as it is. AntsError if nothing has been changed.
        """
        if not self.changes:
            raise AntsError("there is nothing to undo: this session has no interventions.")
        *changes, last = self.changes
        kept = [one for one in self._snapshots if one.edits <= last]
        if kept:
            session = pickle.loads(zlib.decompress(kept[-1].content))
            session.setup, session._snapshots = self.setup, kept
            session.edits = self.edits[: kept[-1].edits]
        else:
            session = Session(self.setup)
        steps, _ = self.edits[last]
        return session._follow(self.edits[len(session.edits) : last], steps, changes)

    @classmethod
    def snapshots(cls, log: Log, most: int = 1000) -> Iterator[tuple[Session, bytes]]:
        """Replay a session from its beginning, snapshot by snapshot.

        There are about `most` snapshots. If there are fewer steps and edits, each step has a
        snapshot, and so does each intervention. Yields the session at that moment, and a frame of
        what has changed since the last one.
        """
        changes = len({steps for steps, _ in log.edits})
        every = max(1, -(-(log.steps + changes) // most))
        session = cls(log.setup)
        yield session, session.snapshot()
        for steps, edits_then in groupby([*log.edits, (log.steps, None)], lambda one: one[0]):
            while session.steps < steps:
                if every == 1:
                    yield session, session.advance()
                    continue
                for _ in session._pieces(min(steps, session.steps + every - session.steps % every)):
                    pass
                if session.steps % every == 0:
                    yield session, session._recorder.snapshot()
            wanted = [edit for _, edit in edits_then if edit is not None]
            for edit in wanted:
                session._do(edit)
            if wanted if every == 1 else steps == log.steps:
                yield session, session._recorder.snapshot()

    def _pieces(self, steps: int) -> Iterator[Session]:
        """Let time pass until it has made so many steps, in pieces of about `_PIECE` seconds."""
        ticks = 1
        while self.steps < steps:
            began = time.perf_counter()
            self._pass(min(ticks, steps - self.steps), self.colony.tick)
            ticks = max(1, 2 * ticks if time.perf_counter() - began < _PIECE else ticks // 2)
            yield self

    def policy_bytes(self) -> bytes:
        """The action values as a policy file holds them; AntsError if each ant has a table."""
        colony = self.colony
        if colony.one_a_slot:
            raise AntsError(
                "each ant has a table of its own, and a policy file holds one; begin a session in "
                "which they share one."
            )
        told = {"seed": self.setup.seed, "task": colony.task.as_dict(), "ticks": self.ticks}
        if self.setup.learns:
            told["training"] = colony.training.as_dict()
        given = (colony.q_values[0], told, colony.task.observation)
        return bytes_of("policy.npz", lambda path: save_policy(path, *given))

    def colony_bytes(self) -> bytes:
        """The colony as it is now, as `Colony.save` writes it; `Colony.load` goes on from it.

        Its later episodes begin as those of the session would, with as many ants as this one.
        """
        self.colony.worlds = (self.interventions.world(),)
        return bytes_of("colony.npz", self.colony.save)


def bytes_of(name: str, write: Callable[[Path], None]) -> bytes:
    """What a function writes into a file of that name."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        write(path)
        return path.read_bytes()
