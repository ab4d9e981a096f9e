"""Learn offline from recorded data, and evaluate policies from data.

The script prints three tables; most columns are means over seeds with 95 % intervals. Table (a) has
the share of greedy rollouts that deliver, for each behaviour policy that recorded the data, number
of transitions and offline learner, and for online Q-learning after as many transitions. Table (b)
shows how well three methods of off-policy evaluation rank ten policies. Table (c) has the
deliveries of colonies that follow policies learned from data of ants that live for ever, or that
are born and die. See docs/results/offline.md.
"""

from __future__ import annotations

from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    from collections.abc import Callable
    from dataclasses import replace
    from functools import partial
    from pathlib import Path

    import numpy as np
    import published
    from published import mean

    from taichi_ants import Colony, TrainingConfig, evaluate, load_policy, offline, train, worlds
    from taichi_ants.analysis.statistics import bootstrap_interval
    from taichi_ants.analysis.tables import Table, number
    from taichi_ants.learners.policies import random_policy, trail_follower
    from taichi_ants.offline import Dataset, record, record_colony
    from taichi_ants.studies.command_line import Parser, progress_bar, run_command, whole_number
    from taichi_ants.task import Life, Task

    WORLD = worlds.paper()
    FORAGING = load_policy(Path(__file__).parent / "policies" / "foraging.npz")

STILL = Task(evaporation_in_evaluation=False)  # without evaporation, as in training
ONLINE = TrainingConfig("q_learning", 0.1, 0.9, epsilon=0.3, epsilon_decay=0.99)
LEARNERS: dict[str, Callable[..., np.ndarray]] = {
    "batch Q-learning": lambda data: offline.batch_q_learning(data, sweeps=20, by_run=True),
    "fitted Q iteration": lambda data: offline.fitted_q_iteration(data, by_run=True),
    "pessimistic": lambda data: offline.pessimistic_q_iteration(data, by_run=True),
}
SIZES = (1000, 3000, 10_000, 30_000, 100_000)

# Off-policy evaluation: target policies explore a little; rewards after 100 steps hardly count.
HORIZON, DISCOUNT, EPSILON = 100, 0.95, 0.1
INTERVALS = {"resamples": 40, "level": 0.9}
JUDGES: dict[str, Callable[..., offline.PolicyValues]] = {
    "importance sampling": partial(offline.importance_sampling, weighted=False, **INTERVALS),
    "weighted": partial(offline.importance_sampling, weighted=True, **INTERVALS),
    "model": partial(offline.model_based, **INTERVALS),
}

# Colonies of 64 ants, three far piles; those with a lifespan have births.
LIFESPANS, TICKS, COLONY_SIZES = (None, 100, 50), 250, (3000, 15_000)


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = Parser(__doc__)
    seeds = "number of seeds, starting at 0"
    parser.add_argument("--seeds", type=whole_number(2), default=10, metavar="N", help=seeds)
    publishes = "write the tables to the docs"
    parser.add_argument("--publish", action="store_true", help=publishes)
    return parser.parse_args(arguments)


def print_tables(settings: argparse.Namespace) -> None:
    """Print the three tables, each as soon as it is finished."""
    seeds = range(settings.seeds)
    for title, table_of in (("data", learning), ("evaluation", judging), ("colonies", dying)):
        with progress_bar(title) as progress:
            table = table_of(seeds, progress)
        published.show(f"offline_{title}", [table], settings.publish)


def learning(seeds: range, progress: Callable[[float], None]) -> Table:
    """Return table (a), the share of rollouts that deliver."""
    good = train(WORLD, ONLINE, seeds).q_values[0]
    sources: dict[str, Callable[[], Dataset]] = {
        "random": lambda: record(WORLD, None, 250, seeds, task=STILL),
        "epsilon 0.5": lambda: record(WORLD, good, 700, seeds, task=STILL, epsilon=0.5),
        "epsilon 0.1": lambda: record(WORLD, good, 2800, seeds, task=STILL, epsilon=0.1),
        "a learner's history": lambda: record(WORLD, ONLINE, 2800, seeds, task=STILL),
    }

    def delivered(q_values: np.ndarray) -> np.ndarray:
        return evaluate(WORLD, q_values, 20, seeds, task=STILL).deliveries.mean(axis=1)

    # One sweep over its own history gives a learner the same table as online learning.
    history = sources["a learner's history"]()
    online = [
        delivered(offline.batch_q_learning(history.first(n), sweeps=1, by_run=True)) for n in SIZES
    ]
    rows = []
    for done, (name, make) in enumerate(sources.items()):
        data = make()
        for n, same in zip(SIZES, online, strict=True):
            some = data.first(transitions=n)
            assert (np.bincount(some.run) == n).all(), f"{name} has too few transitions"
            cells = []
            for learn in LEARNERS.values():
                values = delivered(learn(some))
                (low,), (high,) = bootstrap_interval((values - same)[None])
                cells.append(mean(values, 2) + (" -" if high < 0 else " +" if low > 0 else ""))
            rows.append([name, f"{n}", *cells, mean(same, 2)])
        progress((done + 1) / len(sources))
    notes = ("+ and -: more or less often than online Q-learning after as many transitions.",)
    columns = ("Behaviour", "transitions", *LEARNERS, "online Q-learning")
    return Table("(a) Share of greedy rollouts that deliver", columns, rows, notes)


def judging(seeds: range, progress: Callable[[float], None]) -> Table:
    """Return table (b), the rank correlation of estimated and true values, loss and coverage."""
    stages = [train(WORLD, ONLINE, (1000, 1001), n).q_values[0] for n in (1, 3, 10, 100)]
    policies = np.concatenate([[random_policy(), trail_follower()], *stages])
    played = (record(WORLD, q, 5000, 999, 600, STILL, EPSILON) for q in policies)
    true = np.array([data.returns(DISCOUNT).mean() for data in played])
    behaviours = {"random": (None, 0.0), "epsilon 0.5": (stages[-1][0], 0.5)}
    behaviours["epsilon 0.1"] = (stages[-1][0], 0.1)
    rows: list[list[str]] = []
    for name, (table, epsilon) in behaviours.items():
        for episodes in (10, 100, 1000):
            data = record(WORLD, table, episodes, seeds, HORIZON, STILL, epsilon)
            found: dict[str, list[tuple[float, ...]]] = {judge: [] for judge in JUDGES}
            for run in range(len(seeds)):
                for judge, by in JUDGES.items():
                    values = by(data.of_run(run), policies, DISCOUNT, EPSILON)
                    found[judge].append(_scores(values, true))
            for judge, scores in found.items():
                ranks, loss, covered, size = np.array(scores).T
                cells = mean(ranks, 2), mean(loss, 2), number(100 * covered.mean(), 0)
                rows.append([name, judge, f"{episodes}", *cells, number(np.median(size))])
            progress(len(rows) / (9 * len(JUDGES)))
    columns = ("Behaviour", "method", "episodes", "rank correlation", "loss", "covered %", "sample")
    notes = (
        f"True values, with discount {DISCOUNT}: {', '.join(number(v) for v in np.sort(true))}.",
        "Loss: the value of the best policy minus that of the policy with the best estimate. "
        "Covered: true values in their 90 % bootstrap interval over episodes. Sample: the median "
        "effective sample size.",
    )
    return Table("(b) Ranking ten policies before they are tried", columns, rows, notes, 2)


def _scores(found: offline.PolicyValues, true: np.ndarray) -> tuple[float, ...]:
    """Return Spearman's correlation, loss, coverage of intervals, and effective sample size."""
    from scipy.stats import rankdata

    ranks = np.corrcoef(rankdata(found.value), rankdata(true))[0, 1] if np.ptp(found.value) else 0.0
    covered = (found.low <= true) & (true <= found.high)
    loss = true.max() - true[found.value.argmax()]
    return ranks, loss, covered.mean(), np.median(found.effective_sample_size)


def dying(seeds: range, progress: Callable[[float], None]) -> Table:
    """Return table (c), deliveries of 64 ants with policies from data of ants that die early."""
    rows = []
    cases = [(epsilon, lifespan) for epsilon in (0.3, 0.7) for lifespan in LIFESPANS]
    for done, (epsilon, lifespan) in enumerate(cases):
        life = Life(births=lifespan is not None, lifespan=lifespan, regrowth=0)
        data, episodes = None, 1
        while data is None or np.bincount(data.run).min() < max(COLONY_SIZES):
            data = record_colony(_colony(seeds, life, epsilon), episodes, TICKS)
            episodes *= 2
        # A common mistake: death as a terminal state.
        dies = data.truncated & (data.step + 1 < TICKS)
        mistaken = replace(
            data, terminated=data.terminated | dies, truncated=data.truncated & ~dies
        )
        for n in COLONY_SIZES:
            some = data.first(transitions=n)
            tables = [learn(some) for learn in LEARNERS.values()]
            tables.append(LEARNERS["pessimistic"](mistaken.first(transitions=n)))
            cells = [mean(_delivered(seeds, table)) for table in tables]
            lived = "for ever" if lifespan is None else f"{lifespan} ticks"
            cells.append(mean([len(np.unique(some.of_run(run).state)) for run in seeds]))
            rows.append([f"epsilon {epsilon:g}", lived, f"{n}", *cells])
        progress((done + 1) / len(cases))
    own = mean(_delivered(seeds, FORAGING.q_values))
    notes = (f"The behaviour policy itself, without exploration, delivers {own}.",)
    columns = ("Behaviour", "ants live", "transitions", *LEARNERS, "death as an end", "states seen")
    title = "(c) Deliveries per 1000 ticks of 64 ants that do not die, by data of ants that do"
    return Table(title, columns, rows, notes, 2)


def _colony(seeds: range, life: Life, epsilon: float, q_values: np.ndarray | None = None) -> Colony:
    """Return 64 ants that follow a policy, by default that of the foraging rules."""
    table = FORAGING.q_values if q_values is None else q_values
    training = TrainingConfig("sarsa", 0.1, 0.9, epsilon, 1.0)
    task = replace(FORAGING.task, life=life)
    world = worlds.far_piles(1, (20, 20, 20))
    return Colony(world, task, training, seeds, 64, 64, sharing="frozen", q_values=table)


def _delivered(seeds: range, q_values: np.ndarray) -> np.ndarray:
    """Return the deliveries in 1000 ticks of each colony."""
    return _colony(seeds, Life(regrowth=0), 0.01, q_values).run(1, 1000).deliveries[0]


if __name__ == "__main__":
    run_command(lambda: print_tables(parse_arguments()))
