"""Run one colony of any size, or many in parallel; save, resume and draw it.

`live` is the one kind of run. The study of colonies is a script, `experiments/colony.py`.
"""

from __future__ import annotations

import argparse
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING, Any

from taichi_ants.errors import AntsError, count
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.studies import command_line
from taichi_ants.studies.command_line import whole_number
from taichi_ants.studies.interruption import held
from taichi_ants.studies.plugins import load_plugin
from taichi_ants.task import Task, queueing

if TYPE_CHECKING:
    from taichi_ants import Colony
    from taichi_ants.learners.policies import Policy

_LEARNING = TrainingConfig("sarsa", 0.1, 0.9, 0.1, 1.0)  # the default
FRAMES_PER_SECOND = 12.0
_PIECE_SECONDS = 0.2
COUNT: dict[str, Any] = {"type": whole_number(1), "metavar": "N"}
_OF_RESUMED = ("resume", "ticks", "frame_interval", "plugin", "threads", "arch", "save", "render")


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    main = command_line.Parser(__doc__)
    kinds = main.add_subparsers(metavar="live", required=True)
    about = "run one colony, or many in parallel"
    parser = kinds.add_parser("live", help=about, description=f"{about.capitalize()}.")
    add = parser.add_argument
    add("--ants", **COUNT, default=80, help="number of ants per colony at the start")
    ticks: dict[str, Any] = {"type": whole_number(1, 10_000_000), "metavar": "N"}
    add("--ticks", **ticks, default=1000, help="number of ticks to run")
    colonies = "number of separate colonies, each with its own seed"
    add("--colonies", **COUNT, default=1, help=colonies)
    add("--seed", type=whole_number(), default=0, metavar="N", help="first seed")
    start = "place ants near the queen (nest) or anywhere (spread)"
    add("--start", choices=("nest", "spread"), default="nest", help=start)
    add("--world", default="open", metavar="WORLD", help=command_line.WORLDS)
    sharing = (
        "all ants learn into one table of action values (shared), each into its own (independent), "
        "or no ant learns (frozen)"
    )
    sharings = ("shared", "independent", "frozen")
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
    picture = "draw the last tick (.png), or an animation (.gif)"
    add("--render", metavar="PATH", help=picture)
    add("--frame-interval", **COUNT, default=2, help="ticks per frame of an animation")
    command_line.add_common(parser)
    parser.open_settings = ("world",)
    command_line.add_settings(parser, queueing())
    command_line.add_settings(parser, _LEARNING)

    settings, given = main.parse_given(arguments)
    for name, flag in given.items():
        learns = name.startswith("training.") and name != "training.epsilon"
        if settings.resume and name not in _OF_RESUMED:
            main.error(f"{flag} cannot change a resumed colony; leave it out")
        if settings.sharing == "frozen" and learns:
            main.error(f"{flag} has no effect with --sharing frozen; leave one of them out")
        if settings.policy and name == "task.observation":
            main.error(f"the file of --policy determines the observation; leave out {flag}")
    return settings


def run(settings: argparse.Namespace) -> None:
    """Run a colony and print a summary; a signal stops it between two ticks."""
    from taichi_ants import Colony
    from taichi_ants.files import check_writable_file
    from taichi_ants.rendering.writers import check_animation

    load_plugin(settings.plugin)
    files = settings.save, settings.render
    if settings.render is not None:
        check_animation(settings.render, FRAMES_PER_SECOND)
    if settings.save is not None:
        check_writable_file(settings.save)
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
    from taichi_ants import Colony, load_policy, worlds

    given = command_line.given_settings(settings)
    world = worlds.build(settings.world, **{"seed": settings.seed, **given.get("world", {})})
    policy = load_policy(settings.policy) if settings.policy else None
    task = rules(settings, policy)
    training = given.get("training", {})
    learns = task.needs_table or bool(policy or training)
    names = ("ants", "capacity", "start", "sharing", "threads", "arch")
    options: dict[str, Any] = {name: getattr(settings, name) for name in names}
    seeds = range(settings.seed, settings.seed + settings.colonies)
    options["q_values"] = policy.q_values if policy else None
    config = _LEARNING.replace(**training) if learns else None
    if not learns and settings.sharing == "shared":  # the default
        options["sharing"] = "frozen"
    colony = Colony(world, task, config, seeds, **options)
    colony.begin_episode()
    return colony


def rules(settings: argparse.Namespace, policy: Policy | None) -> Task:
    """Return the task of --task, or the policy's, or `queueing`, with settings from options."""
    named = Task.named()[settings.task] if settings.task else None
    base = named or (policy.task if policy else queueing())
    if policy:
        base = replace(base, observation=policy.observation)
    return base.replace(**command_line.given_settings(settings).get("task", {}))


def live(
    colony: Colony,
    ticks: int,
    progress: Callable[[float], None],
    stopped: Callable[[], bool],
    save: str | None = None,
    render: str | None = None,
    frame_interval: int = 2,
) -> None:
    """Run a colony for `ticks` ticks, or until `stopped()` is true, and write its files.

    `save` is the file of the colony, which is saved even if drawing fails. `render` is a picture
    (.png) of the end, or an animation (.gif).
    """
    from taichi_ants.rendering import colony_snapshots, frames, save_animation
    from taichi_ants.rendering.writers import is_picture

    still = render is None or is_picture(render)
    passing = _pieces(colony, ticks, progress, stopped, ticks if still else frame_interval)
    shown: Iterable[Any] = (s for _ in chain([0], passing) for s in colony_snapshots(colony))
    error: Exception | None = None
    try:
        if still:
            shown = deque(shown, maxlen=1)
        if render is not None:
            save_animation(render, frames(shown, task=colony.task), FRAMES_PER_SECOND)
    except (AntsError, OSError) as raised:
        error = raised  # the colony is intact, because drawing happens between ticks
    if save is not None:
        colony.save(save)
    if error is not None:
        raise error


def _pieces(
    colony: Colony,
    ticks: int,
    progress: Callable[[float], None],
    stopped: Callable[[], bool],
    interval: int,
) -> Iterator[int]:
    """Run a colony in short pieces, so that it can be stopped between them.

    Yields after every `interval` ticks and at the end.
    """
    piece, passed = 1, 0
    while passed < ticks and not stopped():
        began = time.perf_counter()
        now = min(piece, ticks - passed, interval - passed % interval)
        colony.tick(now)
        passed += now
        piece = max(1, piece // 2) if time.perf_counter() - began > _PIECE_SECONDS else 2 * piece
        progress(passed / ticks)
        if passed % interval == 0:
            yield passed
    if passed % interval:
        yield passed


def summary(colony: Colony, ticks: int, seconds: float) -> str:
    """Return a summary of two lines for a run of `ticks` ticks that took `seconds`."""
    outcome = {name: int(array.sum()) for name, array in colony.outcome().counts().items()}
    blocked = 100 * outcome["blocked"] / max(1, outcome["moves"])
    changes = [count(outcome[f"{n}s"], n) for n in ("birth", "death") if outcome[f"{n}s"]]
    changes += [f"{outcome['regrown']} regrown"] if outcome["regrown"] else []
    colonies = f" in {len(colony.seeds):,} colonies" if len(colony.seeds) > 1 else ""
    living = f"{outcome['living']:,} ant{'s' if outcome['living'] != 1 else ''}{colonies}"
    return (
        f"{living}, {count(ticks, 'tick')} in {seconds:.1f} s.\n"
        f"{count(outcome['deliveries'], 'delivery')} by tick {colony.ticks}, "
        f"{', '.join([f'{blocked:.1f} % of the moves blocked', *changes])}."
    )
