"""Render an episode or a colony.

Both use the policy in a file, or train one first. The extension of --out selects the file type:
.gif, .png (only the last tick) or .html, a page that plays. See `%(prog)s episode --help` for
the options of episodes.
"""

from __future__ import annotations

import argparse
from collections import deque
from collections.abc import Container, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from taichi_ants.learners.config import TrainingConfig
from taichi_ants.studies import command_line
from taichi_ants.studies.command_line import whole_number
from taichi_ants.studies.plugins import load_plugin
from taichi_ants.task import Task

if TYPE_CHECKING:
    import numpy as np

    from taichi_ants import World
    from taichi_ants.rendering.snapshots import CaptionedSnapshot

# Defaults that options change.
TASK, TRAINING = Task(), TrainingConfig("sarsa", 0.001, 0.9, 0.3, 0.99)
KINDS = {  # description and example of each subcommand
    "episode": ("render an ant with a fixed policy", "--policy my.npz --epsilon 0.1 --out ant.gif"),
    "colony": ("render many ants with the same fixed policy", "--ants 200 --out ants.gif"),
}

STOPPED = "Stopped; nothing was left behind."


def _size(text: str) -> tuple[int, int]:
    width, cross, height = text.lower().partition("x")
    if not (cross and width.isdecimal() and height.isdecimal()):
        raise argparse.ArgumentTypeError(f"{text!r} is not a size such as 1280x720")
    return int(width), int(height)


_SEED: dict[str, Any] = {"type": whole_number(), "default": 0, "metavar": "N"}
_LENGTH: dict[str, Any] = {"type": whole_number(1, 100_000), "default": 600, "metavar": "N"}
_COUNT: dict[str, Any] = {"type": whole_number(1), "metavar": "N"}
_NUMBER: dict[str, Any] = {"type": float, "metavar": "X"}
_PLAIN = {"action": "store_false", "dest": "overlay"}

# Help text and arguments of `add_argument` of each option.
OPTIONS: dict[str, tuple[str, dict[str, Any]]] = {
    "--out": ("file to write", {"metavar": "PATH"}),
    "--title": ("title of the picture or page", {"metavar": "TEXT"}),
    "--world": (command_line.WORLDS, {"default": "paper", "metavar": "WORLD"}),
    "--seed": ("seed of training and rendering", _SEED),
    "--plugin": (command_line.PLUGIN, {"metavar": "FILE"}),
    "--ants": ("number of ants", {**_COUNT, "default": 80}),
    "--follow": ("show what the ant with this number sees", {**_SEED, "default": None}),
    "--max-steps": ("step limit of the rendered episode", _LENGTH),
    "--ticks": ("ticks per episode of training and rendering", _LENGTH),
    "--epsilon": ("exploration rate while rendering", {**_NUMBER, "default": 0.0}),
    "--policy": ("policy file (.npz) to use instead of training", {"metavar": "FILE"}),
    "--episodes": ("number of training episodes", {**_COUNT, "default": 500}),
    "--size": ("width and height in pixels", {"type": _size, "metavar": "WxH"}),
    "--fps": ("frames per second", {**_NUMBER, "default": 8.0}),
    "--frame-interval": ("ticks per frame (default: 4; for a page, 1)", _COUNT),
    "--no-overlay": ("render only the world, without the panel and the marks of the view", _PLAIN),
}
_LONE, _MANY = {"--max-steps"}, {"--ants", "--follow", "--ticks", "--frame-interval"}
_OF_TRAINING = ("--episodes", "--training.", "--task.")  # unused with --policy
# Defaults of options that differ between subcommands.
_DEFAULTS: dict[str, dict[str, Any]] = {
    "episode": {"out": "results/renders/episode.gif", "size": "1280x720"},
    "colony": {
        **{"out": "results/renders/colony.gif", "size": "960x540"},
        **{"world": "open", "episodes": 60},
    },
}


def add_options(parser: command_line.Parser, flags: Container[str], **defaults: Any) -> None:
    """Add the options of `OPTIONS` in `flags`, and those of a world, a task and training."""
    for flag, (words, reading) in OPTIONS.items():
        if flag in flags:
            parser.add_argument(flag, **{"help": words, **reading})
    parser.set_defaults(**defaults)
    parser.open_settings = ("world",)
    command_line.add_settings(parser, TASK)
    command_line.add_settings(parser, TRAINING)


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    kinds = parser.add_subparsers(metavar="|".join(KINDS), required=True)
    for kind, (shows, example) in KINDS.items():
        example = f"Example: %(prog)s {example}"
        of_kind = kinds.add_parser(
            kind, help=shows, description=f"{shows.capitalize()}.", epilog=example
        )
        flags = OPTIONS.keys() - (_MANY if kind == "episode" else _LONE)
        add_options(of_kind, flags, kind=kind, **_DEFAULTS[kind])
    settings = parse(parser, arguments)
    if settings.kind == "colony" and settings.frame_interval is None:
        # A page shows the action of each ant only if it records every tick.
        settings.frame_interval = 1 if is_page(settings) else 4
    return settings


def parse(parser: command_line.Parser, arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of a command line with some of `OPTIONS`, which fit together."""
    settings, given = parser.parse_given(arguments)
    for flag in given.values():
        if flag.startswith(_OF_TRAINING) and getattr(settings, "policy", None):
            parser.error(f"{flag} configures training, but --policy replaces it, so use only one")
    return settings


def is_page(settings: argparse.Namespace) -> bool:
    """Return whether the command writes a page."""
    return Path(settings.out).suffix.lower() == ".html"


def run(settings: argparse.Namespace) -> None:
    """Write the file that the settings describe, and print a summary."""
    from taichi_ants.rendering.scene import check_size
    from taichi_ants.rendering.writers import check_animation
    from taichi_ants.viewer.page import check_page

    if is_page(settings):
        check_page(settings.out)
    else:
        check_animation(settings.out, settings.fps)
    check_size(settings.size)
    load_plugin(settings.plugin)
    draw = show_episode if settings.kind == "episode" else show_colony
    print(f"{settings.out}: {draw(settings, command_line.given_world(settings))}")


def show_episode(settings: argparse.Namespace, world: World) -> str:
    """Return a summary of an episode after writing its page, animation, or last picture."""
    from taichi_ants.errors import count
    from taichi_ants.rendering import Episode
    from taichi_ants.viewer import record_trace, save_page

    q_values, task, title = find_policy(settings, world)
    rules = {"seed": settings.seed, "max_steps": settings.max_steps, "epsilon": settings.epsilon}
    episode = Episode.play(world, q_values, task=task, **rules)
    if is_page(settings):
        save_page(settings.out, record_trace(episode.trace, title))
    else:
        _save_snapshots(settings, episode.snapshots(), len(episode), title, task)
    outcome = "delivered" if episode.delivered else "not delivered"
    rewards = int(episode.trace.rewards.sum())
    return f"{count(len(episode.trace), 'step')}, return {rewards}, {outcome}"


def show_colony(settings: argparse.Namespace, world: World) -> str:
    """Return a summary of a colony's episode after writing its page, animation, or last picture."""
    from taichi_ants import Colony
    from taichi_ants.errors import count
    from taichi_ants.rendering import colony_snapshots
    from taichi_ants.viewer import record_colony, save_page

    q_values, task, title = find_policy(settings, world)
    who = (TrainingConfig.frozen(settings.epsilon), settings.seed, settings.ants)
    colony = Colony(world, task, *who, sharing="frozen", q_values=q_values)
    colony.begin_episode()
    ticks, every, follow = settings.ticks, settings.frame_interval, settings.follow
    if is_page(settings):
        with command_line.progress_bar("Recording") as progress:
            more: dict[str, Any] = {"title": title, "follow": follow, "progress": progress}
            recording = record_colony(colony, ticks, every, **more)
        save_page(settings.out, recording)
    else:
        snapshots = colony_snapshots(colony, ticks, every, follow)
        _save_snapshots(settings, snapshots, 1 + -(-ticks // every), title, task)
    delivered = count(int(colony.outcome().deliveries.sum()), "delivery")
    return f"{count(settings.ants, 'ant')}, {count(colony.ticks, 'tick')}, {delivered}"


def find_policy(settings: argparse.Namespace, world: World) -> tuple[np.ndarray, Task, str]:
    """Return the action values (n_states, 5) to follow, their task, and a title."""
    from taichi_ants import Colony, Life, learners, load_policy, train
    from taichi_ants.errors import count

    if settings.policy:
        policy = load_policy(settings.policy)
        title = settings.title or f"Following {Path(settings.policy).name}"
        # The world of a single ant does not change: no births, deaths or regrowth.
        alone = settings.kind == "episode"
        return policy.q_values, replace(policy.task, life=Life()) if alone else policy.task, title
    config, seed, episodes = training_config(settings), settings.seed, settings.episodes
    learner = learners.registry.label(config.learner)
    title = settings.title or f"{learner} after {count(episodes, 'episode')}"
    with command_line.progress_bar("Training") as progress:
        task = given_task(settings)
        if settings.kind != "colony":
            result = train(world, config, seed, episodes, task=task, progress=progress)
            return result.q_values[0, 0], task, title
        task = replace(task, evaporation_in_training=True)
        colony = Colony(world, task, config, seed, settings.ants)
        colony.run(episodes, settings.ticks, progress)
    return colony.q_values[0], task, title


def given_task(settings: argparse.Namespace) -> Task:
    """Return the task with the given options."""
    return TASK.replace(**command_line.given_settings(settings).get("task", {}))


def training_config(settings: argparse.Namespace) -> TrainingConfig:
    """Return the training configuration with the given options."""
    return TRAINING.replace(**command_line.given_settings(settings).get("training", {}))


def _save_snapshots(
    settings: argparse.Namespace,
    snapshots: Iterable[CaptionedSnapshot],
    n: int,
    title: str,
    task: Task,
) -> None:
    from taichi_ants.rendering import frames
    from taichi_ants.rendering.writers import is_picture

    look: dict[str, Any] = {"size": settings.size, "title": title, "overlay": settings.overlay}
    look["task"] = task
    if is_picture(settings.out):
        snapshots = deque(snapshots, maxlen=1)
    save_frames(settings, frames(snapshots, **look), n)


def save_frames(settings: argparse.Namespace, pictures: Iterable[np.ndarray], n: int) -> None:
    """Write n pictures as an animation."""
    from taichi_ants.rendering import PAUSE, save_animation

    def counted() -> Iterator[np.ndarray]:
        for done, picture in enumerate(pictures, start=1):
            yield picture
            progress(done / n)

    with command_line.progress_bar("Rendering") as progress:
        save_animation(settings.out, counted(), settings.fps, pause=PAUSE)
