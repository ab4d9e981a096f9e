"""The phases of a tick, as functions of one chunk of ants or of one world.

A chunk is a range of the slots of one world; threads work on different chunks. A phase must not
read what another chunk writes in the same phase.
"""

from types import SimpleNamespace

import taichi as ti

from taichi_ants.engines.colony.arrays import (
    ACTION,
    DELIVERIES,
    DYING,
    EVENT,
    FIRST_VACANT,
    LIFE,
    LIVING,
    NEWBORN,
    NUMBER,
    RUNNING,
    STATE,
    TOP,
    VACANT,
)
from taichi_ants.engines.colony.learning import (
    apply_sums,
    draw_action,
    draw_pair,
    join_sums,
    learn_alone,
    price_draws,
    remember_shared,
    share_error,
)
from taichi_ants.engines.colony.life import (
    count_deaths,
    count_gives,
    give_birth,
    regrow,
    wander,
)
from taichi_ants.engines.colony.steps import commit, grow_old, observe, resolve, want
from taichi_ants.engines.colony.trail import diffused, evaporate
from taichi_ants.engines.runs.learning import TABLE
from taichi_ants.engines.trial import tried
from taichi_ants.learners.registry import Learner
from taichi_ants.learners.td_errors import guarded
from taichi_ants.task.constants import DELIVERED


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


def phases(learner: Learner, sharing: str, own: bool, dense: bool, lively: bool) -> SimpleNamespace:
    """The phases for one learner and way of sharing, see `colony_kernels.colony_kernel`."""
    learns = sharing != "fixed"
    alone = own
    forgets = own and learns  # a newborn knows nothing
    on_policy = learns and learner.draws_next_action
    plans = learns and learner.plans
    shared_plans = plans and not alone
    td_error = guarded(tried(learner).td_error) if learns else None

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
        total = ti.cast(0, ti.i64)
        for ant in range(first, last):
            if c.worlds[RUNNING, w] == 1 and c.ants[LIFE, ant] == LIVING:
                total += c.rewards[commit(c, k, dense, w * k.size, ant, chunk, tick)]
        c.returns[w] += total  # atomic, and integer: the order does not matter

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
                    give_birth(c, k, forgets, w)

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
                        gave = c.ants[EVENT, ant] == DELIVERED
                        if not gave or k.continuing == 1:
                            table = (ant if ti.static(alone) else w) * TABLE
                            next_action = draw_action(c, w, table, ant, seen)
                    if ti.static(learns and alone):
                        learn_alone(td_error, plans, c, k, w, ant, seen, next_action)
                    elif ti.static(learns):
                        share_error(td_error, plans, c, k, w, chunk, ant, seen, next_action)
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
        if k.ends_at_delivery == 1 and c.worlds[DELIVERIES, w] > 0:
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

    return SimpleNamespace(
        choose_all=choose_all,
        resolve_all=resolve_all,
        commit_all=commit_all,
        grow_old_all=grow_old_all,
        before_deaths=before_deaths,
        after_deaths=after_deaths,
        observe_all=observe_all,
        learn_together=learn_together,
        draw_all=draw_all,
        plan_together=plan_together,
        retire_all=retire_all,
        stop_at_delivery=stop_at_delivery,
        tick_of_world=tick_of_world,
    )
