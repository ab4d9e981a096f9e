"""Render an ant before and after learning, side by side.

Without --seed, the script trains many ants, each alone with its own seed, and shows the one that is
closest to the median at all --checkpoints. It writes a GIF. See docs/how-to/pictures.md.
"""

from __future__ import annotations

from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    import math
    from collections.abc import Iterator, Sequence
    from dataclasses import dataclass, replace
    from itertools import zip_longest

    import numpy as np

    from taichi_ants import TrainingConfig, World, evaluate, learners, rollout, train
    from taichi_ants.analysis.behaviour import BEHAVIOURS, DELIVERS, OTHER, classify
    from taichi_ants.commands import render
    from taichi_ants.errors import count
    from taichi_ants.rendering import Episode, colours, text
    from taichi_ants.rendering.rasteriser import Rasteriser, cell, draw_marks
    from taichi_ants.rendering.scene import check_size
    from taichi_ants.rendering.writers import check_animation
    from taichi_ants.studies.command_line import Parser, given_world, run_command, whole_number
    from taichi_ants.studies.plugins import load_plugin
    from taichi_ants.task import Rewards, Task
    from taichi_ants.task.constants import N_ACTIONS, Event

CHECKPOINTS = [0, 1, 2, 20]  # in the paper's world, behaviour differs most between these
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


@dataclass(frozen=True)
class Lessons:
    """The world, the rules of training, and the limits of the rollouts that show its progress."""

    world: World
    config: TrainingConfig
    steps: int = 150  # of a rollout, at most
    task: Task = render.TASK
    epsilon: float = 0.0

    def checkpoints(self, seed: int, after: Sequence[int]) -> list[Checkpoint]:
        """Return rollouts, one after each given number of training episodes."""
        found, how = [], (self.steps, self.task, self.epsilon)
        for n in after:
            table = self.action_values([seed], n)[0]
            episode = Episode(rollout(self.world, table, seed, 0, *how), "")
            behaviour = classify(episode.trace, self.steps)[0][0]
            delivered = "delivered" if episode.delivered else ""
            note = delivered if behaviour in (DELIVERS, OTHER) else BEHAVIOURS[behaviour]
            found.append(Checkpoint(n, episode, note))
        return found

    def typical_seed(self, seeds: Sequence[int], after: Sequence[int]) -> tuple[int, list[int]]:
        """Return the seed closest to the median run, and how many deliver at each checkpoint.

        The function ranks all seeds by the return and by the steps of their rollouts at each
        checkpoint; equal values share the mean of their ranks. It chooses the seed whose largest
        distance from the middle rank is smallest, and the first one on a tie.
        """
        distances, deliver = np.zeros(len(seeds)), []
        for n in after:
            tables, how = self.action_values(seeds, n), (self.steps, self.task, self.epsilon)
            outcome = evaluate(self.world, tables, 1, seeds, *how)
            for values in (outcome.returns[:, 0], outcome.steps[:, 0]):
                above = np.sign(values[:, None] - values).sum(axis=1)  # 0 at the middle rank
                distances = np.maximum(distances, np.abs(above) / len(seeds))
            deliver.append(int((outcome.deliveries[:, 0] > 0).sum()))
        return int(seeds[distances.argmin()]), deliver

    def action_values(self, seeds: Sequence[int], episodes: int) -> np.ndarray:
        """Return action values after training episodes, float32 (seeds, n_states, 5)."""
        if not episodes:
            return np.zeros((len(seeds), self.task.n_states, N_ACTIONS), dtype=np.float32)
        return train(self.world, self.config, seeds, episodes, task=self.task).q_values[0]


def learning_frames(
    checkpoints: Sequence[Checkpoint], size: tuple[int, int], title: str = ""
) -> Iterator[np.ndarray]:
    """Yield frames that show checkpoints of one world side by side, uint8 (height, width, 3).

    Shorter episodes show their last snapshot until the longest ends. `size` is width and height in
    pixels; `title` is a line of text at the top.
    """
    width, height = check_size(size)
    canvas = np.full((height, width, 3), colours.channels(colours.PAGE))
    letters = round(min(width / 60, height / 26))
    letters *= letters >= text.SMALLEST
    top, bottom = 2 * letters * bool(title), height - round(_LEGEND_LINES * letters)
    room = width - 2 * letters
    text.write(canvas, title, width / 2, 1.5 * letters, letters, align="middle", room=room)
    if letters:
        draw_legend(canvas, bottom, letters, checkpoints[0].episode.trace.arguments.task.rewards)
    columns = math.ceil(len(checkpoints) / max(1, math.isqrt(len(checkpoints) * height // width)))
    more = _MORE_LINES * any(checkpoint.among for checkpoint in checkpoints)
    rows, lines = math.ceil(len(checkpoints) / columns), round((_TILE_LINES + more) * letters)
    w = width // columns
    # Not higher than wide, so that each title is close to its world.
    h = min((bottom - top) // rows, w + lines)
    top += (bottom - top - rows * h) // 2
    grid, margin = checkpoints[0].episode.trace.arguments.world.grid, max(2, round(min(w, h) / 60))
    rasteriser = Rasteriser(grid, w, max(1, h - lines), margin)
    tiles = [tile_pictures(checkpoint, rasteriser, h, letters, more) for checkpoint in checkpoints]
    for present in zip_longest(*tiles):
        for place, tile in enumerate(present):
            x, y = place % columns * w, top + place // columns * h
            if tile is not None:
                canvas[y : y + h, x : x + w] = tile
        yield canvas.copy()


def tile_pictures(
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


def draw_legend(canvas: np.ndarray, top: int, letters: int, rewards: Rewards) -> None:
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


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = Parser(__doc__)
    common = ("--out", "--title", "--world", "--seed", "--plugin", "--max-steps", "--epsilon")
    defaults = {"out": "results/renders/learning.gif", "size": "1280x520", "max_steps": 150}
    render.add_options(parser, (*common, "--size", "--fps"), seed=None, **defaults)
    add = parser.add_argument
    seeds = "without --seed, train seeds 0 to N - 1 and show the median one"
    add("--seeds", type=whole_number(1, 10_000), default=200, metavar="N", help=seeds)
    more = {"nargs": "+", "type": whole_number(0), "metavar": "N", "default": CHECKPOINTS}
    add("--checkpoints", **more, help="numbers of training episodes after which to show the ant")
    settings = render.parse(parser, arguments)
    if settings.checkpoints != sorted(set(settings.checkpoints)):
        parser.error(f"--checkpoints is {settings.checkpoints}; it must be ascending numbers")
    return settings


def noted_checkpoints(settings: argparse.Namespace, world: World) -> tuple[int, list[Checkpoint]]:
    """Return the seed, and its checkpoints with notes on other seeds."""
    seed, among = settings.seed, [""] * len(settings.checkpoints)
    given = settings.max_steps, render.given_task(settings), settings.epsilon
    lessons = Lessons(world, render.training_config(settings), *given)
    if seed is None:
        seeds = range(settings.seeds)
        seed, deliver = lessons.typical_seed(seeds, settings.checkpoints)
        if len(seeds) > 1:
            among = [f"{n} of {len(seeds)} ants deliver{'s' * (n == 1)}" for n in deliver]
    found = lessons.checkpoints(seed, settings.checkpoints)
    return seed, [replace(one, among=others) for one, others in zip(found, among, strict=True)]


def show(settings: argparse.Namespace) -> None:
    """Write the animation, and print a summary."""
    check_animation(settings.out, settings.fps)
    check_size(settings.size)
    load_plugin(settings.plugin)
    seed, checkpoints = noted_checkpoints(settings, given_world(settings))
    ant = "an ant" if settings.seed is not None else f"the median of {count(settings.seeds, 'ant')}"
    learner = learners.registry.label(render.training_config(settings).learner)
    title = settings.title or f"{learner}: {ant} before and after learning"
    longest = max(len(checkpoint.episode) for checkpoint in checkpoints)
    render.save_frames(settings, learning_frames(checkpoints, settings.size, title), longest)
    told = [f"{one.title}{f' ({one.among})' if one.among else ''}" for one in checkpoints]
    print(f"{settings.out}: seed {seed}, {', '.join(told)}")


if __name__ == "__main__":
    run_command(lambda: show(parse_arguments()), "Stopped; nothing was left behind.")
