"""What a page can take away from a session, as the bytes of a file."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from taichi_ants.engines.colony.colony import ColonySnapshot
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.live.session import Session
from taichi_ants.rendering import PAUSE, Status, frames, save_animation
from taichi_ants.rendering.moments import Moment
from taichi_ants.task import Pheromone
from taichi_ants.viewer import Recording, page
from taichi_ants.viewer.recorder import fallen

_PAGE_FRAMES, _GIF_FRAMES = 1500, 240  # at most; longer sessions have fewer moments
_GIF_SIZE, _GIF_FPS = (960, 540), 12


def make_page(session: Session) -> bytes:
    """The page that plays the session from its start."""
    return page(session.recording(_PAGE_FRAMES)).encode()


def make_gif(session: Session) -> bytes:
    """The session from its start as an animation."""
    recording, pheromone = session.recording(_GIF_FRAMES), session.setup.build_pheromone()
    look = {"title": "", "strongest": recording.header["trail"]["strongest"]}
    pictures = frames(moments(recording, pheromone), _GIF_SIZE, **look)
    with tempfile.TemporaryDirectory() as place:
        path = Path(place, "session.gif")
        save_animation(path, pictures, _GIF_FPS, pause=PAUSE)
        return path.read_bytes()


def moments(recording: Recording, pheromone: Pheromone) -> Iterator[Moment]:
    """What a recording shows, for pictures.

    Args:
        recording: Of a world.
        pheromone: By which its trails were expected to fall.
    """
    grid = AxialGrid(tuple(recording.header["ranges"]))
    ground = np.zeros(grid.size, np.uint8)
    trail = np.zeros(grid.size, recording.sections(0)["trail"].dtype)
    numbers, before = np.zeros(0, np.int32), (-1, 0)
    for moment in range(len(recording)):
        frame = recording.sections(moment)
        episode, tick, deliveries, _, _, _, ants = frame["clock"].astype(int).tolist()
        passed = tick - before[1] if episode == before[0] else 0
        trail = fallen(trail, ground, pheromone, grid.offsets, passed).copy()
        ground[frame["ground_at"]] = frame["ground"]
        trail[frame["trail_at"]] = frame["trail"]
        numbers = frame["numbers"] if len(frame["numbers"]) or not ants else numbers
        loaded = frame["poses"] >> 3 == 1
        lines = [
            *(("episode", str(episode)), ("tick", str(tick)), ("ants", str(ants))),
            *(("with food", str(loaded.sum())), ("delivered", str(deliveries))),
        ]
        cells, headings = frame["cells"].astype(np.int32), (frame["poses"] & 7).astype(np.int32)
        snapshot = ColonySnapshot(grid, ground.copy(), trail, cells, headings, loaded)
        yield snapshot, Status(tuple(lines))
        before = (episode, tick)


# What pages call it, the name of the file, and what makes it.
EXPORTS: dict[str, tuple[str, Callable[[Session], bytes]]] = {
    "session": ("session.ants", Session.to_bytes),
    "page": ("session.html", make_page),
    "gif": ("session.gif", make_gif),
    "policy": ("policy.npz", Session.policy_bytes),
    "colony": ("colony.npz", Session.colony_bytes),
}
