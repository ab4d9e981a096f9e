"""Many ants in one world: the scaling study of the colony, or one colony that lives for a while.

`study` trains and evaluates 1 to 1000 ants in several kinds of worlds, with ways of sharing a
policy and pheromones, over many seeds; tables, figures and findings go to a folder. `live` lets a
colony of any size live, or many side by side; it can be saved, resumed and drawn.
"""

from __future__ import annotations

import argparse
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from taichi_ants.studies.command_line import (
    BESIDE_DEFAULTS,
    ListAction,
    Parser,
    add_common,
    add_results,
    default_folder,
    load_plugin,
    notice,
    number,
    progress_bar,
    run_command,
    whole_number,
)
from taichi_ants.studies.interruption import held

if TYPE_CHECKING:
    from taichi_ants import Colony, World
    from taichi_ants.analysis.colony.study import ColonyStudy
    from taichi_ants.learners.config import TrainingConfig
    from taichi_ants.studies.colony_study import ArenaPlan, StudyPlan

KINDS = {
    "study": "The scaling study of the colony",
    "live": "One colony, or many side by side, that live for a while",
}
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
EPISODES, FIGURES = "episodes.npz", "figures"
_OF_RESUMED = ("resume", "ticks", "save", "render", "every", "plugin", "threads", "arch")


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """The settings of the command line."""
    summary, more = __doc__.split("\n", 1)
    parser = Parser(summary, epilog=more)
    kinds = parser.add_subparsers(metavar="|".join(KINDS), required=True)
    options = {"study": _add_study, "live": _add_live}
    for kind, words in KINDS.items():
        options[kind](kinds.add_parser(kind, help=words, description=f"{words}."))
    given_words = sys.argv[1:] if arguments is None else arguments
    parser.parse_args(given_words)
    chosen: Any = kinds.choices[given_words[0]]
    settings, given = chosen.parse_given(given_words[1:])
    settings.kind = given_words[0]
    if settings.kind == "study":
        usual: dict[str, Any] = QUICK if settings.quick else DEFAULTS
        for name, value in usual.items():
            if getattr(settings, name) is None:
                setattr(settings, name, value)
        settings.sizes = tuple(sorted({1, *settings.sizes}))
        settings.out = settings.out or default_folder(chosen, "colony", settings, **usual)
    elif settings.resume:
        for name, flag in given.items():
            if name not in _OF_RESUMED:
                parser.error(f"{flag} cannot change a colony that is resumed, leave it out")
    return settings


def _add_learning(parser: argparse.ArgumentParser, epsilon: float) -> None:
    add = parser.add_argument_group("learning").add_argument
    add("--learner", default="sarsa", metavar="NAME", help="name of a learner")
    add("--learning-rate", type=number, default=0.1, metavar="X", help="in (0, 1]")
    add("--discount", type=number, default=0.9, metavar="X", help="in [0, 1]")
    add("--epsilon", type=number, default=epsilon, metavar="X", help="in the first episode")
    add("--planning-steps", type=whole_number(1), metavar="N", help="of learners that plan, 5")


def _add_study(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("--arenas", action=ListAction, item=_arena, metavar="NAME", help=f"of {', '.join(ARENAS)}")
    sizes = "numbers of ants in the paper's and the open worlds (default: 1 2 4 ... 64)"
    several: dict[str, Any] = {"action": ListAction, "item": whole_number(1, 100_000)}
    add("--sizes", **several, metavar="N", help=sizes)
    add("--seeds", type=whole_number(1, 1000), metavar="N", help="how many (default: 20)")
    add("--seed", type=whole_number(), default=0, metavar="N", help="the first of them")
    counts: dict[str, Any] = {"type": whole_number(1, 10_000_000), "metavar": "N"}
    add("--episodes", **counts, help="of training (default: 50)")
    add("--ticks", **counts, help="of an episode (default: 1000)")
    add("--rollouts", **counts, help="evaluation episodes (default: 4)")
    add("--quick", action="store_true", help="fewer seeds, sizes and ticks, no large worlds")
    _add_learning(parser, 0.3)
    add_common(parser)
    add_results(parser, BESIDE_DEFAULTS.format("colony", "sizes-1-8-quick"))


def _arena(text: str) -> str:
    if text not in ARENAS:
        allowed = ", ".join(ARENAS)
        raise argparse.ArgumentTypeError(f"{text!r} is no arena, choose of {allowed}")
    return text


def _add_live(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    counts: dict[str, Any] = {"type": whole_number(1), "metavar": "N"}
    add("--ants", **counts, default=80, help="how many start")
    add("--ticks", type=whole_number(1, 10_000_000), default=1000, metavar="N", help="how long")
    add("--colonies", **counts, default=1, help="side by side, by seed")
    add("--seed", type=whole_number(), default=0, metavar="N", help="the first of them")
    start = "of ants, by the queen or anywhere"
    add("--start", choices=("nest", "spread"), default="nest", help=start)
    add("--world", default="open", metavar="NAME", help="paper, open, or the path of a map file")
    add("--ranges", type=whole_number(1), nargs=3, metavar=("X", "Y", "Z"), help="of an open world")
    add("--sharing", choices=("shared", "own", "fixed"), default="shared", help="of tables")
    add("--policy", metavar="FILE", help="a policy file to start from (.npz)")
    _add_learning(parser, 0.1)
    add = parser.add_argument_group("what comes and goes").add_argument
    add("--births", action="store_true", help="the queen turns food into ants")
    add("--capacity", **counts, help="most ants at once, with births")
    add("--lifespan", **counts, help="ticks after which an ant dies")
    add("--regrowth", type=whole_number(0), metavar="N", help="ticks until taken food is back")
    add("--wander", **counts, help="ticks until a pile of food moves")
    add = parser.add_argument_group("pheromone").add_argument
    add("--evaporation", choices=("linear", "exponential", "none"), help="(default: linear)")
    add("--half-life", type=number, metavar="X", help="ticks; trails evaporate exponentially")
    add("--diffusion", type=number, metavar="X", help="share of a trail that spreads per tick")
    add("--deposit", choices=("set", "add", "none"), help="(default: set)")
    add("--level", **counts, help="what a deposit sets or adds")
    add("--cap", **counts, help="most that deposits add up to")
    add = parser.add_argument_group("files").add_argument
    add("--save", metavar="FILE", help="keep the colony at the end (.npz)")
    add("--resume", metavar="FILE", help="go on with a colony that was saved")
    picture = "a picture of the end (.png), or an animation (.gif, .mp4, a folder)"
    add("--render", metavar="PATH", help=picture)
    add("--every", **counts, default=2, help="ticks a picture of an animation")
    add_common(parser)


def training_config(settings: argparse.Namespace, least: float) -> TrainingConfig:
    """The learner; its epsilon does not decay, but for what a study makes of it."""
    from taichi_ants import TrainingConfig

    numbers = settings.learning_rate, settings.discount, settings.epsilon
    planning = {"planning_steps": settings.planning_steps} if settings.planning_steps else {}
    return TrainingConfig(settings.learner, *numbers, 1.0, least, planning)


def build_plan(settings: argparse.Namespace) -> StudyPlan:
    """The work, checked as a whole before any of it is done."""
    from taichi_ants.studies.colony_study import StudyPlan

    seeds = tuple(range(settings.seed, settings.seed + settings.seeds))
    return StudyPlan(tuple(plan_arena(name, settings, seeds) for name in settings.arenas), seeds)


def plan_arena(name: str, settings: argparse.Namespace, seeds: tuple[int, ...]) -> ArenaPlan:
    """One kind of world; the large ones get fewer conditions and shorter training."""
    from taichi_ants import worlds
    from taichi_ants.analysis.colony import study as names
    from taichi_ants.studies.colony_study import ArenaPlan

    trained = (names.JOINT, names.THEN_JOINT, names.OWN)
    ways = {
        names.ON: (names.COPIED, names.COPIED_LONG, *trained),
        names.OFF: (names.COPIED, *trained),
        names.LASTING: (names.COPIED, *trained),
    }
    large = name == "large"
    if large:
        ways = {names.ON: (names.COPIED, *trained), names.OFF: (names.COPIED, names.JOINT)}
    ranges = {"open": OPEN_RANGES, "large": LARGE_RANGES}.get(name)
    words = {"paper": "the paper's world", "large": f"large worlds {LARGE_RANGES}"}
    return ArenaPlan(
        name=name,
        words=words.get(name, f"open worlds {OPEN_RANGES}"),
        world=tuple(worlds.open_world(s, ranges) for s in seeds) if ranges else worlds.paper(),
        sizes=LARGE_SIZES if large else settings.sizes,
        ways=ways,
        training=training_config(settings, EVALUATION_EPSILON),
        episodes=min(LARGE_EPISODES, settings.episodes) if large else settings.episodes,
        ticks=settings.ticks,
        rollouts=min(LARGE_ROLLOUTS, settings.rollouts) if large else settings.rollouts,
        long_factor=settings.sizes[-1],
    )


def study(settings: argparse.Namespace) -> None:
    """Run the study, or show the finished one."""
    from taichi_ants.studies.result_folder import work_or_show

    plan = build_plan(settings)
    pictures = {} if settings.no_figures else {FIGURES: partial(draw_figures, plan)}
    work_or_show(settings, plan.study().settings(), partial(do_study, settings, plan), pictures)


def do_study(settings: argparse.Namespace, plan: StudyPlan, blocks: Path, ready: Path) -> None:
    """All but the pictures."""
    from taichi_ants import files, save_policy
    from taichi_ants.studies.colony_study import to_arrays

    with progress_bar("study") as progress:
        outcomes = plan.study().run(blocks, settings.threads, settings.arch, progress, notice)
    found = plan.found(outcomes)
    write_tables(found, ready)
    files.write_npz(ready / EPISODES, to_arrays(found))
    policies = files.check_writable_folder(ready / "policies")
    for name, q_values, metadata in plan.median_policies(found, outcomes):
        save_policy(policies / f"{name}.npz", q_values, metadata)


def write_tables(found: ColonyStudy, folder: Path) -> None:
    """Write tables, findings and the report."""
    from taichi_ants import files
    from taichi_ants.analysis.colony import tables
    from taichi_ants.analysis.colony.contrasts import judge_all
    from taichi_ants.studies.result_folder import REPORT

    rows, judged = tables.condition_rows(found), judge_all(found)
    files.write_csv(folder / "conditions.csv", rows, tables.CONDITION_COLUMNS)
    differences = tables.difference_rows(judged)
    files.write_csv(folder / "differences.csv", differences, tables.DIFFERENCE_COLUMNS)
    files.write_text(folder / "table.md", tables.table_markdown(found, rows))
    files.write_text(folder / "findings.md", tables.findings_markdown(found, judged))
    files.write_text(folder / REPORT, tables.report_text(found, rows, judged))


def draw_figures(plan: StudyPlan, results: Path, folder: Path) -> None:
    """Draw the figures of the study in one folder into the folder `figures` of another."""
    from taichi_ants import files
    from taichi_ants.analysis.colony.figures import save_all

    save_all(plan.read(files.read_npz(results / EPISODES)), folder / FIGURES)


def live(settings: argparse.Namespace) -> None:
    """Let one colony live, then say what it did; a signal ends it at a whole tick."""
    from taichi_ants.studies.one_colony import Outputs, live, summary

    outputs = Outputs(settings.save, settings.render, settings.every)
    outputs.check()
    colony = resumed_colony(settings) if settings.resume else new_colony(settings)
    with held() as stopped:
        with progress_bar("colony") as progress:
            pace = live(colony, settings.ticks, outputs, progress, stopped)
        print(summary(colony, pace))
        for path in filter(None, (settings.save, settings.render)):
            print(f"{path} is written.")
        if stopped():
            kept = f"; --resume {settings.save} goes on from there" if settings.save else ""
            raise KeyboardInterrupt(f"Stopped at tick {colony.ticks}{kept}.")


def new_colony(settings: argparse.Namespace) -> Colony:
    """A colony at the start of its episode; deliveries do not end it, so updates look beyond."""
    from taichi_ants import AntsError, Colony, Life, Pheromone, Task, load_policy

    if settings.capacity and not settings.births:
        raise AntsError(
            "--capacity is for colonies in which ants are born; give --births too, or leave it out."
        )
    names = ("evaporation", "half_life", "diffusion", "deposit", "level", "cap")
    given = {name: getattr(settings, name) for name in names if getattr(settings, name) is not None}
    if "half_life" in given:
        given.setdefault("evaporation", "exponential")
    task = Task(
        pheromone=Pheromone(**given),
        delivery="continuing",
        evaporation_in_training=True,
        life=Life(settings.births, settings.lifespan, settings.regrowth, settings.wander),
    )
    colony = Colony(
        build_world(settings),
        task,
        training_config(settings, settings.epsilon),
        range(settings.seed, settings.seed + settings.colonies),
        ants=settings.ants,
        capacity=settings.capacity,
        start=settings.start,
        sharing=settings.sharing,
        q_values=load_policy(settings.policy)[0] if settings.policy else None,
        threads=settings.threads,
        arch=settings.arch,
    )
    colony.begin_episode()
    return colony


def build_world(settings: argparse.Namespace) -> World:
    """The world of one colony."""
    from taichi_ants import AntsError, worlds

    if settings.ranges and settings.world != "open":
        raise AntsError(f"--ranges are those of an open world, not of {settings.world!r}.")
    if settings.ranges:
        return worlds.open_world(settings.seed, settings.ranges)
    return worlds.build(settings.world, settings.seed)


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
    {"study": study, "live": live}[settings.kind](settings)


def main(arguments: list[str] | None = None) -> None:
    """The command line."""
    again = "Stopped; finished parts are kept, and the same command goes on from there."
    run_command(lambda: start(parse_arguments(arguments)), again)
