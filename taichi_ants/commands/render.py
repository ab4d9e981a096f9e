"""Pictures of ants: an episode, a colony, learning made visible, or a policy sheet.

All but learning follow a policy from a file, or one that is trained on the spot. The ending of
--out chooses the kind of file: .gif, .webp, .mp4, .png for a single picture, and without an ending
a folder of PNG pictures.
"""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from taichi_ants.studies.command_line import (
    ListAction,
    Parser,
    load_plugin,
    number,
    progress_bar,
    run_command,
    whole_number,
)

if TYPE_CHECKING:
    import numpy as np

    from taichi_ants import ColonyConfig, World
    from taichi_ants.learners.config import TrainingConfig
    from taichi_ants.rendering import Stage

KINDS = {  # what each subcommand shows, and how it is called
    "episode": ("One ant that follows a policy", "--policy my.npz --epsilon 0.1 --out ant.mp4"),
    "colony": ("Many ants that follow one policy", "--ants 200 --out ants.gif"),
    "learning": ("One ant before and after it learns, side by side", "--stages 0 20 500"),
    "sheet": ("What a policy does in each state", "--policy my.npz --out sheet.png"),
}
DEFAULT_PLANNING_STEPS = 5
_SIZE, _COLONY_SIZE, _LEARNING_SIZE = (1280, 720), (960, 540), (1280, 520)

_IN_WORDS = {"delivers": "delivered", "other": ""}  # all others speak for themselves


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """The settings of the command line."""
    summary, more = __doc__.split("\n", 1)
    parser = Parser(summary, epilog=f"{more} `%(prog)s episode --help` tells what it has to offer.")
    kinds = parser.add_subparsers(metavar="|".join(KINDS), required=True)
    for name, (shows, example) in KINDS.items():
        one = kinds.add_parser(
            name, help=shows, description=f"{shows}.", epilog=f"Example: %(prog)s {example}"
        )
        _add_options(one, name)
    given = sys.argv[1:] if arguments is None else arguments
    parser.parse_args(given)
    settings, named = kinds.choices[given[0]].parse_given(given[1:])
    settings.kind, settings.world_seed_given = given[0], "world_seed" in named
    settings.still = Path(settings.out).suffix.lower() == ".png" and settings.kind != "learning"
    if settings.kind in ("episode", "colony") and settings.size is None:
        settings.size = _COLONY_SIZE if settings.kind == "colony" and not settings.still else _SIZE
    for name, flag in named.items():
        if name in _OF_TRAINING and getattr(settings, "policy", None):
            parser.error(f"{flag} is for training, but --policy is given; leave out one of the two")
        if name == "step" and not settings.still:
            parser.error(f"{flag} is for a single picture; leave it out, or let --out end in .png")
        if name in ("fps", "every") and settings.still:
            parser.error(f"{flag} is for an animation, but --out ends in .png; leave out one")
    return settings


_OF_TRAINING = (
    *("learner", "episodes", "learning_rate", "discount", "train_epsilon", "epsilon_decay"),
    "planning_steps",
)


def _add_options(parser: argparse.ArgumentParser, kind: str) -> None:
    """All options of one kind of picture."""
    colony, learning, sheet = kind == "colony", kind == "learning", kind == "sheet"
    add = parser.add_argument
    out = "policy_sheet.png" if sheet else f"{kind}.gif"
    add("--out", default=f"results/renders/{out}", metavar="PATH", help="file or folder")
    add("--title", help="a line above all")
    world = "open" if colony else "paper"
    add("--world", default=world, help="paper, open, or the path of a map file")
    seed: dict[str, Any] = {"type": whole_number(), "default": 0, "metavar": "N"}
    add("--world-seed", **seed, help="seed of a world drawn at random")
    add("--seed", **seed, help="seed of training and of what is shown")
    add("--plugin", metavar="FILE", help="a Python file that registers learners or worlds")
    if colony:
        add("--ants", type=whole_number(1), default=80, metavar="N", help="how many")
    if learning:
        stages: dict[str, Any] = {"action": ListAction, "item": whole_number(0), "unique": False}
        words = "episodes of training after which to look at the ant"
        add("--stages", **stages, default=(0, 10, 100, 500), metavar="N", help=words)
    else:
        add("--policy", metavar="FILE", help="a policy file (.npz), to train none")
    _add_training(parser, kind)
    if sheet:
        add("--all-states", action="store_true", help="also those that were not visited")
    else:
        _add_acting(parser, kind)
        _add_picture(parser, kind)


def _add_training(parser: argparse.ArgumentParser, kind: str) -> None:
    add = parser.add_argument_group("training").add_argument
    add("--learner", default="sarsa", help="name of the learner")
    if kind != "learning":
        usual = 60 if kind == "colony" else 500
        add("--episodes", type=whole_number(1), default=usual, metavar="N", help="how many")
    add("--learning-rate", type=number, default=0.001, metavar="X", help="in (0, 1]")
    add("--discount", type=number, default=0.9, metavar="X", help="in [0, 1]")
    add("--train-epsilon", type=number, default=0.3, metavar="X", help="in the first episode")
    add("--epsilon-decay", type=number, default=0.99, metavar="X", help="after each episode")
    add("--planning-steps", type=whole_number(1), metavar="N", help="of learners that plan")


def _add_acting(parser: argparse.ArgumentParser, kind: str) -> None:
    add = parser.add_argument_group("what is shown").add_argument
    steps: dict[str, Any] = {"type": whole_number(1, 100_000), "metavar": "N"}
    if kind == "colony":
        add("--ticks", **steps, default=600, help="length of an episode")
    else:
        usual = 150 if kind == "learning" else 600
        add("--max-steps", **steps, default=usual, help="step limit")
    if kind == "episode":
        words = "which of the seed's rollouts"
        add("--number", type=whole_number(0), default=0, metavar="N", help=words)
    words = "probability of a random action"
    add("--epsilon", type=number, default=0.0, metavar="X", help=words)
    add("--no-evaporation", action="store_true", help="trails stay as they are")


def _add_picture(parser: argparse.ArgumentParser, kind: str) -> None:
    add = parser.add_argument_group("picture").add_argument
    size = _LEARNING_SIZE if kind == "learning" else None
    usual = {"episode": " (1280x720)", "colony": " (960x540, a .png 1280x720)"}.get(kind, "")
    add("--size", type=_size, default=size, metavar="WxH", help=f"in pixels{usual}")
    add("--fps", type=number, default=8.0, metavar="X", help="pictures a second")
    if kind == "learning":
        return
    if kind == "colony":
        add("--every", type=whole_number(1), default=4, metavar="N", help="ticks a picture")
    else:
        add("--no-view", action="store_true", help="do not mark the cells in view")
    add("--step", type=whole_number(0), metavar="N", help="of a .png: which one, else the last")
    add("--no-hud", action="store_true", help="no head-up lines")
    add("--no-legend", action="store_true", help="no legend")


def _size(text: str) -> tuple[int, int]:
    width, cross, height = text.lower().partition("x")
    if not (cross and width.isdecimal() and height.isdecimal()):
        raise argparse.ArgumentTypeError(f"{text!r} is no size, write it as 1280x720")
    return int(width), int(height)


def show(settings: argparse.Namespace) -> None:
    """Make what was asked for, and say what it is."""
    from taichi_ants import worlds
    from taichi_ants.rendering import check_animation, check_picture, check_size

    if settings.kind != "sheet":
        check_size(settings.size)
    if settings.still or settings.kind == "sheet":
        check_picture(settings.out)
    else:
        check_animation(settings.out, settings.fps)
    if settings.plugin:
        load_plugin(settings.plugin)
    if settings.world_seed_given:
        worlds.check_seed_counts(settings.world)
    world = worlds.build(settings.world, settings.world_seed)
    kinds = (show_episode, show_colony, show_learning, show_sheet)
    dict(zip(KINDS, kinds, strict=True))[settings.kind](settings, world)


def show_episode(settings: argparse.Namespace, world: World) -> None:
    """Write an episode as an animation, or one step of it as a picture."""
    from taichi_ants.rendering import Episode, frames, save_picture

    q_values, title = find_policy(settings, world)
    episode = Episode.play(
        world, q_values, number=settings.number, max_steps=settings.max_steps, **_acting(settings)
    )
    look = {**_look(settings, title), "view": not settings.no_view}
    if settings.still:
        last = len(episode) - 1
        step = last if settings.step is None else settings.step
        save_picture(settings.out, next(frames([episode.moment(step)], **look)))
        print(f"{settings.out}: step {step} of {last}")
        return
    _save(settings, frames(episode.moments(), **look), len(episode))
    outcome = "delivered" if episode.delivered else "not delivered"
    rewards = int(episode.trace.rewards.sum())
    print(f"{settings.out}: {len(episode.trace)} steps, return {rewards}, {outcome}")


def show_colony(settings: argparse.Namespace, world: World) -> None:
    """Let a colony learn together, then write an episode in which it follows what it has learned.

    As a single picture, the episode is shown at its last tick, or at `--step`.
    """
    from taichi_ants import Colony
    from taichi_ants.analysis.markdown import count
    from taichi_ants.rendering import colony_moments, frames, save_picture

    q_values, title = find_policy(settings, world)
    config = replace(training_config(settings), epsilon=settings.epsilon, min_epsilon=0.0)
    colony = Colony(world, colony_config(settings), config, settings.seed, "fixed", q_values)
    colony.begin_episode()
    look = _look(settings, title)
    if settings.still:
        ticks = settings.ticks if settings.step is None else settings.step
        if ticks:
            colony.tick(ticks)
        save_picture(settings.out, next(frames(colony_moments(colony), **look)))
    else:
        moments = colony_moments(colony, settings.ticks, settings.every)
        _save(settings, frames(moments, **look), 1 + -(-settings.ticks // settings.every))
    delivered = count(int(colony.outcome().deliveries.sum()), "delivery")
    ants, ticks = count(settings.ants, "ant"), count(colony.ticks, "tick")
    print(f"{settings.out}: {ants}, {ticks}, {delivered}")


def show_learning(settings: argparse.Namespace, world: World) -> None:
    """Write the same ant after more and more episodes, side by side."""
    from taichi_ants.rendering import learning_frames

    stages = noted_stages(settings, world)
    title = settings.title or f"{settings.learner}: the same ant before and after learning"
    longest = max(len(stage.episode) for stage in stages)
    _save(settings, learning_frames(stages, settings.size, title), longest)
    print(f"{settings.out}: {', '.join(stage.title for stage in stages)}")


def show_sheet(settings: argparse.Namespace, world: World) -> None:
    """Write what a policy does in each state."""
    from taichi_ants.rendering import policy_sheet, save_picture

    q_values, title = find_policy(settings, world)
    save_picture(settings.out, policy_sheet(q_values, title, complete=settings.all_states))
    print(f"{settings.out}: the best action in each state")


def find_policy(settings: argparse.Namespace, world: World) -> tuple[np.ndarray, str]:
    """The action values (128, 5) to follow, and a title that says where they come from."""
    from taichi_ants import Colony, load_policy, train

    if settings.policy:
        q_values, _ = load_policy(settings.policy)
        return q_values, settings.title or f"policy {Path(settings.policy).stem}"
    config, seed, episodes = training_config(settings), settings.seed, settings.episodes
    with progress_bar("Training") as progress:
        if settings.kind == "colony":
            colony = Colony(world, colony_config(settings), config, seed)
            colony.run(episodes, settings.ticks, progress)
            title = f"{settings.learner}, {episodes} episodes together"
            return colony.q_values[0], settings.title or title
        result = train(world, config, seed, episodes, progress=progress)
    title = f"{settings.learner} after {episodes} episodes"
    return result.q_values[0, 0], settings.title or title


def training_config(settings: argparse.Namespace) -> TrainingConfig:
    from taichi_ants import TrainingConfig, learners

    planning_steps = settings.planning_steps or 0
    if not planning_steps and learners.get(settings.learner).plans:
        planning_steps = DEFAULT_PLANNING_STEPS
    return TrainingConfig(
        learner=settings.learner,
        learning_rate=settings.learning_rate,
        discount=settings.discount,
        epsilon=settings.train_epsilon,
        epsilon_decay=settings.epsilon_decay,
        planning_steps=planning_steps,
    )


def noted_stages(settings: argparse.Namespace, world: World) -> list[Stage]:
    """The stages of an ant that learns, each with what it does then in words."""
    from taichi_ants.analysis.behaviour import BEHAVIOURS, classify
    from taichi_ants.rendering import learning_stages

    with progress_bar("Training") as progress:
        stages = learning_stages(
            world,
            training_config(settings),
            stages=settings.stages,
            max_steps=settings.max_steps,
            progress=progress,
            **_acting(settings),
        )
    noted = []
    for stage in stages:
        (number,), _ = classify(stage.episode.trace, settings.max_steps)
        behaviour = BEHAVIOURS[number]
        noted.append(replace(stage, note=_IN_WORDS.get(behaviour, behaviour)))
    return noted


def colony_config(settings: argparse.Namespace) -> ColonyConfig:
    from taichi_ants import ColonyConfig, Pheromone

    pheromone = Pheromone(evaporation="none" if settings.no_evaporation else "linear")
    return ColonyConfig(ants=settings.ants, pheromone=pheromone)


def _acting(settings: argparse.Namespace) -> dict[str, Any]:
    evaporation = not settings.no_evaporation
    return {"seed": settings.seed, "evaporation": evaporation, "epsilon": settings.epsilon}


def _look(settings: argparse.Namespace, title: str) -> dict[str, Any]:
    hud, legend = not settings.no_hud, not settings.no_legend
    return {"size": settings.size, "hud": hud, "legend": legend, "title": title}


def _save(settings: argparse.Namespace, pictures: Iterable[np.ndarray], n: int) -> None:
    """Write n pictures as an animation."""
    from taichi_ants.rendering import PAUSE, save_animation

    with progress_bar("Rendering") as progress:
        options: dict[str, Any] = {"pause": PAUSE, "n": n, "progress": progress}
        save_animation(settings.out, pictures, settings.fps, **options)


def main(arguments: list[str] | None = None) -> None:
    """The command line."""
    # A polite request to end leaves nothing behind either.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    run_command(lambda: show(parse_arguments(arguments)), "Stopped; nothing was left behind.")
