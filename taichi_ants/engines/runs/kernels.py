"""The kernels for single ants, each in its own world.

`run_kernel` runs whole episodes, with one parallel task per run. The data of a run (cells, Q table,
memory) are small enough for the processor's first cache. `step_kernel` does one step of many ants
with given actions.
"""

from collections.abc import Callable
from dataclasses import fields
from functools import cache
from typing import Any, NamedTuple

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
from taichi_ants.engines.runs.step import (
    EXTRA_CELLS,
    Ant,
    act,
    ground_of,
    paper_state_of,
    restore,
    state_seen,
)
from taichi_ants.learners.config import Hyperparameters
from taichi_ants.learners.learner import Learner
from taichi_ants.learners.memory import At, LearnerArrays, Transition, read_rates, values_of
from taichi_ants.task import Task
from taichi_ants.task.constants import FOOD, FORWARD, PICK_UP, QUEEN, ROW
from taichi_ants.task.events import Event, Reason
from taichi_ants.task.observations import Observation
from taichi_ants.task.rules.actions import step_towards
from taichi_ants.task.rules.delivery import step_end
from taichi_ants.task.rules.noise import slipped
from taichi_ants.task.rules.pheromone import FADING
from taichi_ants.task.rules.policy import (
    chance_of,
    chance_of_softly,
    choose,
    choose_softly,
)
from taichi_ants.task.rules.random_bits import advance, bits_of

# The largest index into arrays, see `engine.size_of_launch`. The mask tells the compiler that
# indices are not negative.
_PLACES = 2**30 - 1


class Failures(NamedTuple):
    """The kinds of noise that are compiled into a kernel; see `task.Noise`."""

    slips: bool = False
    misreads: bool = False


def failures_of(task: Task) -> Failures:
    """Return the kinds of noise of a task."""
    return Failures(task.noise.slip > 0, task.noise.misread > 0)


@cache
def run_kernel(
    learner: Learner | None,
    observation: Observation,
    deposit: int,
    half: bool,
    traced: bool,
    failures: Failures,
    softly: bool,
    arguments: Any,
) -> Callable[..., None]:
    """Return the kernel for runs that learn, or that follow a fixed policy if `learner` is None.

    For `deposit` and `half`, see `rules.pheromone` and `Pheromone.view`. If `softly`, ants choose
    by the rule "softmax". Random draws are in the order of a colony's. If `traced`, the kernel
    also records each step, in `n_episodes * max_steps` rows per run. `arguments` is the type of the
    argument pack.
    """
    learns = learner is not None
    on_policy = learns and learner.draws_next_action
    begins = learns and learner.begin is not None
    hyperparameters = learner.hyperparameters if learns else Hyperparameters
    read = read_rates(hyperparameters)
    columns = N_SETTINGS + len(fields(hyperparameters))
    state_of = state_seen(observation, half, failures.misreads)
    n_states = observation.n_states
    table = n_states * ROW

    @ti.func
    def decide(a: ti.template(), begin, ant, state, explore_below):
        """Return the next action, the stream after the draw and, if traced, the probability."""
        rng, values = advance(ant.random_state), values_of(a.q, begin, state)
        action, chance = 0, ti.f64(0.0)
        if ti.static(softly):
            action = choose_softly(values, bits_of(rng), explore_below, a.choice[0])
            if ti.static(traced):
                chance = chance_of_softly(values, action, explore_below, a.choice[0])
        else:
            action = choose(values, bits_of(rng), explore_below)
            if ti.static(traced):
                chance = chance_of(values, action, explore_below)
        return action, rng, chance

    @ti.func
    def observe(a: ti.template(), base, ant, clock):
        """Return the paper's state and the state of an ant, and the stream after possible draws."""
        paper_state, state = paper_state_of(half, a, base, ant, clock), 0
        after = ant.random_state
        if ti.static(failures.misreads):
            state, after = state_of(a, base, ant, clock, paper_state)
        else:
            state = state_of(a, base, ant, clock, paper_state)
        return paper_state, state, after

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
                    if ti.static(failures.slips):
                        executed, ant.random_state = slipped(action, ant.random_state, a.slip_below)
                    before = ant
                    ant = act(deposit, True, a, base, ant, paper_state, executed, clock)
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


@ti.func
def reason_of(a: ti.template(), base, before, after, action):
    """Return the `Reason` why an action was blocked or failed."""
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
    observation: Observation,
    deposit: int,
    half: bool,
    serial: bool,
    failures: Failures,
    arguments: Any,
) -> Callable[..., None]:
    """Return the kernel of a step, in which ants act, observe and restart; see `run_kernel`.

    If `serial`, one thread does all the work, because waking others would take longer. With
    failures, each ant draws from its stream in the order of a colony's.
    """
    state_of = state_seen(observation, half, failures.misreads)

    @ti.func
    def put(a: ti.template(), i, ant):
        """Store an ant."""
        a.ant_cells[i] = ant.cell
        a.headings[i], a.carries[i] = ti.cast(ant.heading, ti.u8), ti.cast(ant.carries, ti.u8)
        if ti.static(deposit == FADING):
            a.carried[i] = ant.carried

    @ti.func
    def observe(a: ti.template(), i, base, ant, clock):
        """Store the paper's state and state of an ant; the cells of its world start at `base`."""
        paper_state = paper_state_of(half, a, base, ant, clock)
        a.paper_states[i] = ti.cast(paper_state, ti.u8)
        if ti.static(failures.misreads):
            seeing = ant
            seeing.random_state = a.random_states[i]
            a.states[i], a.random_states[i] = state_of(a, base, seeing, clock, paper_state)
        else:
            a.states[i] = state_of(a, base, ant, clock, paper_state)

    @ti.func
    def begin(a: ti.template(), i, own, origin):
        """Reset a world and its ant to the start of an episode."""
        if a.changed[i] == 1:
            restore(a, own, origin, a.cells[own + a.size], a.cells[own + a.size + 1])
        ant = Ant(origin=origin, cell=a.start_cells[i], heading=a.start_headings[i])
        a.steps[i], a.deliveries[i], a.changed[i] = 0, 0, ti.cast(0, ti.u8)
        put(a, i, ant)
        observe(a, i, origin, ant, 0)

    @ti.func
    def do(a: ti.template(), i, own, origin, chosen):
        """Do an action of an ant, and return whether the episode has ended."""
        action = chosen
        if ti.static(failures.slips):
            action, a.random_states[i] = slipped(chosen, a.random_states[i], a.slip_below)
            a.executed[i] = ti.cast(action, ti.u8)
        before = Ant(origin=origin, cell=a.ant_cells[i], heading=ti.cast(a.headings[i], ti.i32))
        before.carries = ti.cast(a.carries[i], ti.i32)
        if ti.static(deposit == FADING):
            before.carried = a.carried[i]
        if action == PICK_UP:  # only the choice among several food items is random
            before.random_state = a.random_states[i]
        # Until an ant changes its world, it reads cells that all ants share, because these stay in
        # the processor's cache.
        changed = ti.cast(a.changed[i], ti.i32)
        base = ti.select((changed == 1) | (action == PICK_UP), own, origin)
        clock, paper_state = a.steps[i] * a.evaporates, ti.cast(a.paper_states[i], ti.i32)
        after = act(deposit, False, a, base, before, paper_state, action, clock)
        a.events[i] = ti.cast(after.event, ti.u8)
        a.reasons[i] = ti.cast(reason_of(a, base, before, after, action), ti.u8)
        if after.event == Event.PICKED_UP:
            changed, a.random_states[i] = 1, after.random_state
        a.changed[i] = ti.cast(changed, ti.u8)
        a.steps[i] = a.steps[i] + 1
        if after.event == Event.DELIVERED:
            a.deliveries[i] += 1
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
                        a.final_states[i], a.final_paper_states[i] = a.states[i], a.paper_states[i]
                        a.final_deliveries[i] = a.deliveries[i]
                        begin(a, i, own, origin)
                elif a.commands[i] == Command.BEGIN:
                    a.rewards_of[i], a.events[i] = 0.0, ti.cast(Event.NONE, ti.u8)
                    a.reasons[i] = ti.cast(Reason.NONE, ti.u8)
                    a.terminations[i], a.truncations[i] = ti.cast(0, ti.u8), ti.cast(0, ti.u8)
                    begin(a, i, own, origin)

    return step
