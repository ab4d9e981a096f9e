"""The scaling study of the colony, or one colony of any size.

Without --ants or --resume: from 1 to 1000 ants, ways of sharing a policy and pheromones are trained
and evaluated in the paper's world and in open ones, over many seeds; tables, figures and findings
go to a folder. With --ants: a colony, or many side by side, lives for a while; it can be saved,
resumed and drawn.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from taichi_ants.studies.command_line import (
    ListAction,
    Parser,
    default_folder,
    load_plugin,
    notice,
    number,
    progress_bar,
    run_command,
    whole_number,
)

if TYPE_CHECKING:
    from taichi_ants import Colony, World
    from taichi_ants.analysis.colony.study import ColonyStudy
    from taichi_ants.learners.config import TrainingConfig
    from taichi_ants.studies.colony_study import ArenaPlan, StudyPlan
    from taichi_ants.studies.result_folder import ResultFolder

ARENAS = ("paper", "open", "large")
OPEN_RANGES, LARGE_RANGES = (30, 30, 30), (100, 100, 100)
LARGE_SIZES, LARGE_EPISODES, LARGE_ROLLOUTS = (1, 10, 100, 1000), 10, 2
QUICK = {
    "arenas": ("paper", "open"),
    "sizes": (1, 4, 16, 64),
    "seeds": 8,
    "episodes": 20,
    "ticks": 500,
    "rollouts": 2,
}
DEFAULTS = {
    "arenas": ARENAS,
    "sizes": (1, 2, 4, 8, 16, 32, 64),
    "seeds": 20,
    "episodes": 50,
    "ticks": 1000,
    "rollouts": 4,
}
EVALUATION_EPSILON = 0.01
PLANNING_STEPS = 5
REPORT, EPISODES, FIGURES = "report.txt", "episodes.npz", "figures"


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """The settings of the command line."""
    parser = Parser(__doc__.split("\n", 1)[0], epilog=__doc__.split("\n", 1)[1])
    add = parser.add_argument
    seed = add("--seed", type=whole_number(), default=0, metavar="N", help="the (first) seed")
    add("--ticks", type=whole_number(1, 10_000_000), metavar="N", help="of an episode, 1000")
    add("--plugin", metavar="FILE", help="a Python file that registers learners or worlds")
    add("--threads", type=whole_number(1, 1024), metavar="N", help="CPU threads (default: all)")
    add("--arch", choices=("cpu", "cuda"), default="cpu", help="where kernels run")
    groups = (_add_learning, _add_study, _add_colony, _add_files)
    learning, study, life, files = (add_group(parser) for add_group in groups)
    settings, given = parser.parse_given(arguments)
    settings.single = settings.ants is not None or settings.resume is not None

    def refuse(reason: str, actions: Iterable[argparse.Action]) -> None:
        """What was given of these is an error."""
        for action in actions:
            if action.dest in given:
                parser.error(f"{given[action.dest]} {reason}")

    if settings.resume:
        refuse("cannot change a colony that is resumed, leave it out", [seed, *life, *learning])
    if settings.single:
        refuse("is for the study, not for one colony", study)
    else:
        refuse("is for one colony, give --ants", [*life, *files])
    if "capacity" in given and not settings.births:
        parser.error("--capacity is for colonies in which ants are born, give --births too")
    _fill_in(parser, settings)
    return settings


def _fill_in(parser: Parser, settings: argparse.Namespace) -> None:
    """What was not given: for the study its defaults, or those of --quick."""
    if settings.single:
        settings.ticks = settings.ticks or DEFAULTS["ticks"]
        settings.epsilon = 0.1 if settings.epsilon is None else settings.epsilon
        return
    for name, value in (QUICK if settings.quick else DEFAULTS).items():
        if getattr(settings, name) is None:
            setattr(settings, name, value)
    settings.epsilon = 0.3 if settings.epsilon is None else settings.epsilon
    settings.sizes = tuple(sorted({1, *settings.sizes}))
    if settings.out is None:
        usual = {"epsilon": 0.3, **(QUICK if settings.quick else DEFAULTS)}
        settings.out = default_folder(parser, "colony", settings, **usual)


def _add_learning(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    group = parser.add_argument_group("learning")
    add = group.add_argument
    add("--learner", default="sarsa", metavar="NAME", help="name of a learner")
    add("--learning-rate", type=number, default=0.1, metavar="X", help="in (0, 1]")
    add("--discount", type=number, default=0.9, metavar="X", help="in [0, 1]")
    add("--epsilon", type=number, metavar="X", help="in a first episode 0.3, of one colony 0.1")
    add("--planning-steps", type=whole_number(1), metavar="N", help="of learners that plan, 5")
    return group._group_actions


def _add_study(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    group = parser.add_argument_group("study")
    add = group.add_argument
    add("--arenas", action=ListAction, item=_arena, metavar="NAME", help=f"of {', '.join(ARENAS)}")
    add(
        "--sizes",
        action=ListAction,
        item=whole_number(1, 100_000),
        metavar="N",
        help="numbers of ants in the paper's and the open worlds (default: 1 2 4 ... 64)",
    )
    add("--seeds", type=whole_number(1, 1000), metavar="N", help="how many (default: 20)")
    add("--episodes", type=whole_number(1), metavar="N", help="of training (default: 50)")
    add("--rollouts", type=whole_number(1), metavar="N", help="evaluation episodes (default: 4)")
    out = (
        "for the results (default: results/colony, and behind it what differs from the defaults, "
        "as in results/colony-sizes-1-8-quick)"
    )
    add("--out", type=Path, metavar="FOLDER", help=out)
    add("--quick", action="store_true", help="fewer seeds, sizes and ticks, no large worlds")
    add("--force", action="store_true", help="replace what FOLDER holds")
    add("--no-figures", action="store_true", help="draw no figures")
    return group._group_actions


def _add_colony(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    group = parser.add_argument_group("one colony")
    add = group.add_argument
    add("--ants", type=whole_number(1), metavar="N", help="how many start")
    add("--colonies", type=whole_number(1), metavar="N", help="side by side, by seed (default: 1)")
    add(
        "--start",
        choices=("nest", "spread"),
        help="of ants, by the queen or anywhere (default: nest)",
    )
    add("--ranges", type=whole_number(1), nargs=3, metavar=("X", "Y", "Z"), help="of an open world")
    add("--world", metavar="NAME", help="paper, open, or the path of a map file (default: open)")
    add("--sharing", choices=("shared", "own", "fixed"), help="of tables (default: shared)")
    add("--policy", metavar="FILE", help="a policy file to start from (.npz)")
    add("--births", action="store_true", help="the queen turns food into ants")
    add("--capacity", type=whole_number(1), metavar="N", help="most ants at once, with births")
    add("--lifespan", type=whole_number(1), metavar="N", help="ticks after which an ant dies")
    add("--regrowth", type=whole_number(0), metavar="N", help="ticks until taken food is back")
    add("--wander", type=whole_number(1), metavar="N", help="ticks until a pile of food moves")
    add("--evaporation", choices=("linear", "exponential", "none"), help="(default: linear)")
    add("--half-life", type=number, metavar="X", help="ticks; trails evaporate exponentially")
    add("--diffusion", type=number, metavar="X", help="share of a trail that spreads per tick")
    add("--deposit", choices=("set", "add", "none"), help="(default: set)")
    add("--level", type=whole_number(1), metavar="N", help="what a deposit sets or adds")
    add("--cap", type=whole_number(1), metavar="N", help="most that deposits add up to")
    return group._group_actions


def _add_files(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    group = parser.add_argument_group("files of one colony")
    add = group.add_argument
    add("--save", metavar="FILE", help="to keep the colony in, at the end, on Ctrl-C or SIGTERM")
    add("--resume", metavar="FILE", help="a colony that was saved; it lives on for --ticks more")
    add("--render", metavar="FILE", help="a .png of the end, or a .gif, .webp or .mp4 of all")
    add("--every", type=whole_number(1), default=2, metavar="N", help="ticks of a picture")
    return group._group_actions


def _arena(text: str) -> str:
    if text not in ARENAS:
        raise argparse.ArgumentTypeError(f"{text!r} is no arena, choose of {', '.join(ARENAS)}")
    return text


def training_config(settings: argparse.Namespace, least: float) -> TrainingConfig:
    """The learner; deliveries do not end an episode, so updates look beyond them."""
    from taichi_ants import TrainingConfig, learners

    plans = learners.get(settings.learner).plans
    return TrainingConfig(
        settings.learner,
        settings.learning_rate,
        settings.discount,
        settings.epsilon,
        epsilon_decay=1.0,
        min_epsilon=least,
        planning_steps=(settings.planning_steps or PLANNING_STEPS) if plans else 0,
        delivery="continuing",
    )


def build_plan(settings: argparse.Namespace) -> StudyPlan:
    """The work, checked as a whole before any of it is done."""
    from taichi_ants.studies.colony_study import StudyPlan

    training = training_config(settings, EVALUATION_EPSILON)
    return StudyPlan(tuple(plan_arena(name, settings) for name in settings.arenas), training)


def plan_arena(name: str, settings: argparse.Namespace) -> ArenaPlan:
    """One kind of world; the large ones get fewer conditions and shorter training."""
    from taichi_ants import worlds
    from taichi_ants.analysis.colony import study as names
    from taichi_ants.studies.colony_study import ArenaPlan

    seeds = tuple(range(settings.seed, settings.seed + settings.seeds))
    trained = (names.JOINT, names.THEN_JOINT, names.OWN)
    ways = {
        names.ON: (names.COPIED, names.COPIED_LONG, *trained),
        names.OFF: (names.COPIED, *trained),
        names.LASTING: (names.COPIED, *trained),
    }
    if name == "large":
        ways = {names.ON: (names.COPIED, *trained), names.OFF: (names.COPIED, names.JOINT)}
    ranges = {"open": OPEN_RANGES, "large": LARGE_RANGES}.get(name)
    words = {"paper": "the paper's world", "large": f"large worlds {LARGE_RANGES}"}
    large = name == "large"
    return ArenaPlan(
        name=name,
        words=words.get(name, f"open worlds {OPEN_RANGES}"),
        worlds=tuple(worlds.open_world(s, ranges) if ranges else worlds.paper() for s in seeds),
        seeds=seeds,
        sizes=LARGE_SIZES if large else settings.sizes,
        ways=ways,
        episodes=min(LARGE_EPISODES, settings.episodes) if large else settings.episodes,
        ticks=settings.ticks,
        rollouts=min(LARGE_ROLLOUTS, settings.rollouts) if large else settings.rollouts,
        long_factor=settings.sizes[-1],
    )


def study(settings: argparse.Namespace) -> None:
    """Run the study, or show the finished one."""
    from taichi_ants.files import file_hash
    from taichi_ants.studies.colony_study import settings_of
    from taichi_ants.studies.provenance import provenance
    from taichi_ants.studies.result_folder import ResultFolder

    plan = build_plan(settings)
    plugin = file_hash(settings.plugin) if settings.plugin else None
    folder = ResultFolder(
        settings.out, {**settings_of(plan), "arch": settings.arch, "plugin": plugin}
    )
    if folder.is_finished() and not settings.force:
        show_finished(settings, plan, folder)
        return
    began = time.perf_counter()
    with folder.work(settings.force) as (blocks, ready):
        do_study(settings, plan, blocks, ready)
        seconds = time.perf_counter() - began
        folder.publish({**provenance(sys.argv), "seconds": seconds})
    print((settings.out / REPORT).read_text("utf-8"))
    print(f"{seconds:.1f} s; everything is in {settings.out}/")


def do_study(settings: argparse.Namespace, plan: StudyPlan, blocks: Path, ready: Path) -> None:
    """All the work, and all files but the manifest."""
    from taichi_ants import files, save_policy
    from taichi_ants.analysis.colony import figures
    from taichi_ants.studies.colony_study import median_policies, run_study, to_arrays

    with progress_bar("study") as progress:
        found, tables = run_study(plan, blocks, settings.threads, settings.arch, progress, notice)
    write_tables(found, ready)
    files.write_npz(ready / EPISODES, to_arrays(found.records))
    policies = files.check_writable_folder(ready / "policies")
    for name, q_values, metadata in median_policies(plan, found, tables):
        save_policy(policies / f"{name}.npz", q_values, metadata)
    if not settings.no_figures:
        figures.save_all(found, ready / FIGURES)


def write_tables(found: ColonyStudy, folder: Path) -> None:
    """Write tables, findings and the report."""
    from taichi_ants import files
    from taichi_ants.analysis.colony import tables
    from taichi_ants.analysis.colony.contrasts import judge_all

    rows, judged = tables.condition_rows(found), judge_all(found)
    files.write_csv(folder / "conditions.csv", rows, tables.CONDITION_COLUMNS)
    differences = tables.difference_rows(judged)
    files.write_csv(folder / "differences.csv", differences, tables.DIFFERENCE_COLUMNS)
    files.write_text(folder / "table.md", tables.table_markdown(found, rows))
    files.write_text(folder / "findings.md", tables.findings_markdown(found, judged))
    files.write_text(folder / REPORT, tables.report_text(found, rows, judged))


def show_finished(settings: argparse.Namespace, plan: StudyPlan, folder: ResultFolder) -> None:
    """Print the report of a finished study; draw figures that were left out."""
    from taichi_ants import files
    from taichi_ants.analysis.colony import figures
    from taichi_ants.studies.colony_study import from_arrays

    folder.check_whole(apart_from=(FIGURES,))
    print(files.read_text(settings.out / REPORT))
    if not settings.no_figures and folder.lacks(FIGURES):
        found = from_arrays(plan, files.read_npz(settings.out / EPISODES))
        with folder.addition() as place:
            figures.save_all(found, place / FIGURES)
    print(f"{settings.out}/ holds this study already; --force runs it again.")


def one_colony(settings: argparse.Namespace) -> None:
    """Let one colony live, then say what it did."""
    from taichi_ants.studies.one_colony import Outputs, live, summary

    outputs = Outputs(settings.save, settings.render, settings.every)
    outputs.check()
    colony = resumed_colony(settings) if settings.resume else new_colony(settings)
    with progress_bar("colony") as progress:
        pace, stop_signal = live(colony, settings.ticks, outputs, progress)
    print(summary(colony, pace))
    for path in filter(None, (settings.save, settings.render)):
        print(f"{path} is written.")
    if stop_signal:
        kept = f"; --resume {settings.save} goes on from there" if settings.save else ""
        print(f"Stopped at tick {colony.ticks}{kept}.", file=sys.stderr)
        sys.exit(128 + stop_signal)


def new_colony(settings: argparse.Namespace) -> Colony:
    """A colony at the start of its episode."""
    from taichi_ants import Colony, ColonyConfig, Pheromone, load_policy

    names = ("evaporation", "half_life", "diffusion", "deposit", "level", "cap")
    given = {name: getattr(settings, name) for name in names if getattr(settings, name) is not None}
    if "half_life" in given:
        given.setdefault("evaporation", "exponential")
    life = ColonyConfig(
        settings.ants,
        settings.capacity,
        Pheromone(**given),
        settings.births,
        settings.lifespan,
        settings.regrowth,
        settings.wander,
        start=settings.start or "nest",
    )
    colony = Colony(
        build_world(settings),
        life,
        training_config(settings, settings.epsilon),
        range(settings.seed, settings.seed + (settings.colonies or 1)),
        settings.sharing or "shared",
        load_policy(settings.policy)[0] if settings.policy else None,
        settings.threads,
        arch=settings.arch,
    )
    colony.begin_episode()
    return colony


def build_world(settings: argparse.Namespace) -> World:
    """The world of one colony."""
    from taichi_ants import AntsError, worlds

    if settings.ranges and settings.world not in (None, "open"):
        raise AntsError(f"--ranges are those of an open world, not of {settings.world!r}.")
    if settings.ranges:
        return worlds.open_world(settings.seed, settings.ranges)
    return worlds.build(settings.world or "open", settings.seed)


def resumed_colony(settings: argparse.Namespace) -> Colony:
    """A colony that was saved."""
    from taichi_ants import AntsError, Colony

    colony = Colony.load(settings.resume, settings.threads, arch=settings.arch)
    if colony.episode < 0:
        raise AntsError(
            f"the colony in {settings.resume!r} has not begun an episode; run it first."
        )
    return colony


def start(settings: argparse.Namespace) -> None:
    """The study, or one colony."""
    if settings.plugin:
        load_plugin(settings.plugin)
    if settings.single:
        one_colony(settings)
    else:
        study(settings)


def main(arguments: list[str] | None = None) -> None:
    """The command line."""
    again = "Stopped; finished parts are kept, and the same command goes on from there."
    run_command(lambda: start(parse_arguments(arguments)), again)
