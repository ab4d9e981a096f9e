"""Pictures of ants: an episode, a colony, learning made visible, or a policy sheet.

Follows a policy from a file, or trains one on the spot (a colony learns together). The ending of
--out chooses the kind of file: .gif, .webp, .mp4, .png for a single picture, and without an ending
a folder of PNG pictures.
"""

from __future__ import annotations

import argparse
import signal
import sys
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

    from taichi_ants import Colony, World
    from taichi_ants.learners.config import TrainingConfig
    from taichi_ants.rendering import Stage

DEFAULT_OUT = {
    "episode": "results/renders/episode.gif",
    "colony": "results/renders/colony.gif",
    "learning": "results/renders/learning.gif",
    "sheet": "results/renders/policy_sheet.png",
}
DEFAULT_MAX_STEPS = {"episode": 600, "colony": 600, "learning": 150}
DEFAULT_SIZE = {"colony": (960, 540), "learning": (1280, 520)}  # all others: 1280 x 720
DEFAULT_EVERY = 4
DEFAULT_EPISODES = {"colony": 60}  # all others: 500
DEFAULT_PLANNING_STEPS = 5
DEFAULT_WORLD = {"colony": "open"}  # all others: the paper's, with one food for them all

_IN_WORDS = {"delivers": "delivered", "other": ""}  # all others speak for themselves

# What is shown, and whether as a single picture or moving.
_EPISODES, _COLONIES = {"a still episode", "an episode"}, {"a still colony", "a colony"}
_ROLLOUTS = _EPISODES | _COLONIES | {"learning"}
# Options that change nothing in all that is shown, by where they do.
_WHERE_IT_COUNTS: dict[str, set[str]] = {
    "policy": _EPISODES | _COLONIES | {"a sheet"},
    "episodes": _EPISODES | _COLONIES | {"a sheet"},
    "stages": {"learning"},
    "all_states": {"a sheet"},
    "greedy": _ROLLOUTS,
    "epsilon": _ROLLOUTS,
    "number": _EPISODES,
    "max_steps": _ROLLOUTS,
    "ants": _COLONIES,
    "no_evaporation": _ROLLOUTS,
    "size": _ROLLOUTS,
    "fps": {"an episode", "a colony", "learning"},
    "step": {"a still episode", "a still colony"},
    "every": {"a colony"},
    "no_hud": _EPISODES | _COLONIES,
    "no_legend": _EPISODES | _COLONIES,
    "no_view": _EPISODES,
}
_OF_TRAINING = (
    *("learner", "episodes", "learning_rate", "discount", "train_epsilon", "epsilon_decay"),
    "planning_steps",
)


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """The settings of the command line."""
    parser = Parser(__doc__.split("\n", 1)[0], epilog=__doc__.split("\n", 1)[1])
    add = parser.add_argument
    add("--show", choices=tuple(DEFAULT_OUT), default="episode", help="what to show")
    add("--world", help="paper, open, or the path of a map file (default: paper, of a colony open)")
    add(
        "--world-seed",
        type=whole_number(),
        default=0,
        metavar="N",
        help="seed of a world drawn at random",
    )
    add(
        "--seed",
        type=whole_number(),
        default=0,
        metavar="N",
        help="seed of training and of the episode",
    )
    add("--plugin", metavar="FILE", help="a Python file that registers learners or worlds")
    _add_policy(parser)
    _add_episode(parser)
    _add_picture(parser)
    settings, given = parser.parse_given(arguments)
    settings.world_seed_given = "world_seed" in given
    settings.out = settings.out or DEFAULT_OUT[settings.show]
    _refuse_what_changes_nothing(parser, settings, given)
    settings.world = settings.world or DEFAULT_WORLD.get(settings.show, "paper")
    settings.episodes = settings.episodes or DEFAULT_EPISODES.get(settings.show, 500)
    settings.max_steps = settings.max_steps or DEFAULT_MAX_STEPS.get(settings.show)
    settings.size = settings.size or _default_size(settings)
    return settings


def _refuse_what_changes_nothing(
    parser: Parser, settings: argparse.Namespace, given: dict[str, str]
) -> None:
    shown = _what_is_shown(settings)
    for name, flag in given.items():
        counts = _WHERE_IT_COUNTS.get(name, {shown})
        if shown not in counts:
            places = ", ".join(sorted(counts))
            parser.error(f"{flag} changes nothing in {shown}; leave it out (it is for {places})")
        if name in _OF_TRAINING and settings.policy:
            parser.error(f"{flag} is for training, but --policy is given; leave out one of the two")


def _what_is_shown(settings: argparse.Namespace) -> str:
    """One of the names in `_WHERE_IT_COUNTS`."""
    if settings.show in ("learning", "sheet"):
        return {"learning": "learning", "sheet": "a sheet"}[settings.show]
    if Path(settings.out).suffix.lower() == ".png":
        return f"a still {settings.show}"
    return {"episode": "an episode", "colony": "a colony"}[settings.show]


def _default_size(settings: argparse.Namespace) -> tuple[int, int]:
    """Width and height; a long animation of many ants is smaller, so that its file is."""
    if settings.show == "colony" and Path(settings.out).suffix.lower() == ".png":
        return 1280, 720
    return DEFAULT_SIZE.get(settings.show, (1280, 720))


def _add_policy(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("policy, from a file or trained on the spot")
    add = group.add_argument
    add("--policy", metavar="FILE", help="a policy file (.npz)")
    add("--learner", default="sarsa", help="name of the learner to train")
    add("--episodes", type=whole_number(1), metavar="N", help="of training, 500, of a colony 60")
    add("--learning-rate", type=number, default=0.001, metavar="X", help="in (0, 1]")
    add("--discount", type=number, default=0.9, metavar="X", help="in [0, 1]")
    add("--train-epsilon", type=number, default=0.3, metavar="X", help="in the first episode")
    add("--epsilon-decay", type=number, default=0.99, metavar="X", help="after each episode")
    add("--planning-steps", type=whole_number(1), metavar="N", help="of learners that plan")
    add(
        "--stages",
        action=ListAction,
        item=whole_number(0),
        unique=False,
        default=(0, 10, 100, 500),
        metavar="N",
        help="numbers of episodes after which --show learning looks at the ant",
    )


def _add_episode(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("episode")
    choice = group.add_mutually_exclusive_group()
    choice.add_argument("--greedy", action="store_true", help="always a best action (the default)")
    choice.add_argument(
        "--epsilon", type=number, default=0.0, metavar="X", help="probability of a random action"
    )
    add = group.add_argument
    add(
        "--number",
        type=whole_number(0),
        default=0,
        metavar="N",
        help="which of the seed's rollouts",
    )
    add(
        "--max-steps",
        type=whole_number(1, 100_000),
        metavar="N",
        help="step limit, by default 600, for --show learning 150",
    )
    add("--ants", type=whole_number(1), default=80, metavar="N", help="of a colony")
    add("--no-evaporation", action="store_true", help="trails stay as they are")


def _add_picture(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("picture")
    add = group.add_argument
    add(
        "--size",
        type=_size,
        metavar="WxH",
        help="in pixels, by default 1280x720, of learning 1280x520, of a moving colony 960x540",
    )
    add("--fps", type=number, default=8.0, metavar="X", help="steps per second")
    add("--title", help="a line above all")
    add("--step", type=whole_number(0), metavar="N", help="of a .png: which step, else the last")
    add(
        "--every",
        type=whole_number(1),
        default=DEFAULT_EVERY,
        metavar="N",
        help=f"ticks of a colony a picture, by default {DEFAULT_EVERY}",
    )
    add("--no-hud", action="store_true", help="no head-up lines")
    add("--no-legend", action="store_true", help="no legend")
    add("--all-states", action="store_true", help="a sheet of states that were not visited, too")
    add("--no-view", action="store_true", help="do not mark the cells in view")
    add("--out", metavar="PATH", help="file or folder, by default in results/renders/")


def _size(text: str) -> tuple[int, int]:
    width, cross, height = text.lower().partition("x")
    if not (cross and width.isdecimal() and height.isdecimal()):
        raise argparse.ArgumentTypeError(f"{text!r} is no size, write it as 1280x720")
    return int(width), int(height)


def show(settings: argparse.Namespace) -> None:
    """Make what was asked for, and say what it is."""
    from taichi_ants import worlds
    from taichi_ants.rendering import check_animation, check_picture, check_size

    one_picture = Path(settings.out).suffix.lower() == ".png"
    check_size(settings.size)
    if settings.show == "sheet" or (settings.show in ("episode", "colony") and one_picture):
        check_picture(settings.out)
    else:
        check_animation(settings.out, settings.fps)
    if settings.plugin:
        load_plugin(settings.plugin)
    if settings.world_seed_given:
        worlds.check_seed_counts(settings.world)
    world = worlds.build(settings.world, settings.world_seed)
    if settings.show == "learning":
        show_learning(settings, world)
        return
    if settings.show == "colony":
        show_colony(settings, world)
        return
    q_values, title = find_policy(settings, world)
    if settings.show == "sheet":
        show_sheet(settings, q_values, title)
    elif one_picture:
        show_step(settings, world, q_values, title)
    else:
        show_episode(settings, world, q_values, title)


def find_policy(settings: argparse.Namespace, world: World) -> tuple[np.ndarray, str]:
    """The action values (128, 5) to follow, and a title that says where they come from."""
    from taichi_ants import load_policy, train

    if settings.policy:
        q_values, _ = load_policy(settings.policy)
        return q_values, settings.title or f"policy {Path(settings.policy).stem}"
    with progress_bar("Training") as progress:
        result = train(
            world, training_config(settings), settings.seed, settings.episodes, progress=progress
        )
    title = f"{settings.learner} after {settings.episodes} episodes"
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


def show_episode(
    settings: argparse.Namespace, world: World, q_values: np.ndarray, title: str
) -> None:
    """Write an episode as an animation."""
    from taichi_ants.rendering import render_episode

    with progress_bar("Rendering") as progress:
        episode = render_episode(
            settings.out,
            world,
            q_values,
            **_rollout(settings),
            **_look(settings, title),
            fps=settings.fps,
            progress=progress,
        )
    outcome = "delivered" if episode.delivered else "not delivered"
    rewards = int(episode.trace.rewards.sum())
    print(f"{settings.out}: {len(episode.trace)} steps, return {rewards}, {outcome}")


def show_step(settings: argparse.Namespace, world: World, q_values: np.ndarray, title: str) -> None:
    """Write one step of an episode as a picture."""
    from taichi_ants.rendering import Episode, episode_picture, save_picture

    episode = Episode.play(world, q_values, **_rollout(settings))
    last = len(episode) - 1
    step = last if settings.step is None else settings.step
    save_picture(settings.out, episode_picture(episode, step, **_look(settings, title)))
    print(f"{settings.out}: step {step} of {last}")


def show_learning(settings: argparse.Namespace, world: World) -> None:
    """Write the same ant after more and more episodes, side by side."""
    from taichi_ants.rendering import render_learning

    stages = noted_stages(settings, world)
    title = settings.title or f"{settings.learner}: the same ant before and after learning"
    with progress_bar("Rendering") as progress:
        render_learning(
            settings.out,
            stages,
            size=settings.size,
            fps=settings.fps,
            title=title,
            progress=progress,
        )
    print(f"{settings.out}: {', '.join(stage.title for stage in stages)}")


def noted_stages(settings: argparse.Namespace, world: World) -> list[Stage]:
    """The stages of an ant that learns, each with what it does then in words."""
    from taichi_ants.analysis.behaviour import BEHAVIOURS, classify
    from taichi_ants.rendering import learning_stages

    with progress_bar("Training") as progress:
        stages = learning_stages(
            world,
            training_config(settings),
            seed=settings.seed,
            stages=settings.stages,
            max_steps=settings.max_steps,
            evaporation=not settings.no_evaporation,
            epsilon=settings.epsilon,
            progress=progress,
        )
    noted = []
    for stage in stages:
        (number,), _ = classify(stage.episode.trace, settings.max_steps)
        behaviour = BEHAVIOURS[number]
        noted.append(replace(stage, note=_IN_WORDS.get(behaviour, behaviour)))
    return noted


def show_colony(settings: argparse.Namespace, world: World) -> None:
    """Let a colony learn together, then write an episode in which it follows what it has learned.

    As a single picture, the episode is shown at its last tick, or at `--step`.
    """
    from taichi_ants.analysis.tables import count
    from taichi_ants.rendering import colony_picture, render_colony, save_picture

    colony, title = settled_colony(settings, world)
    look = {key: _look(settings, title)[key] for key in ("size", "hud", "legend", "title")}
    colony.begin_episode()
    if Path(settings.out).suffix.lower() == ".png":
        ticks = settings.max_steps if settings.step is None else settings.step
        if ticks:
            colony.tick(ticks)
        save_picture(settings.out, colony_picture(colony, **look))
    else:
        with progress_bar("Rendering") as progress:
            render_colony(
                settings.out,
                colony,
                settings.max_steps,
                every=settings.every,
                fps=settings.fps,
                progress=progress,
                **look,
            )
    delivered = count(int(colony.outcome().deliveries.sum()), "delivery")
    ants, ticks = count(settings.ants, "ant"), count(colony.ticks, "tick")
    print(f"{settings.out}: {ants}, {ticks}, {delivered}")


def settled_colony(settings: argparse.Namespace, world: World) -> tuple[Colony, str]:
    """A colony that follows a policy from a file or one that it has learned, and a title."""
    from taichi_ants import Colony, ColonyConfig, Pheromone, load_policy

    pheromone = Pheromone(evaporation="none" if settings.no_evaporation else "linear")
    life = ColonyConfig(ants=settings.ants, pheromone=pheromone)
    training = training_config(settings)
    if settings.policy:
        table, _ = load_policy(settings.policy)
        title = f"policy {Path(settings.policy).stem}"
    else:
        learning = Colony(world, life, training, settings.seed)
        with progress_bar("Training") as progress:
            learning.run(settings.episodes, settings.max_steps, progress)
        table = learning.q_values[0]
        title = f"{settings.learner}, {settings.episodes} episodes together"
    steady = replace(training, epsilon=settings.epsilon, epsilon_decay=1.0, min_epsilon=0.0)
    colony = Colony(world, life, steady, settings.seed, sharing="fixed", q_values=table)
    return colony, settings.title or title


def show_sheet(settings: argparse.Namespace, q_values: np.ndarray, title: str) -> None:
    """Write what a policy does in each state."""
    from taichi_ants.rendering import policy_sheet, save_picture

    save_picture(settings.out, policy_sheet(q_values, title, complete=settings.all_states))
    print(f"{settings.out}: the best action in each state")


def _rollout(settings: argparse.Namespace) -> dict[str, Any]:
    return {
        "seed": settings.seed,
        "number": settings.number,
        "max_steps": settings.max_steps,
        "evaporation": not settings.no_evaporation,
        "epsilon": settings.epsilon,
    }


def _look(settings: argparse.Namespace, title: str) -> dict[str, Any]:
    return {
        "size": settings.size,
        "hud": not settings.no_hud,
        "legend": not settings.no_legend,
        "view": not settings.no_view,
        "title": title,
    }


def main(arguments: list[str] | None = None) -> None:
    """The command line."""
    # A polite request to end leaves nothing behind either.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    run_command(lambda: show(parse_arguments(arguments)), "Stopped; nothing was left behind.")
