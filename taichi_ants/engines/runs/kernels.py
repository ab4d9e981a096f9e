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
from taichi_ants.task.rules.policy import (
    BY_VALUES,
    best_actions,
    chance_of,
    choose,
    choose_in_crowd,
)

# The largest index into arrays, see `engine.size_of_launch`. The mask tells the compiler that
# indices are not negative.
_PLACES = 2**30 - 1
THREADS_OF_BLOCK = 32  # which a GPU starts together
# Runs that a CPU thread takes in turns: each operation of a step waits for the one before, so a
# processor that has several steps to do is busy while one of them waits.
TOGETHER = 4


@cache
def _lanes_type(n: int) -> Any:
    """Return the type of the runs of a task, in n lanes: vectors of what lasts between steps."""
    whole, real, word = (ti.types.vector(n, kind) for kind in (ti.i32, ti.f32, ti.u64))
    numbers = (
        *("run", "episode", "step", "clock", "base", "cell", "heading", "carries", "carried"),
        *("paper_state", "state", "action", "event", "next_state", "total", "recorded"),
    )
    return ti.types.struct(
        **dict.fromkeys(numbers, whole),
        **dict.fromkeys(("learning_rate", "discount", "epsilon"), real),
        **dict.fromkeys(("random_state", "explore_below"), word),
        chance=ti.types.vector(n, ti.f64),
    )


@cache
def run_kernel(
    rules: Rules, learner: Learner | None, traced: bool, together: int, arguments: Any
) -> Callable[..., None]:
    """Return the kernel for runs that learn, or that follow a fixed policy if `learner` is None.

    A task takes `together` runs at a time, each in a lane, and another run when one has ended.
    Random draws are in the order of a colony's. If `traced`, the kernel also records each step, in
    `n_episodes * max_steps` rows per run. `arguments` is the type of the argument pack.
    """
    learns = learner is not None
    on_policy = learns and learner.draws_next_action
    begins = learns and learner.begin is not None
    hyperparameters = learner.hyperparameters if learns else Hyperparameters
    read = read_rates(hyperparameters)
    columns = N_SETTINGS + len(fields(hyperparameters))
    # The steps of one run repeat, but those of several runs cannot be predicted.
    predictable = together == 1
    observe, executes = observe_function(rules, predictable), hooks_at(rules.features)["execute"]
    draw, chance_of_draw = BY_VALUES.get(rules.choice, (None, None))
    n_states = rules.observation.n_states
    table = n_states * ROW
    # A CPU distributes tasks one by one, as runs are uneven.
    block = THREADS_OF_BLOCK if has_guards(arguments) else 1
    lanes_type = _lanes_type(together)

    @ti.func
    def at_of(a: ti.template(), run):
        """Return the place of a run in the memory of learners."""
        return At(
            run * a.tables * table & _PLACES,
            run * a.floats_by_8 * 8 & _PLACES,
            run * a.integers_by_8 * 8 & _PLACES,
        )

    @ti.func
    def ant_of(lanes: ti.template(), k):
        """Return the ant in lane k."""
        return Ant(
            cell=lanes.cell[k],
            heading=lanes.heading[k],
            carries=lanes.carries[k],
            carried=lanes.carried[k],
            random_state=lanes.random_state[k],
        )

    @ti.func
    def decide(a: ti.template(), lanes: ti.template(), k, state):
        """Draw the next action in lane k; if traced, also compute its probability."""
        rng = advance(lanes.random_state[k])
        lanes.random_state[k] = rng
        values = values_of(a.q, lanes.run[k] * a.tables * table & _PLACES, state)
        explore_below, action = lanes.explore_below[k], 0
        if ti.static(draw):
            ant = ant_of(lanes, k)
            action = draw(ant_view(a, ant), values, bits_of(rng), explore_below)
            if ti.static(traced):
                lanes.chance[k] = chance_of_draw(ant_view(a, ant), values, action, explore_below)
        else:
            if ti.static(predictable):
                action = choose(values, bits_of(rng), explore_below)
            else:
                best = best_actions(values)
                action = choose_in_crowd(a.compass, best, bits_of(rng), explore_below)
            if ti.static(traced):
                lanes.chance[k] = chance_of(values, action, explore_below)
        lanes.action[k] = action

    @ti.func
    def begin_episode(a: ti.template(), memory: ti.template(), lanes: ti.template(), k):
        """Begin an episode in lane k, and a run if it is the first one."""
        run, episode, base = lanes.run[k], lanes.episode[k], lanes.base[k]
        if episode == 0:
            lanes.random_state[k] = a.random_states[run]
            lanes.discount[k] = ti.cast(a.settings[run * columns + DISCOUNT], ti.f32)
            restore(a, base, 0, 0, a.size - 1)
        if ti.static(not learns):
            lanes.random_state[k] = a.streams[run * a.n_episodes + episode]
        if ti.static(begins):
            learner.begin(memory, at_of(a, run))
        lanes.learning_rate[k] = ti.cast(a.learning_rate[run], ti.f32)
        lanes.epsilon[k] = ti.cast(a.epsilon[run], ti.f32)
        lanes.explore_below[k] = ti.cast(a.epsilon[run] * 4294967296.0, ti.u64)
        lanes.cell[k], lanes.heading[k] = a.start_cells[run], a.start_headings[run]
        lanes.carries[k], lanes.carried[k], lanes.clock[k], lanes.total[k] = 0, 0, 0, 0
        lanes.paper_state[k], lanes.state[k], lanes.random_state[k] = observe(
            a, base, ant_of(lanes, k), 0
        )
        if ti.static(on_policy):
            decide(a, lanes, k, lanes.state[k])

    @ti.func
    def move(a: ti.template(), memory: ti.template(), lanes: ti.template(), k):
        """Do the first half of a step in lane k: choose, act and observe."""
        if lanes.step[k] == 0:
            begin_episode(a, memory, lanes, k)
        if ti.static(not on_policy):
            decide(a, lanes, k, lanes.state[k])
        ant, base, clock = ant_of(lanes, k), lanes.base[k], lanes.clock[k]
        paper_state, executed = lanes.paper_state[k], lanes.action[k]
        for execute in ti.static(executes):
            executed, ant.random_state = execute(ant_view(a, ant), executed, ant.random_state)
        if ti.static(traced):
            row = lanes.recorded[k]
            a.trace_chances[row] = lanes.chance[k]
            a.trace[row, 0], a.trace[row, 1] = lanes.episode[k], lanes.step[k]
            a.trace[row, 2], a.trace[row, 3] = ant.cell, ant.heading
            a.trace[row, 4], a.trace[row, 5] = paper_state, lanes.state[k]
            a.trace[row, 6], a.trace[row, 12] = lanes.action[k], executed
        ant = act(rules.deposit, predictable, a, base, ant, paper_state, executed, clock)
        clock += a.evaporates
        lanes.paper_state[k], lanes.next_state[k], lanes.random_state[k] = observe(
            a, base, ant, clock
        )
        lanes.cell[k], lanes.heading[k], lanes.clock[k] = ant.cell, ant.heading, clock
        lanes.carries[k], lanes.carried[k], lanes.event[k] = ant.carries, ant.carried, ant.event

    @ti.func
    def learn(a: ti.template(), memory: ti.template(), lanes: ti.template(), k):
        """Do the second half of a step in lane k, and return whether no run is left for it."""
        run, event, action = lanes.run[k], lanes.event[k], lanes.action[k]
        reward, next_state = a.rewards[event], lanes.next_state[k]
        last = ti.cast(lanes.step[k] + 1 == a.max_steps, ti.i32)
        terminated, truncated = step_end(event, a.delivery_terminates, 1, last)
        next_action = -1
        if ti.static(on_policy):
            if terminated == 0:
                decide(a, lanes, k, next_state)
                next_action = lanes.action[k]
        if ti.static(learns):
            at, rates = (
                at_of(a, run),
                read(
                    lanes.learning_rate[k],
                    lanes.discount[k],
                    lanes.epsilon[k],
                    a.settings,
                    run * columns + N_SETTINGS,
                ),
            )
            taken = Transition(
                state=lanes.state[k],
                action=action,
                reward=ti.cast(reward, ti.f32),
                next_state=next_state,
                next_action=next_action,
                terminated=terminated,
                truncated=truncated,
            )
            error, lanes.random_state[k] = learner.learn(
                memory, at, taken, rates, lanes.random_state[k]
            )
            if ti.static(traced):
                row = lanes.recorded[k]
                a.trace_errors[row] = error
                if a.keeps_tables == 1:
                    for i in range(table):
                        a.trace_tables[row * table + i] = a.q[at.table + i]
        if ti.static(traced):
            row = lanes.recorded[k]
            a.trace[row, 7], a.trace[row, 8] = reward, lanes.paper_state[k]
            a.trace[row, 9], a.trace[row, 10] = next_state, terminated
            a.trace[row, 11] = event
            lanes.recorded[k] = row + 1
        lanes.total[k] += reward
        lanes.state[k] = next_state
        lanes.step[k] += 1
        is_over = 0
        if (last == 1) | (event == Event.DELIVERED):
            end_episode(a, lanes, k)
            is_over = ti.cast(lanes.run[k] >= a.n_runs, ti.i32)
        return is_over

    @ti.func
    def end_episode(a: ti.template(), lanes: ti.template(), k):
        """Write the results of an episode, and take another run after the last one."""
        run, episode, base = lanes.run[k], lanes.episode[k], lanes.base[k]
        a.outcomes[RETURNS, run, episode] = lanes.total[k]
        a.outcomes[STEPS, run, episode] = lanes.step[k]
        a.outcomes[DELIVERIES, run, episode] = ti.cast(lanes.event[k] == Event.DELIVERED, ti.i32)
        restore(a, base, 0, a.cells[base + a.size], a.cells[base + a.size + 1])
        first = run * columns
        a.epsilon[run] = ti.max(
            a.settings[first + MIN_EPSILON], a.epsilon[run] * a.settings[first + EPSILON_DECAY]
        )
        a.learning_rate[run] = ti.max(
            a.settings[first + MIN_LEARNING_RATE],
            a.learning_rate[run] * a.settings[first + LEARNING_RATE_DECAY],
        )
        lanes.episode[k], lanes.step[k] = episode + 1, 0
        if episode + 1 == a.n_episodes:
            a.random_states[run] = lanes.random_state[k]
            lanes.run[k], lanes.episode[k] = ti.atomic_add(a.begun[0], 1), 0

    @ti.kernel
    def do_runs(a: arguments):
        memory = ti.static(LearnerArrays(a.q, a.floats, a.integers, n_states))
        ti.loop_config(block_dim=block)
        for task in range(a.n_tasks):
            lanes, active = lanes_type(), 0
            for k in range(together):
                run = task + k * a.n_tasks
                lanes.run[k], lanes.base[k] = run, run * (a.size + EXTRA_CELLS)
                lanes.recorded[k] = run * a.n_episodes * a.max_steps
                active += ti.cast(run < a.n_runs, ti.i32)
            while active > 0:
                for k in range(together):
                    if lanes.run[k] < a.n_runs:
                        move(a, memory, lanes, k)
                for k in range(together):
                    if lanes.run[k] < a.n_runs:
                        active -= learn(a, memory, lanes, k)

    return do_runs
