"""Step-by-step traces of the engine of independent runs, for pictures, teaching and tests.

Traces come from the same kernel as training and evaluation, compiled to record each step.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from taichi_ants import arguments, runtime
from taichi_ants.engines.layout import OUTCOMES, STEPS, TRACE
from taichi_ants.engines.runs.engine import Launcher, Progress, Runs, pieces
from taichi_ants.engines.runs.results import RunState
from taichi_ants.errors import AntsError, checked_whole
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.policies import checked_table, checked_values
from taichi_ants.records import Record
from taichi_ants.task import Task
from taichi_ants.task.constants import EPISODE_STEPS, N_ACTIONS
from taichi_ants.task.events import Event
from taichi_ants.worlds.world import World

MAX_ROLLOUT_STEPS = 1_000_000
MAX_TABLE_ROWS = 12_800_000  # of 32 bytes each; a trace keeps the table after each training step


@dataclass(frozen=True, eq=False)
class RolloutArguments:
    """The arguments of `rollout` or `trace_training` that reproduce a trace.

    `q_values`, float (n_states, 5), is the table that the ant followed with `epsilon`; None if the
    ant learned. `config` configures its learner; None if the ant did not learn.
    """

    world: World
    task: Task
    seed: int
    max_steps: int
    number: int = 0
    q_values: np.ndarray | None = None
    epsilon: float = 0.0
    config: TrainingConfig | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Trace(Record):
    """The record of n steps; cell, heading and state are those before the action.

    Attributes (int32 (n,) unless noted):
        episodes: Number of the episode, from 0; in `trace_policies`, number of the policy.
        steps: Number of the step in its episode, from 0.
        cells: int32 (n, 3), cube coordinates in normal form.
        headings: Heading of the ant, 0 to 5.
        paper_states, states: The paper's state, see `taichi_ants.task.states`; state index, which
            is the same with the paper's observation.
        actions, rewards, events: Action, 0 to 4; its reward; its result, see `Event`.
        executed: Action as executed, which differs from the chosen one only if actions slip.
        next_paper_states, next_states: The paper's state and state index after the step.
        terminated: bool (n,), whether the learner treated the next state as terminal.
        q_values: float32 (n, 5), the action values of the state when the action was chosen.
        td_errors: float32 (n,), the TD error of the step; None without learning.
        tables: float32 (n, n_states, 5), the Q table after the step; None without learning.
        arguments: Those that reproduce it; None for several policies, or if you made it yourself.
    """

    episodes: np.ndarray
    steps: np.ndarray
    cells: np.ndarray
    headings: np.ndarray
    paper_states: np.ndarray
    states: np.ndarray
    actions: np.ndarray
    rewards: np.ndarray
    next_paper_states: np.ndarray
    next_states: np.ndarray
    terminated: np.ndarray
    events: np.ndarray
    q_values: np.ndarray
    td_errors: np.ndarray | None = None
    tables: np.ndarray | None = None
    executed: np.ndarray | None = None
    arguments: RolloutArguments | None = field(default=None, compare=False, repr=False)

    def __len__(self) -> int:
        return len(self.steps)

    @property
    def delivered(self) -> np.ndarray:
        """Whether the ant delivered in each step, bool (n,)."""
        return self.events == Event.DELIVERED


def rollout(
    world: World,
    q_values: np.ndarray,
    seed: int = 0,
    number: int = 0,
    max_steps: int = EPISODE_STEPS,
    task: Task | None = None,
    epsilon: float = 0.0,
) -> Trace:
    """Return the trace of one episode with a table (n_states, 5): rollout `number` of the seed.

    Instead of the table, you can pass the `TrainingResult` of a single run, or a `Policy`. Other
    arguments and errors are those of `evaluate`. Numbers start at 0.
    """
    task = arguments.checked_lone_task(task)
    max_steps = arguments.checked_max_steps(max_steps, task)
    table = checked_table(q_values, task)
    seeds = arguments.checked_seeds_for(seed, ())
    numbers = np.array([checked_whole("number", number, least=0)])
    epsilon = arguments.checked_share("epsilon", epsilon)
    trace = _trace(world, task, Runs.following(table[None], seeds, numbers, epsilon), max_steps)
    made_by = RolloutArguments(
        world, task, int(seeds[0]), max_steps, int(numbers[0]), table.copy(), epsilon
    )
    return replace(trace, arguments=made_by)


def trace_policies(
    world: World,
    q_values: np.ndarray,
    seeds: Sequence[int],
    max_steps: int = EPISODE_STEPS,
    task: Task | None = None,
) -> Iterator[Trace]:
    """Yield the traces of rollout 0 of many policies (n, n_states, 5), some policies at a time.

    `seeds` has one seed per policy, and may repeat seeds. Other arguments are those of `evaluate`.
    """
    task = arguments.checked_lone_task(task)
    tables = checked_values(q_values, task)
    arguments.checked_world(world)
    # A step needs ten times as much memory as a cell of the world.
    per_policy = max(arguments.checked_max_steps(max_steps, task), world.grid.size // 10)
    for first in range(0, len(tables), size := max(1, MAX_ROLLOUT_STEPS // per_policy)):
        some = tables[first : first + size]
        words = np.array(seeds[first : first + size], dtype=object)
        runs = Runs.following(some, words, np.zeros(1, dtype=int), epsilon=0.0)
        trace = _trace(world, task, runs, max_steps)
        yield replace(trace, episodes=trace.episodes + first)


def trace_training(
    world: World,
    config: TrainingConfig,
    seed: int = 0,
    episodes: int = 1,
    max_steps: int = EPISODE_STEPS,
    task: Task | None = None,
) -> Trace:
    """Return the trace of the first episodes of one training run, with the Q table after each step.

    Arguments and errors are those of `train`; episodes * max_steps * n_states is limited to 12.8
    million.
    """
    arguments.checked_world(world, learns=True)
    task = arguments.checked_lone_task(task)
    max_steps = arguments.checked_max_steps(max_steps, task)
    several = arguments.checked_configs(config, task)
    if len(several) > 1:
        raise AntsError(f"config has {len(several)} configurations; pass a single one.")
    seeds = arguments.checked_seeds_for(seed, ())
    state = RunState.initial(several, seeds.tolist(), task.n_states).part([0])
    runs = Runs.learning(several, seeds.tolist(), state)
    trace = _trace(world, task, runs, max_steps, checked_whole("episodes", episodes))
    return replace(
        trace, arguments=RolloutArguments(world, task, int(seeds[0]), max_steps, config=several[0])
    )


def _trace(world: World, task: Task, runs: Runs, max_steps: int, episodes: int = 1) -> Trace:
    """Return the trace of runs, or of one run if it learns, with episodes numbered in sequence."""
    capacity = episodes * max_steps
    learns = runs.learner is not None
    most = MAX_TABLE_ROWS // task.n_states if learns else MAX_ROLLOUT_STEPS
    if capacity > most:
        raise AntsError(
            f"episodes * max_steps is {capacity}; a trace has at most {most} steps, so reduce one "
            "of them."
        )
    arguments.checked_world(world)
    runtime.start()
    before = runs.state.q[:, 0, :, :N_ACTIONS].copy()
    tables = np.empty((capacity if learns else 0, *runs.state.q.shape[2:]), dtype=np.float32)
    launcher, everything = Launcher(world, task, max_steps, runs, traced=True), slice(0, len(runs))
    recorded, errors, _, run = _launch(
        launcher, runs, everything, slice(0, episodes), max_steps, tables
    )
    recorded["episodes"] += run.astype(np.int32) * episodes
    recorded["cells"] = world.grid.cells(recorded["cells"])
    recorded["terminated"] = recorded["terminated"].astype(bool)
    if not learns:
        return Trace(**recorded, q_values=before[run, recorded["states"]])
    n = len(run)
    after = tables[:n, :, :N_ACTIONS]
    values = np.concatenate([before, after[:-1]])[np.arange(n), recorded["states"]]
    return Trace(**recorded, q_values=values, td_errors=errors, tables=after)


def record_steps(
    world: World,
    task: Task,
    max_steps: int,
    runs: Runs,
    episodes: int,
    progress: Progress | None = None,
) -> Iterator[tuple[dict[str, np.ndarray], np.ndarray, np.ndarray]]:
    """Yield the steps of the next episodes of many runs, in pieces, and update the runs' state.

    A piece is the columns of a trace, with episodes numbered from 0 in each run; the probability of
    each action, float64 (n,); and the number of the run, int64 (n,). Pieces of a run are in order.
    """
    arguments.check_progress(progress)
    runtime.start()
    launcher = Launcher(world, task, max_steps, runs, traced=True)
    runs_each = max(1, min(len(runs), MAX_ROLLOUT_STEPS // max_steps))
    episodes_each = max(1, MAX_ROLLOUT_STEPS // (runs_each * max_steps))
    for some, part in pieces(len(runs), episodes, runs_each, episodes_each, progress):
        columns, _, chances, run = _launch(launcher, runs, some, part, max_steps)
        columns["episodes"] += part.start
        yield columns, chances, run + some.start


def _launch(
    launcher: Launcher,
    runs: Runs,
    some: slice,
    part: slice,
    max_steps: int,
    tables: np.ndarray | None = None,
) -> tuple[dict[str, Any], np.ndarray, np.ndarray, np.ndarray]:
    """Return columns, TD errors, probabilities of actions, and runs of some episodes of some runs.

    If `tables` is given, write the table after each step into it.
    """
    n_runs, n_episodes = some.stop - some.start, part.stop - part.start
    capacity = n_episodes * max_steps  # the most steps of a run
    rows, learns = n_runs * capacity, runs.learner is not None
    integers = np.empty((rows, len(TRACE)), dtype=np.int32)
    errors, chances = np.empty(rows if learns else 0, np.float32), np.empty(rows)
    outcomes = np.zeros((len(OUTCOMES), n_runs, n_episodes), dtype=np.int32)
    keeps = {} if tables is None else {"keeps_tables": 1, "trace_tables": tables.reshape(-1)}
    launcher.launch(
        some,
        part,
        outcomes=outcomes,
        trace=integers,
        trace_errors=errors,
        trace_chances=chances,
        **keeps,
    )
    steps_of_run = outcomes[STEPS].sum(axis=1)
    taken = (np.arange(capacity) < steps_of_run[:, None]).reshape(-1)
    columns = dict(zip(TRACE, integers[taken].T, strict=True))
    run = np.repeat(np.arange(n_runs), steps_of_run)
    return columns, errors[taken] if learns else errors, chances[taken], run
