"""Playback of recordings in Python: the world at each moment, computed from the frames."""

import json
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.task.constants import N_ACTIONS
from taichi_ants.viewer import Recording


def unpack(types: Mapping[str, str], frame: bytes) -> dict[str, np.ndarray]:
    """Return the sections of a frame, see `taichi_ants.viewer.frames`."""
    lengths = np.frombuffer(frame, "<u4", 1 + len(types)).tolist()[1:]
    sections, at = {}, 8 * -(-(1 + len(types)) // 2)
    for (name, kind), length in zip(types.items(), lengths, strict=True):
        sections[name] = np.frombuffer(frame, f"<{kind}", length, at)
        at += 8 * -(-sections[name].nbytes // 8)
    return sections


@dataclass
class Played:
    """The world at a moment, and the last actions of ants."""

    clock: list[float]  # see `taichi_ants.viewer.frames.CLOCK`
    numbers: np.ndarray  # of the living ants, ascending, as what follows
    cells: np.ndarray
    headings: np.ndarray
    loaded: np.ndarray
    states: np.ndarray
    actions: np.ndarray  # of the ants of the previous moment
    events: np.ndarray
    td_errors: np.ndarray
    ground: np.ndarray
    trail: np.ndarray
    values: dict[int, float]  # that have changed, by entry
    nests: np.ndarray
    fields: list[np.ndarray]  # the levels of all pheromones in order, the trail first

    def row(self, state: int, n_states: int, owner: int = 0) -> np.ndarray:
        """Return the action values of a state, float32 (5,)."""
        first = (owner * n_states + state) * N_ACTIONS
        return np.array([self.values[first + a] for a in range(N_ACTIONS)], np.float32)


def played(recording: Recording) -> Iterator[Played]:
    """Yield every moment of a recording."""
    grid = AxialGrid(tuple(recording.header["ranges"]))
    ground = np.zeros(grid.size, np.uint8)
    names = [f"trail{n or ''}" for n in range(len(recording.header["pheromones"]))]
    stored = [np.zeros(grid.size, f"<{recording.header['types'][name]}") for name in names]
    values: dict[int, float] = {}
    numbers = np.zeros(0, np.int32)
    for moment in range(len(recording)):
        frame = unpack(recording.header["types"], recording.frames[moment])
        clock = frame["clock"].tolist()
        ground[frame["ground_at"]] = frame["ground"]
        for levels, name in zip(stored, names, strict=True):
            levels[frame[f"{name}_at"]] = frame[name]
        clocks = zip(stored, clock[9:], strict=True)
        fields = [np.maximum(levels - levels.dtype.type(at), 0) for levels, at in clocks]
        entries = frame["table_at"].astype(np.int64).tolist()
        values |= dict(zip(entries, frame["table"].tolist(), strict=True))
        if len(frame["numbers"]):
            numbers = frame["numbers"]
        if not clock[6]:
            numbers = numbers[:0]
        yield Played(
            clock,
            numbers,
            frame["cells"],
            frame["poses"] & 7,
            frame["poses"] & 8 > 0,
            frame["states"],
            frame["acts"] & 15,
            frame["acts"] >> 4,
            frame["td_errors"],
            ground.copy(),
            fields[0],
            dict(values),
            (frame["poses"] >> 4).astype(int),
            fields,
        )


def unpacked(data: bytes) -> Recording:
    """Return a recording from the result of `Recording.to_bytes`, read as a page reads it."""
    whole = zlib.decompress(data)
    at = 4 + int(np.frombuffer(whole, "<u4", 1)[0])
    header, frames = json.loads(whole[4:at]), []
    while at < len(whole):
        length = int(np.frombuffer(whole, "<u4", 1, at)[0])
        frames.append(whole[at : at + length])
        at += length
    return Recording(header, frames)
