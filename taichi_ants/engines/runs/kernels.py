"""The kernel of independent runs: whole episodes, several runs at a time in each parallel task.

The data of a run (cells, Q table, memory) are small enough for the processor's first cache. A task
has a lane for each of its runs, and does each part of a step for all lanes in a loop. Loops without
branches become vector instructions. Parts that have branches, or that write where other runs could
read, are in separate loops. When no run is left for a lane, its ant goes on, but writes nothing.
"""

from collections.abc import Callable
from dataclasses import fields
from functools import cache
from typing import Any

import taichi as ti
from taichi.math import popcnt

from taichi_ants.arithmetic.random_bits import advance, below, bits_of, high_word, low_word
from taichi_ants.engines import layout
from taichi_ants.engines.launch import has_guards
from taichi_ants.engines.layout import N_SETTINGS
from taichi_ants.engines.runs import step
from taichi_ants.engines.runs.step import Ant, Rules, ant_view
from taichi_ants.features import hooks_at
from taichi_ants.learners.config import Hyperparameters
from taichi_ants.learners.learner import Learner
from taichi_ants.learners.memory import (
    At,
    LearnerArrays,
    Transition,
    error_function,
    read_rates,
    values_of,
)
from taichi_ants.task.constants import N_ACTIONS, ROW, Event
from taichi_ants.task.rules import policy
from taichi_ants.task.rules.actions import bit_number_in, step_end
from taichi_ants.task.rules.pheromone import FADING, NONE

LANES = 16  # of a task on a CPU, if there are as many runs
# The largest index into arrays, see `engine.size_of_launch`. The mask tells the compiler that
# indices are not negative.
_PLACES = 2**30 - 8
THREADS_OF_BLOCK = 32  # which a GPU starts together


@cache
def _lanes_type(n: int) -> Any:
    """Return the type of what n lanes keep of their runs: vectors with an entry for each lane."""
    whole, real, word = (ti.types.vector(n, kind) for kind in (ti.i32, ti.f32, ti.u64))
    numbers = (
        *("run", "episode", "step", "clock", "total", "ended", "base", "table", "recorded"),
        *("cell", "heading", "carries", "carried", "event", "paper_state", "state", "action"),
        *("executed", "lays", "exchanges", "first", "last", "entry", "floats", "integers"),
        *("settings", "explores", "choices", "n_choices", "drawn"),
        *("next_state", "next_action", "terminated", "truncated"),
    )
    return ti.types.struct(
        **dict.fromkeys(numbers, whole),
        **dict.fromkeys(("learning_rate", "discount", "epsilon", "error", "updated"), real),
        **dict.fromkeys(("random_state", "explore_below", "word"), word),
        chance=ti.types.vector(n, ti.f64),
    )


def learns_at_once(learner: Learner) -> bool:
    """Return whether a learner can compute the errors of many runs before the first update."""
    return learner.td_error is not None and not learner.plans


@cache
def run_kernel(
    rules: Rules, learner: Learner | None, traced: bool, n_lanes: int, arguments: Any
) -> Callable[..., None]:
    """Return the kernel for runs that learn, or that follow a fixed policy if `learner` is None.

    Random draws are in the order of a colony's. If `traced`, the kernel also records each step, in
    `n_episodes * max_steps` rows per run. `arguments` is the type of the argument pack.
    """
    learns = learner is not None
    on_policy = learns and learner.draws_next_action
    begins = learns and learner.begin is not None
    at_once = learns and learns_at_once(learner)
    hyperparameters = learner.hyperparameters if learns else Hyperparameters
    read = read_rates(hyperparameters)
    error_of = error_function(learner.td_error) if at_once else None
    columns = N_SETTINGS + len(fields(hyperparameters))
    # A single lane has branches, which are faster where a learned policy repeats actions.
    alone, deposit = n_lanes == 1, rules.deposit
    observe, executes = step.observe_function(rules, alone), hooks_at(rules.features)["execute"]
    draw, chance_of_draw = policy.BY_VALUES.get(rules.choice, (None, None))
    by_one = alone or draw is not None  # whether ants choose one after the other
    # Whether an episode in which no random number mattered is equal to all others of the run.
    repeats = not (learns or draw is not None or executes or hooks_at(rules.features)["see"])
    n_states = rules.observation.n_states
    table = n_states * ROW
    # A CPU distributes tasks one by one, as runs are uneven.
    block = THREADS_OF_BLOCK if has_guards(arguments) else 1
    empty_lanes = _lanes_type(n_lanes)

    @ti.func
    def ant_of(lanes: ti.template(), k):
        return Ant(
            cell=lanes.cell[k],
            heading=lanes.heading[k],
            carries=lanes.carries[k],
            carried=lanes.carried[k],
            event=lanes.event[k],
            random_state=lanes.random_state[k],
        )

    @ti.func
    def keep(lanes: ti.template(), k, ant):
        lanes.cell[k], lanes.heading[k] = ant.cell, ant.heading
        lanes.carries[k], lanes.carried[k] = ant.carries, ant.carried
        lanes.event[k], lanes.random_state[k] = ant.event, ant.random_state

    @ti.func
    def decide(a: ti.template(), lanes: ti.template(), k, state, once: ti.template()):
        """Draw and return the next action in lane k, and store its probability."""
        rng, explore_below = advance(lanes.random_state[k]), lanes.explore_below[k]
        values = values_of(a.q, lanes.table[k], state)
        action, chance = 0, ti.f64(0.0)
        if ti.static(draw):
            ant = ant_of(lanes, k)
            action = draw(ant_view(a, ant), values, bits_of(rng), explore_below)
            if ti.static(traced):
                chance = chance_of_draw(ant_view(a, ant), values, action, explore_below)
        else:
            if ti.static(once):  # in an episode: code that compiles faster
                best = policy.best_actions(values)
                action = policy.choose_in_crowd(a.compass, best, bits_of(rng), explore_below)
            else:
                action = policy.choose(values, bits_of(rng), explore_below)
            if ti.static(repeats):
                if lanes.drawn[k] == 0:
                    lanes.drawn[k] = ti.cast(popcnt(policy.best_actions(values)) > 1, ti.i32)
            if ti.static(traced):
                chance = policy.chance_of(values, action, explore_below)
        lanes.random_state[k], lanes.chance[k] = rng, chance
        return action

    @ti.func
    def decide_all(
        a: ti.template(), lanes: ti.template(), states: ti.template(), actions: ti.template()
    ):
        """Draw the next actions in these `states`; an ant whose episode has terminated needs none.

        Numbers of 64 bits and of 32 bits are in separate loops, for twice as wide vectors.
        """
        for k in range(n_lanes):
            rng = advance(lanes.random_state[k])
            bits = bits_of(rng)
            lanes.word[k] = low_word(bits)
            lanes.explores[k] = ti.cast(high_word(bits) < lanes.explore_below[k], ti.i32)
            if ti.static(on_policy):
                rng = ti.select(lanes.terminated[k] == 1, lanes.random_state[k], rng)
            lanes.random_state[k] = rng
        for k in range(n_lanes):
            best = policy.best_actions(values_of(a.q, lanes.table[k], states[k]))
            lanes.choices[k] = ti.select(lanes.explores[k] == 1, (1 << N_ACTIONS) - 1, best)
            lanes.n_choices[k] = popcnt(lanes.choices[k])
            if ti.static(repeats):
                lanes.drawn[k] |= ti.cast(lanes.n_choices[k] > 1, ti.i32)
        for k in range(n_lanes):
            lanes.n_choices[k] = below(lanes.word[k], lanes.n_choices[k])
        for k in range(n_lanes):
            action = bit_number_in(a.compass, lanes.choices[k], lanes.n_choices[k])
            if ti.static(on_policy):
                action = ti.select(lanes.terminated[k] == 1, -1, action)
            actions[k] = action

    @ti.func
    def begin_episode(a: ti.template(), memory: ti.template(), lanes: ti.template(), k):
        """Begin an episode in lane k, and a run if it is the first one."""
        run, base = ti.min(lanes.run[k], a.n_runs - 1), lanes.base[k]
        if lanes.episode[k] == 0:
            lanes.random_state[k] = a.random_states[run]
            lanes.table[k] = run * a.tables * table & _PLACES
            lanes.settings[k] = run * columns
            lanes.floats[k] = run * a.floats_by_8 * 8 & _PLACES
            lanes.integers[k] = run * a.integers_by_8 * 8 & _PLACES
            lanes.discount[k] = ti.cast(a.settings[run * columns + layout.DISCOUNT], ti.f32)
            lanes.first[k], lanes.last[k] = 0, a.size - 1
        step.restore(a, base, 0, lanes.first[k], lanes.last[k])
        if ti.static(not learns):
            lanes.random_state[k] = a.streams[run * a.n_episodes + lanes.episode[k]]
        if ti.static(begins):
            if lanes.run[k] < a.n_runs:
                learner.begin(memory, at_of(lanes, k))
        lanes.learning_rate[k] = ti.cast(a.learning_rate[run], ti.f32)
        lanes.epsilon[k] = ti.cast(a.epsilon[run], ti.f32)
        lanes.explore_below[k] = ti.cast(a.epsilon[run] * 4294967296.0, ti.u64)
        lanes.step[k], lanes.clock[k], lanes.total[k] = 0, 0, 0
        lanes.first[k], lanes.last[k] = a.size, -1
        lanes.drawn[k] = ti.cast(lanes.explore_below[k] > 0, ti.i32)
        ant = Ant(cell=a.start_cells[run], heading=a.start_headings[run])
        ant.random_state = lanes.random_state[k]
        lanes.paper_state[k], lanes.state[k], ant.random_state = observe(a, base, ant, 0)
        keep(lanes, k, ant)
        if ti.static(on_policy):
            lanes.action[k] = decide(a, lanes, k, lanes.state[k], True)

    @ti.func
    def at_of(lanes: ti.template(), k):
        """Return the place of the run in lane k in the memory of learners."""
        return At(lanes.table[k] & _PLACES, lanes.floats[k] & _PLACES, lanes.integers[k] & _PLACES)

    @ti.func
    def record_choice(a: ti.template(), lanes: ti.template(), k, executed):
        row = lanes.recorded[k]
        a.trace_chances[row] = lanes.chance[k]
        a.trace[row, 0], a.trace[row, 1] = lanes.episode[k], lanes.step[k]
        a.trace[row, 2], a.trace[row, 3] = lanes.cell[k], lanes.heading[k]
        a.trace[row, 4], a.trace[row, 5] = lanes.paper_state[k], lanes.state[k]
        a.trace[row, 6], a.trace[row, 12] = lanes.action[k], executed

    @ti.func
    def record_result(a: ti.template(), lanes: ti.template(), k):
        row, event = lanes.recorded[k], lanes.event[k]
        a.trace[row, 7], a.trace[row, 8] = a.rewards[event], lanes.paper_state[k]
        a.trace[row, 9], a.trace[row, 10] = lanes.next_state[k], lanes.terminated[k]
        a.trace[row, 11] = event
        if ti.static(learns):
            a.trace_errors[row] = lanes.error[k]
            if a.keeps_tables == 1:
                for i in range(table):
                    a.trace_tables[row * table + i] = a.q[lanes.table[k] + i]
        lanes.recorded[k] = row + 1

    @ti.func
    def settle(a: ti.template(), lanes: ti.template(), k):
        """Let the ant in lane k deposit, pick up and give, after `move`."""
        ant, base, clock = ant_of(lanes, k), lanes.base[k], lanes.clock[k]
        if ti.static(deposit != NONE):  # no branch, because it could not be predicted
            laid = step.laid_behind(deposit, a, base, ant, clock)
            a.cells[base + ant.cell] = ti.select(lanes.lays[k] == 1, laid, a.cells[base + ant.cell])
        if lanes.exchanges[k] != 0:
            seen, executed = lanes.paper_state[k], lanes.executed[k]
            after = step.pick_up_or_give(deposit, a, base, ant, seen, executed, clock)
            lanes.drawn[k] |= ti.cast(after.random_state != ant.random_state, ti.i32)
            keep(lanes, k, after)

    @ti.func
    def act_and_observe(a: ti.template(), lanes: ti.template()):
        """Do the first half of a step: choose, act and observe."""
        if ti.static(not on_policy and not by_one):
            decide_all(a, lanes, lanes.state, lanes.action)
        for k in range(n_lanes):
            if ti.static(not on_policy and by_one):
                lanes.action[k] = decide(a, lanes, k, lanes.state[k], False)
            ant, executed = ant_of(lanes, k), lanes.action[k]
            for execute in ti.static(executes):
                executed, ant.random_state = execute(ant_view(a, ant), executed, ant.random_state)
            if ti.static(traced):
                record_choice(a, lanes, k, executed)
            if ti.static(alone):
                before = ant.random_state
                ant = step.act(
                    *(deposit, True, a, lanes.base[k], ant),
                    *(lanes.paper_state[k], executed, lanes.clock[k]),
                )
                if ti.static(repeats):
                    lanes.drawn[k] |= ti.cast(ant.random_state != before, ti.i32)
            else:
                ant, enters = step.move(a, ant, lanes.paper_state[k], executed)
                lanes.lays[k] = enters & ant.carries
                lanes.exchanges[k] = step.exchanges(lanes.paper_state[k], executed)
                lanes.executed[k] = executed
                lays = lanes.lays[k] == 1
                lanes.first[k] = ti.min(lanes.first[k], ti.select(lays, ant.cell, a.size))
                lanes.last[k] = ti.max(lanes.last[k], ti.select(lays, ant.cell, -1))
            keep(lanes, k, ant)
        if ti.static(not alone):
            for k in range(n_lanes):
                settle(a, lanes, k)
        for k in range(n_lanes):
            if ti.static(deposit == FADING and not alone):
                lanes.carried[k] = (lanes.carried[k] + 1) * lanes.carries[k]
            lanes.clock[k] += a.evaporates
            lanes.paper_state[k], lanes.next_state[k], lanes.random_state[k] = observe(
                a, lanes.base[k], ant_of(lanes, k), lanes.clock[k]
            )

    @ti.func
    def learn(a: ti.template(), memory: ti.template(), lanes: ti.template()):
        """Do the second half of a step, and return the number of episodes that end with it."""
        ends = 0
        for k in range(n_lanes):
            event, last = lanes.event[k], ti.cast(lanes.step[k] + 1 == a.max_steps, ti.i32)
            lanes.terminated[k], lanes.truncated[k] = step_end(
                event, a.delivery_terminates, 1, last
            )
            lanes.next_action[k] = -1
        if ti.static(on_policy and not by_one):
            decide_all(a, lanes, lanes.next_state, lanes.next_action)
        for k in range(n_lanes):
            if ti.static(on_policy and by_one):
                if lanes.terminated[k] == 0:
                    lanes.next_action[k] = decide(a, lanes, k, lanes.next_state[k], False)
            if ti.static(at_once):
                rates = rates_of(a, lanes, k)
                lanes.entry[k], value, lanes.error[k] = error_of(
                    memory, lanes.table[k], taken_in(a, lanes, k), rates
                )
                lanes.updated[k] = value + rates.learning_rate * lanes.error[k]
        for k in range(n_lanes):
            if ti.static(alone) or lanes.run[k] < a.n_runs:
                if ti.static(at_once):
                    a.q[lanes.entry[k]] = lanes.updated[k]
                elif ti.static(learns):
                    lanes.error[k], lanes.random_state[k] = learner.learn(
                        *(memory, at_of(lanes, k), taken_in(a, lanes, k)),
                        *(rates_of(a, lanes, k), lanes.random_state[k]),
                    )
                if ti.static(traced):
                    record_result(a, lanes, k)
        for k in range(n_lanes):
            lanes.total[k] += a.rewards[lanes.event[k]]
            lanes.state[k] = lanes.next_state[k]
            if ti.static(on_policy):
                # An ant that has no run any more needs an action, too.
                lanes.action[k] = ti.max(lanes.next_action[k], 0)
            lanes.step[k] += 1
            is_over = (lanes.event[k] == Event.DELIVERED) | (lanes.step[k] == a.max_steps)
            if ti.static(not alone):
                is_over &= lanes.run[k] < a.n_runs
            lanes.ended[k] = ti.cast(is_over, ti.i32)
            ends += lanes.ended[k]
        return ends

    @ti.func
    def rates_of(a: ti.template(), lanes: ti.template(), k):
        return read(
            *(lanes.learning_rate[k], lanes.discount[k], lanes.epsilon[k]),
            *(a.settings, lanes.settings[k] + N_SETTINGS),
        )

    @ti.func
    def taken_in(a: ti.template(), lanes: ti.template(), k):
        return Transition(
            state=lanes.state[k],
            action=lanes.action[k],
            reward=ti.cast(a.rewards[lanes.event[k]], ti.f32),
            next_state=lanes.next_state[k],
            next_action=lanes.next_action[k],
            terminated=lanes.terminated[k],
            truncated=lanes.truncated[k],
        )

    @ti.func
    def end_episode(a: ti.template(), lanes: ti.template(), k):
        """Write the results of an episode, and take another run after the last one."""
        run, episode, base = lanes.run[k], lanes.episode[k], lanes.base[k]
        a.outcomes[layout.RETURNS, run, episode] = lanes.total[k]
        a.outcomes[layout.STEPS, run, episode] = lanes.step[k]
        a.outcomes[layout.DELIVERIES, run, episode] = ti.cast(
            lanes.event[k] == Event.DELIVERED, ti.i32
        )
        lanes.first[k] = ti.min(lanes.first[k], a.cells[base + a.size])
        lanes.last[k] = ti.max(lanes.last[k], a.cells[base + a.size + 1])
        settings = run * columns
        a.epsilon[run] = ti.max(
            a.settings[settings + layout.MIN_EPSILON],
            a.epsilon[run] * a.settings[settings + layout.EPSILON_DECAY],
        )
        a.learning_rate[run] = ti.max(
            a.settings[settings + layout.MIN_LEARNING_RATE],
            a.learning_rate[run] * a.settings[settings + layout.LEARNING_RATE_DECAY],
        )
        lanes.episode[k] = episode + 1
        if ti.static(repeats):
            if lanes.drawn[k] == 0:
                for later in range(episode + 1, a.n_episodes):
                    for kind in ti.static(range(len(layout.OUTCOMES))):
                        a.outcomes[kind, run, later] = a.outcomes[kind, run, episode]
                lanes.episode[k] = a.n_episodes
        if lanes.episode[k] == a.n_episodes:
            a.random_states[run] = lanes.random_state[k]
            lanes.run[k], lanes.episode[k] = ti.atomic_add(a.begun[0], 1), 0
            lanes.recorded[k] = lanes.run[k] * a.n_episodes * a.max_steps

    @ti.kernel
    def do_runs(a: arguments):
        memory = ti.static(LearnerArrays(a.q, a.floats, a.integers, n_states))
        ti.loop_config(block_dim=block)
        for task in range(a.n_tasks):
            lanes, ends, active = empty_lanes(), n_lanes, 1
            for k in range(n_lanes):
                run = task + k * a.n_tasks
                lanes.run[k], lanes.base[k] = run, run * (a.size + layout.EXTRA_CELLS)
                lanes.recorded[k] = run * a.n_episodes * a.max_steps
                lanes.ended[k] = 1
            while active > 0:
                if ends > 0:
                    active = 0
                    for k in range(n_lanes):
                        if lanes.ended[k] == 1:
                            lanes.terminated[k] = 0
                            if lanes.step[k] > 0:
                                end_episode(a, lanes, k)
                            begin_episode(a, memory, lanes, k)
                        active += ti.cast(lanes.run[k] < a.n_runs, ti.i32)
                if active > 0:
                    act_and_observe(a, lanes)
                    ends = learn(a, memory, lanes)

    return do_runs
