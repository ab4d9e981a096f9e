"""Pictures of ants: an episode, a colony, learning made visible, or a policy sheet.

All but learning follow a policy from a file, or one that is trained on the spot. The ending of
--out chooses the kind of file: .gif, .mp4, .png for a picture of the end, .html for a page that
plays an episode or a colony, and without an ending a folder of PNG pictures.
`%(prog)s episode --help` tells what it has to offer.
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

# Without options that change them.
TASK, TRAINING = Task(), TrainingConfig("sarsa", 0.001, 0.9, 0.3, 0.99)
KINDS = {  # what each subcommand shows, and how it is called
    "episode": ("One ant that follows a policy", "--policy my.npz --epsilon 0.1 --out ant.mp4"),
    "colony": ("Many ants that follow one policy", "--ants 200 --out ants.gif"),
    "learning": ("One ant before and after it learns, side by side", "--checkpoints 0 5 500"),
    "sheet": ("What a policy does in each state", "--policy my.npz --out sheet.png"),
}


def _size(text: str) -> tuple[int, int]:
    width, cross, height = text.lower().partition("x")
    if not (cross and width.isdecimal() and height.isdecimal()):
        raise argparse.ArgumentTypeError(f"{text!r} is no size, write it as 1280x720")
    return int(width), int(height)


_FILE = {"metavar": "FILE"}
_SEED: dict[str, Any] = {"type": whole_number(), "default": 0, "metavar": "N"}
_LENGTH: dict[str, Any] = {"type": whole_number(1, 100_000), "default": 600, "metavar": "N"}
_COUNT: dict[str, Any] = {"type": whole_number(1), "metavar": "N"}
_NUMBER: dict[str, Any] = {"type": float, "metavar": "X"}
_SEEDS: dict[str, Any] = {"type": whole_number(1, 10_000), "default": 200, "metavar": "N"}
_CHECKPOINTS = {"nargs": "+", "type": whole_number(0), "metavar": "N"}
_PLAIN = {"action": "store_false", "dest": "overlay"}

# Each option: the kinds of pictures that it is for, by their first letters, what it does, and how
# it is read.
_OPTIONS: dict[str, tuple[str, str, dict[str, Any]]] = {
    "--out": ("ecls", "file or folder", {"metavar": "PATH"}),
    "--title": ("ecls", "a line above all", {"metavar": "TEXT"}),
    "--world": ("ecls", WORLDS, {"default": "paper"}),
    "--seed": ("ecls", "seed of training and of what is shown", _SEED),
    "--seeds": ("l", "train seeds 0 to N - 1, show the median run and count the others", _SEEDS),
    "--plugin": ("ecls", "a Python file with learners, worlds, observations", _FILE),
    "--ants": ("c", "how many", {**_COUNT, "default": 80}),
    "--follow": ("c", "number of an ant whose view is shown", {**_SEED, "default": None}),
    "--max-steps": ("el", "step limit of the episode shown", _LENGTH),
    "--ticks": ("c", "length of an episode", _LENGTH),
    "--epsilon": ("ecl", "probability of a random action", {**_NUMBER, "default": 0.0}),
    "--policy": ("ecs", "a policy file (.npz); without one, it is trained", _FILE),
    "--episodes": ("ecs", "of training", {**_COUNT, "default": 500}),
    "--checkpoints": ("l", "looks at the ant after so many episodes of training", _CHECKPOINTS),
    "--size": ("ecl", "in pixels", {"type": _size, "metavar": "WxH"}),
    "--fps": ("ecl", "pictures a second", {**_NUMBER, "default": 8.0}),
    "--frame-interval": ("c", "ticks from one picture to the next", {**_COUNT, "default": None}),
    "--no-overlay": ("ec", "the world alone, without text and marks", _PLAIN),
}
_OF_TRAINING = ("--episodes", "--checkpoints", "--training.", "--task.")  # of no use to a policy
# Where a kind has defaults of its own.
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
    """The settings of the command line."""
    parser = Parser(__doc__)
    kinds = parser.add_subparsers(metavar="|".join(KINDS), required=True)
    for kind, (shows, example) in KINDS.items():
        example = f"Example: %(prog)s {example}"
        one = kinds.add_parser(kind, help=shows, description=f"{shows}.", epilog=example)
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
            parser.error(f"{flag} is of training, but --policy is trained, so leave one out")
        if flag in ("--follow", "--title") and not getattr(settings, "overlay", True):
            parser.error(f"--no-overlay leaves out what {flag} shows, so leave out one of them")
        if flag == "--seeds" and settings.seed is not None:
            parser.error(
                "--seeds chooses the seed that is shown, but --seed names it; leave one out"
            )
        if flag in ("--size", "--fps", "--no-overlay") and is_page(settings):
            parser.error(f"{flag} is of pictures, but --out names a page, so leave {flag} out")
    if settings.kind == "colony" and settings.frame_interval is None:
        # A page tells what each ant does in a tick.
        settings.frame_interval = 1 if is_page(settings) else 4
    return settings


def is_page(settings: argparse.Namespace) -> bool:
    """Whether a page is asked for, of a kind that there is one of."""
    return settings.kind in ("episode", "colony") and Path(settings.out).suffix.lower() == ".html"


def show(settings: argparse.Namespace) -> None:
    """Make what was asked for, and say what it is."""
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
    told = dict(zip(KINDS, kinds, strict=True))[settings.kind](settings, given_world(settings))
    print(f"{settings.out}: {told}")


def show_episode(settings: argparse.Namespace, world: World) -> str:
    """Write an episode as a page or an animation, or its end as a picture."""
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
    """Let a colony learn together, then write an episode in which it follows what it has learned.

    As a single picture, the episode is shown at its last tick.
    """
    from taichi_ants import Colony
    from taichi_ants.errors import count
    from taichi_ants.rendering import colony_snapshots
    from taichi_ants.viewer import record_colony, save_page

    q_values, task, title = find_policy(settings, world)
    config = replace(training_config(settings), epsilon=settings.epsilon, min_epsilon=0.0)
    who = (config, settings.seed, settings.ants)
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
    """Write the same ant after more and more episodes, side by side."""
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
    """Write what a policy does in each state."""
    from taichi_ants.rendering import policy_sheet, save_picture

    q_values, task, title = find_policy(settings, world)
    save_picture(settings.out, policy_sheet(q_values, title, task=task))
    return "the best action in each state"


def find_policy(settings: argparse.Namespace, world: World) -> tuple[np.ndarray, Task, str]:
    """The action values (n_states, 5) to follow, their task, and a title that says whence."""
    from taichi_ants import Colony, Life, learners, load_policy, train
    from taichi_ants.errors import count

    if settings.policy:
        policy = load_policy(settings.policy)
        title = settings.title or f"Following {Path(settings.policy).name}"
        # An episode is of one ant: nothing comes and goes.
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
    """The task with what options change."""
    return TASK.but(**given_settings(settings).get("task", {}))


def training_config(settings: argparse.Namespace) -> TrainingConfig:
    """Return the learner with what options change."""
    return TRAINING.but(**given_settings(settings).get("training", {}))


def noted_checkpoints(settings: argparse.Namespace, world: World) -> tuple[int, list[Checkpoint]]:
    """The seed, and the checkpoints of its ant, with its behaviour and those of other seeds."""
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
    """Write n snapshots of a task as an animation, or the last one as a picture."""
    from taichi_ants.rendering import frames, save_picture
    from taichi_ants.rendering.writers import is_picture

    look: dict[str, Any] = {"size": settings.size, "title": title, "overlay": settings.overlay}
    look["strongest"] = task.pheromone.level
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
    """The command line."""
    run_command(lambda: show(parse_arguments(arguments)), "Stopped; nothing was left behind.")
