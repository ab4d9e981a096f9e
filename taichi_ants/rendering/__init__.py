"""Pictures and animations of worlds and their ants: PNG and GIF, without a display.

- `picture` draws a world at its start.
- `frames` draws the snapshots of `Episode.snapshots` or `colony_snapshots` as arrays; `Scene`
  draws a single snapshot.
- `save_picture` and `save_animation` write arrays to files, which appear only once complete.
"""

from taichi_ants.records import Snapshot
from taichi_ants.rendering.scene import Scene, Status
from taichi_ants.rendering.snapshots import Episode, at_start, colony_snapshots, frames, picture
from taichi_ants.rendering.writers import PAUSE, save_animation, save_picture

__all__ = [
    "PAUSE", "Episode", "Scene", "Snapshot", "Status", "at_start", "colony_snapshots", "frames",
    "picture", "save_animation", "save_picture",
]  # fmt: skip
__dir__ = __all__.copy  # completion lists only public names
