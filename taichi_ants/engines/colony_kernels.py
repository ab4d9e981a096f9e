"""The kernels of a colony: one tick in phases, under two schedules.

Many small worlds: one task a world, all ticks and phases serial inside it. Few large worlds: each
phase a parallel loop over chunks of ants. Both call the same functions in the same order, so that
they give the same numbers.
"""

from collections.abc import Callable
from functools import cache

import taichi as ti

from taichi_ants.constants import REWARD_GIVE
from taichi_ants.engines.colony_arrays import (
    ACTION,
    DELIVERED,
    DYING,
    F32,
    FIRST_VACANT,
    I32,
    I64,
    LIFE,
    LIVING,
    NEWBORN,
    NUMBER,
    REWARD,
    RUNNING,
    STATE,
    TABLE_I32,
    TOP,
    U8,
    U64,
    VACANT,
    Arrays,
    Settings,
)
from taichi_ants.engines.colony_learning import (
    apply_sums,
    draw_action,
    draw_pair,
    join_sums,
    learn_alone,
    price_draws,
    remember_shared,
    share_error,
)
from taichi_ants.engines.colony_life import (
    count_deaths,
    count_gives,
    give_birth,
    regrow,
    wander,
)
from taichi_ants.engines.colony_steps import commit, grow_old, observe, resolve, want
from taichi_ants.engines.colony_trail import diffused, evaporate
from taichi_ants.engines.run_learning import TABLE
from taichi_ants.learners.registry import Learner

# What a kernel does: the first look of an episode; whole ticks, one task a world; or, with loops
# over chunks of ants, one tick, one round of shared planning, and the end of a tick.
BEGIN, BY_WORLD, BY_CHUNK, PLAN, END = "begin", "by_world", "by_chunk", "plan", "end"


@ti.func
def ants_of(c: ti.template(), k: ti.template(), chunk):
    """The world of a chunk, and the range of its ants."""
    w = chunk // k.chunks
    per_chunk = (k.slots + k.chunks - 1) // k.chunks
    first = chunk % k.chunks * per_chunk
    last = ti.min(first + per_chunk, c.worlds[TOP, w])
    return w, w * k.slots + first, w * k.slots + last


@ti.func
def retire(c: ti.template(), k: ti.template(), w, ant):
    """At the end of the tick the dead leave their slots, and the newborn are ants."""
    if c.ants[LIFE, ant] == NEWBORN:
        c.ants[LIFE, ant] = LIVING
    elif c.ants[LIFE, ant] == DYING:
        c.ants[LIFE, ant] = VACANT
        ti.atomic_min(c.worlds[FIRST_VACANT, w], ant - w * k.slots)
        if c.ants[NUMBER, ant] < k.ants:
            c.first_streams[w * k.slots + c.ants[NUMBER, ant]] = c.streams[ant]


@cache
def colony_kernel(
    learner: Learner, sharing: str, dense: bool, lively: bool, schedule: str
) -> Callable[..., None]:
    """The kernel for one learner and way of sharing; it is compiled on first use.

    Args:
        learner: The learner.
        sharing: "shared", "own" or "fixed".
        dense: Whether levels are f32, see `colony_trail`.
        lively: Whether ants or food come and go; leaving that out halves the time to compile.
        schedule: What the kernel does, one of the names above.
    """
    learns = sharing != "fixed"
    alone = sharing == "own"
    on_policy = learns and learner.draws_next_action
    plans = learns and learner.plans
    shared_plans = plans and not alone
    td_error = learner.td_error

    @ti.func
    def choose_all(c: ti.template(), k: ti.template(), chunk):
        w, first, last = ants_of(c, k, chunk)
        for ant in range(first, last):
            if c.worlds[RUNNING, w] == 1 and c.ants[LIFE, ant] == LIVING:
                action = c.ants[ACTION, ant]
                if action < 0:
                    table = (ant if ti.static(alone) else w) * TABLE
                    action = draw_action(c, w, table, ant, c.ants[STATE, ant])
                want(c, w * k.size, ant, action)

    @ti.func
    def resolve_all(c: ti.template(), k: ti.template(), chunk, tick):
        w, first, last = ants_of(c, k, chunk)
        for ant in range(first, last):
            if c.worlds[RUNNING, w] == 1 and c.ants[LIFE, ant] == LIVING:
                resolve(c, w * k.size, ant, tick)

    @ti.func
    def commit_all(c: ti.template(), k: ti.template(), chunk, tick):
        w, first, last = ants_of(c, k, chunk)
        total = 0
        for ant in range(first, last):
            if c.worlds[RUNNING, w] == 1 and c.ants[LIFE, ant] == LIVING:
                total += commit(c, k, dense, w * k.size, ant, chunk, tick)
        c.returns[w] += ti.cast(total, ti.i64)  # atomic, and integer: the order does not matter

    @ti.func
    def grow_old_all(c: ti.template(), k: ti.template(), chunk):
        w, first, last = ants_of(c, k, chunk)
        for ant in range(first, last):
            if c.worlds[RUNNING, w] == 1:
                grow_old(c, k, w * k.size, ant, chunk)

    @ti.func
    def before_deaths(c: ti.template(), k: ti.template(), w, tick):
        if c.worlds[RUNNING, w] == 1:
            count_gives(c, k, w, tick)
            if ti.static(lively):
                if k.births == 1:
                    give_birth(c, k, alone, w)

    @ti.func
    def after_deaths(c: ti.template(), k: ti.template(), w, tick):
        if c.worlds[RUNNING, w] == 1:
            count_deaths(c, k, w)
            if k.regrowth >= 0:
                regrow(c, k, w, tick)
            if k.wander > 0:
                if (tick + 1) % k.wander == 0:
                    wander(c, k, w)

    @ti.func
    def observe_all(c: ti.template(), k: ti.template(), chunk, tick):
        """Observe, choose the next action where the learner asks for it, and learn."""
        w, first, last = ants_of(c, k, chunk)
        clock = (tick + 1) * k.evaporates
        for ant in range(first, last):
            life = c.ants[LIFE, ant]
            if c.worlds[RUNNING, w] == 1 and life != VACANT:
                seen = observe(c, k, dense, w * k.size, ant, clock)
                next_action = -1
                if life != NEWBORN:
                    if ti.static(on_policy):
                        gave = c.ants[REWARD, ant] == REWARD_GIVE
                        if not gave or k.continuing == 1:
                            table = (ant if ti.static(alone) else w) * TABLE
                            next_action = draw_action(c, w, table, ant, seen)
                    if ti.static(learns and alone):
                        learn_alone(td_error, plans, c, k, w, ant, seen, next_action)
                    elif ti.static(learns):
                        share_error(td_error, c, k, w, chunk, ant, seen, next_action)
                c.ants[STATE, ant] = seen
                c.ants[ACTION, ant] = next_action

    @ti.func
    def learn_together(c: ti.template(), k: ti.template(), w):
        join_sums(c, k, w)
        if ti.static(shared_plans):
            remember_shared(c, k, w)
        apply_sums(c, k, w)

    @ti.func
    def draw_all(c: ti.template(), k: ti.template(), chunk):
        w, first, last = ants_of(c, k, chunk)
        for ant in range(first, last):
            life = c.ants[LIFE, ant]
            if c.worlds[RUNNING, w] == 1 and (life == LIVING or life == DYING):
                draw_pair(c, w, chunk, ant)

    @ti.func
    def plan_together(c: ti.template(), k: ti.template(), w):
        join_sums(c, k, w)
        price_draws(td_error, c, k, w)
        apply_sums(c, k, w)

    @ti.func
    def retire_all(c: ti.template(), k: ti.template(), chunk):
        w, first, last = ants_of(c, k, chunk)
        for ant in range(first, last):
            retire(c, k, w, ant)

    @ti.func
    def stop_at_delivery(c: ti.template(), k: ti.template(), w):
        if k.ends_at_delivery == 1 and c.worlds[DELIVERED, w] > 0:
            c.worlds[RUNNING, w] = 0

    @ti.func
    def tick_of_world(c: ti.template(), k: ti.template(), w, tick):
        """One tick of a world with a single chunk, all phases in turn."""
        choose_all(c, k, w)
        resolve_all(c, k, w, tick)
        commit_all(c, k, w, tick)
        if ti.static(dense):
            for place in range(w * k.size, (w + 1) * k.size):
                evaporate(c, k, place)
            if k.share > 0.0:
                for place in range(w * k.size, (w + 1) * k.size):
                    c.spare[place] = diffused(c, k, place)
                for place in range(w * k.size, (w + 1) * k.size):
                    c.level[place] = c.spare[place]
        before_deaths(c, k, w, tick)
        if ti.static(lively):
            if k.lifespan > 0:
                grow_old_all(c, k, w)
            after_deaths(c, k, w, tick)
        observe_all(c, k, w, tick)
        if ti.static(learns and not alone):
            learn_together(c, k, w)
        if ti.static(shared_plans):
            for _ in range(k.planning_steps):
                draw_all(c, k, w)
                plan_together(c, k, w)
        if ti.static(lively):
            retire_all(c, k, w)
        stop_at_delivery(c, k, w)

    @ti.kernel
    def advance_colony(
        first_tick: ti.i32,
        n_ticks: ti.i32,
        worlds: ti.i32,
        ants: ti.i32,
        slots: ti.i32,
        chunks: ti.i32,
        size: ti.i32,
        homes: ti.i32,
        episode: ti.i32,
        evaporates: ti.i32,
        adds: ti.i32,
        level: ti.i32,
        cap: ti.i32,
        decay: ti.f32,
        share: ti.f32,
        births: ti.i32,
        lifespan: ti.i32,
        regrowth: ti.i32,
        wander: ti.i32,
        ends_at_delivery: ti.i32,
        planning_steps: ti.i32,
        continuing: ti.i32,
        ground: U8,
        trail: I32,
        level_f: F32,
        spare: F32,
        walls: U8,
        closer: U8,
        home_of: I32,
        compass: I32,
        ants_: TABLE_I32,
        streams: U64,
        first_streams: U64,
        worlds_: TABLE_I32,
        queen_streams: U64,
        seeds: U64,
        returns: I64,
        tallies: TABLE_I32,
        homes_: TABLE_I32,
        piles: I32,
        rates: F32,
        explore_below: U64,
        q: F32,
        entries: I32,
        slots_of: I32,
        weights: F32,
        sums: I64,
        errors: F32,
        sums_of: TABLE_I32,
        touched: I32,
    ):
        k = ti.static(
            Settings(
                worlds,
                ants,
                slots,
                chunks,
                size,
                homes,
                episode,
                evaporates,
                adds,
                level,
                cap,
                decay,
                share,
                births,
                lifespan,
                regrowth,
                wander,
                ends_at_delivery,
                planning_steps,
                continuing,
            )
        )
        c = ti.static(
            Arrays(
                ground,
                trail,
                level_f,
                spare,
                walls,
                closer,
                home_of,
                compass,
                ants_,
                streams,
                first_streams,
                worlds_,
                queen_streams,
                seeds,
                returns,
                tallies,
                homes_,
                piles,
                rates,
                explore_below,
                q,
                entries,
                slots_of,
                weights,
                sums,
                errors,
                sums_of,
                touched,
            )
        )
        if ti.static(schedule == BEGIN):
            ti.loop_config(block_dim=1)
            for chunk in range(k.worlds * k.chunks):
                w, first, last = ants_of(c, k, chunk)
                for ant in range(first, last):
                    c.ants[STATE, ant] = observe(c, k, dense, w * k.size, ant, 0)
                    c.ants[ACTION, ant] = -1
        elif ti.static(schedule == BY_WORLD):
            ti.loop_config(block_dim=1)
            for w in range(k.worlds):
                for tick in range(first_tick, first_tick + n_ticks):
                    if c.worlds[RUNNING, w] == 1:
                        tick_of_world(c, k, w, tick)
        elif ti.static(schedule == PLAN):
            ti.loop_config(block_dim=1)
            for chunk in range(k.worlds * k.chunks):
                draw_all(c, k, chunk)
            ti.loop_config(block_dim=1)
            for w in range(k.worlds):
                plan_together(c, k, w)
        elif ti.static(schedule == END):
            ti.loop_config(block_dim=1)
            for chunk in range(k.worlds * k.chunks):
                retire_all(c, k, chunk)
            ti.loop_config(serialize=True)
            for w in range(k.worlds):
                stop_at_delivery(c, k, w)
        else:
            ti.loop_config(block_dim=1)
            for chunk in range(k.worlds * k.chunks):
                choose_all(c, k, chunk)
            ti.loop_config(block_dim=1)
            for chunk in range(k.worlds * k.chunks):
                resolve_all(c, k, chunk, first_tick)
            ti.loop_config(block_dim=1)
            for chunk in range(k.worlds * k.chunks):
                commit_all(c, k, chunk, first_tick)
            if ti.static(dense):
                ti.loop_config(block_dim=4096)
                for place in range(k.worlds * k.size):
                    evaporate(c, k, place)
                ti.loop_config(block_dim=4096)
                for place in range(k.worlds * k.size):
                    c.spare[place] = diffused(c, k, place)
                ti.loop_config(block_dim=4096)
                for place in range(k.worlds * k.size):
                    c.level[place] = c.spare[place]
            ti.loop_config(block_dim=1)
            for w in range(k.worlds):
                before_deaths(c, k, w, first_tick)
            if ti.static(lively):
                ti.loop_config(block_dim=1)
                for chunk in range(k.worlds * k.chunks):
                    if k.lifespan > 0:
                        grow_old_all(c, k, chunk)
                ti.loop_config(block_dim=1)
                for w in range(k.worlds):
                    after_deaths(c, k, w, first_tick)
            ti.loop_config(block_dim=1)
            for chunk in range(k.worlds * k.chunks):
                observe_all(c, k, chunk, first_tick)
            if ti.static(learns and not alone):
                ti.loop_config(block_dim=1)
                for w in range(k.worlds):
                    learn_together(c, k, w)

    return advance_colony
