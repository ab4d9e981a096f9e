"""Damaged files of every format: a sentence, or what was written; never anything else."""

import json
import os
import resource
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from taichi_ants import AntsError, Colony, Task, TrainingConfig, load_policy, save_policy, worlds
from taichi_ants.studies.folder import json_in, write_json
from taichi_ants.studies.store import BLOCKS, Store
from taichi_ants.studies.sweep import plan

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
    """A file, and a function that returns its content in a comparable form."""

    path: Path
    read: Callable[[Path], Any]
    checked: bool = True  # whether the reader detects every change of the file

    def outcome(self) -> Any:
        """Return the content of the file or the error, which must be a single short line."""
        try:
            return self.read(self.path)
        except AntsError as error:
            text = str(error)
            assert text.endswith("."), text
            assert "\n" not in text, text
            assert len(text) < 1500, text
            return error


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> dict[str, SmallFile]:
    """One file of each format, by name; archives of arrays with a checksum and without."""
    folder = tmp_path_factory.mktemp("small")
    save_policy(folder / "policy.npz", Q_VALUES, {"seed": 3})
    facts = {"kind": "policy", "version": 2, "observation": "paper", "metadata": {"seed": 3}}
    np.savez(folder / "other.npz", q_values=Q_VALUES, facts=json.dumps(facts))
    world = worlds.World((3, 3, 3), (0, 0, 0), foods=[(2, 0, 0)])
    colony = Colony(world, Task(), TrainingConfig("sarsa", 0.1, 0.9, 0.3, 0.99))
    colony.begin_episode()
    colony.save(folder / "colony.npz")
    steps = {"steps": np.arange(6).reshape(2, 3), "q_values": np.zeros((2, 3, 4), np.float32)}
    Store(folder).add(["a", "b"], [1, 2, 3], steps)
    write_json(folder / "manifest.json", {"seconds": 2.0, "files": {}})
    (folder / "map.txt").write_text(MAP)
    (folder / "sweep.toml").write_text(SWEEP)
    found = {
        "policy": SmallFile(folder / "policy.npz", policy_in),
        "policy of others": SmallFile(folder / "other.npz", policy_in),
        "colony": SmallFile(folder / "colony.npz", Colony.load),
        "block": SmallFile(next((folder / BLOCKS).iterdir()), block_in),
        "manifest": SmallFile(folder / "manifest.json", json_in),
        "map": SmallFile(folder / "map.txt", worlds.load_map, checked=False),
        "sweep": SmallFile(folder / "sweep.toml", lambda f: plan({"file": f}).study, checked=False),
    }
    assert tuple(found) == KINDS
    return found


def policy_in(path: Path) -> dict[str, Any]:
    policy = load_policy(path)
    return {**policy._asdict(), "task": policy.task}


def block_in(path: Path) -> dict[str, np.ndarray]:
    """Return the block; raise AntsError if it is damaged, so that it was set aside."""
    store = Store(path.parents[1])
    for damaged in store.damaged:
        raise AntsError(f"{str(damaged)!r} is damaged.")
    return store.read(["a", "b"], [1, 2, 3], ["steps", "q_values"])


KINDS = ("policy", "policy of others", "colony", "block", "manifest", "map", "sweep")
MOST_GROWTH = 64  # MiB of memory


def same(one: Any, other: Any) -> bool:
    """Return whether two contents are equal."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[name], other[name]) for name in one)
    return np.array_equal(one, other) if isinstance(one, np.ndarray) else bool(one == other)


@contextmanager
def restored(file: SmallFile) -> Iterator[bytes]:
    """Yield the content of a file, and restore it at the end."""
    content = file.path.read_bytes()
    try:
        yield content
    finally:
        file.path.write_bytes(content)


@pytest.mark.filterwarnings("ignore")  # of damaged types
@pytest.mark.parametrize("kind", KINDS[:5])
def test_a_flipped_bit_is_noticed(kind: str, small: dict[str, SmallFile]) -> None:
    """At places drawn at random; where it changes nothing that is read, the content is the same."""
    file, rng = small[kind], np.random.default_rng(KINDS.index(kind))
    whole = file.read(file.path)
    with restored(file) as content:
        bits = 8 * len(content)
        for bit in rng.choice(bits, size=min(bits, 300), replace=False).tolist():
            damaged = bytearray(content)
            damaged[bit // 8] ^= 1 << bit % 8
            file.path.write_bytes(damaged)
            read = file.outcome()
            assert isinstance(read, AntsError) or same(read, whole), f"bit {bit}"


def mutated(content: bytes, rng: np.random.Generator, times: int) -> bytes:
    """Content to which something happened so many times."""
    for _ in range(times):
        at, length = int(rng.integers(len(content) + 1)), int(rng.integers(1, 17))
        before, after = content[:at], content[at:]
        noise = rng.bytes(length)
        content = (
            before,
            after + before,
            before + after[length:],
            before + after[:length] + after,
            before + noise + after,
            before + noise + after[length:],
            before + noise[:1] + after[1:],
            before + bytes(length) + after[length:],
            before + b"\xff" * 4 + after[4:],
        )[int(rng.integers(9))]
    return content


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_anything_that_can_happen_to_a_file(kind: str, small: dict[str, SmallFile]) -> None:
    """Three thousand files in all, the same each time."""
    file, rng = small[kind], np.random.default_rng(KINDS.index(kind))
    whole, begun = file.outcome(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with restored(file) as content:
        for number in range(3000 // len(KINDS) + 1):
            file.path.write_bytes(mutated(content, rng, int(rng.integers(1, 5))))
            began = time.process_time()
            read = file.outcome()
            assert time.process_time() - began < 2, number
            if not isinstance(read, AntsError):
                assert same(read, whole) if file.checked else type(read) is type(whole), number
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - begun
    assert grown < MOST_GROWTH * 1024


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_no_regular_file_is_refused_at_once(
    kind: str, small: dict[str, SmallFile], capsys: pytest.CaptureFixture
) -> None:
    file = small[kind]
    with restored(file):
        for place in ("pipe", "device", "folder"):
            file.path.unlink()
            if place == "pipe":
                os.mkfifo(file.path)
            elif place == "device":
                file.path.symlink_to("/dev/zero")
            else:
                file.path.mkdir()
            read = file.outcome()
            assert isinstance(read, AntsError)
            assert file.path.name in str(read)
            aside = file.path.with_suffix(".damaged")  # where damaged blocks go
            there = aside if os.path.lexists(aside) else file.path
            (Path.rmdir if place == "folder" else Path.unlink)(there)
            file.path.touch()
