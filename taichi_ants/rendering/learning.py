"""Learning made visible: the same ant after more and more episodes, side by side."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from taichi_ants import checks
from taichi_ants.engines.runs.training import train
from taichi_ants.errors import AntsError, count, entries_of, expect, shown, whole
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.rendering import colours, text
from taichi_ants.rendering.marks import cell
from taichi_ants.rendering.moments import Episode
from taichi_ants.rendering.rasteriser import Rasteriser, draw_marks
from taichi_ants.rendering.scene import check_size
from taichi_ants.task import Rewards, Task
from taichi_ants.task.constants import DELIVERED, FAILED, N_ACTIONS, PICKED_UP
from taichi_ants.worlds.world import World

STAGES = (0, 10, 100, 500)
DEFAULT_SIZE = (1280, 520)  # four worlds in a row fill it
# In sizes of the text: the title of a tile, all its text, and the legend.
_TITLE_LINES, _TILE_LINES, _LEGEND_LINES = 1.7, 5.6, 2.6
# What earns or costs reward: its letter, that of a cell, its words, and which reward it is.
_SOURCES = (
    ("T", "T", "onto a trail", "lure"),
    ("S", "S", "nearer to the queen", "lure"),
    ("F", "F", "food", "pick_up"),
    ("Q", "Q", "delivery", "give"),
    ("X", "O", "blocked, in vain", "failed"),
)


@dataclass(frozen=True, eq=False)
class Stage:
    """How an ant does after so many episodes of training.

    Attributes:
        episodes: How many.
        episode: What it does then.
        note: What is said of it at its end.
    """

    episodes: int
    episode: Episode
    note: str = ""

    @property
    def title(self) -> str:
        return f"after {count(self.episodes, 'episode')}" if self.episodes else "before learning"

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
    max_steps: int = 150,
    task: Task | None = None,
    epsilon: float = 0.0,
    progress: Callable[[float], None] | None = None,
) -> list[Stage]:
    """Train one ant, and roll its policy out whenever it has had a given number of episodes.

    Args:
        world: The world.
        config: The learner and its settings.
        seed: Of training and rollouts.
        stages: Numbers of episodes, ascending; 0 is before learning.
        max_steps: Step limit of a rollout.
        task: The rules of the game; None is the paper's.
        epsilon: Probability of a random action in the rollouts.
        progress: Called with the share of the work that is done.

    Raises:
        AntsError: An argument is not allowed; the message names it.
    """
    checks.check_progress(progress)
    task = checks.checked_task(Task() if task is None else task)
    listed = entries_of(stages)
    if listed is None:
        raise AntsError(f"stages is {shown(stages)}; it must be numbers of episodes.")
    stages = [whole("a stage", stage) for stage in listed]
    if not stages or stages != sorted(set(stages)) or stages[0] < 0:
        raise AntsError(f"stages are {shown(tuple(stages))}; they must ascend, from 0 or more.")
    played = []
    for n in stages:
        table = np.zeros((task.n_states, N_ACTIONS), dtype=np.float32)
        if n:
            table = train(world, config, seed, n, task=task).q_values[0, 0]
        episode = Episode.play(
            world, table, seed=seed, max_steps=max_steps, task=task, epsilon=epsilon
        )
        played.append(Stage(n, episode, "delivered" if episode.delivered else ""))
        if progress is not None:
            progress(len(played) / len(stages))
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
    expect("stages", stages, list, tuple)
    for stage in stages:
        expect("a stage", stage, Stage)
    if len({stage.episode.world for stage in stages}) != 1:
        raise AntsError("the stages are of several worlds, or there are none; give those of one.")
    width, height = check_size(size)
    expect("title", title, str)
    canvas = np.full((height, width, 3), colours.channels(colours.PAGE))
    letters = round(min(width / 60, height / 26))
    letters *= letters >= text.SMALLEST
    top, bottom = 2 * letters * bool(title), height - round(_LEGEND_LINES * letters)
    room = width - 2 * letters
    text.write(canvas, title, width / 2, 1.5 * letters, letters, align="middle", room=room)
    if letters:
        _draw_legend(canvas, bottom, letters, stages[0].episode.task.rewards)
    columns = math.ceil(len(stages) / max(1, math.isqrt(len(stages) * height // width)))
    rows, lines = math.ceil(len(stages) / columns), round(_TILE_LINES * letters)
    w = width // columns
    # No higher than wide, so that a title stays near to what it speaks of.
    h = min((bottom - top) // rows, w + lines)
    top += (bottom - top - rows * h) // 2
    grid, margin = stages[0].episode.world.grid, max(2, round(min(w, h) / 60))
    rasteriser = Rasteriser(grid, w, max(1, h - lines), margin)
    pictures = [_tile_pictures(stage, rasteriser, h, letters) for stage in stages]
    for _ in range(max(len(stage.episode) for stage in stages)):
        for place, waiting in enumerate(pictures):
            x, y = place % columns * w, top + place // columns * h
            for tile in islice(waiting, 1):
                canvas[y : y + h, x : x + w] = tile
        yield canvas.copy()


def _tile_pictures(
    stage: Stage, rasteriser: Rasteriser, height: int, letters: int
) -> Iterator[np.ndarray]:
    """One of the worlds, with a title above and how its ant does below."""
    account, width = stage.account(), rasteriser.width
    above = round(_TITLE_LINES * letters)
    tile = np.empty((height, width, 3), dtype=np.uint8)
    for step, (snapshot, _) in enumerate(stage.episode.moments()):
        tile[:] = colours.channels(colours.PAGE)
        tile[above : above + rasteriser.height] = rasteriser.draw(snapshot)
        result = f"step {step}, return {account[step].sum()}"
        if stage.note and step == len(stage.episode.trace):
            result = f"return {account[step].sum()}: {stage.note}"
        parts = [
            f"{'+' if earned > 0 else '-'} {letter} {abs(earned)}"
            for (letter, *_), earned in zip(_SOURCES, account[step].tolist(), strict=True)
            if earned
        ]
        sources = f"= {' '.join(parts).removeprefix('+ ')}" if parts else ""
        below = above + rasteriser.height + 1.2 * letters
        baselines = 1.2 * letters, below, below + 1.4 * letters
        for line, baseline in zip((stage.title, result, sources), baselines, strict=True):
            room = width - letters / 2
            text.write(tile, line, width / 2, baseline, letters, align="middle", room=room)
        yield tile


def _draw_legend(canvas: np.ndarray, top: int, letters: int, rewards: Rewards) -> None:
    """Draw what earns reward in a line across the canvas."""
    lines = [f"{letter} {words} {getattr(rewards, name):+}" for letter, _, words, name in _SOURCES]
    before, after = 1.9 * letters, 0.9 * letters  # room for a cell, and to the next one
    width = sum(before + text.width(line, letters) + after for line in lines) - after
    x, y = (canvas.shape[1] - width) / 2, top + 1.2 * letters
    baseline = y + 0.36 * letters
    for (_, kind, *_), line in zip(_SOURCES, lines, strict=True):
        middle = x + 0.8 * letters
        draw_marks(canvas, cell(kind, (middle, y), 0.8 * letters))
        if kind == "S":
            text.write(canvas, "S", middle, baseline, letters, align="middle")
        x += before
        text.write(canvas, line, x, baseline, letters, colours.FAINT_INK)
        x += text.width(line, letters) + after
