"""The kernels of a colony: what a tick does, in phases, under two schedules.

Many small worlds: one task a world, all ticks and phases serial inside it. Few large worlds: each
phase a parallel loop over chunks of ants. Both call the same functions in the same order, so that
they give the same numbers. The order is that of `taichi_ants.reference.ReferenceColony.tick`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import taichi as ti

from taichi_ants.engines import looks
from taichi_ants.engines.colony.layout import STANDS, AntRow, WorldRow
from taichi_ants.engines.colony.phases import (
    after_deaths,
    before_deaths,
    begin_all,
    choose_all,
    commit_all,
    draw_all,
    grow_old_all,
    learn_together,
    observe_all,
    plan_together,
    resolve_all,
    retire_all,
    settle_all,
    stop_at_delivery,
)
from taichi_ants.engines.colony.trail import diffused, evaporate
from taichi_ants.engines.trial import tried
from taichi_ants.learners.memory import read_rates
from taichi_ants.learners.registry import Learner
from taichi_ants.learners.td_errors import guarded
from taichi_ants.task.constants import N_ACTIONS, ROW
from taichi_ants.task.observations import Observation
from taichi_ants.task.traffic import Traffic


@dataclass(frozen=True)
class Variant:
    """What is compiled into a kernel; all functions of the colony call it `v`.

    Attributes:
        learner: The learner, None if nobody learns.
        own_tables: Whether there is a table for each slot, not one for each world.
        further_tables: How many the learner keeps behind each.
        observation: The observation.
        dense: Whether levels are f32, see `trail`.
        view: Which trails look like one, see `Pheromone`.
        traffic: Who may enter a cell on which another ant stands.
        lively: Whether ants or food come and go; leaving that out halves the time to compile.
    """

    learner: Learner | None
    own_tables: bool
    further_tables: int
    observation: Observation
    dense: bool
    view: str
    traffic: Traffic
    lively: bool

    @property
    def alone(self) -> bool:
        """Whether each ant learns into a table of its own."""
        return self.learner is not None and self.own_tables

    @property
    def begins(self) -> bool:
        """Whether the learner of each ant prepares for an episode."""
        return self.alone and self.learner.begin is not None

    @property
    def together(self) -> bool:
        """Whether all ants of a world learn into one table."""
        return self.learner is not None and not self.own_tables

    @property
    def plans_together(self) -> bool:
        """Whether they do so from a model too."""
        return self.together and self.learner.plans

    @property
    def draws_next_action(self) -> bool:
        """Whether ants draw their next action before they learn."""
        return self.learner is not None and self.learner.draws_next_action

    @property
    def td_error(self) -> Callable[..., Any]:
        """The TD error of a learner whose table is shared."""
        return guarded(self.learner.td_error)

    @property
    def read_rates(self) -> Callable[..., Any]:
        """Makes the rates of the learner."""
        return read_rates(self.learner.hyperparameters)

    @property
    def n_states(self) -> int:
        """The rows of a table."""
        return self.observation.n_states

    @property
    def table_size(self) -> int:
        """The numbers of a table and the further ones behind it."""
        return (1 + self.further_tables) * self.n_states * ROW

    @property
    def n_pairs(self) -> int:
        """The pairs of a row and an action."""
        return self.n_states * N_ACTIONS

    @property
    def sees_percept(self) -> bool:
        """Whether the row of the table is the percept itself, as in the paper."""
        return looks.is_percept(self.observation)

    @property
    def sees_ants(self) -> bool:
        """Whether the cell of an ant has to tell what the ant carries."""
        return not self.sees_percept or self.view == "strongest_under_carriers"

    @property
    def half(self) -> bool:
        """Whether trails of half the strongest look like one."""
        return self.view == "half"

    @property
    def idle(self) -> int:
        """The mark of an ant that wants nothing."""
        return STANDS if self.traffic.shared else 0

    @property
    def row_at(self) -> AntRow:
        """Where an ant keeps the row of its table."""
        return AntRow.PERCEPT if self.sees_percept else AntRow.STATE

    @property
    def row(self) -> Callable[..., Any]:
        """The row of a look."""
        return looks.row_function(self.observation)

    @property
    def look_type(self) -> Any:
        """The struct of a look."""
        return looks.look_type(self.observation, self.dense)

    @property
    def ahead(self) -> tuple[int, ...]:
        """Where the cells ahead stand among those in view."""
        return looks.positions_ahead(self.observation)


@ti.func
def begin(c: ti.template(), v: ti.template(), first_tick, n_ticks):
    """Begin an episode."""
    ti.loop_config(block_dim=1)
    for chunk in range(c.n_worlds * c.n_chunks):
        begin_all(c, v, chunk)


@ti.func
def by_world(c: ti.template(), v: ti.template(), first_tick, n_ticks):
    """Any number of ticks of worlds with a single chunk each, all phases in turn."""
    ti.loop_config(block_dim=1)
    for w in range(c.n_worlds):
        for tick in range(first_tick, first_tick + n_ticks):
            if c.worlds[WorldRow.RUNNING, w] == 1:
                tick_of_world(c, v, w, tick)


@ti.func
def tick_of_world(c: ti.template(), v: ti.template(), w, tick):
    choose_all(c, v, w)
    resolve_all(c, v, w, tick)
    if ti.static(v.traffic.shared):
        settle_all(c, v, w, tick)
    commit_all(c, v, w, tick)
    if ti.static(v.dense):
        for place in range(w * c.size, (w + 1) * c.size):
            evaporate(c, place)
        if c.share > 0.0:
            for place in range(w * c.size, (w + 1) * c.size):
                c.spare[place] = diffused(c, place)
            for place in range(w * c.size, (w + 1) * c.size):
                c.level[place] = c.spare[place]
    before_deaths(c, v, w, tick)
    if ti.static(v.lively):
        if c.lifespan > 0:
            grow_old_all(c, w)
        after_deaths(c, w, tick)
    observe_all(c, v, w, tick)
    if ti.static(v.together):
        learn_together(c, v, w)
    if ti.static(v.plans_together):
        for _ in range(c.planning_steps):
            draw_all(c, v, w)
            plan_together(c, v, w)
    if ti.static(v.lively):
        retire_all(c, w)
    stop_at_delivery(c, w)


@ti.func
def by_chunk(c: ti.template(), v: ti.template(), tick, n_ticks):
    """One tick; `plan` and `end` follow where there is something for them to do."""
    ti.loop_config(block_dim=1)
    for chunk in range(c.n_worlds * c.n_chunks):
        choose_all(c, v, chunk)
    ti.loop_config(block_dim=1)
    for chunk in range(c.n_worlds * c.n_chunks):
        resolve_all(c, v, chunk, tick)
    if ti.static(v.traffic.shared):
        ti.loop_config(block_dim=1)
        for chunk in range(c.n_worlds * c.n_chunks):
            settle_all(c, v, chunk, tick)
    ti.loop_config(block_dim=1)
    for chunk in range(c.n_worlds * c.n_chunks):
        commit_all(c, v, chunk, tick)
    if ti.static(v.dense):
        ti.loop_config(block_dim=4096)
        for place in range(c.n_worlds * c.size):
            evaporate(c, place)
        ti.loop_config(block_dim=4096)
        for place in range(c.n_worlds * c.size):
            c.spare[place] = diffused(c, place)
        ti.loop_config(block_dim=4096)
        for place in range(c.n_worlds * c.size):
            c.level[place] = c.spare[place]
    ti.loop_config(block_dim=1)
    for w in range(c.n_worlds):
        before_deaths(c, v, w, tick)
    if ti.static(v.lively):
        ti.loop_config(block_dim=1)
        for chunk in range(c.n_worlds * c.n_chunks):
            if c.lifespan > 0:
                grow_old_all(c, chunk)
        ti.loop_config(block_dim=1)
        for w in range(c.n_worlds):
            after_deaths(c, w, tick)
    ti.loop_config(block_dim=1)
    for chunk in range(c.n_worlds * c.n_chunks):
        observe_all(c, v, chunk, tick)
    if ti.static(v.together):
        ti.loop_config(block_dim=1)
        for w in range(c.n_worlds):
            learn_together(c, v, w)


@ti.func
def plan(c: ti.template(), v: ti.template(), tick, n_ticks):
    """One round of updates from the models that worlds share."""
    ti.loop_config(block_dim=1)
    for chunk in range(c.n_worlds * c.n_chunks):
        draw_all(c, v, chunk)
    ti.loop_config(block_dim=1)
    for w in range(c.n_worlds):
        plan_together(c, v, w)


@ti.func
def end(c: ti.template(), v: ti.template(), tick, n_ticks):
    """What ends a tick by chunks."""
    ti.loop_config(block_dim=1)
    for chunk in range(c.n_worlds * c.n_chunks):
        retire_all(c, chunk)
    ti.loop_config(serialize=True)
    for w in range(c.n_worlds):
        stop_at_delivery(c, w)


@cache
def colony_kernel(what: Callable[..., None], v: Variant, arguments: Any) -> Callable[..., None]:
    """A kernel (arguments, first tick, ticks); it is compiled on first use.

    Args:
        what: `begin`, `by_world`, `by_chunk`, `plan` or `end`.
        v: The variant.
        arguments: The type of the argument pack, see `Colony.arguments`.
    """
    if v.learner is not None:
        tried(v.learner)
    if not v.sees_percept:
        looks.row_function(v.observation)  # tries it

    @ti.kernel
    def advance_colony(c: arguments, first_tick: ti.i32, n_ticks: ti.i32):
        what(c, v, first_tick, n_ticks)

    return advance_colony
