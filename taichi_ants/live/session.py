"""Sessions: a colony with interventions, and a log that replays it bit for bit."""

from __future__ import annotations

import copy
import math
import pickle
import tempfile
import time
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants import files, interventions
from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.errors import AntsError, checked_whole, expect
from taichi_ants.files.archives import Kind
from taichi_ants.learners.policies import save_policy
from taichi_ants.live.setup import Setup, check_most
from taichi_ants.task.constants import N_ACTIONS
from taichi_ants.viewer import Recorder

# Sessions within these limits fit into `most`, so reading a file takes little time and memory.
_WRITER = "Session.save, or Save session on its page,"
KIND = Kind("session", 4, _WRITER, most=5_000_000)
_REPLAY_SLICE = 0.02  # seconds of a piece of a replay
_SNAPSHOT_INTERVAL = 0.1  # seconds between snapshots, the longest replay of an undo
_MOST_KEPT = 1 << 28  # bytes of all snapshots
_LARGEST = 1 << 26  # bytes of a colony above which there are no snapshots


def cells_of(edit: Any) -> int:
    """Return the number of cells that an edit names, 0 if it names none."""
    settings = list(edit.values()) if isinstance(edit, dict) else []
    lists = [setting.get("cells") for setting in settings if isinstance(setting, dict)]
    return sum(len(cells) for cells in lists if isinstance(cells, list))


@dataclass(frozen=True, eq=False)
class Log:
    """The setup and all edits of a session up to some step, from which it can be replayed."""

    setup: Setup
    edits: tuple[tuple[int, Any], ...]  # (steps, edit), in order, see `taichi_ants.interventions`
    steps: int  # see `Session`
    ticks: int | None  # see `Session`; None if unknown
    state: str | None  # `Interventions.state` at the end; None if unknown
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
        """Return the log in a file; arguments and errors are those of `archives.read`."""
        with KIND.reading(path, content) as (arrays, facts):
            expect("state", facts["state"], str)
            steps = checked_whole("steps", facts["steps"], 0)
            check_most("ticks", steps)
            check_most("edits", len(facts["edits"]))
            check_most("cells in all edits", sum(cells_of(edit) for _, edit in facts["edits"]))
            edits, before = [], 0
            for at, edit in facts["edits"]:
                before = checked_whole("steps", at, before, steps)
                edits.append((before, edit))
            last = max(len(edits) - 1, 0)
            changes = [checked_whole("changes", first, 0, last) for first in facts["changes"]]
            if changes[:1] != [0][: len(edits)] or changes != sorted(set(changes)):
                raise ValueError("changes")
            return cls(
                *(Setup.from_json(facts["setup"], arrays["table"]), tuple(edits), steps),
                checked_whole("ticks", facts["ticks"], 0, steps),
                *(facts["state"], str(path), tuple(changes)),
            )


class Session:
    """A colony with all interventions since its first tick.

    A session depends only on its setup and its edits, so `load` can replay it. Raises AntsError if
    the world or the colony cannot be built.

    Attributes:
        colony: The colony; only the session may advance it.
        edits: (steps, edit) of each edit, in order.
        changes: The index in `edits` of the first edit of each change; a stroke is one change.
        recorder: Describes the session for pages, and makes their frames.
    """

    def __init__(self, setup: Setup) -> None:
        expect("setup", setup, Setup)
        self.setup, self.colony = setup, setup.build_colony()
        self.interventions = Interventions(self.colony)
        self.edits: list[tuple[int, dict[str, Any]]] = []
        self.changes: list[int] = []
        self._cells = 0  # in all edits
        self._begun = 0  # episodes that began after one had ended
        # The number of edits before, and the session without its edits, pickled and compressed.
        self._snapshots: list[tuple[int, bytes]] = []
        self._snapshot_time = -math.inf  # of the last snapshot, in seconds
        self.interventions.length = setup.ticks_per_episode or None
        self.interventions.begin_episode()
        self.colony._observe([])  # has no effect, but compiles kernels for the first edit
        # The title must not contain the number of ants, because interventions change it.
        title = f"Ants in a world of {self.colony.grid.count} cells"
        self.recorder = Recorder(self.colony, title=title)
        self.recorder.note()
        self.recorder.snapshot()

    @property
    def ticks(self) -> int:
        """The number of ticks in all episodes."""
        return self.recorder.ticks

    @property
    def steps(self) -> int:
        """The number of ticks, plus the number of episodes that began after one had ended."""
        return self.ticks + self._begun

    @property
    def ended(self) -> bool:
        """Whether the episode has ended; the next step begins another one."""
        return self.colony.ticks == self.interventions.length

    def advance(self, n: int = 1) -> bytes:
        """Return a frame of changes after n more steps, which may span episodes.

        If an episode has ended, a step begins the next one, without a tick. The frame has the
        actions of ants only if n is 1.
        """
        until = self.steps + checked_whole("n", n)
        if n == 1 and not self.ended:
            return self._run(1, self.recorder.tick)
        while self.steps < until:
            self._run(until - self.steps, self.colony.tick)
        return self.recorder.snapshot()

    def _run(self, n: int, tick: Callable[[int], Any]) -> Any:
        """Advance with the function `tick`; return its result, None if no tick passes."""
        if self.ended:
            self.recorder.note(ended=True)
            self._begun += 1  # first, because Ctrl-C during a launch raises an error after it
            self.interventions.begin_episode()
            return None
        length = self.interventions.length
        n = min(n, length - self.colony.ticks) if length else n
        check_most("ticks", self.ticks + n)
        frame = tick(n)
        self.recorder.note()
        return frame

    def apply(self, edit: object, goes_on: bool = False) -> bytes:
        """Return a frame of changes after applying and recording an edit.

        An edit maps the name of an intervention to its settings or its short form. If it affects
        only an ended episode, it is lost when the next one begins. An edit that `goes_on` belongs
        to the same change as the previous edit, see `undone`. Raises AntsError if the edit is not
        valid or not possible; nothing has changed.
        """
        self._do(edit, goes_on)
        return self.recorder.snapshot()

    def _do(self, edit: object, goes_on: bool = False) -> None:
        intervention = interventions.from_dict(edit)
        plain = intervention.facts()
        check_most("edits", len(self.edits) + 1)
        check_most("cells in all edits", self._cells + cells_of(plain))
        begins = not (goes_on and self.changes)
        if begins:
            self._take_snapshot()
        if "episode" in plain:
            self.recorder.note(ended=True)
        # Recorded first, because Ctrl-C during a launch raises an error after it.
        if begins:
            self.changes.append(len(self.edits))
        self.edits.append((self.steps, plain))
        try:
            self.interventions.apply(intervention)
        except AntsError:
            self.edits.pop()
            del self.changes[len(self.changes) - begins :]
            raise
        self._cells += cells_of(plain)

    def _take_snapshot(self) -> None:
        """Take a snapshot of the session, unless a replay from the last snapshot would be quick.

        If snapshots take too much memory, drop the oldest.
        """
        now = time.perf_counter()
        if now - self._snapshot_time < _SNAPSHOT_INTERVAL or self.colony.nbytes > _LARGEST:
            return
        bare: Any = copy.copy(self)
        bare.setup, bare.edits, bare.changes, bare._snapshots = None, [], [], []
        content = zlib.compress(pickle.dumps(bare, pickle.HIGHEST_PROTOCOL), 1)
        self._snapshots.append((len(self.edits), content))
        self._snapshot_time = now
        while sum(len(content) for _, content in self._snapshots) > _MOST_KEPT:
            del self._snapshots[0]

    def log(self) -> Log:
        """Return the log: the setup, the edits, and the state at the end."""
        state = self.interventions.state()
        done, changes = tuple(self.edits), tuple(self.changes)
        return Log(self.setup, done, self.steps, self.ticks, state, changes=changes)

    def save(self, path: files.PathLike) -> None:
        """Write the log; raises as `archives.write` does."""
        self.log().write(path)

    def to_bytes(self) -> bytes:
        """Return the bytes of a file with the log."""
        return bytes_of("session.npz", self.save)

    @classmethod
    def load(cls, path: files.PathLike, progress: Callable[[float], None] | None = None) -> Session:
        """Return the replay of a session that `save` wrote.

        Calls `progress` from time to time with the completed share of the steps. Raises AntsError
        if the file is missing, damaged or altered, or if the replay ends in another state.
        """
        log = Log.read(path)
        for session in cls.replay(log):
            if progress is not None:
                progress(session.steps / max(log.steps, 1))
        return session

    @classmethod
    def replay(cls, log: Log) -> Iterator[Session]:
        """Yield the session of a log while it is replayed, at least a few times per second.

        The last session is the whole replay. Raises AntsError if the log is damaged, or if the
        replay does not end in the state that the log contains.
        """
        with KIND.building(log.name):
            session = cls(log.setup)
            yield from session._follow(log.edits, log.steps, log.changes)
            if log.state not in (None, session.interventions.state()):
                raise ValueError("replayed, it does not end as it did")

    def _follow(
        self, edits: Sequence[tuple[int, Any]], steps: int, changes: Sequence[int]
    ) -> Iterator[Session]:
        """Advance to a number of steps and apply the edits, in short pieces."""
        for at, edit in edits:
            yield from self._advance_to(at)
            self._do(edit)
            yield self
        yield from self._advance_to(steps)
        self.changes = list(changes)
        self.recorder.snapshot()
        yield self

    def undone(self) -> tuple[Iterator[Session], int]:
        """Return an iterator like `replay` that ends before the last change, and its steps then.

        It uses a snapshot; this session does not change. Raises AntsError if it has no changes.
        """
        if not self.changes:
            raise AntsError("there is nothing to undo: this session has no interventions.")
        *changes, last = self.changes
        snapshots = [(n, content) for n, content in self._snapshots if n <= last]
        if snapshots:
            n, content = snapshots[-1]
            session = pickle.loads(zlib.decompress(content))
            session.setup, session._snapshots, session.edits = self.setup, snapshots, self.edits[:n]
        else:
            session = Session(self.setup)
        steps, _ = self.edits[last]
        return session._follow(self.edits[len(session.edits) : last], steps, changes), steps

    @classmethod
    def snapshots(cls, log: Log, most: int) -> Iterator[tuple[Session, bytes]]:
        """Yield about `most` snapshots of a replay: the session, and a frame of changes.

        If there are fewer steps and edits, each step and each edit has a snapshot.
        """
        changes = len({steps for steps, _ in log.edits})
        every = max(1, -(-(log.steps + changes) // most))
        session = cls(log.setup)
        yield session, session.recorder.whole()
        for steps, edits_then in groupby([*log.edits, (log.steps, None)], lambda edit: edit[0]):
            while session.steps < steps:
                if every == 1:
                    yield session, session.advance()
                    continue
                until = min(steps, session.steps + every - session.steps % every)
                for _ in session._advance_to(until):
                    pass
                if session.steps % every == 0:
                    yield session, session.recorder.snapshot()
            edits_here = [edit for _, edit in edits_then if edit is not None]
            for edit in edits_here:
                session._do(edit)
            if edits_here if every == 1 else steps == log.steps:
                yield session, session.recorder.snapshot()

    def _advance_to(self, steps: int) -> Iterator[Session]:
        """Advance to a number of steps, in pieces of about `_REPLAY_SLICE` seconds."""
        ticks = 1
        while self.steps < steps:
            began = time.perf_counter()
            self._run(min(ticks, steps - self.steps), self.colony.tick)
            ticks = max(1, 2 * ticks if time.perf_counter() - began < _REPLAY_SLICE else ticks // 2)
            yield self

    def policy_bytes(self) -> bytes:
        """Return the bytes of a policy file; raise AntsError if ants have several tables."""
        colony, learns = self.colony, self.setup.learns
        tables = colony.q_values[0].reshape(-1, colony.task.n_states, N_ACTIONS)
        no_table = not colony.task.needs_table
        if no_table or (len(tables) > 1 and learns):
            raise AntsError(
                f"ants have {'no table' if no_table else 'several tables'}, but a policy file "
                "holds a single one; export the colony instead."
            )
        metadata = {"seed": self.setup.seed, "task": colony.task.as_dict(), "ticks": self.ticks}
        if learns:
            metadata["training"] = colony.training.as_dict()
        arguments = (tables[0], metadata, colony.task.observation)
        return bytes_of("policy.npz", lambda path: save_policy(path, *arguments))

    def colony_bytes(self) -> bytes:
        """Return the bytes of a file from which `Colony.load` resumes the colony.

        Its later episodes begin with the present number of ants, as in the session.
        """
        self.colony.worlds = (self.interventions.world(),)
        return bytes_of("colony.npz", self.colony.save)


def bytes_of(name: str, write: Callable[[Path], None]) -> bytes:
    """Return the bytes that a function writes into a file with the given name."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        write(path)
        return path.read_bytes()
