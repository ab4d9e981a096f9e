"""Render an episode, a colony, an ant that learns, or a policy sheet.

Episodes, colonies and sheets use the policy in a file, or train one first. The extension of --out
selects the file type: .gif, .mp4, .png (only the last tick) or .html, a page that plays an episode
or a colony. Without an extension, --out is a folder of PNG pictures. See `%(prog)s episode --help`
for the options of episodes.
"""

from __future__ import annotations

import argparse
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from taichi_ants.learners.config import TrainingConfig
from taichi_ants.studies.command_line import (
    PLUGIN,
    WORLDS,
    Parser,
    add_settings,
    given_settings,
    given_world,
    load_plugin,
    progress_bar,
    run_command,
    whole_number,
)
from taichi_ants.task import Task

if TYPE_CHECKING:
    import numpy as np

    from taichi_ants import World
    from taichi_ants.rendering import Checkpoint
    from taichi_ants.rendering.snapshots import CaptionedSnapshot

# Defaults that options change.
TASK, TRAINING = Task(), TrainingConfig("sarsa", 0.001, 0.9, 0.3, 0.99)
KINDS = {  # description and example of each subcommand
    "episode": ("render an ant with a fixed policy", "--policy my.npz --epsilon 0.1 --out ant.mp4"),
    "colony": ("render many ants with the same fixed policy", "--ants 200 --out ants.gif"),
    "learning": ("render an ant before and after learning, side by side", "--checkpoints 0 5 500"),
    "sheet": ("render a table of the best action in each state", "--policy my.npz --out sheet.png"),
}


def _size(text: str) -> tuple[int, int]:
    width, cross, height = text.lower().partition("x")
    if not (cross and width.isdecimal() and height.isdecimal()):
        raise argparse.ArgumentTypeError(f"{text!r} is not a size such as 1280x720")
    return int(width), int(height)


_FILE = {"metavar": "FILE"}
_SEED: dict[str, Any] = {"type": whole_number(), "default": 0, "metavar": "N"}
_LENGTH: dict[str, Any] = {"type": whole_number(1, 100_000), "default": 600, "metavar": "N"}
_COUNT: dict[str, Any] = {"type": whole_number(1), "metavar": "N"}
_NUMBER: dict[str, Any] = {"type": float, "metavar": "X"}
_SEEDS: dict[str, Any] = {"type": whole_number(1, 10_000), "default": 200, "metavar": "N"}
_CHECKPOINTS = {"nargs": "+", "type": whole_number(0), "metavar": "N"}
_PLAIN = {"action": "store_false", "dest": "overlay"}

# Each option: first letters of its subcommands, help text, arguments of `add_argument`.
_OPTIONS: dict[str, tuple[str, str, dict[str, Any]]] = {
    "--out": ("ecls", "file or folder to write", {"metavar": "PATH"}),
    "--title": ("ecls", "title of the picture or page", {"metavar": "TEXT"}),
    "--world": ("ecls", WORLDS, {"default": "paper", "metavar": "WORLD"}),
    "--seed": ("ecls", "seed of training and rendering", _SEED),
    "--seeds": (
        "l",
        "without --seed, train seeds 0 to N - 1 and show the median one",
        _SEEDS,
    ),
    "--plugin": ("ecls", PLUGIN, _FILE),
    "--ants": ("c", "number of ants", {**_COUNT, "default": 80}),
    "--follow": ("c", "show what the ant with this number sees", {**_SEED, "default": None}),
    "--max-steps": ("el", "step limit of the rendered episode", _LENGTH),
    "--ticks": ("c", "ticks per episode of training and rendering", _LENGTH),
    "--epsilon": ("ecl", "exploration rate while rendering", {**_NUMBER, "default": 0.0}),
    "--policy": ("ecs", "policy file (.npz) to use instead of training", _FILE),
    "--episodes": ("ecs", "number of training episodes", {**_COUNT, "default": 500}),
    "--checkpoints": (
        "l",
        "numbers of training episodes after which to show the ant",
        _CHECKPOINTS,
    ),
    "--size": ("ecl", "width and height in pixels", {"type": _size, "metavar": "WxH"}),
    "--fps": ("ecl", "frames per second", {**_NUMBER, "default": 8.0}),
    "--frame-interval": ("c", "ticks per frame (default: 4; for a page, 1)", _COUNT),
    "--no-overlay": (
        "ec",
        "render only the world, without the panel and the marks of the view",
        _PLAIN,
    ),
}
_OF_TRAINING = ("--episodes", "--checkpoints", "--training.", "--task.")  # unused with --policy
# Defaults of options that differ between subcommands.
_DEFAULTS: dict[str, dict[str, Any]] = {
    "episode": {"out": "results/renders/episode.gif", "size": "1280x720"},
    "colony": {
        **{"out": "results/renders/colony.gif", "size": "960x540"},
        **{"world": "open", "episodes": 60},
    },
    "learning": {
        **{"out": "results/renders/learning.gif", "size": "1280x520"},
        **{"max_steps": 150, "checkpoints": (0, 1, 2, 20), "seed": None},
    },
    "sheet": {"out": "results/renders/policy_sheet.png"},
}


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = Parser(__doc__)
    kinds = parser.add_subparsers(metavar="|".join(KINDS), required=True)
    for kind, (shows, example) in KINDS.items():
        example = f"Example: %(prog)s {example}"
        one = kinds.add_parser(
            kind, help=shows, description=f"{shows.capitalize()}.", epilog=example
        )
        for flag, (where, words, reading) in _OPTIONS.items():
            if kind[0] in where:
                one.add_argument(flag, **{"help": words, **reading})
        one.set_defaults(kind=kind, **_DEFAULTS[kind])
        one.open_settings = ("world", "task", "training")
        add_settings(one, TASK)
        add_settings(one, TRAINING)
    settings, given = parser.parse_given(arguments)
    for flag in given.values():
        if flag.startswith(_OF_TRAINING) and getattr(settings, "policy", None):
            parser.error(f"{flag} configures training, but --policy replaces it, so use only one")
        if flag in ("--follow", "--title") and not getattr(settings, "overlay", True):
            parser.error(f"{flag} has no effect with --no-overlay, so use only one")
        if flag == "--seeds" and settings.seed is not None:
            parser.error("--seeds selects the seed to show, but --seed sets it, so use only one")
        if flag in ("--size", "--fps", "--no-overlay") and is_page(settings):
            parser.error(f"{flag} has no effect on a page, so leave it out or write a .gif file")
    if settings.kind == "colony" and settings.frame_interval is None:
        # A page shows the action of each ant only if it records every tick.
        settings.frame_interval = 1 if is_page(settings) else 4
    return settings


def is_page(settings: argparse.Namespace) -> bool:
    """Return whether the command writes a page, which exists for episodes and colonies."""
    return settings.kind in ("episode", "colony") and Path(settings.out).suffix.lower() == ".html"


def show(settings: argparse.Namespace) -> None:
    """Write the file that the settings describe, and print a summary."""
    from taichi_ants.rendering import check_animation, check_picture
    from taichi_ants.rendering.scene import check_size
    from taichi_ants.rendering.writers import is_picture
    from taichi_ants.viewer import check_page

    if is_page(settings):
        check_page(settings.out)
    elif settings.kind == "sheet" or (settings.kind != "learning" and is_picture(settings.out)):
        check_picture(settings.out)
    else:
        check_animation(settings.out, settings.fps)
    if settings.kind != "sheet":
        check_size(settings.size)
    load_plugin(settings.plugin)
    kinds = (show_episode, show_colony, show_learning, show_sheet)
    summary = dict(zip(KINDS, kinds, strict=True))[settings.kind](settings, given_world(settings))
    print(f"{settings.out}: {summary}")


def show_episode(settings: argparse.Namespace, world: World) -> str:
    """Return a summary of an episode after writing its page, animation, or last picture."""
    from taichi_ants.errors import count
    from taichi_ants.rendering import Episode
    from taichi_ants.viewer import record_episode, save_page

    q_values, task, title = find_policy(settings, world)
    rules = {"seed": settings.seed, "max_steps": settings.max_steps, "epsilon": settings.epsilon}
    episode = Episode.play(world, q_values, task=task, **rules)
    if is_page(settings):
        save_page(settings.out, record_episode(episode, title))
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
        with progress_bar("Recording") as progress:
            more: dict[str, Any] = {"title": title, "follow": follow, "progress": progress}
            recording = record_colony(colony, ticks, every, **more)
        save_page(settings.out, recording)
    else:
        snapshots = colony_snapshots(colony, ticks, every, follow)
        _save_snapshots(settings, snapshots, 1 + -(-ticks // every), title, task)
    delivered = count(int(colony.outcome().deliveries.sum()), "delivery")
    return f"{count(settings.ants, 'ant')}, {count(colony.ticks, 'tick')}, {delivered}"


def show_learning(settings: argparse.Namespace, world: World) -> str:
    """Return a summary of the checkpoints of an ant after writing their animation."""
    from taichi_ants import learners
    from taichi_ants.errors import count
    from taichi_ants.rendering import learning_frames

    seed, checkpoints = noted_checkpoints(settings, world)
    ant = "an ant" if settings.seed is not None else f"the median of {count(settings.seeds, 'ant')}"
    learner = learners.label(training_config(settings).learner)
    title = settings.title or f"{learner}: {ant} before and after learning"
    longest = max(len(checkpoint.episode) for checkpoint in checkpoints)
    _save(settings, learning_frames(checkpoints, settings.size, title), longest)
    told = [f"{one.title}{f' ({one.among})' if one.among else ''}" for one in checkpoints]
    return f"seed {seed}, {', '.join(told)}"


def show_sheet(settings: argparse.Namespace, world: World) -> str:
    """Return a summary of a policy sheet after writing it."""
    from taichi_ants.rendering import policy_sheet, save_picture

    q_values, task, title = find_policy(settings, world)
    save_picture(settings.out, policy_sheet(q_values, title, task=task))
    return "the best action in each state"


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
    title = settings.title or f"{learners.label(config.learner)} after {count(episodes, 'episode')}"
    with progress_bar("Training") as progress:
        task = _task(settings)
        if settings.kind != "colony":
            result = train(world, config, seed, episodes, task=task, progress=progress)
            return result.q_values[0, 0], task, title
        task = replace(task, evaporation_in_training=True)
        colony = Colony(world, task, config, seed, settings.ants)
        colony.run(episodes, settings.ticks, progress)
    return colony.q_values[0], task, title


def _task(settings: argparse.Namespace) -> Task:
    return TASK.replace(**given_settings(settings).get("task", {}))


def training_config(settings: argparse.Namespace) -> TrainingConfig:
    """Return the training configuration with the given options."""
    return TRAINING.replace(**given_settings(settings).get("training", {}))


def noted_checkpoints(settings: argparse.Namespace, world: World) -> tuple[int, list[Checkpoint]]:
    """Return the seed, and its checkpoints with notes on their behaviour and on other seeds."""
    from taichi_ants.analysis.behaviour import BEHAVIOURS, DELIVERS, OTHER, classify
    from taichi_ants.rendering import learning_checkpoints, typical_seed

    seed, among = settings.seed, [""] * len(settings.checkpoints)
    given = (world, training_config(settings))
    what: dict[str, Any] = {"checkpoints": settings.checkpoints, "task": _task(settings)}
    what |= {"max_steps": settings.max_steps, "epsilon": settings.epsilon}
    with progress_bar("Training") as progress:
        what["progress"] = progress
        if seed is None:
            seed, deliver = typical_seed(*given, seeds=range(settings.seeds), **what)
            if settings.seeds > 1:
                among = [f"{n} of {settings.seeds} ants deliver{'s' * (n == 1)}" for n in deliver]
        checkpoints = learning_checkpoints(*given, seed=seed, **what)
    noted = []
    for checkpoint, others in zip(checkpoints, among, strict=True):
        number = classify(checkpoint.episode.trace, settings.max_steps)[0][0]
        note = checkpoint.note if number in (DELIVERS, OTHER) else BEHAVIOURS[number]
        noted.append(replace(checkpoint, note=note, among=others))
    return seed, noted


def _save_snapshots(
    settings: argparse.Namespace,
    snapshots: Iterable[CaptionedSnapshot],
    n: int,
    title: str,
    task: Task,
) -> None:
    from taichi_ants.rendering import frames, save_picture
    from taichi_ants.rendering.writers import is_picture

    look: dict[str, Any] = {"size": settings.size, "title": title, "overlay": settings.overlay}
    look["task"] = task
    if is_picture(settings.out):
        last = deque(snapshots, maxlen=1)
        save_picture(settings.out, next(frames(last, **look)))
    else:
        _save(settings, frames(snapshots, **look), n)


def _save(settings: argparse.Namespace, pictures: Iterable[np.ndarray], n: int) -> None:
    """Write n pictures as an animation."""
    from taichi_ants.rendering import PAUSE, save_animation

    def counted() -> Iterator[np.ndarray]:
        for done, picture in enumerate(pictures, start=1):
            yield picture
            progress(done / n)

    with progress_bar("Rendering") as progress:
        save_animation(settings.out, counted(), settings.fps, pause=PAUSE)


def main(arguments: list[str] | None = None) -> None:
    """Run the command line."""
    run_command(lambda: show(parse_arguments(arguments)), "Stopped; nothing was left behind.")
