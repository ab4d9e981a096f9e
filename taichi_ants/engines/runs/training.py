"""Training, evaluation and traces of many ants, each alone in its own world.

Traces come from the same kernel as training and evaluation, compiled to record each step.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import astuple, replace
from functools import partial
from itertools import groupby
from typing import Any

import numpy as np

from taichi_ants import arguments, runtime
from taichi_ants.engines.layout import OUTCOMES, TRACE
from taichi_ants.engines.runs.engine import MAX_ROLLOUT_STEPS, Progress, Runs, RunState, memory_for
from taichi_ants.engines.runs.results import RolloutArguments, Rollouts, Trace, TrainingResult
from taichi_ants.errors import AntsError, checked_whole, enough_memory, expect
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.policies import check_finite, checked_table, checked_values
from taichi_ants.task import Task
from taichi_ants.task.constants import EPISODE_STEPS, EPISODES, N_ACTIONS
from taichi_ants.worlds.world import World

MAX_TABLE_ROWS = 12_800_000  # of 32 bytes each; a trace keeps the table after each training step


@enough_memory("so many cells, runs or episodes")
def train(
    world: World,
    configs: TrainingConfig | Sequence[TrainingConfig],
    seeds: int | Sequence[int],
    episodes: int = EPISODES,
    max_steps: int = EPISODE_STEPS,
    task: Task | None = None,
    threads: int | None = None,
    *,
    arch: str | None = None,
    progress: Progress | None = None,
) -> TrainingResult:
    """Return the result of training every configuration with every seed, in independent runs.

    A run depends only on its configuration, its seed, world, episodes, max_steps and task. Other
    runs, their order, and the number of threads do not change it.

    Args:
        world: The world, to which each episode resets.
        configs: One configuration or several.
        seeds: One seed or several different ones: 5 is the single seed 5, range(5) are five seeds.
        episodes: Episodes of each run, at least 1.
        max_steps: Steps after which an episode is truncated, 1 to 10 million.
        task: The rules; None for those of the paper.
        threads: CPU threads; None keeps the present number, or at the first start uses all.
        arch: "cpu" or "cuda"; None keeps the present one, or at the first start uses the CPU.
        progress: A function that is called with the share of the work done, 0 to 1.

    Raises:
        AntsError: An argument is not allowed; the message names it.

    >>> train(worlds.paper(), config, seeds=range(3), episodes=60).returns.shape
    (1, 3, 60)
    """
    task, max_steps = arguments.checked_run(world, task, max_steps, learns=True)
    configs = arguments.checked_configs(configs, task)
    seeds = arguments.checked_seeds(seeds)
    outcomes = (np.zeros((len(configs), len(seeds), 0), dtype=np.int32),) * 3
    state = RunState.initial(configs, seeds, task.n_states)
    start = TrainingResult(world, configs, seeds, max_steps, task, *outcomes, 0.0, state)
    runtime.start(threads, arch)
    return _train(start, episodes, progress)


@enough_memory("so many episodes")
def continue_training(result: TrainingResult, episodes: int) -> TrainingResult:
    """Return a new result after training every run of a result for more episodes.

    It equals, bit for bit, the result of a single training with the sum of the episodes; `seconds`
    is the time of the new ones. Errors are those of `train`.

    >>> continue_training(result, 40).returns.shape
    (1, 3, 100)
    """
    expect("result", result, TrainingResult)
    arguments.checked_configs(result.configs)
    state = result.state
    given = (state.q.shape[2] - 1, state.floats.shape[2], state.integers.shape[2])
    needed = astuple(memory_for(result.configs, result.task.n_states))
    if np.less(given, needed).any():  # kernels would write outside of it
        raise AntsError(
            "a learner needs more memory than when this training started; train again from the "
            "first episode."
        )
    copies = RunState(**{name: array.copy() for name, array in vars(state).items()})
    return _train(replace(result, state=copies), episodes)


def _train(
    result: TrainingResult, episodes: int, progress: Progress | None = None
) -> TrainingResult:
    """Return what `continue_training` returns, but change the state of the given result."""
    episodes = checked_whole("episodes", episodes)
    configs, seeds, seconds = result.configs, result.seeds, 0.0
    outcomes = np.zeros((len(OUTCOMES), len(configs), len(seeds), episodes), dtype=np.int32)
    first = 0
    # A launch has one kernel, of the learner, and one cost, of its hyperparameters.
    for _, group in groupby(configs, lambda config: (config.learner, config.hyperparameters)):
        chosen = tuple(group)
        where = slice(first, first := first + len(chosen))
        state = result.state.part(where)
        runs = Runs.learning(result.world, result.task, result.max_steps, chosen, seeds, state)
        into = outcomes[:, where].reshape(len(OUTCOMES), len(runs), episodes)  # a view
        part = progress and partial(_report, progress, where, len(configs))
        seconds += runs.do_episodes(into, part)
        check_finite(runs.state.q, chosen, seeds)
    joined: dict[str, Any] = {
        name: np.concatenate([getattr(result, name), array], axis=2)
        for name, array in zip(OUTCOMES, outcomes, strict=True)
    }
    return replace(result, **joined, seconds=seconds)


def _report(progress: Progress, part: slice, total: int, share: float) -> None:
    """Report the share of a part of `total` configurations that is done as that of all."""
    progress((part.start + (part.stop - part.start) * share) / total)


@enough_memory("so many seeds or rollouts")
def evaluate(
    world: World,
    q_values: np.ndarray,
    rollouts: int = 50,
    seeds: int | Sequence[int] = 0,
    max_steps: int = EPISODE_STEPS,
    task: Task | None = None,
    epsilon: float = 0.0,
    threads: int | None = None,
    *,
    arch: str | None = None,
) -> Rollouts:
    """Return the outcomes of episodes in which ants follow fixed policies and do not learn.

    Args:
        q_values: float (..., n_states, 5), action values; ants take the best action, and break ties
            at random.
        rollouts: Episodes with each table, at least 1. Each rollout has its own random stream.
        seeds: One seed for all tables, or one per index of the tables' last leading axis. A single
            table takes any number of seeds, which are then the first axis of the result.
        epsilon: Probability of a random action.
        world, max_steps, task, threads, arch: As in `train`.

    Raises:
        AntsError: An argument is not allowed; the message names it.

    >>> evaluate(worlds.paper(), result.q_values, seeds=range(3)).deliveries.shape
    (1, 3, 50)
    """
    task, max_steps = arguments.checked_run(world, task, max_steps)
    tables = checked_values(q_values, task)
    if tables.ndim == 2 and (several := len(arguments.checked_seeds(seeds))) > 1:
        tables = np.broadcast_to(tables, (several, *tables.shape))
    shape = tables.shape[:-2]
    run_seeds = arguments.checked_seeds_for(seeds, shape)
    rollouts = checked_whole("rollouts", rollouts)
    epsilon = arguments.checked_share("epsilon", epsilon)
    runtime.start(threads, arch)
    flat = tables.reshape(-1, *tables.shape[-2:])
    runs = Runs.following(world, task, max_steps, flat, run_seeds, range(rollouts), epsilon)
    outcomes = np.empty((3, len(runs), rollouts), np.int32)
    runs.do_episodes(outcomes)
    returns, steps, deliveries = outcomes.reshape(3, *shape, rollouts)
    of_tables = tuple(run_seeds[: shape[-1] if shape else 1].tolist())
    return Rollouts(returns, steps, deliveries, of_tables)


def rollout(
    world: World,
    q_values: np.ndarray,
    seed: int = 0,
    number: int = 0,
    max_steps: int = EPISODE_STEPS,
    task: Task | None = None,
    epsilon: float = 0.0,
) -> Trace:
    """Return the trace of one episode in which an ant follows a fixed policy.

    Args:
        q_values: float (n_states, 5), action values; or the `TrainingResult` of a single run, or a
            `Policy`.
        number: The number of the rollout of the seed, as `evaluate` counts them, from 0.
        world, seed, max_steps, task, epsilon: As in `evaluate`, whose errors it also raises.

    >>> rollout(worlds.paper(), result.q_values[0, 0]).headings[0].item()
    0
    """
    task, max_steps = arguments.checked_run(world, task, max_steps)
    table = checked_table(q_values, task)
    seeds = arguments.checked_seeds_for(seed, ())
    number = checked_whole("number", number, least=0)
    epsilon = arguments.checked_share("epsilon", epsilon)
    runs = Runs.following(world, task, max_steps, table[None], seeds, [number], epsilon)
    seed, kept = int(seeds[0]), table.copy()
    made_by = RolloutArguments(world, task, seed, max_steps, number, kept, epsilon)
    return next(followed(runs, made_by))


def followed(runs: Runs, made_by: RolloutArguments | None = None) -> Iterator[Trace]:
    """Yield the traces of one rollout of each policy; its number is that of the episode."""
    _check_length(runs.max_steps, MAX_ROLLOUT_STEPS)
    for steps in runs.record(episodes=1):
        values = runs.state.q[steps["runs"], 0, steps["states"], :N_ACTIONS]
        steps["episodes"] = steps["runs"].astype(np.int32)
        yield _trace(runs.world, steps, q_values=values, arguments=made_by)


def trace_training(
    world: World,
    config: TrainingConfig,
    seed: int = 0,
    episodes: int = 1,
    max_steps: int = EPISODE_STEPS,
    task: Task | None = None,
) -> Trace:
    """Return the trace of the first episodes of one training run, with the Q table after each step.

    Args:
        config: The configuration of the learner.
        world, seed, episodes, max_steps, task: As in `train`, whose errors it also raises. The
            product of episodes, steps and states is limited to 12.8 million.

    >>> trace_training(worlds.paper(), config, max_steps=50).tables.shape
    (50, 128, 5)
    """
    task, max_steps = arguments.checked_run(world, task, max_steps, learns=True)
    episodes = checked_whole("episodes", episodes)
    (config,) = arguments.checked_configs(config, task)
    _check_length(episodes * max_steps, min(MAX_ROLLOUT_STEPS, MAX_TABLE_ROWS // task.n_states))
    seeds = arguments.checked_seeds_for(seed, ()).tolist()
    runs = Runs.learning(world, task, max_steps, [config], seeds)
    before = runs.state.q[:, 0, :, :N_ACTIONS].copy()
    tables = np.empty((episodes * max_steps, *runs.state.q.shape[2:]), dtype=np.float32)
    (steps,) = runs.record(episodes, tables=tables)
    n = len(steps["states"])
    after = tables[:n, :, :N_ACTIONS]
    values = np.concatenate([before, after[:-1]])[np.arange(n), steps["states"]]
    made_by = RolloutArguments(world, task, seeds[0], max_steps, config=config)
    more = {"q_values": values, "td_errors": steps["td_errors"], "tables": after}
    return _trace(world, steps, **more, arguments=made_by)


def _check_length(steps: int, most: int) -> None:
    if steps > most:
        raise AntsError(
            f"episodes * max_steps is {steps}; a trace has at most {most} steps, so reduce one of "
            "them."
        )


def _trace(world: World, steps: dict[str, np.ndarray], **more: Any) -> Trace:
    columns: dict[str, Any] = {name: steps[name] for name in TRACE}
    columns["cells"] = world.grid.cells(columns["cells"])
    columns["terminated"] = columns["terminated"].astype(bool)
    return Trace(**columns, **more)
