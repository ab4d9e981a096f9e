"""Pictures of learning: the same ant at several stages of training, side by side."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np

from taichi_ants import arguments
from taichi_ants.engines.runs.training import evaluate, train
from taichi_ants.errors import AntsError, count, entries_of, expect, shown, whole
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.rendering import colours, text
from taichi_ants.rendering.rasteriser import Rasteriser, cell, draw_marks
from taichi_ants.rendering.scene import check_size
from taichi_ants.rendering.snapshots import Episode
from taichi_ants.task import Rewards, Task
from taichi_ants.task.constants import N_ACTIONS
from taichi_ants.task.events import Event
from taichi_ants.worlds.world import World

CHECKPOINTS = (0, 1, 2, 20)  # in the paper's world, behaviour differs most between these
SEEDS = 200
DEFAULT_SIZE = (1280, 520)  # four worlds in a row fill it
# Heights in multiples of the text size: a tile's title, a second line below it, all text of a tile,
# the legend.
_TITLE_LINES, _MORE_LINES, _TILE_LINES, _LEGEND_LINES = 1.7, 1.4, 5.6, 2.6
# Sources of reward: letter, letter of the cell drawn with it, label, field of `Rewards`.
_SOURCES = (
    ("T", "T", "onto a trail", "shaping"),
    ("S", "S", "nearer to the queen", "shaping"),
    ("F", "F", "food", "pick_up"),
    ("Q", "Q", "delivery", "deliver"),
    ("X", "O", "blocked, in vain", "failed"),
)


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """The behaviour of an ant after a number of training episodes."""

    episodes: int
    episode: Episode
    note: str = ""  # shown after the return at the end of the episode
    among: str = ""  # a line below the title, about other seeds

    @property
    def title(self) -> str:
        return f"after {count(self.episodes, 'episode')}" if self.episodes else "before learning"

    def account(self) -> np.ndarray:
        """Return the reward earned up to each snapshot, by `_SOURCES`, int (len(episode), 5)."""
        trace, events = self.episode.trace, self.episode.trace.events
        gave, took = events == Event.DELIVERED, events == Event.PICKED_UP
        failed = (events == Event.FAILED) | (events == Event.BLOCKED)
        carries = np.cumsum(took) > np.cumsum(gave)
        sources = np.select([failed, gave, took, carries], [4, 3, 2, 1], 0)
        earned = np.zeros((len(trace) + 1, len(_SOURCES)), dtype=np.int64)
        earned[np.arange(1, len(earned)), sources] = trace.rewards
        return earned.cumsum(axis=0)


def learning_checkpoints(
    world: World,
    config: TrainingConfig,
    *,
    seed: int = 0,
    checkpoints: Sequence[int] = CHECKPOINTS,
    max_steps: int = 150,
    task: Task | None = None,
    epsilon: float = 0.0,
    progress: Callable[[float], None] | None = None,
) -> list[Checkpoint]:
    """Return rollouts of an ant's policy, one after each given number of training episodes.

    Args:
        world, config, task: The training setup; a task of None is the paper's.
        seed: The seed of training and rollouts.
        checkpoints: Numbers of episodes, ascending; 0 is before learning.
        max_steps, epsilon: The step limit and the exploration rate of rollouts.
        progress: Called with the completed share of the work.
    """
    task, checkpoints = _checked(task, checkpoints, progress)
    played = []
    for n in checkpoints:
        table = _tables(world, config, [seed], n, task)[0]
        rules: dict[str, Any] = {"max_steps": max_steps, "task": task, "epsilon": epsilon}
        episode = Episode.play(world, table, seed=seed, **rules)
        played.append(Checkpoint(n, episode, "delivered" if episode.delivered else ""))
        if progress is not None:
            progress(len(played) / len(checkpoints))
    return played


def typical_seed(
    world: World,
    config: TrainingConfig,
    *,
    seeds: int | Sequence[int] = range(SEEDS),
    checkpoints: Sequence[int] = CHECKPOINTS,
    max_steps: int = 150,
    task: Task | None = None,
    epsilon: float = 0.0,
    progress: Callable[[float], None] | None = None,
) -> tuple[int, list[int]]:
    """Return the seed closest to the median run, and the number of seeds that deliver.

    The function ranks all seeds by the return and by the steps of their rollouts at each
    checkpoint; equal values share the mean of their ranks. It chooses the seed whose largest
    distance from the middle rank is smallest, and the first one on a tie. `seeds` are the seeds to
    choose from; other arguments and errors are those of `learning_checkpoints`.

    Returns:
        The seed, and for each checkpoint the number of seeds that deliver within `max_steps`.
    """
    task, checkpoints = _checked(task, checkpoints, progress)
    chosen = arguments.checked_seeds(seeds)
    distances, deliver = np.zeros(len(chosen)), []
    for done, n in enumerate(checkpoints, start=1):
        tables = _tables(world, config, chosen, n, task)
        outcome = evaluate(world, tables, 1, chosen, max_steps, task, epsilon)
        for values in (outcome.returns[:, 0], outcome.steps[:, 0]):
            above = np.sign(values[:, None] - values).sum(axis=1)  # 0 at the middle rank
            distances = np.maximum(distances, np.abs(above) / len(chosen))
        deliver.append(int((outcome.deliveries[:, 0] > 0).sum()))
        if progress is not None:
            progress(done / len(checkpoints))
    return int(chosen[distances.argmin()]), deliver


def _checked(
    task: Task | None, checkpoints: Sequence[int], progress: object
) -> tuple[Task, list[int]]:
    arguments.check_progress(progress)
    task = arguments.checked_lone_task(task)
    listed = entries_of(checkpoints)
    if listed is None:
        raise AntsError(
            f"checkpoints is {shown(checkpoints)}; it must be a list of numbers of episodes."
        )
    checkpoints = [whole("a checkpoint", checkpoint) for checkpoint in listed]
    if not checkpoints or checkpoints != sorted(set(checkpoints)) or checkpoints[0] < 0:
        raise AntsError(
            f"checkpoints is {shown(tuple(checkpoints))}; it must be ascending numbers, 0 or more."
        )
    return task, checkpoints


def _tables(
    world: World, config: TrainingConfig, seeds: Sequence[int], episodes: int, task: Task
) -> np.ndarray:
    """Return action values after a number of training episodes, float32 (seeds, n_states, 5)."""
    if not episodes:
        return np.zeros((len(seeds), task.n_states, N_ACTIONS), dtype=np.float32)
    return train(world, config, seeds, episodes, task=task).q_values[0]


def learning_frames(
    checkpoints: Sequence[Checkpoint], size: tuple[int, int] = DEFAULT_SIZE, title: str = ""
) -> Iterator[np.ndarray]:
    """Yield frames that show checkpoints of one world side by side, uint8 (height, width, 3).

    Shorter episodes show their last snapshot until the longest ends. `size` is width and height in
    pixels; `title` is a line of text at the top.
    """
    expect("checkpoints", checkpoints, list, tuple)
    for checkpoint in checkpoints:
        expect("a checkpoint", checkpoint, Checkpoint)
    if not checkpoints:
        raise AntsError("checkpoints is empty; give at least one checkpoint.")
    worlds = len({checkpoint.episode.made.world for checkpoint in checkpoints})
    if worlds > 1:
        raise AntsError(
            f"checkpoints has episodes in {worlds} worlds; give checkpoints of one world."
        )
    width, height = check_size(size)
    expect("title", title, str)
    canvas = np.full((height, width, 3), colours.channels(colours.PAGE))
    letters = round(min(width / 60, height / 26))
    letters *= letters >= text.SMALLEST
    top, bottom = 2 * letters * bool(title), height - round(_LEGEND_LINES * letters)
    room = width - 2 * letters
    text.write(canvas, title, width / 2, 1.5 * letters, letters, align="middle", room=room)
    if letters:
        _draw_legend(canvas, bottom, letters, checkpoints[0].episode.made.task.rewards)
    columns = math.ceil(len(checkpoints) / max(1, math.isqrt(len(checkpoints) * height // width)))
    more = _MORE_LINES * any(checkpoint.among for checkpoint in checkpoints)
    rows, lines = math.ceil(len(checkpoints) / columns), round((_TILE_LINES + more) * letters)
    w = width // columns
    # Not higher than wide, so that each title is close to its world.
    h = min((bottom - top) // rows, w + lines)
    top += (bottom - top - rows * h) // 2
    grid, margin = checkpoints[0].episode.made.world.grid, max(2, round(min(w, h) / 60))
    rasteriser = Rasteriser(grid, w, max(1, h - lines), margin)
    pictures = [
        _tile_pictures(checkpoint, rasteriser, h, letters, more) for checkpoint in checkpoints
    ]
    for _ in range(max(len(checkpoint.episode) for checkpoint in checkpoints)):
        for place, waiting in enumerate(pictures):
            x, y = place % columns * w, top + place // columns * h
            for tile in islice(waiting, 1):
                canvas[y : y + h, x : x + w] = tile
        yield canvas.copy()


def _tile_pictures(
    checkpoint: Checkpoint, rasteriser: Rasteriser, height: int, letters: int, more: float
) -> Iterator[np.ndarray]:
    """Yield pictures of one world, with the title above and the return below."""
    account, width = checkpoint.account(), rasteriser.width
    above = round((_TITLE_LINES + more) * letters)
    tile = np.empty((height, width, 3), dtype=np.uint8)
    for step, (snapshot, _) in enumerate(checkpoint.episode.snapshots()):
        tile[:] = colours.channels(colours.PAGE)
        tile[above : above + rasteriser.height] = rasteriser.draw(snapshot)
        result = f"step {step}, return {account[step].sum()}"
        if checkpoint.note and step == len(checkpoint.episode.trace):
            result += f": {checkpoint.note}"
        parts = [
            f"{'+' if earned > 0 else '-'} {letter} {abs(earned)}"
            for (letter, *_), earned in zip(_SOURCES, account[step].tolist(), strict=True)
            if earned
        ]
        sources = f"= {' '.join(parts).removeprefix('+ ')}" if parts else ""
        below = above + rasteriser.height + 1.2 * letters
        lines = (
            (checkpoint.title, 1.2 * letters),
            (checkpoint.among, (1.2 + _MORE_LINES) * letters),
            (result, below),
            (sources, below + 1.4 * letters),
        )
        for line, baseline in lines:
            room = width - letters / 2
            text.write(tile, line, width / 2, baseline, letters, align="middle", room=room)
        yield tile


def _draw_legend(canvas: np.ndarray, top: int, letters: int, rewards: Rewards) -> None:
    lines = [f"{letter} {words} {getattr(rewards, name):+}" for letter, _, words, name in _SOURCES]
    before, after = 1.9 * letters, 0.9 * letters  # pixels for the cell, and after the label
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
