"""The kernels of a colony: one tick in phases, under two schedules.

Many small worlds: one task a world, all ticks and phases serial inside it. Few large worlds: each
phase a parallel loop over chunks of ants. Both call the same functions in the same order, so that
they give the same numbers.
"""

from collections.abc import Callable
from functools import cache

import taichi as ti

from taichi_ants.engines.colony.arrays import (
    ACTION,
    F32,
    I32,
    I64,
    RUNNING,
    STATE,
    TABLE_I32,
    U8,
    U64,
    Arrays,
    Settings,
)
from taichi_ants.engines.colony.phases import ants_of, phases
from taichi_ants.engines.colony.steps import observe
from taichi_ants.engines.colony.trail import diffused, evaporate
from taichi_ants.learners.registry import Learner

# What a kernel does: the first look of an episode; whole ticks, one task a world; or, with loops
# over chunks of ants, one tick, one round of shared planning, and the end of a tick.
BEGIN, BY_WORLD, BY_CHUNK, PLAN, END = "begin", "by_world", "by_chunk", "plan", "end"


@cache
def colony_kernel(
    learner: Learner, sharing: str, own: bool, dense: bool, lively: bool, schedule: str
) -> Callable[..., None]:
    """The kernel for one learner and way of sharing; it is compiled on first use.

    Args:
        learner: The learner.
        sharing: "shared", "own" or "fixed".
        own: Whether there is a table for each slot.
        dense: Whether levels are f32, see `colony_trail`.
        lively: Whether ants or food come and go; leaving that out halves the time to compile.
        schedule: What the kernel does, one of the names above.
    """
    p = phases(learner, sharing, own, dense, lively)
    shares = sharing == "shared"

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
        rewards: I32,
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
                rewards,
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
                        p.tick_of_world(c, k, w, tick)
        elif ti.static(schedule == PLAN):
            ti.loop_config(block_dim=1)
            for chunk in range(k.worlds * k.chunks):
                p.draw_all(c, k, chunk)
            ti.loop_config(block_dim=1)
            for w in range(k.worlds):
                p.plan_together(c, k, w)
        elif ti.static(schedule == END):
            ti.loop_config(block_dim=1)
            for chunk in range(k.worlds * k.chunks):
                p.retire_all(c, k, chunk)
            ti.loop_config(serialize=True)
            for w in range(k.worlds):
                p.stop_at_delivery(c, k, w)
        else:
            ti.loop_config(block_dim=1)
            for chunk in range(k.worlds * k.chunks):
                p.choose_all(c, k, chunk)
            ti.loop_config(block_dim=1)
            for chunk in range(k.worlds * k.chunks):
                p.resolve_all(c, k, chunk, first_tick)
            ti.loop_config(block_dim=1)
            for chunk in range(k.worlds * k.chunks):
                p.commit_all(c, k, chunk, first_tick)
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
                p.before_deaths(c, k, w, first_tick)
            if ti.static(lively):
                ti.loop_config(block_dim=1)
                for chunk in range(k.worlds * k.chunks):
                    if k.lifespan > 0:
                        p.grow_old_all(c, k, chunk)
                ti.loop_config(block_dim=1)
                for w in range(k.worlds):
                    p.after_deaths(c, k, w, first_tick)
            ti.loop_config(block_dim=1)
            for chunk in range(k.worlds * k.chunks):
                p.observe_all(c, k, chunk, first_tick)
            if ti.static(shares):
                ti.loop_config(block_dim=1)
                for w in range(k.worlds):
                    p.learn_together(c, k, w)

    return advance_colony
