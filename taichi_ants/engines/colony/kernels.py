"""The kernels of a colony: the phases of a tick, in order, and the sharing of work among threads.

If worlds are many and small, each world is one part of the work. If they are few and large, all
threads share each phase by chunks, which are ranges of the ants, cells or states of one world, and
wait for each other at a barrier. On a GPU, each ant, cell or state has a thread, and a phase is a
parallel loop. All do the same phases in the same order and give the same numbers. The order is that
of `taichi_ants.reference.ReferenceColony.tick`.
"""

from collections.abc import Callable, Iterable, Iterator
from functools import cache, partial
from itertools import groupby
from typing import Any, NamedTuple

import taichi as ti
from taichi.lang.any_array import AnyArray

from taichi_ants.engines import views
from taichi_ants.engines.colony import layout, learning, life, memory, own_inputs, steps, trail
from taichi_ants.engines.colony.barrier import next_group, part_of, share_of_part, wait_for_blocks
from taichi_ants.engines.colony.columns import chunks_of, function, share_of, trait
from taichi_ants.engines.colony.layout import Order, WorldRow
from taichi_ants.engines.colony.views import entries_of
from taichi_ants.features import hooks_at
from taichi_ants.kernel_functions import Named, kernel_function, while_compiling
from taichi_ants.learners.memory import guarded, read_rates
from taichi_ants.task.model import Model
from taichi_ants.task.rules.conflicts import STANDS
from taichi_ants.task.rules.policy import BY_LEVELS, BY_VALUES

THREADS_OF_BLOCK = 256  # in `in_one_loop`
ANTS, CELLS, STATES, SUMS, WORLD = "ants", "cells", "states", "sums", "world"


class Phase(NamedTuple):
    """A part of a tick that all ants, cells, states or worlds (`of`) finish together.

    It must not read values that another chunk writes in the same phase. `do` is a `ti.func` with
    arguments (c, v, w, chunk, ant, tick) for ANTS, (c, v, place, tick) for CELLS, (c, v, w, tick)
    for WORLD. For STATES, a range of the states of all tables, they are (c, v, w, first, last). For
    SUMS, those of a chunk for a state, with `by_ant` only, they are (c, v, w, chunk, state).
    """

    of: str
    do: Callable[..., None]


# Phases that need no barrier between them: none uses what another chunk changes in the others.
Group = tuple[Phase, ...]


class Variant:
    """A model with the functions and types of its kernels; `v` in functions.

    `in_chunks` says whether threads share worlds; else each world is one chunk. With `by_ant`,
    each ant can have a thread, and chunks only spread sums, to which threads add atomically.
    """

    def __init__(self, model: Model, schedule: str) -> None:
        vars(self).update(vars(model))
        self.in_chunks, self.by_ant = schedule != "by_world", schedule == layout.BY_ANT
        self.add_to_sums, self.note_transition = learning.add_to_sums, learning.note_transition
        if self.by_ant:
            self.add_to_sums = learning.add_atomically
            self.note_transition = learning.note_atomically
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
            self.encode = kernel_function(model.observation.encode)
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
        return [self.field(c, number) for number, dense in enumerate(self.dense_by_number) if dense]


variant = cache(Variant)


def tick_groups(v: Variant) -> Iterator[Group]:
    """Yield the phases of a tick before rounds of `planning_groups` and the `last_groups`."""
    yield (Phase(ANTS, steps.want),)
    if v.traffic.shared:
        yield (Phase(ANTS, steps.resolve),)
    yield (Phase(ANTS, steps.act),)
    if v.lays_in_turn:
        for number in range(len(v.pheromones)):
            yield (Phase(ANTS, steps.lays_field(number)),)
    if v.dense:
        yield (Phase(CELLS, trail.evaporate),)
        yield (Phase(CELLS, trail.diffuse),)
        yield (Phase(CELLS, trail.apply_diffusion),)
    count, births = Phase(WORLD, life.count), Phase(WORLD, life.give_birth)
    food = Phase(WORLD, life.regrow), Phase(WORLD, life.move_piles)
    changes = [births] * v.ants_change
    if v.at["aged"]:
        yield (count, births)
        yield (Phase(ANTS, life.grow_old),)
        yield from [food] * v.food_changes
    elif v.ants_change or v.food_changes or v.reads_deliveries:
        yield (count, *changes, *(food * v.food_changes))
    yield (Phase(ANTS, learning.observe_and_learn),)
    if v.plans_together:
        yield (join(v),)
        yield (Phase(WORLD, learning.remember_shared),)


def join(v: Variant) -> Phase:
    """Return the phase that joins the sums of chunks."""
    return Phase(SUMS, learning.join_atomically) if v.by_ant else Phase(STATES, learning.join_sums)


def planning_groups(v: Variant) -> Iterator[Group]:
    """Yield the phases of one round of updates from the models that ants share."""
    yield Phase(STATES, learning.apply_sums), Phase(ANTS, learning.draw_pair)
    yield join(v), Phase(STATES, learning.find_errors)


def last_groups(v: Variant) -> Iterator[Group]:
    """Yield the phases at the end of a tick."""
    learns: Group = (Phase(STATES, learning.apply_sums),) * v.together
    if v.together and not v.plans_together:
        learns = (join(v), *learns)
    ends: Group = (Phase(WORLD, life.count), Phase(WORLD, life.end_tick))
    if v.ants_change:  # `end_tick` changes what all phases of ants read
        learns = (*learns, Phase(ANTS, life.update_slots))
        yield learns
        learns = ()
    yield *learns, *ends


@function
def do(phase, c, v, chunk):
    """Do a phase for a chunk, or for the world `chunk`, unless its episode has ended."""
    w = chunk if ti.static(phase.of == WORLD) else chunk // chunks_of(c, v)
    if ti.static(phase.of == STATES):  # without updates if the episode has ended
        first, last = share_of(c, v, chunk, v.n_rows)
        phase.do(c, v, w, first, last)
    else:
        running, tick = c.worlds[WorldRow.RUNNING, w], c.worlds[WorldRow.TICKS, w]
        if ti.static(phase.of == ANTS):
            first, last = share_of(c, v, chunk, c.n_slots)
            last = ti.min(last, c.worlds[WorldRow.TOP, w]) * running
            for ant in range(w * c.n_slots + first, w * c.n_slots + last):
                if is_taken(c, v, ant):
                    phase.do(c, v, w, chunk, ant, tick)
        elif ti.static(phase.of == CELLS):
            first, last = share_of(c, v, chunk, c.size)
            for index in range(w * c.size + first, w * c.size + last * running):
                phase.do(c, v, index, tick)
        elif running == 1:
            phase.do(c, v, w, tick)


@while_compiling
def is_taken(c, v, ant):
    """Return whether an ant is in a slot; without vacant slots, always, while a kernel compiles."""
    return trait(c.stage, ant) != layout.Stage.VACANT if v.slots_matter else True


# What happens to all ants between two ticks.
ONCE = {
    "begin": Phase(ANTS, learning.begin),
    "see_interventions": Phase(ANTS, learning.see_interventions),
}


@cache
def once(v: Variant, name: str, arguments: Any) -> Callable[..., None]:
    """Return a kernel of what all ants do between two ticks, by its name."""
    phase = ONCE[name]

    @ti.kernel
    def advance_colony(c: arguments):
        ti.loop_config(block_dim=1)
        for chunk in range(c.n_worlds * chunks_of(c, v)):
            do(phase, c, v, chunk)

    return advance_colony


@while_compiling
def entries_in_world(of, c, v):
    """Return the number of entries of each world, such as ants or cells, by the numbers `c`."""
    if of in (STATES, SUMS):
        return v.n_rows * c.places if of == SUMS else v.n_rows
    return 1 if of == WORLD else c.n_slots if of == ANTS else c.size


@function
def do_one(phase, c, v, i):
    """Do a phase for entry i of what all worlds have, such as an ant or a cell; or for world i."""
    w = i // entries_in_world(phase.of, c, v)
    running, tick = c.worlds[WorldRow.RUNNING, w], c.worlds[WorldRow.TICKS, w]
    if ti.static(phase.of == STATES):
        phase.do(c, v, w, i - w * v.n_rows, i - w * v.n_rows + 1)
    elif ti.static(phase.of == SUMS):
        phase.do(c, v, w, i // v.n_rows, i % v.n_rows)
    elif ti.static(phase.of == ANTS):
        slot = i - w * c.n_slots
        if running == 1 and slot < c.worlds[WorldRow.TOP, w]:
            if is_taken(c, v, i):
                phase.do(c, v, w, w * c.places + slot % c.places, i, tick)
    elif running == 1:
        if ti.static(phase.of == CELLS):
            phase.do(c, v, i, tick)
        else:
            phase.do(c, v, w, tick)


def loops_of(groups: Iterable[Group]) -> tuple[tuple[str, Group], ...]:
    """Return what loops go over, and the phases of each; none uses what others change in it."""
    return tuple(
        (of, tuple(phases))
        for group in groups
        for of, phases in groupby(group, lambda phase: phase.of)
    )


@cache
def by_ant(v: Variant, name: str, contents: memory.Contents, arguments: Any) -> Callable[..., None]:
    """Return a kernel with a parallel loop for each phase, or for several of a group."""
    groups: list[Group] = [(ONCE[name],)] if name in ONCE else []
    if name in ("tick", "first"):
        groups += tick_groups(v)
    if name == "planning":
        groups += planning_groups(v)
    if name in ("tick", "last"):
        groups += last_groups(v)
    loops = loops_of(groups)

    @while_compiling
    def lengths_of(memories: Any) -> dict[str, Any]:
        numbers = Named(partial(memory.number_of, contents, memories))
        return {of: numbers.n_worlds * entries_in_world(of, numbers, v) for of, _ in loops}

    @ti.kernel
    def advance_colony(c: arguments):
        lengths = lengths_of(c)  # all before the first loop, else a GPU launches more kernels
        for of, phases in ti.static(loops):
            ti.loop_config(block_dim=128)
            for i in range(lengths[of]):
                colony = memory.view_of(contents, c)
                for phase in ti.static(phases):
                    do_one(phase, colony, v, i)

    return advance_colony


@cache
def in_one_loop(
    v: Variant, blocks: int, contents: memory.Contents, arguments: Any
) -> Callable[..., None]:
    """Return a kernel of whole ticks in a single parallel loop, for a colony of few ants.

    A GPU takes about 70 microseconds to start the loops of a tick one after another. Here, its
    threads wait for each other after each loop. All run at the same time, because there are as many
    `blocks` of them as the GPU has multiprocessors. Without blocks, on a CPU, one thread does all.
    """
    groups, planning, last = (
        loops_of(some(v)) for some in (tick_groups, planning_groups, last_groups)
    )
    width = THREADS_OF_BLOCK if blocks else 1
    threads = max(1, blocks) * width

    @function
    def share(loops: ti.template(), c, thread, passed):
        """Do a thread's share of loops, waiting after each; return how many loops were done."""
        done = passed
        for of, phases in ti.static(loops):
            i, end = thread, c.n_worlds * entries_in_world(of, c, v)
            while i < end:
                for phase in ti.static(phases):
                    do_one(phase, c, v, i)
                i += threads
            done += 1
            if ti.static(blocks > 0):
                wait_for_blocks(c, thread % width, done * blocks)
        return done

    @ti.kernel
    def advance_colony(c: arguments):
        ti.loop_config(block_dim=width)
        for thread in range(threads):
            colony = memory.view_of(contents, c)
            done = 0
            for _ in range(colony.orders[Order.TICKS]):
                done = share(groups, colony, thread, done)
                if ti.static(v.plans_together):
                    for _round in range(colony.planning_steps):
                        done = share(planning, colony, thread, done)
                done = share(last, colony, thread, done)

    return advance_colony


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
def ticks(v: Variant, arguments: Any) -> Callable[..., None]:
    """Return a kernel of whole ticks whose work is divided into parts, see `Order`.

    Without `v.in_chunks`, each part is a world, and does all ticks independently. Threads take
    parts in order, so successive parts are worlds that are far apart: the counts of neighbours
    share cache lines, and threads that write to the same lines slow each other down. With chunks,
    each part does its share of the chunks, and waits for the others at a barrier after each group
    of phases. A parallel loop per group would take 20 to 200 microseconds more, because threads
    would sleep and wake up. If a part does not arrive, all parts leave, and another launch starts
    with the next group, see `Order.FIRST`.
    """
    groups, planning, last = (
        tuple(some(v)) for some in (tick_groups, planning_groups, last_groups)
    )

    @function
    def share(group: ti.template(), c, part, parts, at):
        """Do a part's share of group `at`, and wait; return the next group, or -1 to leave."""
        following = at
        if ti.static(not v.in_chunks):
            for phase in ti.static(group):
                do(phase, c, v, part)
        else:
            for phase in ti.static(group):
                n = c.n_worlds if ti.static(phase.of == WORLD) else c.n_worlds * chunks_of(c, v)
                begin, end = share_of_part(c, n, part, parts, at)
                for chunk in range(begin, end):
                    do(phase, c, v, chunk)
            following = next_group(c, part, parts, at)
        return following

    @ti.kernel
    def advance_colony(c: arguments):
        ti.loop_config(block_dim=1)
        for i in range(c.orders[Order.PARTS]):
            read_ahead(c)
            part, parts, at, n = i, c.orders[Order.PARTS], 0, c.orders[Order.TICKS]
            if ti.static(v.in_chunks):
                part = part_of(c)
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
