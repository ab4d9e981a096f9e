"""Small session files that would need much time or memory if their size were not checked."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants.files import archives
from taichi_ants.live.session import Session


def _edits(facts: dict[str, Any], edit: dict[str, Any], times: int) -> str:
    return json.dumps({**facts, "edits": [[0, edit]] * times, "changes": [0]})


def _setup(facts: dict[str, Any], **changes: Any) -> str:
    return json.dumps({**facts, "setup": {**facts["setup"], **changes}})


_TRAIL = {"trail": {"level": 1, "cells": list(range(100, 300))}}


# Name: a function that changes the facts of a session, and a part of the error message.
ATTACKS: dict[str, tuple[Callable[[dict[str, Any]], str], str]] = {
    "20 000 edits": (lambda facts: _edits(facts, {"episode": {}}, 20_000), "20000 edits"),
    "edits of many cells": (lambda facts: _edits(facts, _TRAIL, 3000), "600000 cells in all edits"),
    "4 000 000 lists": (lambda _: "[" + "[]," * 4_000_000 + "[]]", "5000000 are allowed"),
    "deep lists": (lambda _: "[" * 60_000 + "]" * 60_000, "does not contain a session"),
    "a large map": (
        lambda facts: _setup(facts, world="\n".join(["." * 1000] * 1000)),
        "at most 50000 are allowed",
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
