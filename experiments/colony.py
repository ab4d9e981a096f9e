"""Study how colonies scale, or run one colony of any size.

`study` trains and evaluates 1 to 64 ants under several rules in several kinds of worlds with many
seeds, and writes tables, figures and findings to a folder. `live` runs a colony of any size, or
many in parallel, and can save, resume and draw it. See docs/results/foraging.md.

To add rules, name them in `colony_series.toml`, and add an entry to `TASKS`. To add a kind of
world, name it there, and extend `world_of`.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read by NumPy; the training uses all cores

from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    import sys
    from collections.abc import Mapping, Sequence
    from dataclasses import dataclass, replace
    from functools import partial
    from itertools import product
    from pathlib import Path
    from typing import Any

    import colony_findings as study
    import numpy as np
    import published
    from colony_figures import draw_all
    from colony_findings import JOINT, WORLD_KINDS, WORLDS, Condition
    from colony_limits import limits_of

    from taichi_ants import AntsError, Colony, TrainingConfig, commands, files, learners, worlds
    from taichi_ants.analysis.drawings import drawings
    from taichi_ants.analysis.tables import plain_text, sentence
    from taichi_ants.errors import count
    from taichi_ants.learners.policies import save_policy
    from taichi_ants.measures.finished import COLONY
    from taichi_ants.report import page
    from taichi_ants.settings import nested
    from taichi_ants.studies import command_line
    from taichi_ants.studies.command import planned, run_study
    from taichi_ants.studies.command_line import whole_number
    from taichi_ants.studies.folder import MANIFEST, PAGE, REPORT
    from taichi_ants.studies.folder import Results as Runs
    from taichi_ants.studies.points import ColonyPoint, Drawn, settings_of
    from taichi_ants.studies.study import Study
    from taichi_ants.studies.sweep import measured
    from taichi_ants.task import Life, Pheromone, Task, foraging, paper, queueing
    from taichi_ants.viewer import record_colony
    from taichi_ants.worlds import World

VERSION = 1  # of the arrays that are kept of each run
LEARNING = TrainingConfig("sarsa", 0.1, 0.9, 0.3, 1.0)  # without the decays that `scheduled` adds
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
        study.PAPER: paper(),
        study.SILENT: replace(paper(), pheromone=_SILENT),
        study.A: replace(paper(), pheromone=foraging().pheromone),
        study.BC: replace(foraging(), pheromone=paper().pheromone),
        study.ABC: foraging(),
        study.ABC_SILENT: replace(foraging(), pheromone=_SILENT),
        study.QUEUES: queueing(),
    }.items()
}
# Rules whose policies are also evaluated with more ants, and in other worlds, than in training.
COMPARED = (study.PAPER, study.ABC, study.QUEUES)
TRAINED_WITH = {study.ALONE: 1, study.FEW: 4, study.SOME: 16}
OPEN, LARGE_SIZE = "open", 1000
_POOL = range(1 << 20, (1 << 20) + 64)  # seeds of the worlds for training
EXPLORING = 0.7  # the share of training episodes in which epsilon and the learning rate decrease
OPTIMISM = 10.0  # the initial action value, above most true values
# Kinds of world in which food moves or takes time to grow back.
LIVES = {"moving": Life(regrowth=0, pile_move_interval=100), "slow": Life(regrowth=100)}
RANGES = {"small": (15, 15, 15), "wide": (60, 60, 60), "large": (100, 100, 100)}
_PILES = {"piles": 3, "moving": 3, "one_pile": 1}  # number of piles; there is no other food
SHOWN_TICKS, MOST_SHOWN = 240, 1000  # of recordings: ticks, and ants at most

# The point of each condition; conditions can share points.
Conditions = dict[Condition, ColonyPoint]


def parse_arguments(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the settings of the command line of `study`."""
    main = command_line.Parser(__doc__)
    kinds = main.add_subparsers(metavar="study|live", required=True)
    about = "study colonies of several sizes, rules and worlds with many seeds"
    parser = kinds.add_parser("study", help=about, description=f"{about.capitalize()}.")
    kinds.add_parser("live", help="run one colony, or many in parallel")
    add = parser.add_argument
    text = (
        "kinds of world (see docs/results/foraging.md); ants train in paper, open and piles, and "
        "ants trained in open are evaluated in all others"
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
    parser.open_settings, parser.own_settings = ("training",), _PLANNED
    command_line.add_settings(parser, LEARNING)
    command_line.add_study(parser, "colony", quick)
    settings, given = main.parse_given([*arguments])
    for name in QUICK.keys() - given.keys() if settings.quick else ():
        setattr(settings, name, QUICK[name])
    settings.world_kinds = tuple(one for one in WORLDS if one in settings.world_kinds)
    settings.sizes = tuple(sorted({1, *settings.sizes}))
    return command_line.with_folder(settings, "colony")


# Training, worlds and rules of each condition.


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


def world_of(world_kind: str) -> World | Drawn:
    """Return the world of a kind, or the recipe of one for each seed."""
    if world_kind == "paper":
        return worlds.paper()
    ranges = RANGES.get(world_kind, (30, 30, 30))
    if world_kind in _PILES:
        return Drawn.by("far_piles", ranges=ranges, piles=_PILES[world_kind])
    return Drawn.by("open", ranges=ranges, rock_share=0.3 if world_kind == "rocks" else 0.15)


@dataclass(frozen=True)
class Plan:
    """The study, and the point of each condition."""

    study: Study
    conditions: Conditions


def plan(options: Mapping[str, Any]) -> Plan:
    """Return the study; AntsError if ants cannot share a table with the learner.

    It evaluates all conditions with and without exploration.
    """
    given = nested({path: value for path, value in options.items() if "." in path})
    training = LEARNING.replace(**given.get("training", {}))
    if learners.get(training.learner).td_error is None:
        able = [name for name in learners.names() if learners.get(name).td_error]
        raise AntsError(
            f"learner {training.learner!r} has no TD error that can be summed over ants, which "
            f"a shared table requires; choose one of {', '.join(able)}."
        )
    training = replace(training, min_epsilon=study.EVALUATION_EPSILON)
    training = scheduled(training, options["episodes"])
    names = "episodes", "ticks", "rollouts"
    several = tuple(options["world_kinds"]), tuple(options["sizes"])
    conditions = conditions_of(*several, training, **{name: options[name] for name in names})
    seeds = tuple(range(options["seed"], options["seed"] + options["seeds"]))
    points = *conditions.values(), *map(greedy, conditions.values())
    measures = tuple(COLONY)
    return Plan(Study(points, seeds, measures, partial(measured, "colony", measures)), conditions)


def conditions_of(
    world_kinds: Sequence[str], sizes: Sequence[int], training: TrainingConfig, **lengths: Any
) -> Conditions:
    """Return the conditions of some kinds of world, which are names in `WORLDS`.

    `sizes` are ascending. Ants that train in one kind of world and act in another have the last
    size.
    """
    kinds = dict.fromkeys([*world_kinds, OPEN])
    places = {world_kind: world_of(world_kind) for world_kind in kinds}
    pools: dict[str, tuple[World, ...] | None] = {}  # for training; None in the paper's world
    for one in WORLD_KINDS.keys() & places.keys():
        place = places[one]
        pools[one] = tuple(map(place.of, _POOL)) if isinstance(place, Drawn) else None

    def trained(world_kind: str, rules: str, ants: int) -> ColonyPoint:
        places_of = places[world_kind], TASKS[rules], training, pools[world_kind]
        return ColonyPoint(*places_of, ants, **lengths)

    conditions: Conditions = {}
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
            conditions[Condition(world_kind, rules, study.ABROAD, abroad.ants)] = abroad
    return conditions


def greedy(point: ColonyPoint) -> ColonyPoint:
    """Return the point that evaluates the same ants without exploration."""
    calm = replace(point, evaluation_epsilon=0.0)
    return replace(calm, pool=None, episodes=0, after=point) if point.episodes else calm


# Results: measures, tables, policies, figures, and the page.


def with_bounds(
    conditions: Conditions, values: Mapping[Any, Mapping[str, np.ndarray]], seeds: Sequence[int]
) -> study.Measured:
    """Return all measures, float64 (seeds,), of all conditions from those of the points.

    Bounds are nan if food moves or takes time to grow back, because no bound is known.
    """
    limits: dict[Any, list] = {}
    found = {}
    for condition, point in conditions.items():
        key = point.world, point.task.traffic, point.task.turns_at_queen
        if key not in limits:
            places = point.worlds(seeds)
            several = places if isinstance(places, list) else [places]
            limits[key] = [limits_of(one, point.task) for one in several]
        known = point.task.life == _LIVELY
        most = [one.deliveries(point.ants) if known else np.nan for one in limits[key]]
        bound, of_point = np.broadcast_to(np.array(most), len(seeds)), values[point]
        share = of_point["deliveries"] / np.where(bound > 0, bound, np.nan)
        calm = values[greedy(point)]["deliveries"]
        found[condition] = {**of_point, "greedy": calm, "bound": bound, "bound_share": share}
    return found


def tables(plan: Plan, runs: Runs) -> str:
    """Return the report, after writing all results; while runs are missing, of whole conditions.

    The policies are those of median seeds.
    """
    folder, seeds, present = runs.folder, runs.study.seeds, np.all(runs.present, axis=1)
    place_of = {point: place for place, point in enumerate(runs.study.points)}
    conditions = {
        condition: point
        for condition, point in plan.conditions.items()
        if present[place_of[point]] and present[place_of[greedy(point)]]
    }
    if not conditions:
        raise AntsError("no condition has all of its runs yet; wait for the first ones.")
    arrays = runs.read(runs.study.keys, arrays=COLONY)
    of_points = {p: {n: a[row] for n, a in arrays.items()} for p, row in place_of.items()}
    values = with_bounds(conditions, of_points, seeds)
    rows, judged = study.condition_rows(values), study.judge_all(values)
    for name, table in (
        ("seeds.csv", study.rows_of_seeds(values, seeds)),
        ("conditions.csv", [one.columns() for one in rows]),
        ("differences.csv", study.difference_rows(judged)),
    ):
        files.write_csv(folder / name, table, list(table[0]))
    for name, shown in (("glance", study.glance(rows)), ("elsewhere", study.means(rows)[-1])):
        published.write(folder / "tables" / f"colony_{name}.json", [shown])
    policies = {}
    for condition, point in conditions.items():
        if condition.rules in COMPARED and condition.regime == JOINT:
            keys = [runs.study.keys[place_of[point]]]
            q_values = runs.read(keys, arrays=["q_values"])["q_values"][0]
            order = np.argsort(values[condition]["deliveries"], kind="stable")
            run = int(order[(len(seeds) - 1) // 2])
            policies[condition] = q_values[run]
            metadata = {
                **condition._asdict(),
                **{"task": point.task.as_dict(), "training": point.training.as_dict()},
                **{"seed": seeds[run], "episodes": point.episodes, "ticks": point.ticks},
                "deliveries_per_1000_ticks": values[condition]["deliveries"][run],
            }
            name = f"{condition.world_kind}_{condition.rules}_{condition.ants}.npz"
            save_policy(folder / "policies" / name, q_values[run], metadata, point.task.observation)
    parts: dict[str, Any] = {"drawings": [], "players": []}
    if runs.figures:
        parts["drawings"] = drawings(draw_all(rows), folder / "figures")
        parts["players"] = at_work(conditions, policies, seeds[0])
    facts = page.setting_facts(settings_of(runs.study.points, seeds))
    parts["facts"] = {**facts, **page.made_facts(runs.made)}
    links = [path.name for path in folder.iterdir()] + [MANIFEST, REPORT]
    files.write_text(folder / PAGE, colony_page(rows, judged, **parts, files=links))
    return plain_text(study.on_one_screen(rows, judged), width=79)


def colony_page(rows: Sequence[study.ConditionRow], judged: study.Judged, **parts: Any) -> str:
    """Return the page as HTML; `parts` are drawings, players, facts and files."""
    world_kinds = {row.condition.world_kind for row in rows}
    seeds = study.seeds_in_words(rows[0].seeds)
    return page.fill(
        Path(__file__).with_name("colony.html"),
        title="Which rules and which training make a colony deliver more?",
        byline=f"{seeds}, {count(len(rows), 'condition')}, "
        f"{count(len(world_kinds), 'kind')} of world",
        seeds=seeds,
        epsilon=f"{study.EVALUATION_EPSILON:g}",
        worlds=[words for name, words in WORLD_KINDS.items() if name in world_kinds],
        headlines=study.headlines(rows, judged),
        findings=_statements(judged),
        glance=study.glance(rows),
        tables=study.means(rows),
        **parts,
    )


def _statements(judged: study.Judged) -> page.Statements:
    lines = []
    for (world_kind, series), by_sizes in judged.items():
        unit = COLONY[series.measure].label
        told = [
            page.ShownFinding(
                count(n, "ant") if n == less else f"{n} against {less}", one, "Difference", unit
            )
            for (n, less), one in by_sizes.items()
        ]
        facts = {"Question": series.question, "Difference in": unit}
        verdicts = [study.of_largest(by_sizes).verdict]
        statement = f"{sentence(series.statement)}."
        lines.append(page.Statement(statement, sentence(WORLDS[world_kind]), verdicts, facts, told))
    return page.Statements(("Statement", "World", "Largest colony"), lines, "statements")


def at_work(
    conditions: Conditions, policies: Mapping[Condition, np.ndarray], seed: int
) -> list[page.Player]:
    """Return recordings of the largest colony under each of the compared rules, in one world."""
    kinds, players = [*WORLD_KINDS], []
    small = [(kinds.index(one.world_kind), one.ants) for one in policies if one.ants <= MOST_SHOWN]
    kind, ants = max(small, default=(0, 0))
    for condition in [one for one in policies if (one.world_kind, one.ants) == (kinds[kind], ants)]:
        point, world = conditions[condition], world_of(kinds[kind])
        colony = Colony(
            *(world.of(seed) if isinstance(world, Drawn) else world, point.task),
            replace(point.training, epsilon=point.training.least_epsilon),
            *(seed, ants),
            sharing="frozen",
            q_values=policies[condition],
        )
        colony.begin_episode()
        rules = study.RULES[condition.rules]
        recording = record_colony(colony, SHOWN_TICKS, title=rules)
        done = count(int(colony.outcome().deliveries.sum()), "delivery")
        where = WORLD_KINDS[kinds[kind]]
        words = f"{count(ants, 'ant')} in {where}: {done} in {SHOWN_TICKS} ticks."
        players.append(page.Player(sentence(rules), words, recording))
    return players


def main(arguments: list[str] | None = None) -> None:
    """Run the study or, with `live`, one colony."""
    words = sys.argv[1:] if arguments is None else arguments
    if words[:1] == ["live"]:
        commands.run("colony", words)
    with command_line.reporting(command_line.AGAIN):
        settings = parse_arguments(words)
        run_study(settings, planned(__file__, settings))


if __name__ == "__main__":
    main()
