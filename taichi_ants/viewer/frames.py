"""Frames: what changed in a world from one moment to the next, as bytes; and recordings of them.

A frame is a list of arrays, its sections, in little-endian order. It begins with uint32 numbers:
its length in bytes, and how many elements each section has. Each section begins at a multiple of
eight bytes, so that both NumPy and JavaScript can look at it where it lies.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

# In `clock`, in this order. Deliveries and returns are of the episode, delivered and ticks of
# all so far. What `trail` holds less the clock of the trail is the level, not below 0.
CLOCK = (
    "episode",
    "tick",
    "deliveries",
    "returns",
    "epsilon",
    "learning_rate",
    "ants",
    "delivered",
    "ticks",
    "trail_clock",
)

# Of a point of the curves, in this order. The ticks and what was delivered are of all episodes so
# far, returns of this one; ended is 1 at the end of an episode.
POINT = ("episode", "ticks", "delivered", "returns", "epsilon", "ended")

# The sections, in order, and their types; "cell", "state" and "level" depend on the world.
SECTIONS = {
    "clock": "f8",
    # The ants, in ascending order of their numbers. `numbers` is empty if they are those of the
    # frame before.
    "numbers": "i4",
    "cells": "cell",
    "poses": "u1",  # the heading, plus 8 with food
    "states": "state",
    # What the ants of the frame before have done since; empty if that was not one tick.
    "acts": "u1",  # the action, plus 16 times the event
    "td_errors": "f4",  # NaN where it is not known; empty if nobody learns
    # Where the world has changed since the frame before, and what it is there.
    "ground_at": "cell",
    "ground": "u1",
    "trail_at": "cell",
    "trail": "level",  # expiry clocks, or levels, see `Colony.stored_trail`
    "table_at": "f8",  # (owner * n_states + state) * 5 + action; the owner is 0, or an ant
    "table": "f4",
    # Points for curves since the frame before, see `POINT`.
    "progress": "f8",
}
_HEAD = 8 * -(-(1 + len(SECTIONS)) // 2)  # bytes


def types_of(size: int, n_states: int, dense: bool) -> dict[str, str]:
    """The type of each section in a world of so many cells, states, and kind of trail."""
    of_world = {
        "cell": "u2" if size < 2**16 else "u4",
        "state": "u2" if n_states < 2**16 else "u4",
        "level": "f4" if dense else "i4",
    }
    return {name: of_world.get(kind, kind) for name, kind in SECTIONS.items()}


def pack(types: Mapping[str, str], sections: Mapping[str, Any]) -> bytes:
    """A frame; sections that are not given are empty."""
    head, parts = [], []
    for name, kind in types.items():
        array = np.ascontiguousarray(sections.get(name, ()), dtype=f"<{kind}")
        head.append(array.size)
        parts.append(array.tobytes() + bytes(-array.nbytes % 8))
    body = b"".join(parts)
    numbers = np.array([_HEAD + len(body), *head], dtype="<u4").tobytes()
    return numbers.ljust(_HEAD, b"\0") + body


@dataclass(frozen=True, eq=False)
class Recording:
    """What happened, as a page plays it.

    Attributes:
        header: What it is about, as JSON can hold it, see `Recorder.header`.
        frames: The first moment, then what changed until each later one.
    """

    header: dict[str, Any]
    frames: list[bytes]

    def __len__(self) -> int:
        """The number of moments."""
        return len(self.frames)

    def to_bytes(self) -> bytes:
        """The recording as a page holds it, compressed: its header as JSON, then all frames."""
        header = json.dumps(self.header, separators=(",", ":")).encode()
        header += b" " * (-(len(header) + 4) % 8)  # frames begin at a multiple of eight
        length = np.array([len(header)], dtype="<u4").tobytes()
        return zlib.compress(b"".join([length, header, *self.frames]), 9)
