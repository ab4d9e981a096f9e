"""A colony that people watch and change: deterministic, recorded, replayed to the bit."""

from __future__ import annotations

import io
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants import files
from taichi_ants.engines.colony.hand import Hand
from taichi_ants.engines.stored import FileKind
from taichi_ants.errors import AntsError, checked_whole, expect
from taichi_ants.learners.policies import save_policy
from taichi_ants.live import edits
from taichi_ants.live.setup import Setup
from taichi_ants.task.constants import N_ACTIONS
from taichi_ants.viewer import Recorder, Recording

MOST_TICKS = 1_000_000_000
_MOST_BYTES = 1 << 28  # of a session, unpacked

_KIND = FileKind("taichi-ants session 1", "session", "Session.save, or Save on its page,")


class Session:
    """A colony in a world, from its first tick on, and all that a hand has changed.

    It depends on its setup and its edits alone: `load` replays them.

    Args:
        setup: How it begins.

    Attributes:
        colony: As it is now; nobody else may move it on.
        ticks: How many have passed in all episodes.
        steps: How many steps time has made: ticks, and episodes that began since one had ended.
        edits: (steps, edit) of each edit, in order.

    Raises:
        AntsError: The world or the colony cannot be built.
    """

    def __init__(self, setup: Setup) -> None:
        expect("setup", setup, Setup)
        self.setup, self.colony = setup, setup.build_colony()
        self.hand = Hand(self.colony)
        self.ticks = self.steps = 0
        self.edits: list[tuple[int, edits.Edit]] = []
        self.hand.begin_episode(self._length)
        self.colony.look()  # changes nothing, but compiles what the first edit needs
        self._recorder = Recorder(self.colony)
        self._recorder.moment()
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

    def moment(self) -> bytes:
        """A frame that holds all as it is now, for a page that has read none."""
        return self._recorder.whole()

    def advance(self, n: int = 1) -> bytes:
        """Let n ticks pass, fewer where the episode ends before; a frame of what has changed.

        If the episode has ended, the next one begins instead, and no tick passes: so pages see both
        the end of an episode and the beginning of the next.

        Raises:
            AntsError: n is not allowed.
        """
        return self._pass(checked_whole("n", n), self._recorder.tick) or self._recorder.moment()

    def _pass(self, n: int, tick: Callable[[int], Any]) -> Any:
        """As `advance`, by a function that lets ticks pass; what it gives, None without ticks."""
        if self.ended:
            self.hand.begin_episode(self._length)
            self.steps += 1
            return None
        n = min(n, self._length - self.colony.ticks if self._length else n)
        if self.ticks + n > MOST_TICKS:
            raise AntsError(f"a session has at most {MOST_TICKS} ticks; begin another one.")
        before = self.colony.ticks
        try:
            return tick(n)
        finally:  # even if somebody interrupts it
            self.ticks += self.colony.ticks - before
            self.steps += self.colony.ticks - before

    def apply(self, edit: object) -> bytes:
        """Do an edit now, see `edits`, and record it; a frame of what has changed.

        If the episode has ended, what is of this episode alone goes with it.

        Raises:
            AntsError: It is none, or there is no room for it; nothing has changed.
        """
        self._do(edit)
        return self._recorder.moment()

    def _do(self, edit: object) -> None:
        plain = edits.checked(edit, self.hand)
        edits.apply(plain, self.hand, self._length)
        self.edits.append((self.steps, plain))

    def values(self) -> dict[str, dict[str, float]]:
        """What the edit "set" can change, by name: value, least, most and step."""
        return {name: value._asdict() for name, value in edits.values(self.hand).items()}

    def to_bytes(self) -> bytes:
        """The session as a file holds it: how it began, the edits, and what its end is like."""
        return _bytes_of("session.npz", self.save)

    def save(self, path: files.PathLike) -> None:
        """Write the session; raises as `files.write_npz` does."""
        table = np.zeros((0, N_ACTIONS)) if self.setup.learns else self.setup.policy
        facts = {
            "task": self.setup.task.as_dict(),
            "setup": self.setup.to_json(),
            "edits": self.edits,
            "steps": self.steps,
            "state": self.hand.state(),
        }
        _KIND.write(path, facts, {"table": np.asarray(table, np.float32)}, compress=True)

    @classmethod
    def load(cls, path: files.PathLike) -> Session:
        """Replay a session that `save` wrote, up to its end.

        Raises:
            AntsError: The file is missing, damaged or altered, or its end is another one here.
        """
        return cls._replayed(path, None)

    @classmethod
    def from_bytes(cls, content: bytes) -> Session:
        """As `load`, of what a file holds."""
        try:
            with zipfile.ZipFile(io.BytesIO(content)) as archive:
                size = sum(one.file_size for one in archive.infolist())
        except Exception:
            size = 0  # no archive at all, which `_replayed` says
        if size > _MOST_BYTES:
            raise AntsError("what was given takes too much memory; give a file of Session.save.")
        return cls._replayed("the loaded file", content)

    @classmethod
    def _replayed(cls, path: files.PathLike, content: bytes | None) -> Session:
        stored, facts = _KIND.read(path, content)
        with _KIND.rebuilding(path):
            session = cls(Setup.from_json(facts["setup"], stored["table"]))
            end = checked_whole("steps", facts["steps"], 0, MOST_TICKS)
            for steps, edit in facts["edits"]:
                session._go(checked_whole("steps", steps, session.steps, end))
                session._do(edit)
            session._go(end)
            if session.hand.state() != facts["state"]:
                raise ValueError("replayed, it does not end as it did")
            session._recorder.moment()
        return session

    def _go(self, steps: int) -> None:
        """Let time pass until it has made so many steps."""
        while self.steps < steps:
            self._pass(steps - self.steps, self.colony.tick)

    def moments(self, most: int = 1000) -> Iterator[tuple[Session, bytes]]:
        """The session once more from its beginning, moment by moment; this one stays as it is.

        Args:
            most: About how many moments there are at most. If there are fewer steps and edits, each
                step has a moment, and what a hand has changed before it as well.

        Yields:
            The session at that moment, and a frame of what has changed since the last one.
        """
        changes = len({steps for steps, _ in self.edits})
        every = max(1, -(-(self.steps + changes) // checked_whole("most", most)))
        session = Session(self.setup)
        yield session, session.moment()
        for steps, edits_then in groupby([*self.edits, (self.steps, None)], lambda one: one[0]):
            while session.steps < steps:
                if every == 1:
                    yield session, session.advance()
                    continue
                session._go(min(steps, session.steps + every - session.steps % every))
                if session.steps % every == 0:
                    yield session, session._recorder.moment()
            wanted = [edit for _, edit in edits_then if edit is not None]
            for edit in wanted:
                session._do(edit)
            if wanted if every == 1 else steps == self.steps:
                yield session, session._recorder.moment()

    def recording(self, most_frames: int = 1000) -> Recording:
        """The session as a page plays it without a server, see `moments`."""
        passed = list(self.moments(most_frames))
        return Recording(passed[-1][0].header(), [frame for _, frame in passed])

    def gif_bytes(self, most_frames: int = 300, fps: float = 12.0) -> bytes:
        """An animation of the session, see `moments`."""
        from taichi_ants.rendering import colony_moments, frames, save_animation

        passed = self.moments(most_frames)
        shown = (moment for session, _ in passed for moment in colony_moments(session.colony))
        pictures = frames(shown, strongest=self.setup.task.pheromone.level)
        return _bytes_of("session.gif", lambda path: save_animation(path, pictures, fps))

    def policy_bytes(self) -> bytes:
        """The action values as they are now, as a policy file holds them.

        Raises:
            AntsError: Each ant has a table of its own.
        """
        colony = self.colony
        if colony.one_a_slot:
            raise AntsError(
                "each ant has a table of its own, and a policy file holds one; begin a session in "
                "which they share one."
            )
        told = {"seed": self.setup.seed, "task": colony.task.as_dict(), "ticks": self.ticks}
        if self.setup.learns:
            told["training"] = colony.training.as_dict()
        values, sees = colony.q_values[0], colony.task.observation
        return _bytes_of("policy.npz", lambda path: save_policy(path, values, told, sees))

    def colony_bytes(self) -> bytes:
        """The colony as it is now, as `Colony.save` writes it; `Colony.load` goes on from it.

        Its later episodes begin as those of the session would, with as many ants as this one.
        """
        self.colony.worlds = (self.hand.world(),)
        return _bytes_of("colony.npz", self.colony.save)


def _bytes_of(name: str, write: Callable[[Path], None]) -> bytes:
    """What a function writes into a file of that name."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        write(path)
        return path.read_bytes()
