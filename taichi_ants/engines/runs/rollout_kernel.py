"""The kernel for one or more steps of batched environments, which records each step.

A thread takes `WIDTH` ants at a time, and each ant takes up to `LENGTH` steps in a row, so that its
cells stay in the processor's first cache. The ant writes a code for each step into `codes`. Then
the thread writes the codes of all its ants as rows of results, with neighbouring ants in
neighbouring memory. On a GPU, each ant has a thread, which writes its results itself, because
neighbouring threads write at the same time.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import taichi as ti

from taichi_ants.arithmetic.random_bits import advance, bits_of, high_word, joined, low_word
from taichi_ants.engines.launch import has_guards
from taichi_ants.engines.layout import EXTRA_CELLS, TERMINATED, TRUNCATED, Command
from taichi_ants.engines.runs import step
from taichi_ants.engines.runs.step import Ant, Rules, act, ant_view, parts_of
from taichi_ants.features import hooks_at
from taichi_ants.task.constants import PICK_UP, Event, Reason
from taichi_ants.task.rules.actions import step_end
from taichi_ants.task.rules.pheromone import FADING
from taichi_ants.task.rules.policy import choose_from_masks

WIDTH, LENGTH = 512, 64
# Codes between the steps of an ant: with a power of two, all of them would compete for the same
# lines of the cache.
_STRIDE = WIDTH + 8
CODES_OF_CHUNK = LENGTH * _STRIDE  # of `WIDTH` ants
# A code is an i64: the state, and from these bits on the result of the step (`layout.TERMINATED`)
# and the action.
_RESULT, _ACTION = 32, 40
_THREADS_OF_BLOCK = 128  # which a GPU starts together


@cache
def rollout_kernel(
    rules: Rules,
    follows: bool,
    width: int,
    serial: bool,
    numbers: tuple[str, ...],
    arguments: Any,
) -> Callable[..., None]:
    """Return the kernel of a rollout; see `BatchedEnvironments.rollout`.

    If `follows`, ants choose by a table, with draws from their own streams, else they take given
    actions. `width` is the number of values in an observation, or 0 for a single step without
    observations. If `serial`, one thread does all the work, because waking others would take
    longer. `numbers` are the arguments that are in an array, see `parts_of`. Each ant draws from
    its stream in the order of a colony's.
    """
    deposit, observe, single = rules.deposit, step.observe_function(rules, True), width == 0
    executes = hooks_at(rules.features)["execute"]
    by_ant = has_guards(arguments) and not single

    @ti.func
    def record(a: ti.template(), row, code):
        """Write the results of a step."""
        state, result = ti.cast(code, ti.i32), ti.cast(code >> _RESULT, ti.i32)
        if ti.static(follows):
            a.taken[row] = code >> _ACTION & 7
        a.rewards_of[row] = a.rewards[result & (TRUNCATED - 1)]
        if ti.static(single):
            a.results[row] = result & 255
        else:
            a.result_rows[row] = ti.cast(result & 255, ti.u8)
        for k in ti.static(range(width)):
            a.seen[row * width + k] = a.shown[state * width + k]

    @ti.func
    def take_steps(a: ti.template(), i, first, n_steps, place):
        """Let ant i take steps from row `first` on; its first code is at `place`."""
        own, origin = a.shared_cells + i * (a.size + EXTRA_CELLS), a.worlds[i] * a.size
        ant = Ant(origin=origin, cell=a.ant_cells[i], heading=a.headings[i])
        ant.carries = a.carries[i]
        ant.random_state = joined(a.random_states[2 * i], a.random_states[2 * i + 1])
        if ti.static(deposit == FADING):
            ant.carried = a.carried[i]
        paper_state, state = a.paper_states[i], a.states[i]
        # Until an ant changes its world, it reads cells that all ants share.
        steps, base = a.steps[i], ti.select(a.changed[i] == 1, own, origin)
        deliveries = a.deliveries[i]
        command, choices = a.commands[i], ti.cast(0, ti.u64)
        if ti.static(follows):
            choices = a.choices[i]
        reason = ti.cast(Reason.NONE, ti.i32)
        for t in range(n_steps):
            action, event, flags = 0, ti.cast(Event.NONE, ti.i32), 0
            if ti.static(follows):
                choices = advance(choices)
                action = choose_from_masks(
                    a.compass, a.best, state, bits_of(choices), a.explore_below
                )
            elif ti.static(single):
                action = ti.cast(a.taken[i], ti.i32)
            elif ti.static(by_ant):
                action = ti.cast(a.taken[t * a.n + i], ti.i32)
            else:
                action = ti.cast(a.codes[place + t * _STRIDE], ti.i32)
            begins = ti.cast(command == Command.BEGIN, ti.i32)
            if command == Command.STEP:
                executed, before = action, ant
                for execute in ti.static(executes):
                    executed, ant.random_state = execute(
                        ant_view(a, ant), executed, ant.random_state
                    )
                into = ti.select(executed == PICK_UP, own, base)
                ant = act(deposit, False, a, into, ant, paper_state, executed, steps * a.evaporates)
                event = ant.event
                if ti.static(single):
                    reason = step.reason_of(a, into, before, ant, executed)
                if event == Event.PICKED_UP:  # the store keeps this a branch, which is faster
                    a.changed[i] = 1
                    base = own
                steps += 1
                deliveries += ti.cast(event == Event.DELIVERED, ti.i32)
                paper_state, state, ant.random_state = observe(a, base, ant, steps * a.evaporates)
                last = ti.cast(steps == a.max_steps, ti.i32)
                terminated, truncated = step_end(
                    event, a.delivery_terminates, a.delivery_truncates, last
                )
                flags = terminated * TERMINATED | truncated * TRUNCATED
                if flags != 0:
                    command = a.after_end[0]
                    if command == Command.STEP:  # the next episode begins in the same step
                        a.final_states[(first + t) * a.n + i] = state
                        a.final_paper_states[i] = paper_state
                        a.final_deliveries[i] = deliveries
                        begins = 1
            seen = state
            if begins == 1:
                if base == own:
                    step.restore(a, own, origin, a.cells[own + a.size], a.cells[own + a.size + 1])
                    a.changed[i] = 0
                stream = ant.random_state
                ant = Ant(origin=origin, cell=a.start_cells[i], heading=a.start_headings[i])
                ant.random_state = stream
                steps, deliveries, base, command = 0, 0, origin, Command.STEP
                paper_state, state, ant.random_state = observe(a, origin, ant, 0)
                seen = state
            result = event | flags | action << 8
            code = ti.cast(seen, ti.i64) | ti.cast(result, ti.i64) << _RESULT
            if ti.static(single):
                record(a, i, code)
            elif ti.static(by_ant):
                record(a, t * a.n + i, code)
            else:
                a.codes[place + t * _STRIDE] = code
        a.ant_cells[i], a.headings[i] = ant.cell, ant.heading
        a.carries[i] = ant.carries
        a.random_states[2 * i] = ti.cast(low_word(ant.random_state), ti.i32)
        a.random_states[2 * i + 1] = ti.cast(high_word(ant.random_state), ti.i32)
        if ti.static(deposit == FADING):
            a.carried[i] = ant.carried
        a.paper_states[i], a.states[i] = paper_state, state
        a.steps[i], a.deliveries[i] = steps, deliveries
        if ti.static(single):
            a.reasons[i] = reason
        else:
            a.commands[i] = command
            a.results[i] = ti.select(command == Command.STEP, 0, TRUNCATED)
        if ti.static(follows):
            a.choices[i] = choices

    @ti.func
    def take_rows(a: ti.template(), ant, ants, place):
        """Let `ants` ants from number `ant` on take all steps; their codes start at `place`."""
        first = 0
        while first < a.n_steps:
            length = ti.min(LENGTH, a.n_steps - first)
            if ti.static(not follows):
                for t in range(length):
                    row, line = (first + t) * a.n + ant, place + t * _STRIDE
                    for j in range(ants):
                        a.codes[line + j] = a.taken[row + j]
            for j in range(ants):
                take_steps(a, ant + j, first, length, place + j)
            for t in range(length):
                row, line = (first + t) * a.n + ant, place + t * _STRIDE
                for j in range(ants):
                    record(a, row + j, a.codes[line + j])
            first += length

    @ti.func
    def take_chunk(a: ti.template(), chunk):
        ant, ants = chunk * WIDTH, ti.min(WIDTH, a.n - chunk * WIDTH)
        if ti.static(single):
            for i in range(ant, ant + ants):
                if a.commands[i] != Command.WAIT:
                    take_steps(a, i, 0, 1, 0)
        else:
            take_rows(a, ant, ants, chunk * _STRIDE * LENGTH)

    @ti.func
    def take_all(a: ti.template(), i):
        if ti.static(by_ant):
            take_steps(a, i, 0, a.n_steps, 0)
        elif a.commands[i] != Command.WAIT:
            take_steps(a, i, 0, 1, 0)

    @ti.kernel
    def rollout_on_gpu(a: arguments):
        ti.loop_config(block_dim=_THREADS_OF_BLOCK)
        for i in range(parts_of(a, numbers).n):
            take_all(parts_of(a, numbers), i)

    @ti.kernel
    def rollout(a: arguments):
        ti.loop_config(block_dim=1, serialize=serial)
        for chunk in range((parts_of(a, numbers).n + WIDTH - 1) // WIDTH):
            take_chunk(parts_of(a, numbers), chunk)

    return rollout_on_gpu if has_guards(arguments) else rollout
