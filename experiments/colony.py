"""Study how colonies scale, or run one colony of any size.

`study` trains and evaluates 1 to 64 ants under several rules in several kinds of worlds with many
seeds, and writes tables, figures and findings to a folder. `live` runs a colony of any size, or
many in parallel, and can save, resume and draw it. See docs/colony_study.md.

To add rules, add entries to `RULES` (`colony_findings`) and `TASKS`. To add a kind of world, add an
entry to `WORLDS` there, and extend `place`.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read by NumPy; the training uses all cores

from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    import sys
    from collections.abc import Iterable, Mapping, Sequence
    from dataclasses import replace
    from functools import partial
    from itertools import product
    from pathlib import Path
    from typing import Any

    import numpy as np
    from colony_figures import draw_all
    from colony_findings import (
        ABC,
        ABC_SILENT,
        ABROAD,
        ALONE,
        BC,
        EVALUATION_EPSILON,
        FEW,
        JOINT,
        OF_STUDY,
        PAPER,
        QUEUES,
        RULES,
        SILENT,
        SOME,
        WORLD_KINDS,
        WORLDS,
        A,
        Condition,
        Judged,
        Measured,
        Results,
        difference_rows,
        found,
        glance,
        headlines,
        means,
        of_largest,
        on_one_screen,
        rows_of_seeds,
    )

    from taichi_ants import (
        AntsError,
        Colony,
        Life,
        Pheromone,
        Task,
        TrainingConfig,
        World,
        commands,
        files,
        learners,
        worlds,
    )
    from taichi_ants.analysis import style
    from taichi_ants.analysis.bounds.limits import limits_of
    from taichi_ants.analysis.drawings import drawings
    from taichi_ants.analysis.findings import seeds_in_words
    from taichi_ants.analysis.tables import markdown, plain_text, sentence
    from taichi_ants.errors import count
    from taichi_ants.files.results import MANIFEST, REPORT
    from taichi_ants.learners.policies import load_policy, save_policy
    from taichi_ants.measures.finished import COLONY, Run, values_of
    from taichi_ants.report.page import (
        Player,
        Shown,
        Statement,
        Statements,
        fill,
        made_facts,
        setting_facts,
    )
    from taichi_ants.studies import command_line
    from taichi_ants.studies.blocks import Blocks, Outcome
    from taichi_ants.studies.command_line import whole_number
    from taichi_ants.studies.machines import chosen
    from taichi_ants.studies.points import ColonyPoint, Progress
    from taichi_ants.studies.result_folder import work_or_show
    from taichi_ants.studies.runner import VALUE, Study
    from taichi_ants.task import foraging, paper, queueing
    from taichi_ants.viewer import record_colony

SEEDS, FIGURES, POLICIES = "seeds.csv", "figures", "policies"
QUICK = {
    **{"world_kinds": ("paper", "open", "piles"), "sizes": (1, 16, 64), "seeds": 8},
    **{"episodes": 20, "ticks": 500, "rollouts": 2},
}
# Training settings that the study sets itself.
_PLANNED = (
    *("training.epsilon_decay", "training.min_epsilon", "training.initial_q"),
    *("training.learning_rate_decay", "training.min_learning_rate"),
)
_SILENT, _LIVELY = Pheromone(deposit="none"), Life(regrowth=0)
# Trails evaporate also in training, and food grows back at once.
TASKS: dict[str, Task] = {
    rules: replace(task, evaporation_in_training=True, life=_LIVELY)
    for rules, task in {
        PAPER: paper(),
        SILENT: replace(paper(), pheromone=_SILENT),
        A: replace(paper(), pheromone=foraging().pheromone),
        BC: replace(foraging(), pheromone=paper().pheromone),
        ABC: foraging(),
        ABC_SILENT: replace(foraging(), pheromone=_SILENT),
        QUEUES: queueing(),
    }.items()
}
# Rules whose policies are also evaluated with more ants, and in other worlds, than in training.
COMPARED = (PAPER, ABC, QUEUES)
TRAINED_WITH = {ALONE: 1, FEW: 4, SOME: 16}
OPEN, LARGE_SIZE = "open", 1000
POOL, FIRST_OF_POOL = 64, 1 << 20  # number of worlds for training, and the first one's seed
EXPLORING = 0.7  # the share of training episodes in which epsilon and the learning rate decrease
OPTIMISM = 10.0  # the initial action value, above most true values
# Kinds of world in which food moves or takes time to grow back.
LIVES = {"moving": Life(regrowth=0, pile_move_interval=100), "slow": Life(regrowth=100)}
RANGES = {"small": (15, 15, 15), "wide": (60, 60, 60), "large": (100, 100, 100)}
_PILES = {"piles": 3, "moving": 3, "one_pile": 1}  # number of piles; there is no other food
SHOWN_TICKS, MOST_SHOWN = 240, 1000  # of recordings: ticks, and ants at most

# The point of each condition; conditions can share points.
Plan = dict[Condition, ColonyPoint]


def parse_arguments(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the settings of the command line of `study`."""
    main = command_line.Parser(__doc__)
    kinds = main.add_subparsers(metavar="study|live", required=True)
    about = "study colonies of several sizes, rules and worlds with many seeds"
    parser = kinds.add_parser("study", help=about, description=f"{about.capitalize()}.")
    kinds.add_parser("live", help="run one colony, or many in parallel")
    add = parser.add_argument
    text = (
        "kinds of world, explained in docs/colony_study.md; ants train in paper, open and piles, "
        "and ants trained in open are evaluated in all others"
    )
    world_kinds: dict[str, Any] = {"nargs": "+", "choices": tuple(WORLDS), "metavar": "NAME"}
    add("--world-kinds", **world_kinds, default=tuple(WORLDS), help=text)
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
    parser.open_settings, parser.own_settings = ("training",), _PLANNED
    command_line.add_settings(parser, learning())
    command_line.add_common(parser)
    command_line.add_machines(parser)
    command_line.add_results(parser, "colony")
    settings, given = main.parse_given([*arguments])
    for name in QUICK.keys() - given.keys() if settings.quick else ():
        setattr(settings, name, QUICK[name])
    settings.world_kinds = tuple(one for one in WORLDS if one in settings.world_kinds)
    settings.sizes = tuple(sorted({1, *settings.sizes}))
    settings.command = "colony"
    return command_line.with_folder(settings, "colony")


# Training, worlds and rules of each condition.


def learning() -> TrainingConfig:
    """Return the default training, without the decays, which `scheduled` adds."""
    return TrainingConfig("sarsa", 0.1, 0.9, 0.3, 1.0)


def scheduled(training: TrainingConfig, episodes: int) -> TrainingConfig:
    """Return the training with geometric decays of epsilon and of the learning rate.

    Epsilon decays to its minimum and the learning rate to a tenth in the first 70 % of the
    episodes.
    """
    exploring = max(1, round(EXPLORING * episodes))
    low = max(training.least_epsilon, 1e-6)
    return replace(
        training,
        epsilon_decay=min(1.0, (low / max(training.epsilon, low)) ** (1 / exploring)),
        learning_rate_decay=0.1 ** (1 / exploring),
        min_learning_rate=training.learning_rate / 10,
        initial_q=OPTIMISM,
    )


def task_in(world_kind: str, task: Task) -> Task:
    """Return the task with the food rules of a kind of world."""
    return replace(task, life=LIVES.get(world_kind, _LIVELY))


def place(world_kind: str, seed: int) -> World:
    """Return the world of a kind and a seed; the paper's world ignores the seed."""
    if world_kind == "paper":
        return worlds.paper()
    ranges = RANGES.get(world_kind, (30, 30, 30))
    if world_kind in _PILES:
        return worlds.far_piles(seed, ranges, piles=_PILES[world_kind])
    return worlds.open_world(seed, ranges, rock_share=0.3 if world_kind == "rocks" else 0.15)


def _drawn(world_kind: str, seeds: Iterable[int]) -> tuple[World, ...] | None:
    return None if world_kind == "paper" else tuple(place(world_kind, seed) for seed in seeds)


def plan(
    world_kinds: Sequence[str],
    sizes: Sequence[int],
    seeds: Sequence[int],
    training: TrainingConfig,
    episodes: int,
    ticks: int,
    rollouts: int,
) -> Plan:
    """Return the conditions of some kinds of world, which are names in `WORLDS`.

    `sizes` are ascending. Ants that train in one kind of world and act in another have the last
    size.

    Raises:
        AntsError: Ants cannot share a table with the learner.
    """
    if learners.get(training.learner).td_error is None:
        able = [name for name in learners.names() if learners.get(name).td_error]
        raise AntsError(
            f"learner {training.learner!r} has no TD error that can be summed over ants, which "
            f"a shared table requires; choose one of {', '.join(able)}."
        )
    training = scheduled(replace(training, min_epsilon=EVALUATION_EPSILON), episodes)
    kinds = dict.fromkeys([*world_kinds, OPEN])
    places = {world_kind: _drawn(world_kind, seeds) or worlds.paper() for world_kind in kinds}
    others = range(FIRST_OF_POOL, FIRST_OF_POOL + POOL)
    pools = {one: _drawn(one, others) for one in kinds if one in WORLD_KINDS}
    lengths: Any = {"episodes": episodes, "ticks": ticks, "rollouts": rollouts}

    def trained(world_kind: str, rules: str, ants: int) -> ColonyPoint:
        places_of = places[world_kind], TASKS[rules], training, pools[world_kind]
        return ColonyPoint(*places_of, ants, **lengths)

    conditions: Plan = {}
    for world_kind in world_kinds:
        for rules, n in product(TASKS, sizes if world_kind in WORLD_KINDS else ()):
            conditions[Condition(world_kind, rules, JOINT, n)] = trained(world_kind, rules, n)
        for rules, (regime, few), n in product(COMPARED, TRAINED_WITH.items(), sizes):
            if world_kind in WORLD_KINDS and n > few:
                after = trained(world_kind, rules, few)
                copies = replace(after, ants=n, episodes=0, after=after)
                conditions[Condition(world_kind, rules, regime, n)] = copies
        for rules in COMPARED if world_kind != OPEN else ():
            after = trained(OPEN, rules, sizes[-1])
            where: Any = {"world": places[world_kind], "task": task_in(world_kind, after.task)}
            n = LARGE_SIZE if world_kind == "large" else sizes[-1]
            abroad = replace(after, **where, pool=None, ants=n, episodes=0, after=after)
            conditions[Condition(world_kind, rules, ABROAD, abroad.ants)] = abroad
    return conditions


def greedy(point: ColonyPoint) -> ColonyPoint:
    """Return the point that evaluates the same ants without exploration."""
    calm = replace(point, evaluation_epsilon=0.0)
    return replace(calm, pool=None, episodes=0, after=point) if point.episodes else calm


def study_of(conditions: Plan, seeds: Sequence[int]) -> Study[ColonyPoint]:
    """Return the study that measures all conditions of a plan."""
    return Study((*conditions.values(), *map(greedy, conditions.values())), tuple(seeds))


# Measures.


def with_measures(points: Sequence[ColonyPoint], seeds: Sequence[int], outcome: Outcome) -> Outcome:
    """Return an outcome of one point with its measures."""
    (point,) = points
    run = Run.of_colony({n: a[0] for n, a in outcome.items()}, point.ants, point.ticks)
    values = values_of(run)
    return {**outcome, **{f"{VALUE}{name}": array[None] for name, array in values.items()}}


def take_results(
    conditions: Plan,
    asked: Study[ColonyPoint],
    folder: Path,
    runs: Mapping[str, Any],
    blocks: Blocks,
) -> None:
    """Add finished results, whose `Study.runs` were `runs`, to the blocks of a study."""
    key_of = dict(zip(asked.in_order, asked.keys, strict=True))
    names_of = dict(zip(runs["points"], runs["seeds_of"], strict=True))
    rows: dict[Condition, list[dict[str, str]]] = {}
    for row in files.read_csv(folder / SEEDS):
        where = row["world_kind"], row["rules"], row["regime"], int(row["ants"])
        rows.setdefault(Condition(*where), []).append(row)
    for condition, several in rows.items():
        point = conditions[condition]
        columns = {name: np.array([float(row[name]) for row in several]) for name in OF_STUDY}
        own = {name: columns[name] for name in COLONY}
        # Only this measure of ants that do not explore is in the results.
        calm = dict.fromkeys(own, np.full(len(several), np.nan))
        calm["deliveries"] = columns["greedy"]
        for one, values in ((point, own), (greedy(point), calm)):
            seeds = runs["seeds"][names_of[key_of[one]]]
            blocks.add([key_of[one]], seeds, {f"{VALUE}{n}": a[None] for n, a in values.items()})


def measured(
    conditions: Plan, values: Mapping[Any, Mapping[str, np.ndarray]], seeds: int
) -> Measured:
    """Return all measures, float64 (seeds,), of all conditions from those of the points.

    Bounds are nan if food moves or takes time to grow back, because no bound is known.
    """
    limits: dict[Any, list] = {}
    found = {}
    for condition, point in conditions.items():
        key = point.world, point.task.traffic, point.task.turns_at_queen
        if key not in limits:
            limits[key] = [limits_of(one, point.task) for one in point.places_of_evaluation]
        known = point.task.life == _LIVELY
        most = [one.deliveries(point.ants) if known else np.nan for one in limits[key]]
        bound, of_point = np.broadcast_to(np.array(most), seeds), values[point]
        share = of_point["deliveries"] / np.where(bound > 0, bound, np.nan)
        calm = values[greedy(point)]["deliveries"]
        found[condition] = {**of_point, "greedy": calm, "bound": bound, "bound_share": share}
    return found


# Results: tables, policies, figures, and the page.


def do_study(
    conditions: Plan,
    asked: Study[ColonyPoint],
    blocks: Path,
    folder: Path,
    draws: bool,
    progress: Progress,
    **how: Any,
) -> Results | None:
    """Return the results of a study, after writing all of their files; None for a shard.

    Computes the blocks that are missing in `blocks`; `how` has further arguments of
    `Study.in_blocks`.
    """
    arrays = asked.reduced(blocks, with_measures, progress, **how)
    if how.get("shard", (1, 1))[1] > 1:
        return None
    of_points = {p: {n: a[row] for n, a in arrays.items()} for row, p in enumerate(asked.points)}
    values = measured(conditions, of_points, len(asked.seeds))
    results = Results.of(values)
    for name, table in (
        (SEEDS, rows_of_seeds(values, asked.seeds)),
        ("conditions.csv", [one.columns() for one in results.rows]),
        ("differences.csv", difference_rows(results.judged)),
    ):
        files.write_csv(folder / name, table, list(table[0]))
    files.write_text(folder / "findings.md", markdown(found(*results)))
    files.write_text(folder / REPORT, plain_text(on_one_screen(*results), width=79))
    save_policies(conditions, asked, values, blocks, folder / POLICIES, **how)
    if draws:
        with style.all_or_none(folder / FIGURES):
            style.save_all(draw_all(results.rows), folder / FIGURES)
    return results


def save_policies(
    conditions: Plan,
    asked: Study[ColonyPoint],
    values: Measured,
    blocks: Path,
    folder: Path,
    **how: Any,
) -> None:
    """Save the policy of the median seed of each condition with joint training in `COMPARED`.

    Results that were taken over have only measures, so these runs are done again.
    """
    files.check_writable_folder(folder)
    place_of = {point: place for place, point in enumerate(asked.in_order)}
    median: dict[Condition, tuple[int, int]] = {}  # the point and the seed, by their places
    for condition, point in conditions.items():
        if condition.rules in COMPARED and condition.regime == JOINT:
            order = np.argsort(values[condition]["deliveries"], kind="stable")
            median[condition] = place_of[point], int(order[(len(asked.seeds) - 1) // 2])
    runs = np.zeros((len(asked.in_order), len(asked.seeds)), bool)
    for at in median.values():
        runs[at] = True
    asked.complete(blocks, runs, "q_values", reduce=with_measures, **how)
    saved = Blocks(blocks)
    for condition, (where, run) in median.items():
        point, name = asked.in_order[where], asked.names[where][run]
        metadata = {
            **condition._asdict(),
            **{"task": point.task.as_dict(), "training": point.training.as_dict()},
            **{"seed": asked.seeds[run], "episodes": point.episodes, "ticks": point.ticks},
            "deliveries_per_1000_ticks": values[condition]["deliveries"][run],
        }
        (q_values,) = saved.read(asked.keys[where], [name], "q_values")["q_values"]
        save_policy(policy_file(folder, condition), q_values, metadata, point.task.observation)


def policy_file(folder: Path, condition: Condition) -> Path:
    """Return the path of the policy of a condition."""
    return folder / f"{condition.world_kind}_{condition.rules}_{condition.ants}.npz"


def make_page(
    settings: argparse.Namespace,
    conditions: Plan,
    asked: Study[ColonyPoint],
    folder: Path,
    results: Results | None,
    made: Mapping[str, Any],
) -> str:
    """Return the page of the results in a folder, which are read from it if `results` is None."""
    results = results or Results.read(files.read_csv(folder / SEEDS))
    shown = not settings.no_figures
    return colony_page(
        results,
        drawings=drawings(draw_all(results.rows)) if shown else [],
        players=at_work(folder / POLICIES, conditions, asked.seeds, settings.arch) if shown else [],
        facts={**setting_facts(asked.settings()), **made_facts(made)},
        files=[path.name for path in folder.iterdir()] + [MANIFEST],
    )


def colony_page(results: Results, **parts: Any) -> str:
    """Return the page as HTML; `parts` are drawings, players, facts and files."""
    rows, judged = results
    world_kinds = {row.condition.world_kind for row in rows}
    seeds = seeds_in_words(rows[0].seeds)
    return fill(
        Path(__file__).with_name("colony.html"),
        title="Which rules and which training make a colony deliver more?",
        byline=f"{seeds}, {count(len(rows), 'condition')}, "
        f"{count(len(world_kinds), 'kind')} of world",
        seeds=seeds,
        epsilon=f"{EVALUATION_EPSILON:g}",
        worlds=[words for name, words in WORLD_KINDS.items() if name in world_kinds],
        headlines=headlines(*results),
        findings=_statements(judged),
        glance=glance(rows),
        tables=means(rows),
        **parts,
    )


def _statements(judged: Judged) -> Statements:
    lines = []
    for (world_kind, series), by_sizes in judged.items():
        unit = COLONY[series.measure].label
        told = [
            Shown(count(n, "ant") if n == less else f"{n} against {less}", one, "Difference", unit)
            for (n, less), one in by_sizes.items()
        ]
        facts = {"Question": series.question, "Difference in": unit}
        verdicts = [of_largest(by_sizes).verdict]
        statement = f"{sentence(series.statement)}."
        lines.append(Statement(statement, sentence(WORLDS[world_kind]), verdicts, facts, told))
    return Statements(("Statement", "World", "Largest colony"), lines, "statements")


def at_work(policies: Path, conditions: Plan, seeds: Sequence[int], arch: str) -> list[Player]:
    """Return recordings of the largest colony under each of the compared rules, in one world."""
    trained = [one for one in conditions if one.regime == JOINT and one.ants <= MOST_SHOWN]
    if not trained:
        return []
    world_kind = max((one.world_kind for one in trained), key=list(WORLD_KINDS).index)
    ants = max(one.ants for one in trained)
    players = []
    for rules in COMPARED:
        condition = Condition(world_kind, rules, JOINT, ants)
        point = conditions[condition]
        colony = Colony(
            *(point.places_of_evaluation[0], point.task),
            replace(point.training, epsilon=point.training.least_epsilon),
            *(seeds[0], ants),
            sharing="frozen",
            q_values=load_policy(policy_file(policies, condition)).q_values,
            arch=arch,
        )
        colony.begin_episode()
        recording = record_colony(colony, SHOWN_TICKS, title=RULES[rules])
        done = count(int(colony.outcome().deliveries.sum()), "delivery")
        words = f"{count(ants, 'ant')} in {WORLD_KINDS[world_kind]}: {done} in {SHOWN_TICKS} ticks."
        players.append(Player(sentence(RULES[rules]), words, recording))
    return players


def study(settings: argparse.Namespace) -> None:
    """Run the study, or show its results if it is finished."""
    command_line.load_plugin(settings.plugin)
    seeds = tuple(range(settings.seed, settings.seed + settings.seeds))
    lengths = settings.episodes, settings.ticks, settings.rollouts
    training = learning().replace(**command_line.given_settings(settings).get("training", {}))
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


def main(arguments: list[str] | None = None) -> None:
    """Run the study or, with `live`, one colony."""
    words = sys.argv[1:] if arguments is None else arguments
    if words[:1] == ["live"]:
        commands.run("colony", words)
    command_line.run_command(lambda: study(parse_arguments(words)), command_line.AGAIN)


if __name__ == "__main__":
    from colony import main  # so that worker processes find its functions by their module

    main()
