"""Damaged files of every kind: a sentence, or what was written; never anything else."""

from __future__ import annotations

import os
import resource
import time
from pathlib import Path

import numpy as np
import pytest
from small_files import SmallFile, outcome, restored, same, small_files

from taichi_ants import AntsError

KINDS = (
    *("policy", "policy of others", "training result", "data set", "colony", "session", "block"),
    *("manifest", "map", "sweep"),
)
CHECKED = KINDS[:8]
MOST_GROWTH = 64  # MiB of memory


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> dict[str, SmallFile]:
    found = small_files(tmp_path_factory.mktemp("small"))
    assert (tuple(found), tuple(one for one in found if found[one].checked)) == (KINDS, CHECKED)
    return found


@pytest.mark.filterwarnings("ignore")  # of damaged types
@pytest.mark.parametrize("kind", CHECKED)
def test_a_flipped_bit_is_noticed(kind: str, small: dict[str, SmallFile]) -> None:
    """At places drawn at random; where it changes nothing that is read, the content is the same."""
    file, rng = small[kind], np.random.default_rng(KINDS.index(kind))
    whole = file.read()
    with restored(file) as content:
        bits = 8 * len(content)
        for bit in rng.choice(bits, size=min(bits, 300), replace=False).tolist():
            damaged = bytearray(content)
            damaged[bit // 8] ^= 1 << bit % 8
            file.path.write_bytes(damaged)
            read = outcome(file)
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
    whole, begun = file.read(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with restored(file) as content:
        for number in range(3000 // len(KINDS) + 1):
            file.path.write_bytes(mutated(content, rng, int(rng.integers(1, 5))))
            began = time.process_time()
            read = outcome(file)
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
            read = outcome(file)
            assert isinstance(read, AntsError)
            assert file.path.name in str(read)
            aside = file.path.with_suffix(".damaged")  # where damaged blocks go
            there = aside if os.path.lexists(aside) else file.path
            (Path.rmdir if place == "folder" else Path.unlink)(there)
            file.path.touch()
