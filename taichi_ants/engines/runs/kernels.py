"""The kernels of single ants, each in a world of its own.

`run_kernel` does whole episodes, step by step, in one task a run. All that a run touches (cells,
Q-table, memory) lies together and stays in the processor's first cache. A launch cannot be
interrupted, so that the engine cuts the work into short ones. `step_kernel` does one step of many
ants, whose actions come from outside.
"""

from collections.abc import Callable
from dataclasses import fields
from functools import cache
from typing import Any

import taichi as ti

from taichi_ants.engines.layout import (
    DELIVERIES,
    DISCOUNT,
    EPSILON_DECAY,
    LEARNING_RATE_DECAY,
    MIN_EPSILON,
    MIN_LEARNING_RATE,
    N_SETTINGS,
    RETURNS,
    STEPS,
    Command,
)
from taichi_ants.engines.plugin_check import checked_plugin
from taichi_ants.engines.runs.step import (
    EXTRA_CELLS,
    Ant,
    act,
    ground_of,
    percept_of,
    restore,
    state_seen,
)
from taichi_ants.learners.config import Hyperparameters
from taichi_ants.learners.learner import Learner
from taichi_ants.learners.memory import At, LearnerArrays, Transition, read_rates, values_of
from taichi_ants.task.constants import FOOD, FORWARD, PICK_UP, QUEEN, ROW
from taichi_ants.task.events import Event, Reason
from taichi_ants.task.observations import Observation
from taichi_ants.task.rules.actions import step_towards
from taichi_ants.task.rules.delivery import step_end
from taichi_ants.task.rules.pheromone import FADING
from taichi_ants.task.rules.policy import chance_of, choose
from taichi_ants.task.rules.random_bits import advance, bits_of

# Places in arrays lie below this, see `engine.size_of_launch`. To say so spares the compiler the
# case that they are negative.
_PLACES = 2**30 - 1


@cache
def run_kernel(
    learner: Learner | None,
    observation: Observation,
    deposit: int,
    half: bool,
    traced: bool,
    arguments: Any,
) -> Callable[..., None]:
    """The kernel for runs that learn, or follow a fixed policy; it is compiled on first use.

    `deposit` and `half` are the pheromone's, see `rules.pheromone` and `Pheromone.view`. If
    `traced`, each step is recorded too, in `n_episodes * max_steps` rows for each run. `arguments`
    is the type of the argument pack.
    """
    learns = learner is not None
    learner = checked_plugin(learner) if learns else None
    on_policy = learns and learner.draws_next_action
    begins = learns and learner.begin is not None
    hyperparameters = learner.hyperparameters if learns else Hyperparameters
    read = read_rates(hyperparameters)
    columns = N_SETTINGS + len(fields(hyperparameters))
    state_of = state_seen(observation, half)
    n_states = observation.n_states
    table = n_states * ROW

    @ti.func
    def decide(a: ti.template(), begin, ant, state, explore_below):
        """The ant's next action, its stream after the draw, and, if traced, the probability."""
        rng, values = advance(ant.random_state), values_of(a.q, begin, state)
        action, chance = choose(values, bits_of(rng), explore_below), ti.f64(0.0)
        if ti.static(traced):
            chance = chance_of(values, action, explore_below)
        return action, rng, chance

    @ti.func
    def record(a: ti.template(), n, episode, step, before, percept, taken, after, seen):
        """Write the integers of a step."""
        a.trace[n, 0], a.trace[n, 1] = episode, step
        a.trace[n, 2], a.trace[n, 3] = before.cell, before.heading
        a.trace[n, 4], a.trace[n, 5] = percept, taken.state
        a.trace[n, 6], a.trace[n, 7] = taken.action, a.rewards[after.event]
        a.trace[n, 8], a.trace[n, 9] = seen, taken.next_state
        a.trace[n, 10], a.trace[n, 11] = taken.terminated, after.event

    @ti.kernel
    def run(a: arguments):
        memory = ti.static(LearnerArrays(a.q, a.floats, a.integers, n_states))
        ti.loop_config(block_dim=1)
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
                next_chance = ti.f64(0.0)  # of the next action, where it is drawn before learning
                percept = percept_of(half, a, base, ant, clock)
                state = state_of(a, base, ant, clock, percept)
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
                    before = ant
                    ant = act(deposit, a, base, ant, percept, action, clock)
                    clock += a.evaporates
                    reward = a.rewards[ant.event]
                    total += reward
                    seen = percept_of(half, a, base, ant, clock)
                    next_state = state_of(a, base, ant, clock, seen)
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
                        record(a, n_recorded, episode, step, before, percept, taken, ant, seen)
                        n_recorded += 1
                    percept, state = seen, next_state
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


@ti.func
def reason_of(a: ti.template(), base, before, after, action):
    """Why an action was blocked or failed, as a `Reason`."""
    reason = ti.cast(Reason.NONE, ti.i32)
    if after.event == Event.BLOCKED:
        ahead = before.cell + step_towards(a.compass, after.heading, FORWARD)
        ground = ground_of(a.cells[base + ahead])
        reason = Reason.ROCK_OR_EDGE_AHEAD
        if ground == FOOD:
            reason = Reason.FOOD_AHEAD
        elif ground == QUEEN:
            reason = Reason.QUEEN_AHEAD
    elif after.event == Event.FAILED:
        if action == PICK_UP:
            reason = ti.select(
                before.carries == 1, Reason.CARRIES_FOOD_ALREADY, Reason.NO_FOOD_IN_VIEW
            )
        else:
            reason = ti.select(before.carries == 1, Reason.NO_QUEEN_IN_VIEW, Reason.CARRIES_NO_FOOD)
    return reason


@cache
def step_kernel(
    observation: Observation, deposit: int, half: bool, serial: bool, arguments: Any
) -> Callable[..., None]:
    """The kernel of a step: act, observe, and begin anew, with arguments as of `run_kernel`.

    If `serial`, one thread does all and no other one is woken.
    """
    state_of = state_seen(observation, half)

    @ti.func
    def put(a: ti.template(), i, ant):
        """Write down an ant."""
        a.ant_cells[i] = ant.cell
        a.headings[i], a.carries[i] = ti.cast(ant.heading, ti.u8), ti.cast(ant.carries, ti.u8)
        if ti.static(deposit == FADING):
            a.carried[i] = ant.carried

    @ti.func
    def observe(a: ti.template(), i, base, ant, clock):
        """Write down what an ant sees; its cells, or those of its unchanged world, are at base."""
        percept = percept_of(half, a, base, ant, clock)
        a.percepts[i] = ti.cast(percept, ti.u8)
        a.states[i] = state_of(a, base, ant, clock, percept)

    @ti.func
    def begin(a: ti.template(), i, own, origin):
        """Set a world and its ant to where an episode starts."""
        if a.changed[i] == 1:
            restore(a, own, origin, a.cells[own + a.size], a.cells[own + a.size + 1])
        ant = Ant(origin=origin, cell=a.start_cells[i], heading=a.start_headings[i])
        a.steps[i], a.changed[i] = 0, ti.cast(0, ti.u8)
        put(a, i, ant)
        observe(a, i, origin, ant, 0)

    @ti.func
    def do(a: ti.template(), i, own, origin, action):
        """An action of an ant; returns whether the episode has ended."""
        before = Ant(origin=origin, cell=a.ant_cells[i], heading=ti.cast(a.headings[i], ti.i32))
        before.carries = ti.cast(a.carries[i], ti.i32)
        if ti.static(deposit == FADING):
            before.carried = a.carried[i]
        if action == PICK_UP:  # only which of several foods it takes is left to chance
            before.random_state = a.random_states[i]
        # As long as an ant has changed nothing, it sees the cells that all ants of its world share:
        # they stay in the processor's cache.
        changed = ti.cast(a.changed[i], ti.i32)
        base = ti.select((changed == 1) | (action == PICK_UP), own, origin)
        clock, percept = a.steps[i] * a.evaporates, ti.cast(a.percepts[i], ti.i32)
        after = act(deposit, a, base, before, percept, action, clock)
        a.events[i] = ti.cast(after.event, ti.u8)
        a.reasons[i] = ti.cast(reason_of(a, base, before, after, action), ti.u8)
        if after.event == Event.PICKED_UP:
            changed, a.random_states[i] = 1, after.random_state
        a.changed[i] = ti.cast(changed, ti.u8)
        a.steps[i] = a.steps[i] + 1
        put(a, i, after)
        observe(a, i, ti.select(changed == 1, own, origin), after, clock + a.evaporates)
        last = ti.cast(a.steps[i] == a.max_steps, ti.i32)
        terminated, truncated = step_end(
            after.event, a.delivery_terminates, a.delivery_truncates, last
        )
        a.rewards_of[i] = a.rewards[after.event]
        a.terminations[i], a.truncations[i] = ti.cast(terminated, ti.u8), ti.cast(truncated, ti.u8)
        return terminated | truncated

    @ti.kernel
    def step(a: arguments):
        ti.loop_config(block_dim=1, serialize=serial)
        for chunk in range((a.n + a.per_chunk - 1) // a.per_chunk):
            for i in range(chunk * a.per_chunk, ti.min((chunk + 1) * a.per_chunk, a.n)):
                origin = a.worlds[i] * a.size
                own = a.shared_cells + i * (a.size + EXTRA_CELLS)
                if a.commands[i] == Command.STEP:
                    ended = do(a, i, own, origin, ti.cast(a.actions[i], ti.i32))
                    if ended & a.same_step == 1:
                        a.final_states[i], a.final_percepts[i] = a.states[i], a.percepts[i]
                        begin(a, i, own, origin)
                elif a.commands[i] == Command.BEGIN:
                    a.rewards_of[i], a.events[i] = 0.0, ti.cast(Event.NONE, ti.u8)
                    a.reasons[i] = ti.cast(Reason.NONE, ti.u8)
                    a.terminations[i], a.truncations[i] = ti.cast(0, ti.u8), ti.cast(0, ti.u8)
                    begin(a, i, own, origin)

    return step
