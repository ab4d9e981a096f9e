"""Pictures of worlds and their ants, without a display: stills, GIF, MP4.

- `frames` draws snapshots, which `Episode.snapshots` and `colony_snapshots` yield, as arrays;
  `Scene` draws one.
- `learning_frames` shows one ant after more and more episodes, side by side.
- `policy_sheet` shows what a policy does in each state.
- `save_picture` and `save_animation` write arrays; a file appears when it is whole.
"""

from taichi_ants.engines.records import Snapshot
from taichi_ants.rendering.learning import (
    Checkpoint,
    learning_checkpoints,
    learning_frames,
    typical_seed,
)
from taichi_ants.rendering.scene import Scene, Status
from taichi_ants.rendering.sheet import policy_sheet
from taichi_ants.rendering.snapshots import Episode, at_start, colony_snapshots, frames
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
