"""Step-by-step traces of the engine of independent runs, for pictures, teaching and tests.

Traces come from the same kernel as training and evaluation, compiled to record each step.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
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
    task, max_steps = arguments.checked_run(world, task, max_steps)
    table = checked_table(q_values, task)
    seeds = arguments.checked_seeds_for(seed, ())
    number = checked_whole("number", number, least=0)
    epsilon = arguments.checked_share("epsilon", epsilon)
    runs = Runs.following(table[None], seeds, np.array([number]), epsilon)
    seed, kept = int(seeds[0]), table.copy()
    made_by = RolloutArguments(world, task, seed, max_steps, number, kept, epsilon)
    return next(_followed(world, task, runs, max_steps, made_by))


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
    task, max_steps = arguments.checked_run(world, task, max_steps)
    tables = checked_values(q_values, task)
    runs = Runs.following(tables, np.array(seeds, dtype=object), np.zeros(1, dtype=int), 0.0)
    yield from _followed(world, task, runs, max_steps)


def _followed(
    world: World, task: Task, runs: Runs, max_steps: int, made_by: RolloutArguments | None = None
) -> Iterator[Trace]:
    """Yield the traces of one rollout of each policy; its number is that of the episode."""
    _check_length(max_steps, MAX_ROLLOUT_STEPS)
    for steps in record_steps(world, task, max_steps, runs, episodes=1):
        values = runs.state.q[steps["runs"], 0, steps["states"], :N_ACTIONS]
        steps["episodes"] = steps["runs"].astype(np.int32)
        yield _trace(world, steps, q_values=values, arguments=made_by)


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
    task, max_steps = arguments.checked_run(world, task, max_steps, learns=True)
    episodes = checked_whole("episodes", episodes)
    several = arguments.checked_configs(config, task)
    if len(several) > 1:
        raise AntsError(f"config has {len(several)} configurations; pass a single one.")
    _check_length(episodes * max_steps, min(MAX_ROLLOUT_STEPS, MAX_TABLE_ROWS // task.n_states))
    seeds = arguments.checked_seeds_for(seed, ()).tolist()
    runs = Runs.learning(several, seeds, RunState.initial(several, seeds, task.n_states).part([0]))
    before = runs.state.q[:, 0, :, :N_ACTIONS].copy()
    tables = np.empty((episodes * max_steps, *runs.state.q.shape[2:]), dtype=np.float32)
    (steps,) = record_steps(world, task, max_steps, runs, episodes, tables=tables)
    n = len(steps["states"])
    after = tables[:n, :, :N_ACTIONS]
    values = np.concatenate([before, after[:-1]])[np.arange(n), steps["states"]]
    made_by = RolloutArguments(world, task, seeds[0], max_steps, config=several[0])
    more = {"q_values": values, "td_errors": steps["td_errors"], "tables": after}
    return _trace(world, steps, **more, arguments=made_by)


def _check_length(steps: int, most: int) -> None:
    """Raise AntsError if a trace would be too long."""
    if steps > most:
        raise AntsError(
            f"episodes * max_steps is {steps}; a trace has at most {most} steps, so reduce one of "
            "them."
        )


def _trace(world: World, steps: dict[str, np.ndarray], **more: Any) -> Trace:
    """Return the trace of recorded steps."""
    columns: dict[str, Any] = {name: steps[name] for name in TRACE}
    columns["cells"] = world.grid.cells(columns["cells"])
    columns["terminated"] = columns["terminated"].astype(bool)
    return Trace(**columns, **more)


def record_steps(
    world: World,
    task: Task,
    max_steps: int,
    runs: Runs,
    episodes: int,
    progress: Progress | None = None,
    tables: np.ndarray | None = None,
) -> Iterator[dict[str, np.ndarray]]:
    """Yield the steps of the next episodes of many runs, in pieces, and update the runs' state.

    A piece is the columns `TRACE`, with episodes numbered from 0 in each run, and further arrays
    (n,). They are "runs", the number of the run, int64; "chances", the probability of each action,
    float64; and "td_errors", float32, of learners. Pieces of a run are in order. If `tables` is given, the
    kernel writes the table after each step of the piece into it.
    """
    runtime.start()
    launcher = Launcher(world, task, max_steps, runs, traced=True)
    keeps = {} if tables is None else {"keeps_tables": 1, "trace_tables": tables}
    # A step needs ten times as much memory as a cell of the world.
    most_runs = MAX_ROLLOUT_STEPS // max(max_steps, world.grid.size // 10)
    runs_each = max(1, min(len(runs), most_runs))
    episodes_each = max(1, MAX_ROLLOUT_STEPS // (runs_each * max_steps))
    for some, part in pieces(len(runs), episodes, runs_each, episodes_each, progress):
        n_runs, n_episodes = some.stop - some.start, part.stop - part.start
        capacity = n_episodes * max_steps  # the most steps of a run
        integers = np.empty((n_runs * capacity, len(TRACE)), np.int32)
        chances, errors = np.empty(n_runs * capacity), np.empty(n_runs * capacity, np.float32)
        outcomes = np.zeros((len(OUTCOMES), n_runs, n_episodes), np.int32)
        arrays = {"trace": integers, "trace_errors": errors, "trace_chances": chances}
        launcher.launch(some, part, outcomes=outcomes, **arrays, **keeps)
        steps_of_run = outcomes[STEPS].sum(axis=1)
        taken = (np.arange(capacity) < steps_of_run[:, None]).reshape(-1)
        columns = dict(zip(TRACE, integers[taken].T, strict=True))
        columns["episodes"] += part.start
        columns["runs"] = np.repeat(np.arange(some.start, some.stop), steps_of_run)
        yield {**columns, "chances": chances[taken], "td_errors": errors[taken]}
