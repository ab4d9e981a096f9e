"""Pictures of worlds and their ants, without a display: stills, GIF, MP4.

- A picture shows a `Snapshot` of a world, as `Colony.snapshot` or `at_start` give it, with a
  `Status`, what is said of it. `Episode.snapshots` and `colony_snapshots` yield them.
- `frames` draws snapshots as arrays, one at a time; `Scene` does so with one.
- `learning_checkpoints` and `learning_frames` show one ant after more and more episodes, side by
  side; `typical_seed` returns the seed of the median ant.
- `policy_sheet` shows what a policy does in each state.
- `save_picture` and `save_animation` write arrays; a file appears when it is whole.
"""

from taichi_ants.rendering.learning import (
    Checkpoint,
    learning_checkpoints,
    learning_frames,
    typical_seed,
)
from taichi_ants.rendering.panel import Status
from taichi_ants.rendering.scene import Scene
from taichi_ants.rendering.sheet import policy_sheet
from taichi_ants.rendering.snapshot import Snapshot, at_start
from taichi_ants.rendering.snapshots import Episode, colony_snapshots, frames
from taichi_ants.rendering.writers import (
    PAUSE,
    check_animation,
    check_picture,
    save_animation,
    save_picture,
)

__all__ = [
    "PAUSE",
    "Checkpoint",
    "Episode",
    "Scene",
    "Snapshot",
    "Status",
    "at_start",
    "check_animation",
    "check_picture",
    "colony_snapshots",
    "frames",
    "learning_checkpoints",
    "learning_frames",
    "policy_sheet",
    "save_animation",
    "save_picture",
    "typical_seed",
]
