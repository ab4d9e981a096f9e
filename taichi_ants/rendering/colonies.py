"""Animations of colonies."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.errors import AntsError, whole
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.rendering.arguments import expect
from taichi_ants.rendering.episodes import DEFAULT_FPS, Progress, with_pause
from taichi_ants.rendering.panel import Status
from taichi_ants.rendering.scene import DEFAULT_SIZE, Scene
from taichi_ants.rendering.snapshot import Snapshot
from taichi_ants.rendering.writers import PathLike, check_animation, save_animation
from taichi_ants.task.constants import DEPOSIT_LEVEL

if TYPE_CHECKING:
    from taichi_ants.engines.colony.colony import Colony


def colony_frames(
    colony: Colony,
    ticks: int,
    size: tuple[int, int] = DEFAULT_SIZE,
    *,
    every: int = 1,
    world: int = 0,
    hud: bool = True,
    legend: bool = True,
    title: str = "",
    full_level: float = DEPOSIT_LEVEL,
) -> Iterator[np.ndarray]:
    """Let time pass in a colony, and draw it: uint8 (height, width, 3), now and every few ticks.

    Args:
        colony: In an episode; it is moved on by `ticks`.
        ticks: How many, at least 1; the last step is shorter if need be.
        size: Width and height in pixels.
        every: Ticks from one picture to the next, at least 1.
        world: Number of the world to draw.
        hud: Whether to write ticks, ants and deliveries beside the world.
        legend: Whether to draw what the colours mean.
        title: A line above both.
        full_level: The trail level that has the last colour of the ramp.

    Raises:
        AntsError: `every` or `ticks` is below 1, or the size is not allowed.
    """
    grid = _grid_of(colony, world)
    every, ticks = _checked_ticks(every, ticks)
    scene = Scene(grid, size, hud=hud, legend=legend, title=title, full_level=full_level)
    yield _drawn(scene, colony, world)
    for done in range(0, ticks, every):
        colony.tick(min(every, ticks - done))
        yield _drawn(scene, colony, world)


def colony_picture(
    colony: Colony, size: tuple[int, int] = DEFAULT_SIZE, *, world: int = 0, **look: Any
) -> np.ndarray:
    """The picture of a colony as it is; other arguments as in `colony_frames`."""
    return _drawn(Scene(_grid_of(colony, world), size, **look), colony, world)


def render_colony(
    path: PathLike,
    colony: Colony,
    ticks: int,
    size: tuple[int, int] = DEFAULT_SIZE,
    *,
    fps: float = DEFAULT_FPS,
    every: int = 1,
    world: int = 0,
    hud: bool = True,
    legend: bool = True,
    title: str = "",
    full_level: float = DEPOSIT_LEVEL,
    progress: Progress | None = None,
) -> None:
    """Write what `colony_frames` draws as an animation; path, fps and errors: `render_episode`."""
    check_animation(path, fps)
    every, ticks = _checked_ticks(every, ticks)
    look: dict[str, Any] = {"hud": hud, "legend": legend, "title": title, "full_level": full_level}
    frames = colony_frames(colony, ticks, size, every=every, world=world, **look)
    save_animation(path, with_pause(frames, 1 + -(-ticks // every), fps, progress), fps)


def _checked_ticks(every: int, ticks: int) -> tuple[int, int]:
    """Ticks from one picture to the next, and in all."""
    if whole("every", every) < 1 or whole("ticks", ticks) < 1:
        raise AntsError(f"every is {every} and ticks {ticks}; both must be at least 1.")
    return int(every), int(ticks)


def _grid_of(colony: Colony, world: int) -> AxialGrid:
    """The grid of one of a colony's worlds."""
    from taichi_ants.engines.colony.colony import Colony

    expect("colony", colony, Colony)
    if not 0 <= whole("world", world) < len(colony.worlds):
        raise AntsError(
            f"world is {world}, but the colony has {len(colony.worlds)}; count them from 0."
        )
    return colony.worlds[world].grid


def _drawn(scene: Scene, colony: Colony, world: int) -> np.ndarray:
    snapshot = Snapshot.of(colony.snapshot(world))
    delivered = int(colony.outcome().deliveries[0, world])
    more = (
        ("ants", str(len(snapshot.ant_cells))),
        ("with food", str(int(snapshot.ant_carries.sum()))),
        ("delivered", str(delivered)),
    )
    return scene.draw(snapshot, Status(step=colony.ticks, more=more, step_name="tick"))
