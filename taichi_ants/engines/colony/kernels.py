"""The kernels of a colony: the phases of a tick, in order, and the sharing of work among threads.

If worlds are many and small, each world is one part of the work. If they are few and large, all
threads share each phase by chunks, which are ranges of the ants or cells of one world, and wait for
each other at a barrier. Both do the same phases in the same order and give the same numbers. The
order is that of `taichi_ants.reference.ReferenceColony.tick`.
"""

from collections.abc import Callable, Iterator
from functools import cache
from itertools import chain, groupby
from typing import Any, NamedTuple

import taichi as ti
from taichi.lang.any_array import AnyArray

from taichi_ants.engines import views
from taichi_ants.engines.colony import columns, layout, learning, life, own_inputs, steps, trail
from taichi_ants.engines.colony.columns import function
from taichi_ants.engines.colony.layout import Barrier, Order, WorldRow
from taichi_ants.engines.colony.views import entries_of
from taichi_ants.features import hooks_at
from taichi_ants.learners.memory import guarded, read_rates
from taichi_ants.task.model import Model
from taichi_ants.task.rules.conflicts import STANDS
from taichi_ants.task.rules.policy import BY_LEVELS, BY_VALUES

ANTS, CELLS, WORLD = "ants", "cells", "world"


class Phase(NamedTuple):
    """A part of a tick that all ants, cells or worlds (`of`: ANTS, CELLS, WORLD) finish together.

    It must not read values that another chunk writes in the same phase. `do` is a `ti.func` with
    arguments (c, v, w, chunk, ant, tick) for ANTS, (c, v, place, tick) for CELLS, (c, v, w, tick)
    for WORLD.
    """

    of: str
    do: Callable[..., None]


class Variant:
    """A model with the functions and types of its kernels; `v` in functions."""

    def __init__(self, model: Model) -> None:
        vars(self).update(vars(model))
        # The mark of an ant that wants no other cell.
        self.mark_of_rest = STANDS if model.traffic.shared else 0
        # The hooks of features at each point, in their order.
        self.at = hooks_at(model.features)
        self.entries = entries_of(model)
        own = own_inputs.own_rules(model.rules)
        self.draw_by_values, _ = BY_VALUES.get(model.choice, (None, None))
        self.attraction, self.choose_cell = BY_LEVELS.get(model.choice, (None, None))
        self.draw_by_cues = steps.draw_cell if self.choose_cell else None
        if model.choice_rule:
            self.draw_by_cues = own[model.choice_rule].choose
        self.own_reward = model.reward_rule and own[model.reward_rule].pay
        deposits = [rule and own[rule].lay for rule in model.deposit_rules]
        evaporations = [rule and own[rule].evaporate for rule in model.evaporation_rules]
        self.pheromones = tuple(
            zip(model.dense_by_number, model.views, deposits, evaporations, strict=True)
        )
        if model.learner is not None:
            self.read_rates = read_rates(model.learner.hyperparameters)
        if model.together:
            self.td_error = guarded(model.learner.td_error)
        self.level_type = ti.f32 if model.sees_dense else ti.i32
        if not model.is_papers:
            self.encode = views.encode_function(model.observation)
            reads_dense = tuple(model.dense_by_number[number] for number in model.reads)
            self.view_type = views.view_type(model.observation, model.sees_dense, reads_dense)

    def field(self, c: Any, number: int) -> trail.PheromoneArrays:
        """Return the arrays and numbers of a pheromone; 0 is the trail."""
        dense, view, deposit, evaporation = self.pheromones[number]
        end = f"_{number}" if number else ""
        return trail.PheromoneArrays(
            dense,
            view == "half",
            view == "strongest_under_carriers",
            getattr(c, layout.array_of(number, dense)),
            getattr(c, f"spare{end}") if dense else None,
            *(getattr(c, name + end) for name in trail.NUMBERS),
            deposited_when=getattr(c, f"deposited_when{end}") if number else None,
            own_deposit=deposit,
            own_evaporation=evaporation,
        )

    def dense_fields(self, c: Any) -> list[trail.PheromoneArrays]:
        """Return the arrays and numbers of the dense pheromones."""
        return [self.field(c, number) for number, dense in enumerate(self.dense_by_number) if dense]


variant = cache(Variant)


def tick_phases(v: Variant) -> Iterator[Phase]:
    """Yield the phases of a tick before rounds of `planning_phases` and the `last_phases`."""
    yield Phase(ANTS, steps.want)
    if v.traffic.shared:
        yield Phase(ANTS, steps.resolve)
    yield Phase(ANTS, steps.act)
    if v.lays_in_turn:
        for number in range(len(v.pheromones)):
            yield Phase(ANTS, steps.lays_field(number))
    if v.dense:
        yield Phase(CELLS, trail.evaporate)
        yield Phase(CELLS, trail.diffuse)
        yield Phase(CELLS, trail.apply_diffusion)
    if v.ants_change or v.food_changes or v.reads_deliveries:
        yield Phase(WORLD, life.count)
    if v.ants_change:
        yield Phase(WORLD, life.give_birth)
    if v.at["aged"]:
        yield Phase(ANTS, life.grow_old)
    if v.food_changes:
        yield Phase(WORLD, life.regrow)
        yield Phase(WORLD, life.move_piles)
    yield Phase(ANTS, learning.observe_and_learn)
    yield Phase(WORLD, life.count)
    if v.together:
        yield Phase(WORLD, learning.learn_together)


def planning_phases(v: Variant) -> Iterator[Phase]:
    """Yield the phases of one round of updates from the models that ants share."""
    yield Phase(ANTS, learning.draw_pair)
    yield Phase(WORLD, learning.plan_together)


def last_phases(v: Variant) -> Iterator[Phase]:
    """Yield the phases at the end of a tick."""
    if v.ants_change:
        yield Phase(ANTS, life.update_slots)
    yield Phase(WORLD, life.end_tick)


@function
def do(phase, c, v, chunk):
    """Do a phase for a chunk, or for the world `chunk`, unless its episode has ended."""
    w = chunk
    if ti.static(phase.of != WORLD):
        w = chunk // c.n_chunks
    running, tick = c.worlds[WorldRow.RUNNING, w], c.worlds[WorldRow.TICKS, w]
    if ti.static(phase.of == ANTS):
        first, last = share_of(c, chunk, c.n_slots)
        last = ti.min(last, c.worlds[WorldRow.TOP, w]) * running
        for ant in range(w * c.n_slots + first, w * c.n_slots + last):
            if is_taken(c, v, ant):
                phase.do(c, v, w, chunk, ant, tick)
    elif ti.static(phase.of == CELLS):
        first, last = share_of(c, chunk, c.size)
        for index in range(w * c.size + first, w * c.size + last * running):
            phase.do(c, v, index, tick)
    elif running == 1:
        phase.do(c, v, w, tick)


@function
def is_taken(c, v, ant):
    """Return whether an ant is in a slot; without vacant slots, always, while a kernel compiles."""
    taken = True
    if ti.static(v.slots_matter):
        taken = columns.trait(c.stage, ant) != layout.Stage.VACANT
    return taken


@function
def share_of(c, chunk, n):
    """Return the range of a chunk among n ants or cells of a world."""
    each = (n + c.n_chunks - 1) // c.n_chunks
    first = chunk % c.n_chunks * each
    return first, ti.min(first + each, n)


def shared_out(phases: Iterator[Phase]) -> list[tuple[Phase, ...]]:
    """Return phases in groups without barriers inside; successive WORLD phases form one group."""
    groups: list[tuple[Phase, ...]] = []
    for of_worlds, some in groupby(phases, lambda phase: phase.of == WORLD):
        several = tuple(some)
        groups += [several] if of_worlds else [(phase,) for phase in several]
    return groups


@cache
def once(v: Variant, what: Callable[..., None], arguments: Any) -> Callable[..., None]:
    """Return a kernel of what all ants do between two ticks."""
    phase = Phase(ANTS, what)

    @ti.kernel
    def advance_colony(c: arguments):
        ti.loop_config(block_dim=1)
        for chunk in range(c.n_worlds * c.n_chunks):
            do(phase, c, v, chunk)

    return advance_colony


@function
def wait_for_all(c, part, parts, number):
    """Wait until all parts arrive at barrier `number`; return 0 if one does not arrive, else 1.

    The first part that starts decides: it opens the barrier once the others have arrived, or gives
    up. If it gives up, all parts that have started leave at this barrier, also those that still
    wait at the one before. A part that starts later leaves at its first barrier, which is the same
    one.
    """
    goes_on = 1
    if part == 0:
        wanted, spins = (number + 1) * (parts - 1), 0
        # Atomic, because the compiler could move a plain read out of the loop.
        arrived = ti.atomic_add(c.barrier[Barrier.ARRIVED], 0)
        while arrived < wanted and spins < c.orders[Order.SPINS]:
            arrived = ti.atomic_add(c.barrier[Barrier.ARRIVED], 0)
            spins += 1
        goes_on = ti.cast(arrived >= wanted, ti.i32)
        ti.atomic_add(
            c.barrier[Barrier.OPENED], ti.select(goes_on == 1, ti.i64(1), ti.i64(layout.GAVE_UP))
        )
    else:
        ti.atomic_add(c.barrier[Barrier.ARRIVED], 1)
        opened = ti.atomic_add(c.barrier[Barrier.OPENED], 0)
        while opened >= 0 and opened <= number:
            opened = ti.atomic_add(c.barrier[Barrier.OPENED], 0)
        # The first part may have opened this barrier, and given up at the next one since then.
        if opened < 0:
            opened -= ti.i64(layout.GAVE_UP)
        goes_on = ti.cast(opened > number, ti.i32)
    return goes_on


@function
def read_ahead(c):
    """Read all arguments before the loops of a kernel.

    Otherwise the compiler reads the numbers and the addresses of arrays again after each write into
    an array, because the write could change them. It removes what the kernel does not use: also the
    values read here.
    """
    value = 0.0
    for one in ti.static(c._members):
        if ti.static(not isinstance(one, AnyArray)):
            value = ti.cast(one, ti.f32)
        else:
            value = ti.cast(one[[0] * ti.static(len(one.shape))], ti.f32)
    return value


@ti.func
def world_of(i, parts, threads):
    """Return the world of part i: threads that take successive parts get distant worlds."""
    return (i % threads) * (parts // threads) + i // threads


@cache
def ticks(v: Variant, waits: bool, arguments: Any) -> Callable[..., None]:
    """Return a kernel of whole ticks whose work is divided into parts, see `Order`.

    Without `waits`, each part is a world of a single chunk, and does all ticks independently.
    Threads take parts in order, so successive parts are worlds that are far apart: the counts of
    neighbours share cache lines, and threads that write to the same lines slow each other down.
    With `waits`, each part does its share of the chunks, and waits for the others at a barrier
    after each group of phases. A parallel loop per group would take 20 to 200 microseconds more,
    because threads would sleep and wake up. If a part does not arrive, all parts leave, and another
    launch starts with the next group, see `Order.FIRST`.
    """
    groups, planning = shared_out(tick_phases(v)), shared_out(planning_phases(v))
    last = shared_out(last_phases(v))
    if not v.plans_together:
        groups, last = shared_out(chain(tick_phases(v), last_phases(v))), []

    @function
    def share(group: ti.template(), c, part, parts, at):
        """Do a part's share of group `at`, and wait; return the next group, or -1 to leave."""
        following = at
        if ti.static(not waits):
            for phase in ti.static(group):
                do(phase, c, v, part)
        else:
            if at >= 0:
                if at >= c.orders[Order.FIRST]:
                    n = c.n_worlds if ti.static(group[0].of == WORLD) else c.n_worlds * c.n_chunks
                    for chunk in range(n * part // parts, n * (part + 1) // parts):
                        for phase in ti.static(group):
                            do(phase, c, v, chunk)
                following = at + 1
                if parts > 1:
                    if wait_for_all(c, part, parts, at) == 0:
                        following = -1
        return following

    @ti.kernel
    def advance_colony(c: arguments):
        ti.loop_config(block_dim=1)
        for i in range(c.orders[Order.PARTS]):
            read_ahead(c)
            part, parts, at, n = i, c.orders[Order.PARTS], 0, c.orders[Order.TICKS]
            if ti.static(waits):
                part = ti.cast(ti.atomic_add(c.barrier[Barrier.STARTED], 1), ti.i32)
            else:
                part = world_of(i, parts, c.orders[Order.THREADS])
                n = ti.select(part < c.n_worlds, n, 0)  # the last thread can have fewer worlds
            for _ in range(n):
                for group in ti.static(groups):
                    at = share(group, c, part, parts, at)
                if ti.static(v.plans_together):
                    for _round in range(c.planning_steps):
                        for group in ti.static(planning):
                            at = share(group, c, part, parts, at)
                for group in ti.static(last):
                    at = share(group, c, part, parts, at)
            if (part == 0) & (at >= 0):
                c.orders[Order.PASSED] += c.orders[Order.TICKS]

    return advance_colony
