"""Frames, which hold the changes of a world since the previous frame as bytes.

A frame is a list of arrays, its sections, in little-endian order. It begins with uint32 numbers:
its length in bytes, and the number of elements of each section. Each section begins at a multiple
of eight bytes, so that NumPy and JavaScript can read it without a copy.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

# Elements of `clock`, in order. `deliveries` and `returns` count this episode, `delivered` and
# `ticks` all episodes. The level of a trail is its value in `trail` minus `trail_clock`, or 0.
CLOCK = (
    *("episode", "tick", "deliveries", "returns", "epsilon", "learning_rate"),
    *("ants", "delivered", "ticks", "trail_clock"),  # then the clocks of the fields in order
)

# Elements of a point of the curves, in order. `ticks` and `delivered` count all episodes,
# `returns` this one; `ended` is 1 at the end of an episode.
POINT = ("episode", "ticks", "delivered", "returns", "epsilon", "ended")

# The sections of a frame in order, with types; "cell", "state" and "level" depend on the world.
SECTIONS = {
    "clock": "f8",
    # The ants, in ascending order of their numbers. `numbers` is empty if they are the same as in
    # the previous frame.
    "numbers": "i4",
    "cells": "cell",
    "poses": "u1",  # the heading, plus 8 with food, plus 16 times the nest
    # The caste, plus 16 times the kind of the food that the ant carries; empty without castes and
    # with one kind of food.
    "groups": "u1",
    "marks": "u1",  # how faded all ants are by the first mark, 0 to 255, then by the next ones
    "states": "state",
    # Actions of the ants of the previous frame; empty unless exactly one tick has passed.
    "acts": "u1",  # the executed action, or 15 of an ant that rests, plus 16 times the event
    "choices": "u1",  # the chosen action, plus 8 if it was drawn one tick earlier; 15 if it rests
    "rewards": "f4",  # of these actions
    "td_errors": "f4",  # NaN where unknown; empty if no ant learns
    # Changes since the previous frame: indices and new values.
    "ground_at": "cell",
    "ground": "u1",
    "kinds_at": "cell",
    "kinds": "u1",  # kinds of the food in cells; empty with one kind
    "queens": "cell",  # cells of the queens by nest; empty if they are those of the previous frame
    "trail_at": "cell",
    "trail": "level",  # expiry clocks, or levels, see `Colony._stored_pheromone`
    # (owner * n_states + state) * 5 + action; the owner is an ant, or the nest of ants that share.
    "table_at": "f8",
    "table": "f4",
    # Points of curves since the previous frame, see `POINT`.
    "progress": "f8",
}


def types_of(size: int, n_states: int, dense: bool, *fields: bool) -> dict[str, str]:
    """Return the type of each section of frames.

    `size` is the number of cells. If `dense`, trails are stored as levels, not as expiry clocks.
    Each field adds sections like those of the trail, "trail1_at" and "trail1" for the first one;
    `fields` says which of them are dense.
    """
    of_world = {
        "cell": "u2" if size < 2**16 else "u4",
        "state": "u2" if n_states < 2**16 else "u4",
        "level": "f4" if dense else "i4",
    }
    types = {name: of_world.get(kind, kind) for name, kind in SECTIONS.items()}
    for number, levels in enumerate(fields, 1):
        types |= {f"trail{number}_at": of_world["cell"], f"trail{number}": "f4" if levels else "i4"}
    return types


def pack(types: Mapping[str, str], sections: Mapping[str, Any]) -> bytes:
    """Return a frame; missing sections are empty."""
    head, parts = [], []
    for name, kind in types.items():
        array = np.ascontiguousarray(sections.get(name, ()), dtype=f"<{kind}")
        head.append(array.size)
        parts.append(array.tobytes() + bytes(-array.nbytes % 8))
    body, begin = b"".join(parts), 8 * -(-(1 + len(types)) // 2)
    numbers = np.array([begin + len(body), *head], dtype="<u4").tobytes()
    return numbers.ljust(begin, b"\0") + body
