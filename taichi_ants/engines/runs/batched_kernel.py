"""The kernel of one step of many single ants, each in a world of its own: act, observe, begin anew.

It does in one launch what `run_kernel` does in each of its steps; the actions come from outside.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import taichi as ti

from taichi_ants.engines.layout import Command
from taichi_ants.engines.runs.step import (
    EXTRA_CELLS,
    Ant,
    act,
    ground_of,
    percept_of,
    restore,
    state_seen,
)
from taichi_ants.task.constants import FOOD, FORWARD, PICK_UP, QUEEN
from taichi_ants.task.events import Event, Reason
from taichi_ants.task.observations import Observation
from taichi_ants.task.rules.actions import step_towards
from taichi_ants.task.rules.delivery import step_end
from taichi_ants.task.rules.pheromone import FADING


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
    """The kernel, see `run_kernel`; if `serial`, one thread does all and no other one is woken."""
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
