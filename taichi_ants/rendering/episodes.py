"""Animations of one ant that follows a policy."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np

from taichi_ants.engines.runs.traces import Trace, rollout
from taichi_ants.errors import AntsError, checked_flag, whole
from taichi_ants.rendering.arguments import expect
from taichi_ants.rendering.panel import Status
from taichi_ants.rendering.replay import Replay
from taichi_ants.rendering.scene import DEFAULT_SIZE, Scene, check_size, range_with_zero
from taichi_ants.rendering.snapshot import Snapshot
from taichi_ants.rendering.writers import PathLike, check_animation, save_animation
from taichi_ants.task import Task
from taichi_ants.worlds.world import World

Progress = Callable[[float], None]  # called with the share of the work that is done, 0 to 1

DEFAULT_FPS = 8.0
_LAST_PICTURE_SECONDS = 1.5


@dataclass(frozen=True, eq=False)
class Episode:
    """A rollout with what it takes to draw it.

    Attributes:
        world: Where it happened.
        trace: Its n steps.
        seed, number: Of the rollout.
        task: The rules of the game; None is the paper's.
        name: What the head-up lines call it.
        whole: Whether it ended with its last step; the beginning of an episode has no outcome.
    """

    world: World
    trace: Trace
    seed: int = 0
    number: int = 0
    task: Task | None = None
    name: str = ""
    whole: bool = True

    @classmethod
    def play(
        cls,
        world: World,
        q_values: np.ndarray,
        *,
        seed: int = 0,
        number: int = 0,
        max_steps: int = 600,
        task: Task | None = None,
        epsilon: float = 0.0,
    ) -> Episode:
        """Roll a policy out; arguments and errors are those of `rollout`."""
        expect("world", world, World)
        trace = rollout(world, q_values, seed, number, max_steps, task, epsilon)
        name = "greedy" if epsilon == 0 else f"epsilon {epsilon:g}"
        return cls(world, trace, seed, number, task, name)

    @property
    def delivered(self) -> bool:
        """Whether it ended with the food given to the queen."""
        return bool(self.trace.delivered[-1])

    def __len__(self) -> int:
        """The number of its moments, n + 1."""
        return len(self.trace) + 1

    def moments(self) -> Iterator[tuple[Snapshot, Status]]:
        """The world before each step with what the ant is about to do, and the world at the end."""
        trace = self.trace
        returns = np.concatenate([[0], np.cumsum(trace.rewards)]).tolist()
        outcome = "delivered" if self.delivered else "step limit"
        replay = Replay(self.world, trace, self.seed, self.number, self.task)
        for step, snapshot in enumerate(replay.snapshots()):
            if step < len(trace):
                yield (
                    snapshot,
                    Status(
                        step=step,
                        episode_return=returns[step],
                        episode=self.name,
                        state=int(trace.states[step]),
                        action=int(trace.actions[step]),
                        q_values=trace.q_values[step],
                    ),
                )
            else:
                yield (
                    snapshot,
                    Status(
                        step=step,
                        episode_return=returns[step],
                        episode=self.name,
                        state=int(trace.next_states[-1]),
                        outcome=outcome if self.whole else "",
                    ),
                )


def episode_frames(
    episode: Episode,
    size: tuple[int, int] = DEFAULT_SIZE,
    *,
    hud: bool = True,
    legend: bool = True,
    view: bool = True,
    title: str = "",
) -> Iterator[np.ndarray]:
    """The pictures of an episode, uint8 (height, width, 3), one for each of its moments.

    Args:
        episode: The episode.
        size: Width and height in pixels.
        hud: Whether to draw the head-up lines.
        legend: Whether to draw what the colours mean.
        view: Whether to mark the three cells in view, with the letters that the ant sees.
        title: A line above head-up lines and legend.

    Raises:
        AntsError: The size is not allowed.
    """
    expect("episode", episode, Episode)
    scene = _scene_of(episode, size, hud=hud, legend=legend, title=title)
    seen = checked_flag("view", view)
    for snapshot, status in episode.moments():
        yield scene.draw(snapshot if seen else without_view(snapshot), status)


def episode_picture(
    episode: Episode,
    step: int,
    size: tuple[int, int] = DEFAULT_SIZE,
    *,
    hud: bool = True,
    legend: bool = True,
    view: bool = True,
    title: str = "",
) -> np.ndarray:
    """The picture of one step, 0 to len(episode) - 1; other arguments as in `episode_frames`.

    Raises:
        AntsError: There is no such step, or the size is not allowed.
    """
    expect("episode", episode, Episode)
    if whole("step", step) not in range(len(episode)):
        raise AntsError(f"there is no step {step!r}; the episode has 0 to {len(episode) - 1}.")
    scene = _scene_of(episode, size, hud=hud, legend=legend, title=title)
    snapshot, status = next(islice(episode.moments(), step, None))
    seen = checked_flag("view", view)
    return scene.draw(snapshot if seen else without_view(snapshot), status)


def _scene_of(episode: Episode, size: tuple[int, int], **look: Any) -> Scene:
    bars = range_with_zero(episode.trace.q_values)
    return Scene(episode.world.grid, size, q_range=bars, **look)


def without_view(snapshot: Snapshot) -> Snapshot:
    """The same without the cells in view."""
    return replace(snapshot, letters=None)


def render_episode(
    path: PathLike,
    world: World,
    q_values: np.ndarray,
    *,
    seed: int = 0,
    number: int = 0,
    max_steps: int = 600,
    task: Task | None = None,
    epsilon: float = 0.0,
    size: tuple[int, int] = DEFAULT_SIZE,
    fps: float = DEFAULT_FPS,
    hud: bool = True,
    legend: bool = True,
    view: bool = True,
    title: str = "",
    progress: Progress | None = None,
) -> Episode:
    """Roll a policy out and write the episode as an animation.

    Args:
        path: The ending decides: .gif, .webp or .mp4; a folder of numbered PNG pictures without.
        world, q_values, seed, number, max_steps, task, epsilon: As in `rollout`; a smaller
            `max_steps` keeps the episode of an ant that has not learned short.
        size: Width and height in pixels, 64 to 4096 each.
        fps: Steps per second. The last picture stays a little longer.
        hud, legend, view, title: What to draw, see `episode_frames`.
        progress: Called after each picture with the share of the work that is done.

    Returns:
        The episode.

    Raises:
        AntsError: An argument is not allowed, PyAV is missing for an .mp4, or the file cannot be
            written.
    """
    check_animation(path, fps)
    check_size(size)
    expect("title", title, str)
    episode = Episode.play(
        world,
        q_values,
        seed=seed,
        number=number,
        max_steps=max_steps,
        task=task,
        epsilon=epsilon,
    )
    frames = episode_frames(episode, size, hud=hud, legend=legend, view=view, title=title)
    save_animation(path, with_pause(frames, len(episode), fps, progress), fps)
    return episode


def with_pause(
    frames: Iterator[np.ndarray], n: int, fps: float, progress: Progress | None = None
) -> Iterator[np.ndarray]:
    """n frames, with the last one repeated, so that it can be looked at before all begins anew."""
    for done, frame in enumerate(frames, start=1):
        yield frame
        if progress is not None:
            progress(done / n)
    for _ in range(round(_LAST_PICTURE_SECONDS * fps) - 1):
        yield frame
