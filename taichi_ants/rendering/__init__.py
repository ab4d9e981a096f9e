"""Pictures of worlds and their ants, without a display: stills, GIF, WebP, MP4.

- `Scene` draws a `Snapshot` of a world, with head-up lines (`Status`) and a legend, as an array.
- `save_picture` and `save_animation` write such arrays; a file appears when it is whole.
- `render_episode` rolls a policy out and writes the episode; `Episode`, `episode_frames` and
  `episode_picture` are its parts.
- `learning_stages` and `render_learning` show one ant after more and more episodes, side by side.
- `render_colony` lets time pass in a `Colony` and draws it; `colony_frames` and
  `colony_picture` are its parts.
- `policy_sheet` shows what a policy does in each state.
- `Viewport` tells which cell a pixel shows, and where a cell lies.

The names are imported when they are first used, so that a command line that only needs one of them
starts quickly.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from taichi_ants.rendering.colonies import colony_frames, colony_picture, render_colony
    from taichi_ants.rendering.episodes import (
        Episode,
        episode_frames,
        episode_picture,
        render_episode,
    )
    from taichi_ants.rendering.learning import (
        Stage,
        learning_frames,
        learning_stages,
        render_learning,
    )
    from taichi_ants.rendering.panel import Status
    from taichi_ants.rendering.scene import Scene, check_size
    from taichi_ants.rendering.sheet import best_actions, clarity, policy_sheet, usual_spread
    from taichi_ants.rendering.snapshot import Snapshot
    from taichi_ants.rendering.viewport import Viewport
    from taichi_ants.rendering.writers import (
        check_animation,
        check_picture,
        save_animation,
        save_picture,
    )

_HOMES = {
    "Episode": "episodes",
    "Scene": "scene",
    "Snapshot": "snapshot",
    "Stage": "learning",
    "Status": "panel",
    "Viewport": "viewport",
    "best_actions": "sheet",
    "check_animation": "writers",
    "check_picture": "writers",
    "check_size": "scene",
    "clarity": "sheet",
    "colony_frames": "colonies",
    "colony_picture": "colonies",
    "episode_frames": "episodes",
    "episode_picture": "episodes",
    "learning_frames": "learning",
    "learning_stages": "learning",
    "policy_sheet": "sheet",
    "render_colony": "colonies",
    "render_episode": "episodes",
    "render_learning": "learning",
    "save_animation": "writers",
    "save_picture": "writers",
    "usual_spread": "sheet",
}

__all__ = [
    "Episode",
    "Scene",
    "Snapshot",
    "Stage",
    "Status",
    "Viewport",
    "best_actions",
    "check_animation",
    "check_picture",
    "check_size",
    "clarity",
    "colony_frames",
    "colony_picture",
    "episode_frames",
    "episode_picture",
    "learning_frames",
    "learning_stages",
    "policy_sheet",
    "render_colony",
    "render_episode",
    "render_learning",
    "save_animation",
    "save_picture",
    "usual_spread",
]


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'taichi_ants.rendering' has no attribute {name!r}")
    value = getattr(import_module(f"taichi_ants.rendering.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
