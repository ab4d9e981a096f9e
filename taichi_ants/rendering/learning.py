"""Learning made visible: the same ant after more and more episodes, side by side."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from taichi_ants.engines.runs.training import continue_training, train
from taichi_ants.errors import AntsError, expect, whole
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.rendering import colours, text
from taichi_ants.rendering.moments import Episode
from taichi_ants.rendering.panel import Status, draw_swatch
from taichi_ants.rendering.rasteriser import Rasteriser
from taichi_ants.rendering.scene import check_size
from taichi_ants.rendering.viewport import Viewport
from taichi_ants.rendering.writers import Progress
from taichi_ants.task import Rewards, Task
from taichi_ants.task.constants import (
    DELIVERED,
    DEPOSIT_LEVEL,
    EMPTY,
    FAILED,
    FOOD,
    N_ACTIONS,
    OBSTACLE,
    PICKED_UP,
    QUEEN,
)
from taichi_ants.worlds.world import World

STAGES = (0, 10, 100, 500)
DEFAULT_SIZE = (1280, 520)  # four worlds in a row fill it
# In sizes of the text: the title of a tile, all its text, and the legend.
_TITLE_LINES, _TILE_LINES, _LEGEND_LINES = 1.7, 5.6, 2.6
# What earns or costs reward: its name in the account of a stage; the cell that stands for it in the
# legend, with its trail and a letter on it; its words; and which of the rewards it is.
_SOURCES = (
    ("T", EMPTY, DEPOSIT_LEVEL // 2, "", "T onto a trail", "lure"),
    ("S", EMPTY, 0, "S", "S nearer to the queen, with food", "lure"),
    ("F", FOOD, 0, "", "F food", "pick_up"),
    ("Q", QUEEN, 0, "", "Q delivery", "give"),
    ("X", OBSTACLE, 0, "", "X blocked, in vain", "failed"),
)


@dataclass(frozen=True, eq=False)
class Stage:
    """How an ant does after so many episodes of training.

    Attributes:
        episodes: How many.
        episode: What it does then.
        note: What to say of it at its end, in place of whether it has delivered.
    """

    episodes: int
    episode: Episode
    note: str = ""

    @property
    def title(self) -> str:
        if self.episodes == 0:
            return "before learning"
        return f"after {self.episodes} episode{'s' if self.episodes > 1 else ''}"

    def account(self) -> np.ndarray:
        """What was earned until each moment, int (len(episode), 5); the sum is the return.

        The columns are T, S, F, Q and X: steps onto a trail, steps nearer to the queen with food,
        food picked up, food given to her, and what failed.
        """
        trace = self.episode.trace
        events = trace.events
        carries = np.cumsum(events == PICKED_UP) > np.cumsum(events == DELIVERED)
        sources = np.select(
            [events == FAILED, events == DELIVERED, events == PICKED_UP, carries], [4, 3, 2, 1], 0
        )
        earned = np.zeros((len(trace) + 1, len(_SOURCES)), dtype=np.int64)
        earned[np.arange(1, len(earned)), sources] = trace.rewards
        return earned.cumsum(axis=0)


def learning_stages(
    world: World,
    config: TrainingConfig,
    *,
    seed: int = 0,
    stages: Sequence[int] = STAGES,
    train_steps: int = 600,
    max_steps: int = 150,
    task: Task | None = None,
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
        task: The rules of the game; None is the paper's.
        epsilon: Probability of a random action in the rollouts.
        progress: Called with the share of the work that is done.

    Raises:
        AntsError: An argument is not allowed; the message names it.
    """
    if not isinstance(stages, Iterable):
        raise AntsError(f"stages are {stages!r}; they must be several whole numbers.")
    stages = [whole("a stage", stage) for stage in stages]
    if not stages or stages != sorted(stages) or stages[0] < 0:
        raise AntsError(f"stages are {tuple(stages)!r}; they must ascend, from 0 or more.")
    task = task or Task()
    played, result = [], None
    different = tuple(dict.fromkeys(stages))
    for n in different:
        table = np.zeros((task.n_states, N_ACTIONS), dtype=np.float32)
        if n:
            result = (
                train(world, config, seed, n, train_steps, task)
                if result is None
                else continue_training(result, n - result.episodes)
            )
            table = result.q_values[0, 0]
        episode = Episode.play(
            world,
            table,
            seed=seed,
            max_steps=max_steps,
            task=task,
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
    stages = _checked(stages)
    width, height = check_size(size)
    expect("title", title, str)
    canvas = np.empty((height, width, 3), dtype=np.uint8)
    canvas[:] = colours.channels(colours.PAGE)
    text_size = round(min(width / 60, height / 26))
    if text_size < text.SMALLEST:
        text_size = 0
    top, bottom = 0, height - round(_LEGEND_LINES * text_size)
    if title and text_size:
        line = text.shortened(title, text_size, width - 2 * text_size)
        text.write(canvas, line, width / 2, 1.5 * text_size, text_size, align="middle")
        top = round(2.0 * text_size)
    grid = stages[0].episode.world.grid
    tiles = _tiles(grid, len(stages), (0, top, width, bottom - top), text_size)
    _, _, w, h = tiles[0]
    margin = max(2, round(min(w, h) / 60))
    viewport = Viewport.fit(grid, w, h - round(_TILE_LINES * text_size), margin=margin)
    if text_size:
        _draw_legend(canvas, bottom, text_size, viewport.hexagon, stages[0].episode.task.rewards)
    rasteriser = Rasteriser(grid, viewport)
    pictures = [_tile_pictures(stage, rasteriser, h, text_size) for stage in stages]
    for _ in range(max(len(stage.episode) for stage in stages)):
        for (x, y, _, _), waiting in zip(tiles, pictures, strict=True):
            for tile in islice(waiting, 1):
                canvas[y : y + h, x : x + w] = tile
        yield canvas.copy()


def _checked(stages: Sequence[Stage]) -> list[Stage]:
    """The stages, at least one."""
    if isinstance(stages, Stage) or not isinstance(stages, Iterable):
        raise AntsError(f"stages are {stages!r}; give a list of what learning_stages returned.")
    stages = list(stages)
    for stage in stages:
        expect("a stage", stage, Stage)
    if not stages:
        raise AntsError("there are no stages; give at least one.")
    if len({stage.episode.world for stage in stages}) > 1:
        raise AntsError("the stages are of several worlds; give those of one.")
    return stages


def _tile_pictures(
    stage: Stage, rasteriser: Rasteriser, height: int, size: int
) -> Iterator[np.ndarray]:
    """One of the worlds, with a title above and how its ant does below."""
    view, account = rasteriser.viewport, stage.account().tolist()
    above, under = round(_TITLE_LINES * size), round(_TILE_LINES * size)
    tile = np.empty((height, view.width, 3), dtype=np.uint8)

    def write(words: tuple[str, ...], baseline: float, ink: int = colours.INK) -> None:
        """The longest words for which there is room."""
        room = view.width - size / 2
        fitting = next((one for one in words if text.width(one, size) <= room), words[-1])
        text.write(tile, fitting, view.width / 2, baseline, size, ink, align="middle")

    for snapshot, status in stage.episode.moments():
        tile[:] = colours.channels(colours.PAGE)
        tile[above : above + view.height] = rasteriser.draw(snapshot)
        if size:
            write((text.shortened(stage.title, size, view.width),), 1.2 * size)
            below = height - (under - above) + 1.2 * size
            ink = colours.INK if status.outcome else colours.FAINT_INK
            write(_lines(status, stage.note), below, ink)
            write((_sources(account[status.step]), ""), below + 1.4 * size, ink)
        yield tile


def _sources(earned: list[int]) -> str:
    """Where the return comes from."""
    named = zip(_SOURCES, earned, strict=True)
    parts = [f"{'+' if n > 0 else '-'} {name} {abs(n)}" for (name, *_), n in named if n]
    return "= " + " ".join(parts).removeprefix("+ ") if parts else ""


def _lines(status: Status, note: str) -> tuple[str, ...]:
    """What stands below a world, the longest first; the return is in all of them."""
    result = f"return {status.episode_return}"
    outcome = note or (status.outcome if status.outcome == "delivered" else "")
    if not status.outcome or not outcome:
        return (f"step {status.step}, {result}", result, str(status.episode_return))
    return (
        f"step {status.step}, {result}: {outcome}",
        f"{result}: {outcome}",
        result,
        str(status.episode_return),
    )


def _draw_legend(canvas: np.ndarray, top: int, size: int, hexagon: float, rewards: Rewards) -> None:
    """Draw what earns reward in a line across the canvas; shorter where there is little room."""
    whole = [f"{words} {getattr(rewards, name):+}" for *_, words, name in _SOURCES]
    side, gap = round(1.4 * size), round(0.9 * size)
    for words in (whole, [source[0] for source in _SOURCES]):
        width = sum(side + 0.5 * size + text.width(one, size) + gap for one in words) - gap
        if width <= canvas.shape[1]:
            break
    x = (canvas.shape[1] - width) / 2
    baseline = top + round(0.5 * side + 0.8 * size)
    for (_, ground, trail, letter, *_), label in zip(_SOURCES, words, strict=True):
        y = top + round(0.45 * size)
        draw_swatch(canvas, (round(x), y, side), ground, None, hexagon, trail)
        text.write(canvas, letter, x + 0.59 * side, baseline, size, align="middle")
        x += side + 0.5 * size
        text.write(canvas, label, x, baseline, size, colours.FAINT_INK)
        x += text.width(label, size) + gap


def _tiles(
    grid: AxialGrid, n: int, place: tuple[int, int, int, int], text_size: int
) -> list[tuple[int, int, int, int]]:
    """Left, top, width and height of n tiles, in as many columns as make the worlds largest."""
    left, top, width, height = place
    lines = round(_TILE_LINES * text_size)

    def fitted(columns: int) -> Viewport:
        rows = math.ceil(n / columns)
        return Viewport.fit(grid, width // columns, max(1, height // rows - lines))

    columns = max(range(1, n + 1), key=lambda count: (fitted(count).hexagon, count))
    rows = math.ceil(n / columns)
    # No higher than the worlds, so that a title stays near to what it speaks of.
    world = round(fitted(columns).height_of(grid)) + 2 * text_size
    w, h = width // columns, min(height // rows, world + lines)
    top += (height - rows * h) // 2
    return [(left + i % columns * w, top + i // columns * h, w, h) for i in range(n)]
