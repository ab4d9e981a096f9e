"""Learning made visible: the same ant after more and more episodes, side by side."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from taichi_ants.config import TrainingConfig
from taichi_ants.constants import N_ACTIONS, N_STATES
from taichi_ants.engines.runs import continue_training, train
from taichi_ants.errors import AntsError
from taichi_ants.hexgrid import AxialGrid
from taichi_ants.rendering import colours, text
from taichi_ants.rendering.episodes import DEFAULT_FPS, Episode, Progress, with_pause, without_view
from taichi_ants.rendering.panel import Status
from taichi_ants.rendering.rasteriser import Rasteriser
from taichi_ants.rendering.scene import check_size
from taichi_ants.rendering.viewport import Viewport
from taichi_ants.rendering.writers import PathLike, check_animation, save_animation
from taichi_ants.worlds.world import World

STAGES = (0, 10, 100, 500)
DEFAULT_SIZE = (1280, 460)  # four worlds in a row fill it
# In sizes of the text: the title of a tile, and all its text.
_TITLE_LINES, _TILE_LINES = 1.7, 4.2


@dataclass(frozen=True, eq=False)
class Stage:
    """How an ant does after so many episodes of training."""

    episodes: int
    episode: Episode

    @property
    def title(self) -> str:
        if self.episodes == 0:
            return "before learning"
        return f"after {self.episodes} episode{'s' if self.episodes > 1 else ''}"


def learning_stages(
    world: World,
    config: TrainingConfig,
    *,
    seed: int = 0,
    stages: Sequence[int] = STAGES,
    train_steps: int = 600,
    max_steps: int = 150,
    evaporation: bool = True,
    epsilon: float = 0.0,
    progress: Progress | None = None,
) -> list[Stage]:
    """Train one ant, and roll its policy out whenever it has had a given number of episodes.

    Args:
        world: The world.
        config: The learner and its settings.
        seed: Of training and rollouts.
        stages: Numbers of episodes, ascending, of equal ones one counts; 0 is before learning.
        train_steps: Step limit of a training episode.
        max_steps: Step limit of a rollout.
        evaporation: Whether trails fall in the rollouts; they never do in training.
        epsilon: Probability of a random action in the rollouts.
        progress: Called with the share of the work that is done.

    Raises:
        AntsError: An argument is not allowed; the message names it.
    """
    if not stages or list(stages) != sorted(stages) or stages[0] < 0:
        raise AntsError(f"stages are {tuple(stages)!r}; they must ascend, from 0 or more.")
    played, result = [], None
    different = tuple(dict.fromkeys(stages))
    for n in different:
        table = np.zeros((N_STATES, N_ACTIONS), dtype=np.float32)
        if n:
            result = (
                train(world, config, seed, n, train_steps)
                if result is None
                else continue_training(result, n - result.episodes)
            )
            table = result.q_values[0, 0]
        episode = Episode.play(
            world,
            table,
            seed=seed,
            max_steps=max_steps,
            evaporation=evaporation,
            epsilon=epsilon,
        )
        played.append(Stage(n, episode))
        if progress is not None:
            progress(len(played) / len(different))
    return played


def learning_frames(
    stages: Sequence[Stage], size: tuple[int, int] = DEFAULT_SIZE, title: str = ""
) -> Iterator[np.ndarray]:
    """The pictures of all stages side by side, uint8 (height, width, 3), until the last one ends.

    A stage that has ended stays as it ended.

    Args:
        stages: At least one, all in one world.
        size: Width and height in pixels.
        title: A line above all.

    Raises:
        AntsError: The size is not allowed.
    """
    width, height = check_size(size)
    canvas = np.empty((height, width, 3), dtype=np.uint8)
    canvas[:] = colours.channels(colours.PAGE)
    text_size = round(min(width / 60, height / 26))
    readable = text_size >= text.SMALLEST
    top = 0
    if title and readable:
        line = text.shortened(title, text_size, width - 2 * text_size)
        text.write(canvas, line, width / 2, 1.5 * text_size, text_size, align="middle")
        top = round(2.0 * text_size)
    grid = stages[0].episode.world.grid
    text_size = text_size if readable else 0
    tiles = _tiles(grid, len(stages), (0, top, width, height - top), text_size)
    panels = [
        _Panel(canvas, stage, tile, text_size) for stage, tile in zip(stages, tiles, strict=True)
    ]
    for _ in range(max(len(stage.episode) for stage in stages)):
        for panel in panels:
            panel.go_on()
        yield canvas.copy()


def render_learning(
    path: PathLike,
    stages: Sequence[Stage],
    *,
    size: tuple[int, int] = DEFAULT_SIZE,
    fps: float = DEFAULT_FPS,
    title: str = "",
    progress: Progress | None = None,
) -> None:
    """Write the stages as an animation; arguments and errors as in `render_episode`."""
    check_animation(path, fps)
    frames = learning_frames(stages, size, title)
    longest = max(len(stage.episode) for stage in stages)
    save_animation(path, with_pause(frames, longest, fps, progress), fps)


class _Panel:
    """One of the worlds, with a title above and how its ant does below."""

    def __init__(
        self,
        canvas: np.ndarray,
        stage: Stage,
        place: tuple[int, int, int, int],
        text_size: int,
    ) -> None:
        left, top, width, height = place
        self._canvas = canvas
        self._text_size = text_size
        self._middle = left + width / 2
        self._width = width
        above = round(_TITLE_LINES * text_size)
        below = round(_TILE_LINES * text_size) - above
        self._footer = top + height - below
        grid = stage.episode.world.grid
        margin = max(2, round(min(width, height) / 60))
        room = (left, top + above, width, height - above - below)
        self._rasteriser = Rasteriser(grid, Viewport.fit(grid, *room, margin=margin))
        self._moments = stage.episode.moments()
        if text_size:
            text.write(
                canvas,
                text.shortened(stage.title, text_size, width),
                *(self._middle, top + 1.2 * text_size, text_size),
                align="middle",
            )

    def go_on(self) -> None:
        """Draw the next moment; nothing once the episode has ended."""
        moment = next(self._moments, None)
        if moment is None:
            return
        snapshot, status = moment
        self._rasteriser.draw(self._canvas, without_view(snapshot))
        if not self._text_size:
            return
        left = round(self._middle - self._width / 2)
        footer = self._canvas[self._footer :, left : left + self._width]
        footer[: round(1.8 * self._text_size)] = colours.channels(colours.PAGE)
        line = self._fitting_line(status)
        baseline = self._footer + 1.2 * self._text_size
        ink = colours.INK if status.outcome else colours.FAINT_INK
        text.write(self._canvas, line, self._middle, baseline, self._text_size, ink, align="middle")

    def _fitting_line(self, status: Status) -> str:
        room = self._width - self._text_size / 2
        lines = _lines(status)
        return next((one for one in lines if text.width(one, self._text_size) <= room), lines[-1])


def _lines(status: Status) -> tuple[str, ...]:
    """What stands below a world, the longest first; the return is in all of them."""
    result = f"return {status.episode_return}"
    end = f", {status.outcome}" if status.outcome == "delivered" else ""
    return (
        f"step {status.step}, {result}{end}",
        f"{result}{end}",
        result,
        str(status.episode_return),
    )


def _tiles(
    grid: AxialGrid, n: int, place: tuple[int, int, int, int], text_size: int
) -> list[tuple[int, int, int, int]]:
    """Left, top, width and height of n tiles, in as many columns as make the worlds largest."""
    left, top, width, height = place
    lines = round(_TILE_LINES * text_size)

    def fitted(columns: int) -> Viewport:
        rows = math.ceil(n / columns)
        return Viewport.fit(grid, 0, 0, width // columns, max(1, height // rows - lines))

    columns = max(range(1, n + 1), key=lambda count: (fitted(count).hexagon, count))
    rows = math.ceil(n / columns)
    # No higher than the worlds, so that a title stays near to what it speaks of.
    world = round(fitted(columns).height_of(grid)) + 2 * text_size
    w, h = width // columns, min(height // rows, world + lines)
    top += (height - rows * h) // 2
    return [(left + i % columns * w, top + i // columns * h, w, h) for i in range(n)]
