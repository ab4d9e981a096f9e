"""Small session files that would need much time or memory if their size were not checked."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants.files import archives
from taichi_ants.live.session import Session

_EDIT = [0, {"episode": {}}]


def _edits(facts: dict[str, Any], n: int) -> str:
    return json.dumps({**facts, "edits": [_EDIT] * n, "changes": [0]})


def _setup(facts: dict[str, Any], **changes: Any) -> str:
    return json.dumps({**facts, "setup": {**facts["setup"], **changes}})


def _cells(facts: dict[str, Any]) -> str:
    edit = {"trail": {"level": 1, "cells": list(range(100, 300))}}
    return json.dumps({**facts, "edits": [[0, edit]] * 3000, "changes": [0]})


# Name: a function that changes the facts of a session, and a part of the error message.
ATTACKS: dict[str, tuple[Callable[[dict[str, Any]], str], str]] = {
    "20 000 edits": (lambda facts: _edits(facts, 20_000), "at most 10000 edits"),
    "400 000 edits": (lambda facts: _edits(facts, 400_000), "5000000 are allowed"),
    "edits of many cells": (_cells, "of 400000 cells are allowed"),
    "4 000 000 lists": (lambda _: "[" + "[]," * 4_000_000 + "[]]", "5000000 are allowed"),
    "1 300 000 lists": (lambda _: "[" + "[]," * 1_300_000 + "[]]", "does not contain a session"),
    "deep lists": (lambda _: "[" * 60_000 + "]" * 60_000, "does not contain a session"),
    "a large map": (
        lambda facts: _setup(facts, world="\n".join(["." * 1000] * 1000)),
        "at most 50000 are allowed",
    ),
    "a map of far cells": (
        lambda facts: _setup(facts, world="Q" + "\n" * 24_000 + " " * 24_000 + "F\n"),
        "at most 1500000 are allowed",
    ),
    "a long bridge": (
        lambda facts: _setup(
            facts, world="double_bridge", world_settings={"short": 1000, "long": 1990}
        ),
        "at most 1500000 are allowed",
    ),
    "a narrow world": (
        lambda facts: _setup(facts, world="open", world_settings={"ranges": [1, 1, 15_000]}),
        "at most 1500000 are allowed",
    ),
}


def attack(name: str, session: Session, folder: Path) -> bytes:
    """Return a file of `ATTACKS` with valid checksums."""
    session.save(folder / "session.npz")
    arrays = archives.read(folder / "session.npz")
    facts, _ = ATTACKS[name]
    text = facts(json.loads(arrays["facts"].item()))
    archives.write(folder / "session.npz", {**arrays, "facts": np.array(text.encode())})
    return (folder / "session.npz").read_bytes()
