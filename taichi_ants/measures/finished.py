"""Measures of finished runs: one number for each run, before any statistics.

A run of kind "runs" is the training of a lone ant with the greedy rollouts of its final policy. One
of kind "colony" is the evaluation of a colony. For lone ants, each measure of counts has measures
of the episodes in each window and of the greedy rollouts. If a run has fewer than 50 episodes,
"last 50" means all of them. Measures of the first or second 50 episodes need 100 episodes, so that
early and late measures never share an episode.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from taichi_ants.errors import AntsError, shown
from taichi_ants.measures.built_in import first_delivery
from taichi_ants.measures.measure import COUNTS, MEASURES, RUN, Measure, get

WINDOW = 50
# Windows of episodes: slice, words, fewest episodes of a run.
_WINDOWS = {
    "first50": (slice(0, WINDOW), "the first 50 episodes", 2 * WINDOW),
    "second50": (slice(WINDOW, 2 * WINDOW), "episodes 51 to 100", 2 * WINDOW),
    "last50": (slice(-WINDOW, None), "the last 50 episodes", 1),
    "all": (slice(None), "all episodes", 1),
}
_COLONY_COUNTS = ("deliveries", "first_delivery", "moves", "blocked", "returns")
_of_run = partial(Measure, of=RUN)
# The outcome of a `RunPoint` or a `ColonyPoint`: arrays (..., episodes or rollouts) by name.
Outcome = Mapping[str, np.ndarray]
Counts = Mapping[str, Any]


@dataclass(frozen=True)
class Run:
    """The counts of finished runs, which measures of runs read.

    Attributes:
        training: The counts of each training episode of lone ants by name, integer (..., episodes):
            returns, ticks, deliveries, first_delivery (-1 for none) and living. Empty for colonies.
        evaluation: Likewise of each evaluation rollout, without learning, (..., rollouts). Those of
            colonies also have moves and blocked.
        ants: The number of ants at the start.
        ticks: The length of the rollouts of a colony; None for lone ants.

    >>> successes = measures.register(
    ...     "successes", lambda run: (run.evaluation["deliveries"] > 0).mean(axis=-1), of="run"
    ... )
    """

    training: Counts
    evaluation: Counts
    ants: int = 1
    ticks: int | None = None

    @classmethod
    def of_lone_ant(cls, outcome: Outcome) -> Run:
        return cls(counts_of_lone_ant(outcome), counts_of_lone_ant(outcome, "greedy_"))

    @classmethod
    def of_colony(cls, outcome: Outcome, ants: int, ticks: int) -> Run:
        counts = {name: outcome[name] for name in _COLONY_COUNTS}
        counts["ticks"] = np.broadcast_to(np.int32(ticks), outcome["deliveries"].shape)
        return cls({}, counts, ants, ticks)


def counts_of_lone_ant(outcome: Outcome, before: str = "") -> Counts:
    """Return the counts of the episodes of lone ants from their returns, steps and deliveries."""
    steps, deliveries = outcome[f"{before}steps"], outcome[f"{before}deliveries"]
    # An episode ends at its first delivery, or without one.
    first = np.where(deliveries > 0, steps, np.int32(-1))
    counts = {"returns": outcome[f"{before}returns"], "ticks": steps, "deliveries": deliveries}
    return {**counts, "first_delivery": first, "living": 1}


def of_episodes(measure: Measure, counts: Counts) -> np.ndarray:
    """Return a measure of counts of the episodes of lone ants, an array (..., episodes).

    Raises:
        AntsError: The measure reads a count that lone ants do not have, or does not work on arrays.
    """
    return np.broadcast_to(measure.computed(counts), np.shape(counts["ticks"]))


def of_lone_ants(counts: Counts) -> dict[str, np.ndarray]:
    """Return `first_delivery`, `efficiency` and your own measures of counts that lone ants have."""
    yours = [measure for measure in MEASURES.yours.values() if measure.of == COUNTS]
    values = {}
    for measure in (get("first_delivery"), get("efficiency"), *yours):
        with suppress(AntsError):  # it reads counts of colonies
            values[measure.name] = of_episodes(measure, counts)
    return values


def _mean(measure: Measure, of: str, episodes: slice, run: Run) -> np.ndarray:
    return of_episodes(measure, getattr(run, of))[..., episodes].mean(axis=-1, dtype=float)


def _fluctuation(measure: Measure, episodes: slice, run: Run) -> np.ndarray:
    """Return the root mean square change between successive episodes, divided by sqrt(2).

    For independent episodes this is their standard deviation; a slow trend hardly changes it.
    """
    changes = np.diff(of_episodes(measure, run.training)[..., episodes].astype(float))
    return np.sqrt(np.einsum("...i,...i", changes, changes) / changes.shape[-1] / 2)


def _windows(measure: Measure, words: str) -> Iterator[Measure]:
    """Yield the measures of runs of lone ants for a measure of counts."""
    name, unit = measure.name, measure.unit
    for window, (episodes, when, least) in _WINDOWS.items():
        mean = partial(_mean, measure, "training", episodes)
        yield _of_run(f"{name}_{window}", mean, unit, f"mean {words} of {when}", episodes=least)
        changes = f"fluctuation of the {words} from episode to episode in {when}"
        full, of_window = f"{name}_fluctuation_{window}", partial(_fluctuation, measure, episodes)
        yield _of_run(full, of_window, unit, changes, episodes=max(2, least))
    mean = partial(_mean, measure, "evaluation", slice(None))
    yield _of_run(f"greedy_{name}", mean, unit, f"mean {words} of the greedy rollouts")


def _repeats(run: Run) -> np.ndarray:
    arrays = run.evaluation["returns"], run.evaluation["ticks"]
    same = [(array == array[..., :1]).all(axis=-1) for array in arrays]
    return np.logical_and(*same).astype(float)


def _improved(run: Run) -> np.ndarray:
    late, early = (LONE[f"return_{when}50"].function(run) for when in ("last", "first"))
    return (late > early).astype(float)


def _per_1000_ticks(count: str, run: Run) -> np.ndarray:
    return run.evaluation[count].mean(axis=-1, dtype=float) * 1000 / run.ticks


def _blocked(run: Run) -> np.ndarray:
    """Return the share of all moves of the rollouts that failed; nan if no ant tried to move."""
    moves = run.evaluation["moves"].sum(axis=-1, dtype=float)
    return run.evaluation["blocked"].sum(axis=-1) / np.where(moves > 0, moves, np.nan)


_LONE = (
    *_windows(Measure("return", lambda counts: counts["returns"], "reward"), "return"),
    *_windows(Measure("steps", lambda counts: counts["ticks"], "steps"), "length"),
    *_windows(
        Measure("deliveries", lambda counts: counts["deliveries"], "deliveries per episode"),
        "deliveries",
    ),
    _of_run("shortest_episode", lambda run: run.training["ticks"].min(axis=-1).astype(float),
            "steps", "length of the shortest training episode", episodes=1),
    _of_run("improved", _improved, "share of runs",
            "whether the last 50 episodes return more than the first 50", episodes=2 * WINDOW),
    _of_run("greedy_repeats", _repeats, "share of runs",
            "whether all greedy rollouts of a run are equal in return and length"),
)  # fmt: skip
_COLONY = (
    _of_run("deliveries", partial(_per_1000_ticks, "deliveries"), "", "deliveries per 1000 ticks"),
    _of_run("per_ant", lambda run: _per_1000_ticks("deliveries", run) / run.ants, "",
            "deliveries per ant and 1000 ticks"),
    _of_run("first_delivery", lambda run: first_delivery(run.evaluation).mean(axis=-1), "",
            "ticks to the first delivery"),
    _of_run("no_delivery_rate", lambda run: (run.evaluation["first_delivery"] < 0).mean(axis=-1),
            "", "share of episodes without a delivery"),
    _of_run("blocked", _blocked, "", "share of blocked moves"),
    _of_run("reward", lambda run: _per_1000_ticks("returns", run) / run.ants, "",
            "reward per ant and 1000 ticks"),
)  # fmt: skip
LONE = {measure.name: measure for measure in _LONE}
COLONY = {measure.name: measure for measure in _COLONY}
FINISHED = {"runs": LONE, "colony": COLONY}


def of_runs(kind: str, name: str) -> Measure:
    """Return the measure of finished runs of a kind with this name.

    For colonies, also a measure of a state or of a series, whose value is the mean of those at the
    ends of rollouts. Raises AntsError, with a list of all names, if there is none.
    """
    if isinstance(name, str) and name in FINISHED[kind]:
        return FINISHED[kind][name]
    if isinstance(name, str) and name.partition(".")[0] in _registered(kind):
        return get(name)
    counts = [m for m in map(get, MEASURES.names()) if kind == "runs" and m.of == COUNTS]
    for measure in counts:
        for window in _windows(measure, measure.name.replace("_", " ")):
            if window.name == name:
                episode = dict.fromkeys(("returns", "steps", "deliveries"), np.ones(1, int))
                of_episodes(measure, counts_of_lone_ant(episode))  # raises an error if it cannot
                return window
    raise AntsError(f"measures is {shown(name)}; it must be one of {names_of(kind)}.")


def _registered(kind: str) -> set[str]:
    """Return the names of registered measures that are measures of runs of a kind as they are."""
    return {name for name in MEASURES.names() if kind == "colony" or get(name).of == RUN}


def names_of(kind: str) -> str:
    """Return the names of all measures of finished runs of this kind, for a message."""
    more = ", or the name of a measure of a plugin (--plugin FILE)" if kind == "colony" else ""
    return ", ".join([*FINISHED[kind], *sorted(_registered(kind) - FINISHED[kind].keys())]) + more


def values_of(run: Run, names: Iterable[str] | None = None) -> dict[str, np.ndarray]:
    """Return measures of finished runs by name, float64 (...); all those of the package for None.

    If the runs have fewer episodes of training than a measure needs, it is nan.
    """
    kind, runs = "runs" if run.ticks is None else "colony", run.evaluation["returns"].shape[:-1]
    episodes = run.training["returns"].shape[-1] if run.training else 0
    measures = [of_runs(kind, name) for name in names or FINISHED[kind]]
    return {
        m.name: m.computed(run) if episodes >= m.episodes else np.full(runs, np.nan)
        for m in measures
    }
