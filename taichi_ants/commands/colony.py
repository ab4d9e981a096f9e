"""Study how colonies scale, or run one colony of any size.

`study` trains and evaluates 1 to 64 ants under several rules in several kinds of worlds with many
seeds, and writes tables, figures and findings to a folder. `live` runs a colony of any size, or
many in parallel, and can save, resume and draw it.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from taichi_ants.learners.config import TrainingConfig
from taichi_ants.studies import command_line
from taichi_ants.studies.command_line import whole_number
from taichi_ants.studies.interruption import held, stoppable
from taichi_ants.task import Task, queueing

if TYPE_CHECKING:
    from taichi_ants import Colony
    from taichi_ants.analysis.colony.tables import Results
    from taichi_ants.learners.policies import Policy
    from taichi_ants.studies.colony_study import Plan
    from taichi_ants.studies.runner import Study

WORLD_KINDS = (
    *("paper", "open", "piles"),
    *("rocks", "one_pile", "moving", "slow", "small", "wide", "large"),
)
QUICK = {
    **{"world_kinds": ("paper", "open", "piles"), "sizes": (1, 16, 64), "seeds": 8},
    **{"episodes": 20, "ticks": 500, "rollouts": 2},
}
# Training settings that the study sets itself.
PLANNED = (
    *("training.epsilon_decay", "training.min_epsilon", "training.initial_q"),
    *("training.learning_rate_decay", "training.min_learning_rate"),
)
COUNT: dict[str, Any] = {"type": whole_number(1), "metavar": "N"}
_FILES = ("save", "render", "figure")
_OF_RESUMED = ("resume", "ticks", "frame_interval", "plugin", "threads", "arch", *_FILES)


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
    kinds = parser.add_subparsers(metavar="|".join(KINDS), required=True)
    for kind, (words, add_options) in KINDS.items():
        one = kinds.add_parser(kind, help=words, description=f"{words.capitalize()}.")
        one.set_defaults(kind=kind)
        add_options(one)
    settings, given = parser.parse_given(arguments)
    if settings.kind == "study":
        for name in QUICK.keys() - given.keys() if settings.quick else ():
            setattr(settings, name, QUICK[name])
        settings.world_kinds = tuple(one for one in WORLD_KINDS if one in settings.world_kinds)
        settings.sizes = tuple(sorted({1, *settings.sizes}))
        settings.command = "colony"
        command_line.with_folder(settings, "colony")
    else:
        _check_live(settings, given, parser.error)
    return settings


def _check_live(
    settings: argparse.Namespace, given: Mapping[str, str], error: Callable[[str], NoReturn]
) -> None:
    for name, flag in given.items():
        if settings.resume and name not in _OF_RESUMED:
            error(f"{flag} cannot change a resumed colony; leave it out")
        learns = name.startswith("training.") and name != "training.epsilon"
        if settings.sharing == "frozen" and learns:
            error(
                f"{flag} has no effect with --sharing frozen (no learning); leave one of them out"
            )
    if settings.policy and "task.observation" in given:
        error(
            "--task.observation has no effect with --policy, because the file determines the "
            "observation; leave one of them out"
        )
    if "frame_interval" in given and (
        not settings.render or settings.render.lower().endswith(".png")
    ):
        picture = settings.render or "missing"
        error(
            f"--frame-interval requires an animation, but --render is {picture}; name a .gif or "
            ".mp4 file or a folder"
        )


def _add_study(parser: command_line.Parser) -> None:
    add = parser.add_argument
    kinds = (
        "kinds of world, explained in docs/colony_study.md; ants train in paper, open and piles, "
        "and ants trained in open are evaluated in all others"
    )
    world_kinds: dict[str, Any] = {"nargs": "+", "choices": WORLD_KINDS, "metavar": "NAME"}
    add("--world-kinds", **world_kinds, default=WORLD_KINDS, help=kinds)
    several: dict[str, Any] = {"nargs": "+", "type": whole_number(1, 100_000)}
    sizes = "numbers of ants of the colonies; 1 is always included"
    add("--sizes", **several, default=(1, 4, 16, 64), metavar="N", help=sizes)
    add("--seeds", type=whole_number(1, 1000), default=20, metavar="N", help="number of seeds")
    add("--seed", type=whole_number(), default=0, metavar="N", help="first seed")
    counts: dict[str, Any] = {"type": whole_number(1, 10_000_000), "metavar": "N"}
    add("--episodes", **counts, default=60, help="number of training episodes")
    add("--ticks", **counts, default=1000, help="ticks per episode")
    add("--rollouts", **counts, default=4, help="number of evaluation episodes")
    quick = (
        f"use {QUICK['seeds']} seeds, too few for verdicts, fewer sizes, episodes and ticks, and "
        "only the kinds paper, open and piles: to see that the study runs, not for conclusions"
    )
    add("--quick", action="store_true", help=quick)
    parser.open_settings, parser.own_settings = ("training",), PLANNED
    command_line.add_settings(parser, _learning(0.3))
    command_line.add_common(parser)
    command_line.add_machines(parser)
    command_line.add_results(parser, "colony")


def _add_live(parser: command_line.Parser) -> None:
    add = parser.add_argument
    add("--ants", **COUNT, default=80, help="number of ants per colony at the start")
    ticks: dict[str, Any] = {"type": whole_number(1, 10_000_000), "metavar": "N"}
    add("--ticks", **ticks, default=1000, help="number of ticks to run")
    add(
        "--colonies", **COUNT, default=1, help="number of separate colonies, each with its own seed"
    )
    add("--seed", type=whole_number(), default=0, metavar="N", help="first seed")
    start = "place ants near the queen (nest) or anywhere (spread)"
    add("--start", choices=("nest", "spread"), default="nest", help=start)
    add("--world", default="open", metavar="WORLD", help=command_line.WORLDS)
    sharings = ("shared", "independent", "frozen")
    sharing = (
        "all ants learn into one table of action values (shared), each into its own (independent), "
        "or no ant learns (frozen)"
    )
    add("--sharing", choices=sharings, default="shared", help=sharing)
    add("--policy", metavar="FILE", help="policy file (.npz) with the action values at the start")
    capacity = (
        "largest number of living ants per colony (default: --ants, or 2 * --ants + 64 with births)"
    )
    add("--capacity", **COUNT, help=capacity)
    which = (
        "rules to start from; options such as --task.delivery change them (default: the rules in "
        "the file of --policy, or queueing)"
    )
    add("--task", choices=("paper", "foraging", "queueing"), help=which)
    add = parser.add_argument_group("files").add_argument
    add("--save", metavar="FILE", help="save the colony at the end (.npz)")
    add("--resume", metavar="FILE", help="resume a saved colony (.npz)")
    picture = "draw the last tick (.png), or an animation (.gif, .mp4, or a folder of pictures)"
    add("--render", metavar="PATH", help=picture)
    add("--frame-interval", **COUNT, default=2, help="ticks per frame of an animation")
    figure = "plot the deliveries per tick of all colonies together (.png), with the numbers (.csv)"
    add("--figure", metavar="FILE.png", help=figure)
    command_line.add_common(parser)
    parser.open_settings = ("world", "task", "training")
    command_line.add_settings(parser, queueing())
    command_line.add_settings(parser, _learning(0.1))


KINDS = {
    "study": ("study colonies of several sizes, rules and worlds with many seeds", _add_study),
    "live": ("run one colony, or many in parallel", _add_live),
}


def _learning(epsilon: float) -> TrainingConfig:
    """Return the default training, without a decay of epsilon, which the study adds."""
    return TrainingConfig("sarsa", 0.1, 0.9, epsilon, 1.0)


def training_config(settings: argparse.Namespace, epsilon: float) -> TrainingConfig:
    """Return the training with the settings of the command line."""
    return _learning(epsilon).replace(**command_line.given_settings(settings).get("training", {}))


def study(settings: argparse.Namespace) -> None:
    """Run the study, or show its results if it is finished."""
    from taichi_ants.studies.colony_study import do_study, plan, study_of, take_results
    from taichi_ants.studies.machines import chosen
    from taichi_ants.studies.result_folder import work_or_show

    seeds = tuple(range(settings.seed, settings.seed + settings.seeds))
    lengths = settings.episodes, settings.ticks, settings.rollouts
    training = training_config(settings, 0.3)
    conditions = plan(settings.world_kinds, settings.sizes, seeds, training, *lengths)
    asked = study_of(conditions, seeds)

    def work(blocks: Path, ready: Path) -> Results | None:
        bar = command_line.progress_bar
        with chosen(settings) as how, bar("study", how.get("executor")) as progress:
            shows = not settings.no_figures
            return do_study(conditions, asked, blocks, ready, shows, progress, **how)

    words = {name: getattr(settings, name) for name in ("world_kinds", "sizes")}
    page = partial(make_page, settings, conditions, asked)
    take = partial(take_results, conditions, asked)
    work_or_show(settings, {**words, **asked.settings()}, work, tuple(words), page, asked, take)


def make_page(
    settings: argparse.Namespace,
    conditions: Plan,
    asked: Study,
    folder: Path,
    results: Results | None,
    made: Mapping[str, Any],
) -> str:
    """Return the page of the results in a folder, which are read from it if `results` is None."""
    from taichi_ants import files
    from taichi_ants.analysis.colony.figures import draw_all
    from taichi_ants.analysis.colony.tables import Results
    from taichi_ants.analysis.drawings import drawings
    from taichi_ants.files.results import MANIFEST
    from taichi_ants.report.colony import at_work, colony_page
    from taichi_ants.report.page import made_facts, setting_facts
    from taichi_ants.studies.colony_study import POLICIES, SEEDS

    results = results or Results.read(files.read_csv(folder / SEEDS))
    shown = not settings.no_figures
    return colony_page(
        results.rows,
        results.judged,
        drawings=drawings(draw_all(results.rows)) if shown else [],
        players=at_work(folder / POLICIES, conditions, asked.seeds, settings.arch) if shown else [],
        facts={**setting_facts(asked.settings()), **made_facts(made)},
        files=[path.name for path in folder.iterdir()] + [MANIFEST],
    )


def live(settings: argparse.Namespace) -> None:
    """Run a colony and print a summary; a signal stops it between two ticks."""
    from taichi_ants import Colony
    from taichi_ants.studies.one_colony import check_places, live, summary

    files = settings.save, settings.render, settings.figure
    check_places(*files)
    if settings.resume:
        colony = Colony.load(settings.resume, settings.threads, arch=settings.arch)
    else:
        colony = new_colony(settings)
    begun, began = colony.ticks, time.perf_counter()
    with held() as stopped:
        with command_line.progress_bar("colony") as progress:
            live(colony, settings.ticks, progress, stopped, *files, settings.frame_interval)
        print(summary(colony, colony.ticks - begun, time.perf_counter() - began))
        for path in filter(None, files):
            print(f"Wrote {path}.")
        if stopped():
            kept = f"; use --resume {settings.save} to resume" if settings.save else ""
            raise KeyboardInterrupt(f"Stopped at tick {colony.ticks}{kept}.")


def new_colony(settings: argparse.Namespace) -> Colony:
    """Return a new colony from the settings, at the start of its episode."""
    from taichi_ants import AntsError, Colony, load_policy, worlds

    given = command_line.given_settings(settings)
    world = worlds.build(settings.world, **{"seed": settings.seed, **given.get("world", {})})
    policy = load_policy(settings.policy) if settings.policy else None
    task = rules(settings, policy)
    learns_nothing = not task.choice.needs_table
    if learns_nothing and (policy or given.get("training")):
        raise AntsError(
            f"--task.choice.rule is {task.choice.rule}, by which ants choose without learning; "
            "leave out --policy and the options of --training."
        )
    if settings.sharing == "frozen" and policy is None and not learns_nothing:
        raise AntsError(
            "--sharing frozen requires a policy; add --policy FILE, or choose another --sharing."
        )
    names = ("ants", "capacity", "start", "sharing", "threads", "arch")
    options: dict[str, Any] = {name: getattr(settings, name) for name in names}
    seeds = range(settings.seed, settings.seed + settings.colonies)
    options["q_values"] = policy.q_values if policy else None
    training = None if learns_nothing else training_config(settings, 0.1)
    if learns_nothing and settings.sharing == "shared":  # the default
        options["sharing"] = "frozen"
    colony = Colony(world, task, training, seeds, **options)
    colony.begin_episode()
    return colony


def rules(settings: argparse.Namespace, policy: Policy | None) -> Task:
    """Return the task of --task, or the policy's, or `queueing`, with settings from options."""
    named = Task.named()[settings.task] if settings.task else None
    base = named or (policy.task if policy else queueing())
    if policy:
        base = replace(base, observation=policy.observation)
    return base.replace(**command_line.given_settings(settings).get("task", {}))


def start(settings: argparse.Namespace) -> None:
    """Run the study or one colony."""
    command_line.load_plugin(settings.plugin)
    if settings.kind == "live":
        live(settings)
    else:
        with stoppable(command_line.AGAIN):
            study(settings)


def main(arguments: list[str] | None = None) -> None:
    """Run the command."""
    command_line.run_command(lambda: start(parse_arguments(arguments)))
