"""The kernel of the engine of independent runs: whole episodes, step by step, in one task a run.

All that a run touches (cells, Q-table, model) lies together and stays in the processor's first
cache. A launch cannot be interrupted, so that the engine cuts the work into short ones.
"""

from collections.abc import Callable
from functools import cache

import taichi as ti

from taichi_ants.engines.runs.learning import (
    MODEL,
    ROW,
    TABLE,
    Rates,
    plan,
    remember,
    update,
    values_of,
)
from taichi_ants.engines.runs.step import EXTRA_CELLS, Ant, act, observe, restore
from taichi_ants.engines.trial import tried
from taichi_ants.learners.registry import Learner
from taichi_ants.learners.td_errors import guarded
from taichi_ants.task.constants import DELIVERED
from taichi_ants.task.rules.policy import choose
from taichi_ants.task.rules.random_bits import advance, bits_of

_I32 = ti.types.ndarray(dtype=ti.i32, ndim=1)
_U8 = ti.types.ndarray(dtype=ti.u8, ndim=1)
_U64 = ti.types.ndarray(dtype=ti.u64, ndim=1)
_F32 = ti.types.ndarray(dtype=ti.f32, ndim=1)
_F64 = ti.types.ndarray(dtype=ti.f64, ndim=1)
_OUTCOMES = ti.types.ndarray(dtype=ti.i32, ndim=2)

# The columns of a trace, one row a step.
TRACE = (
    "episode",
    "step",
    "cell",
    "heading",
    "state",
    "action",
    "reward",
    "next_state",
    "terminated",
    "event",
)


@cache
def run_kernel(learner: Learner | None, traced: bool = False) -> Callable[..., None]:
    """The kernel for one learner, or for a fixed policy (None); it is compiled on first use.

    With `traced` each step is recorded too, in `n_episodes * max_steps` rows for each run.
    """
    learns = learner is not None
    on_policy = learns and learner.draws_next_action
    plans = learns and learner.plans
    td_error = guarded(tried(learner).td_error) if learns else None

    @ti.func
    def decide(q: ti.template(), table, ant, state, explore_below):
        """The ant's next action, and its stream after the draw."""
        rng = advance(ant.random_state)
        return choose(values_of(q, table, state), bits_of(rng), explore_below), rng

    @ti.func
    def record(
        trace: ti.template(), row, episode, step, before, state, action, reward, seen, ended, event
    ):
        """Write the integers of a step."""
        trace[row, 0], trace[row, 1] = episode, step
        trace[row, 2], trace[row, 3] = before.cell, before.heading
        trace[row, 4], trace[row, 5], trace[row, 6] = state, action, reward
        trace[row, 7], trace[row, 8], trace[row, 9] = seen, ended, event

    @ti.kernel
    def run(
        n_runs: ti.i32,
        n_episodes: ti.i32,
        max_steps: ti.i32,
        evaporation: ti.i32,
        size: ti.i32,
        world: _I32,
        closer: _U8,
        compass: _I32,
        rewards: _I32,
        starts: _I32,
        rates_of: _F32,
        exploration: _F64,
        settings: _I32,
        random_states: _U64,
        streams: _U64,
        q: _F32,
        entries: _I32,
        slots: _I32,
        cells: _I32,
        returns: _OUTCOMES,
        steps: _OUTCOMES,
        deliveries: _OUTCOMES,
        trace: _OUTCOMES,
        trace_errors: _F32,
        trace_tables: _F32,
    ):
        ti.loop_config(block_dim=1)
        for i in range(n_runs):
            base, table, model = i * (size + EXTRA_CELLS), i * TABLE, i * MODEL
            restore(cells, world, base, size, 0, size - 1)
            rng, epsilon = random_states[i], exploration[3 * i]
            n_visited, n_recorded = settings[3 * i + 2], i * n_episodes * max_steps
            for episode in range(n_episodes):
                if ti.static(not learns):
                    rng = streams[i * n_episodes + episode]
                ant = Ant(cell=starts[2 * i], heading=starts[2 * i + 1], random_state=rng)
                rates = Rates(rates_of[2 * i], rates_of[2 * i + 1], ti.cast(epsilon, ti.f32))
                explore_below = ti.cast(epsilon * 4294967296.0, ti.u64)
                step, clock, total, next_action = 0, 0, 0, -1
                state = observe(cells, closer, compass, base, ant, clock)
                if ti.static(on_policy):
                    next_action, ant.random_state = decide(q, table, ant, state, explore_below)
                while step < max_steps and ant.event != DELIVERED:
                    action = next_action
                    if ti.static(not on_policy):
                        action, ant.random_state = decide(q, table, ant, state, explore_below)
                    before = ant
                    ant = act(cells, compass, base, size, ant, state, action, clock)
                    clock += evaporation
                    reward = rewards[ant.event]
                    total += reward
                    seen = observe(cells, closer, compass, base, ant, clock)
                    ended = ti.cast(ant.event == DELIVERED, ti.i32) & (1 - settings[3 * i + 1])
                    if ti.static(on_policy):
                        next_action = -1
                        if ended == 0:
                            next_action, ant.random_state = decide(
                                q, table, ant, seen, explore_below
                            )
                    if ti.static(learns):
                        pair = state * ROW + action
                        error = update(
                            td_error, q, table, rates, pair, reward, ended, seen, next_action
                        )
                        if ti.static(plans):
                            n_visited = remember(
                                entries, slots, model, n_visited, pair, ant.event, ended, seen
                            )
                            ant.random_state = plan(
                                td_error,
                                q,
                                entries,
                                rewards,
                                table,
                                model,
                                rates,
                                n_visited,
                                settings[3 * i],
                                ant.random_state,
                            )
                        if ti.static(traced):
                            trace_errors[n_recorded] = error
                            for k in range(TABLE):
                                trace_tables[n_recorded * TABLE + k] = q[table + k]
                    if ti.static(traced):
                        record(
                            trace,
                            n_recorded,
                            episode,
                            step,
                            before,
                            state,
                            action,
                            reward,
                            seen,
                            ended,
                            ant.event,
                        )
                        n_recorded += 1
                    state = seen
                    step += 1
                rng = ant.random_state
                returns[i, episode], steps[i, episode] = total, step
                deliveries[i, episode] = ti.cast(ant.event == DELIVERED, ti.i32)
                first, last = cells[base + size], cells[base + size + 1]
                restore(cells, world, base, size, first, last)
                epsilon = ti.max(exploration[3 * i + 2], epsilon * exploration[3 * i + 1])
            random_states[i], exploration[3 * i] = rng, epsilon
            settings[3 * i + 2] = n_visited

    return run
