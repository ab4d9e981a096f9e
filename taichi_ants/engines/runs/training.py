"""Training and evaluation of many ants, each alone in a world of its own."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from taichi_ants import learners, runtime
from taichi_ants.checks import (
    check_finite,
    checked_configs,
    checked_count,
    checked_food,
    checked_max_steps,
    checked_progress,
    checked_q_values,
    checked_runs_task,
    checked_seeds,
    checked_seeds_for,
    checked_share,
    checked_world,
)
from taichi_ants.engines.runs.engine import Progress, RunEngine
from taichi_ants.engines.runs.results import LearnerCost, Rollouts, RunState, TrainingResult
from taichi_ants.errors import AntsError, shown
from taichi_ants.grid.constants import STREAM_ANT, STREAM_ROLLOUT
from taichi_ants.grid.randomness import stream_state
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.task import Task
from taichi_ants.task.constants import N_ACTIONS, N_STATES
from taichi_ants.worlds.world import World

_ROW = 8  # action values of a state in a RunState, padded
_MODEL = N_STATES * N_ACTIONS


def train(
    world: World,
    configs: TrainingConfig | Sequence[TrainingConfig],
    seeds: int | Sequence[int],
    episodes: int = 500,
    max_steps: int = 600,
    task: Task | None = None,
    threads: int | None = None,
    *,
    arch: str | None = None,
    progress: Progress | None = None,
) -> TrainingResult:
    """Train every configuration with every seed, each run independent of all others.

    A run depends on the world, its configuration, its seed and the arguments below alone: not on
    what else is trained, in which order, or on how many threads.

    Args:
        world: The world; each episode starts from exactly this.
        configs: One configuration or several.
        seeds: One seed or several different ones.
        episodes: Episodes of each run, at least 1.
        max_steps: Steps after which an episode is truncated, 1 to 10 million.
        task: The rules of the game; None is the paper's.
        threads: CPU threads; None keeps what runs, or takes all.
        arch: "cpu" or "cuda"; None keeps what runs, or takes the CPU.
        progress: Called now and then with the share of the work that is done.

    Raises:
        AntsError: An argument is not allowed; the message names it.
    """
    configs = checked_configs(configs)
    seeds = checked_seeds(seeds)
    checked_food(world)
    task = checked_runs_task(task)
    none_yet = np.zeros((len(configs), len(seeds), 0), dtype=np.int32)
    start = TrainingResult(
        world=world,
        configs=configs,
        seeds=seeds,
        max_steps=checked_max_steps(max_steps, task),
        task=task,
        returns=none_yet,
        steps=none_yet,
        deliveries=none_yet,
        costs=(),
        state=fresh_state(configs, seeds, task),
    )
    return continue_training(start, episodes, threads, arch=arch, progress=progress)


def continue_training(
    result: TrainingResult,
    episodes: int,
    threads: int | None = None,
    *,
    arch: str | None = None,
    progress: Progress | None = None,
) -> TrainingResult:
    """Train every run of a result for more episodes.

    The outcome is, bit for bit, that of a single training with the sum of the episodes; the given
    result is left as it is.

    Args:
        result: What `train` or this function returned.
        episodes: Further episodes of each run, at least 1.
        threads, arch, progress: As in `train`.

    Returns:
        All episodes, old and new; `costs` holds what the new ones took.

    Raises:
        AntsError: An argument is not allowed; the message names it.
    """
    if not isinstance(result, TrainingResult):
        raise AntsError(f"result is {shown(result)}; give what train has returned.")
    result.check()
    checked_configs(result.configs)
    episodes = checked_count("episodes", episodes)
    progress = checked_progress(progress)
    settings = runtime.start(threads, arch)
    state = result.state.take(...)
    shape = (len(result.configs), len(result.seeds))
    outcomes = np.zeros((3, *shape, episodes), dtype=np.int32)
    costs = []
    work = _Work(result.configs, progress)
    for group in _groups(result.configs):
        config = result.configs[group[0]]
        task = result.task
        engine = RunEngine(
            result.world, task, result.max_steps, task.evaporation_in_training, settings
        )
        runs = _flat(state.take(group))
        outcomes[:, group] = engine.run(
            learners.get(config.learner),
            np.tile(np.array(result.seeds, dtype=object), len(group)),
            rates_of([result.configs[c] for c in group], len(result.seeds)),
            runs,
            episodes,
            progress=work.part(group),
        ).reshape(3, len(group), shape[1], episodes)
        trained = [result.configs[c] for c in group]
        check_finite(runs.q, trained, result.seeds)
        state.put(group, _shaped(runs, (len(group), shape[1])))
        spent = int(outcomes[1, group].sum(dtype=np.int64))
        costs.append(LearnerCost(config.learner, config.planning_steps, spent, engine.seconds))
    before = (result.returns, result.steps, result.deliveries)
    returns, steps, deliveries = (
        np.concatenate(pair, axis=2) for pair in zip(before, outcomes, strict=True)
    )
    return replace(
        result,
        returns=returns,
        steps=steps,
        deliveries=deliveries,
        costs=tuple(costs),
        state=state,
    )


def evaluate(
    world: World,
    q_values: np.ndarray,
    rollouts: int = 50,
    seeds: int | Sequence[int] = 0,
    max_steps: int = 600,
    task: Task | None = None,
    epsilon: float = 0.0,
    threads: int | None = None,
    *,
    arch: str | None = None,
    progress: Progress | None = None,
) -> Rollouts:
    """Follow fixed policies without learning.

    Args:
        world: The world; each rollout starts from exactly this.
        q_values: float (..., 128, 5), action values; the best action is taken, ties at random.
        rollouts: Episodes with each table, at least 1. Rollout k of a seed has a stream of its own.
        seeds: One seed for all tables, or as many as the tables' last leading axis is long.
        max_steps: Steps after which a rollout is truncated.
        task: The rules of the game; None is the paper's.
        epsilon: Probability of a random action.
        threads, arch, progress: As in `train`.

    Raises:
        AntsError: An argument is not allowed; the message names it.
    """
    task = checked_runs_task(task)
    tables = checked_q_values(q_values, task)
    shape = tables.shape[:-2]
    run_seeds = checked_seeds_for(seeds, shape)
    rollouts = checked_count("rollouts", rollouts)
    epsilon = checked_share("epsilon", epsilon)
    max_steps = checked_max_steps(max_steps, task)
    progress = checked_progress(progress)
    settings = runtime.start(threads, arch)
    evaporates = task.evaporation_in_evaluation
    engine = RunEngine(checked_world(world), task, max_steps, evaporates, settings)
    outcomes = engine.run(
        None,
        run_seeds,
        np.zeros((len(run_seeds), 2), dtype=np.float32),
        fixed_policy_state(tables.reshape(-1, N_STATES, N_ACTIONS), epsilon),
        rollouts,
        rollout_streams(run_seeds, np.arange(rollouts)),
        progress,
    )
    return Rollouts(*outcomes.reshape(3, *shape, rollouts))


def rollout_streams(seeds: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """The random streams of rollouts by their numbers (k,), uint64 (seeds, k)."""
    words = _as_words(seeds)
    return stream_state(words[:, None], STREAM_ROLLOUT, numbers[None, :])


def fixed_policy_state(tables: np.ndarray, epsilon: float) -> RunState:
    """The state of runs that follow tables (n, 128, 5) with a constant epsilon."""
    state = _bare_state((len(tables),), plans=False)
    state.q[..., :N_ACTIONS] = tables
    state.exploration[:] = (epsilon, 1.0, 0.0)
    return state


def fresh_state(configs: Sequence[TrainingConfig], seeds: Sequence[int], task: Task) -> RunState:
    """The state of runs that have not begun, leading axes (configurations, seeds)."""
    plans = any(learners.get(config.learner).plans for config in configs)
    state = _bare_state((len(configs), len(seeds)), plans)
    words = _as_words(np.array(seeds, dtype=object))
    state.random_states[:] = stream_state(words, STREAM_ANT, 0)
    for c, config in enumerate(configs):
        state.exploration[c] = (config.epsilon, config.epsilon_decay, config.min_epsilon)
        state.settings[c] = (config.planning_steps, task.delivery == "continuing", 0)
    return state


def _bare_state(shape: tuple[int, ...], plans: bool) -> RunState:
    model = (*shape, _MODEL if plans else 1)
    return RunState(
        q=np.zeros((*shape, N_STATES, _ROW), dtype=np.float32),
        random_states=np.zeros(shape, dtype=np.uint64),
        exploration=np.zeros((*shape, 3), dtype=np.float64),
        settings=np.zeros((*shape, 3), dtype=np.int32),
        entries=np.zeros(model, dtype=np.int32),
        slots=np.zeros(model, dtype=np.int32),
    )


def _as_words(seeds: np.ndarray) -> np.ndarray:
    """Seeds of any sign as 64-bit words."""
    return np.array([seed % 2**64 for seed in seeds.tolist()], dtype=np.uint64)


def rates_of(configs: Iterable[TrainingConfig], n_seeds: int) -> np.ndarray:
    """Learning rate and discount of each run, float32 (configurations * seeds, 2)."""
    pairs = [(config.learning_rate, config.discount) for config in configs]
    return np.repeat(np.array(pairs, dtype=np.float32), n_seeds, axis=0)


def _groups(configs: Sequence[TrainingConfig]) -> list[list[int]]:
    """The configurations of each learner and number of planning steps: one kernel, one cost."""
    groups: dict[tuple[str, int], list[int]] = {}
    for c, config in enumerate(configs):
        groups.setdefault((config.learner, config.planning_steps), []).append(c)
    return list(groups.values())


def _flat(state: RunState) -> RunState:
    return _reshaped(state, 2, (-1,))


def _shaped(state: RunState, shape: tuple[int, ...]) -> RunState:
    return _reshaped(state, 1, shape)


def _reshaped(state: RunState, axes: int, shape: tuple[int, ...]) -> RunState:
    return RunState(
        **{name: array.reshape(*shape, *array.shape[axes:]) for name, array in vars(state).items()}
    )


class _Work:
    """Joins the progress of groups of configurations, weighted by what a step costs."""

    def __init__(self, configs: Sequence[TrainingConfig], progress: Progress | None) -> None:
        self._weights = [4 + config.planning_steps for config in configs]
        self._progress = progress
        self._done = 0.0

    def part(self, group: Sequence[int]) -> Progress | None:
        """The progress of one group, to be used after that of the groups before it."""
        progress = self._progress
        if progress is None:
            return None
        begin, share = self._done, sum(self._weights[c] for c in group) / sum(self._weights)
        self._done += share
        return lambda part: progress(begin + share * part)
