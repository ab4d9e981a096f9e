"""One small file of each kind, with the function that reads it."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from taichi_ants import (
    AntsError,
    Colony,
    Dataset,
    Task,
    TrainingConfig,
    TrainingResult,
    load_policy,
    save_policy,
    worlds,
)
from taichi_ants.engines.runs.engine import RunState
from taichi_ants.live.session import Session
from taichi_ants.live.setup import Setup
from taichi_ants.offline.dataset import COLUMNS
from taichi_ants.studies.folder import json_in, write_json
from taichi_ants.studies.store import BLOCKS, Store
from taichi_ants.studies.sweep import plan
from taichi_ants.worlds import World

WORLD = World((3, 3, 3), (0, 0, 0), foods=[(2, 0, 0)])
TASK = Task(delivery="truncates")
SARSA = TrainingConfig("sarsa", 0.1, 0.9, 0.3, 0.99)
Q_VALUES = np.random.default_rng(0).normal(size=(128, 5)).round(1).astype(np.float32)
MAP = "trail = 7\n; a comment\n  .\n.   F\n  Q\n.   #\n  0\n"
SWEEP = """kind = "runs"
measures = "greedy_return"
seeds = 2
episodes = 60
training.learner = "sarsa"
training.learning_rate = 0.1
training.epsilon = 0.3
training.epsilon_decay = 0.99
[vary]
training.discount = [0.8, 0.9]
"""


class SmallFile(NamedTuple):
    """A file, and a function that returns its content in a comparable form.

    Attributes:
        path: The file.
        read: Returns the content of `path`.
        checked: Whether the reader detects every change of the file.
    """

    path: Path
    read: Callable[[], Any]
    checked: bool = True


def small_files(folder: Path) -> dict[str, SmallFile]:
    """Return one file of each kind, by name, in a folder."""

    def of(name: str, read: Callable[[Path], Any]) -> SmallFile:
        return SmallFile(folder / name, lambda: read(folder / name))

    found = {
        "policy": of("policy.npz", _policy),
        "policy of others": of("other.npz", _policy),
        "training result": of("training.npz", TrainingResult.load),
        "data set": of("data.npz", Dataset.load),
        "colony": of("colony.npz", Colony.load),
        "session": of("session.npz", lambda path: Session.load(path).interventions.state()),
        "block": SmallFile(_block(folder), lambda: _read_block(folder)),
        "manifest": of("manifest.json", lambda path: json_in(path)),
        "map": of("map.txt", worlds.load_map)._replace(checked=False),
        "sweep": of("sweep.toml", _sweep)._replace(checked=False),
    }
    save_policy(found["policy"].path, Q_VALUES, {"seed": 3})
    facts = {"kind": "policy", "version": 2, "observation": "paper", "metadata": {"seed": 3}}
    np.savez(found["policy of others"].path, q_values=Q_VALUES, facts=json.dumps(facts))
    _training().save(found["training result"].path)
    _dataset().save(found["data set"].path)
    colony = Colony(WORLD, TASK, SARSA)
    colony.begin_episode()
    colony.save(found["colony"].path)
    Session(Setup("paper", TASK, SARSA, ants=2)).save(found["session"].path)
    write_json(folder / "manifest.json", {"seconds": 2.0, "files": {}})
    found["map"].path.write_text(MAP)
    found["sweep"].path.write_text(SWEEP)
    return found


def same(one: Any, other: Any) -> bool:
    """Return whether two contents are equal."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[name], other[name]) for name in one)
    return np.array_equal(one, other) if isinstance(one, np.ndarray) else bool(one == other)


def outcome(file: SmallFile) -> Any:
    """Return the content of a file or the error, which must be a single short line."""
    try:
        return file.read()
    except AntsError as error:
        text = str(error)
        assert text.endswith("."), text
        assert "\n" not in text, text
        assert len(text) < 1500, text
        return error


@contextmanager
def restored(file: SmallFile) -> Iterator[bytes]:
    """Yield the content of a file, and restore it at the end."""
    content = file.path.read_bytes()
    try:
        yield content
    finally:
        file.path.write_bytes(content)


def _policy(path: Path) -> dict[str, Any]:
    policy = load_policy(path)
    return {**policy._asdict(), "task": policy.task}


def _training() -> TrainingResult:
    arrays = {name: np.ones((1, 1, 2), np.int32) for name in ("returns", "steps", "deliveries")}
    state = RunState.initial([SARSA], [0], TASK.n_states)
    return TrainingResult(WORLD, (SARSA,), (0,), 9, TASK, **arrays, seconds=1.0, state=state)


def _dataset() -> Dataset:
    columns = {name: np.zeros(3, dtype) for name, dtype in COLUMNS.items()}
    columns["step"][:], columns["truncated"][2] = range(3), True
    columns["behaviour_probability"][:] = 0.5
    return Dataset(WORLD, TASK, (0,), {"policy": "random"}, **columns)


def _block(folder: Path) -> Path:
    """Return the file of a block in a new store."""
    steps = {"steps": np.arange(6).reshape(2, 3), "q_values": np.zeros((2, 3, 4), np.float32)}
    Store(folder).add(["a", "b"], [1, 2, 3], steps)
    return next((folder / BLOCKS).iterdir())


def _read_block(folder: Path) -> dict[str, np.ndarray]:
    """Return the block; raise AntsError if it is damaged, so that it was set aside."""
    store = Store(folder)
    for path in store.damaged:
        raise AntsError(f"{str(path)!r} is damaged.")
    return store.read(["a", "b"], [1, 2, 3], ["steps", "q_values"])


def _sweep(path: Path) -> Any:
    return plan({"file": path}).study
