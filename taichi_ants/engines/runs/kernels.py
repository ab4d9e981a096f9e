"""The kernel of independent runs: whole episodes, with one parallel task per run.

The data of a run (cells, Q table, memory) are small enough for the processor's first cache.
"""

from collections.abc import Callable
from dataclasses import fields
from functools import cache
from typing import Any

import taichi as ti

from taichi_ants.arithmetic.random_bits import advance, bits_of
from taichi_ants.engines.launch import has_guards
from taichi_ants.engines.layout import (
    DELIVERIES,
    DISCOUNT,
    EPSILON_DECAY,
    EXTRA_CELLS,
    LEARNING_RATE_DECAY,
    MIN_EPSILON,
    MIN_LEARNING_RATE,
    N_SETTINGS,
    RETURNS,
    STEPS,
)
from taichi_ants.engines.runs.step import Ant, Rules, act, ant_view, observe_function, restore
from taichi_ants.features import hooks_at
from taichi_ants.learners.config import Hyperparameters
from taichi_ants.learners.learner import Learner
from taichi_ants.learners.memory import At, LearnerArrays, Transition, read_rates, values_of
from taichi_ants.task.constants import ROW, Event
from taichi_ants.task.rules.actions import step_end
from taichi_ants.task.rules.policy import BY_VALUES, chance_of, choose

# The largest index into arrays, see `engine.size_of_launch`. The mask tells the compiler that
# indices are not negative.
_PLACES = 2**30 - 1
THREADS_OF_BLOCK = 32  # which a GPU starts together


@cache
def run_kernel(
    rules: Rules, learner: Learner | None, traced: bool, arguments: Any
) -> Callable[..., None]:
    """Return the kernel for runs that learn, or that follow a fixed policy if `learner` is None.

    Random draws are in the order of a colony's. If `traced`, the kernel also records each step, in
    `n_episodes * max_steps` rows per run. `arguments` is the type of the argument pack.
    """
    learns = learner is not None
    on_policy = learns and learner.draws_next_action
    begins = learns and learner.begin is not None
    hyperparameters = learner.hyperparameters if learns else Hyperparameters
    read = read_rates(hyperparameters)
    columns = N_SETTINGS + len(fields(hyperparameters))
    observe, executes = observe_function(rules), hooks_at(rules.features)["execute"]
    draw, chance_of_draw = BY_VALUES.get(rules.choice, (None, None))
    n_states = rules.observation.n_states
    table = n_states * ROW
    # A CPU distributes runs one by one, as they are uneven.
    block = THREADS_OF_BLOCK if has_guards(arguments) else 1

    @ti.func
    def decide(a: ti.template(), begin, ant, state, explore_below):
        """Return the next action, the stream after the draw and, if traced, the probability."""
        rng, values = advance(ant.random_state), values_of(a.q, begin, state)
        action, chance = 0, ti.f64(0.0)
        if ti.static(draw):
            action = draw(ant_view(a, ant), values, bits_of(rng), explore_below)
            if ti.static(traced):
                chance = chance_of_draw(ant_view(a, ant), values, action, explore_below)
        else:
            action = choose(values, bits_of(rng), explore_below)
            if ti.static(traced):
                chance = chance_of(values, action, explore_below)
        return action, rng, chance

    @ti.func
    def record(
        a: ti.template(), n, episode, step, before, paper_state, taken, executed, after, seen
    ):
        """Record the integers of a step."""
        a.trace[n, 0], a.trace[n, 1] = episode, step
        a.trace[n, 2], a.trace[n, 3] = before.cell, before.heading
        a.trace[n, 4], a.trace[n, 5] = paper_state, taken.state
        a.trace[n, 6], a.trace[n, 7] = taken.action, a.rewards[after.event]
        a.trace[n, 8], a.trace[n, 9] = seen, taken.next_state
        a.trace[n, 10], a.trace[n, 11] = taken.terminated, after.event
        a.trace[n, 12] = executed

    @ti.kernel
    def run(a: arguments):
        memory = ti.static(LearnerArrays(a.q, a.floats, a.integers, n_states))
        ti.loop_config(block_dim=block)
        for i in range(a.n_runs):
            base, first = i * (a.size + EXTRA_CELLS), i * columns
            at = At(
                i * a.tables * table & _PLACES,
                i * a.floats_by_8 * 8 & _PLACES,
                i * a.integers_by_8 * 8 & _PLACES,
            )
            discount = ti.cast(a.settings[first + DISCOUNT], ti.f32)
            restore(a, base, 0, 0, a.size - 1)
            rng, exploration, rate = a.random_states[i], a.epsilon[i], a.learning_rate[i]
            n_recorded = i * a.n_episodes * a.max_steps
            for episode in range(a.n_episodes):
                if ti.static(not learns):
                    rng = a.streams[i * a.n_episodes + episode]
                if ti.static(begins):
                    learner.begin(memory, at)
                ant = Ant(cell=a.start_cells[i], heading=a.start_headings[i], random_state=rng)
                rates = read(
                    ti.cast(rate, ti.f32),
                    discount,
                    ti.cast(exploration, ti.f32),
                    a.settings,
                    first + N_SETTINGS,
                )
                explore_below = ti.cast(exploration * 4294967296.0, ti.u64)
                step, clock, total, next_action = 0, 0, 0, -1
                next_chance = ti.f64(0.0)  # probability of a next action drawn before learning
                paper_state, state, ant.random_state = observe(a, base, ant, clock)
                if ti.static(on_policy):
                    next_action, ant.random_state, next_chance = decide(
                        a, at.table, ant, state, explore_below
                    )
                while step < a.max_steps and ant.event != Event.DELIVERED:
                    action, chance = next_action, next_chance
                    if ti.static(not on_policy):
                        action, ant.random_state, chance = decide(
                            a, at.table, ant, state, explore_below
                        )
                    if ti.static(traced):
                        a.trace_chances[n_recorded] = chance
                    executed = action
                    for execute in ti.static(executes):
                        executed, ant.random_state = execute(
                            ant_view(a, ant), executed, ant.random_state
                        )
                    before = ant
                    ant = act(rules.deposit, True, a, base, ant, paper_state, executed, clock)
                    clock += a.evaporates
                    reward = a.rewards[ant.event]
                    total += reward
                    seen, next_state, ant.random_state = observe(a, base, ant, clock)
                    last = ti.cast(step + 1 == a.max_steps, ti.i32)
                    terminated, truncated = step_end(ant.event, a.delivery_terminates, 1, last)
                    if ti.static(on_policy):
                        next_action = -1
                        if terminated == 0:
                            next_action, ant.random_state, next_chance = decide(
                                a, at.table, ant, next_state, explore_below
                            )
                    taken = Transition(
                        state=state,
                        action=action,
                        reward=ti.cast(reward, ti.f32),
                        next_state=next_state,
                        next_action=next_action,
                        terminated=terminated,
                        truncated=truncated,
                    )
                    if ti.static(learns):
                        error, ant.random_state = learner.learn(
                            memory, at, taken, rates, ant.random_state
                        )
                        if ti.static(traced):
                            a.trace_errors[n_recorded] = error
                            if a.keeps_tables == 1:
                                for k in range(table):
                                    a.trace_tables[n_recorded * table + k] = a.q[at.table + k]
                    if ti.static(traced):
                        record(
                            *(a, n_recorded, episode, step, before, paper_state, taken, executed),
                            ant,
                            seen,
                        )
                        n_recorded += 1
                    paper_state, state = seen, next_state
                    step += 1
                rng = ant.random_state
                a.outcomes[RETURNS, i, episode], a.outcomes[STEPS, i, episode] = total, step
                a.outcomes[DELIVERIES, i, episode] = ti.cast(ant.event == Event.DELIVERED, ti.i32)
                restore(a, base, 0, a.cells[base + a.size], a.cells[base + a.size + 1])
                exploration = ti.max(
                    a.settings[first + MIN_EPSILON], exploration * a.settings[first + EPSILON_DECAY]
                )
                rate = ti.max(
                    a.settings[first + MIN_LEARNING_RATE],
                    rate * a.settings[first + LEARNING_RATE_DECAY],
                )
            a.random_states[i], a.epsilon[i], a.learning_rate[i] = rng, exploration, rate

    return run
