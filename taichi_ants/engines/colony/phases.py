"""The phases of a tick, as functions of one chunk of ants or of one world.

A chunk is a range of the slots of one world; threads work on different chunks. A phase must not
read what another chunk writes in the same phase.
"""

import taichi as ti

from taichi_ants.engines.colony.layout import AntRow, Stage, WorldRow
from taichi_ants.engines.colony.learning import (
    apply_sums,
    begin_to_learn,
    draw_action,
    draw_pair,
    join_sums,
    learn_alone,
    price_draws,
    remember_shared,
    share_error,
    terminates,
)
from taichi_ants.engines.colony.life import (
    count_deaths,
    count_gives,
    give_birth,
    regrow,
    wander,
)
from taichi_ants.engines.colony.steps import commit, grow_old, observe, resolve, settle, want


@ti.func
def ants_of(c: ti.template(), chunk):
    """The world of a chunk, and the range of its ants, empty once the world's episode has ended."""
    w = chunk // c.n_chunks
    per_chunk = (c.n_slots + c.n_chunks - 1) // c.n_chunks
    first = chunk % c.n_chunks * per_chunk
    last = ti.min(first + per_chunk, c.worlds[WorldRow.TOP, w]) * c.worlds[WorldRow.RUNNING, w]
    return w, w * c.n_slots + first, w * c.n_slots + last


@ti.func
def begin_all(c: ti.template(), v: ti.template(), chunk):
    """The ants look around, and their learners begin an episode."""
    w, first, last = ants_of(c, chunk)
    base = w * c.size
    for ant in range(first, last):
        c.ants[AntRow.PERCEPT, ant], c.ants[v.row_at, ant] = observe(c, v, base, ant, 0)
        begin_to_learn(c, v, ant)


@ti.func
def choose_all(c: ti.template(), v: ti.template(), chunk):
    w, first, last = ants_of(c, chunk)
    base = w * c.size
    for ant in range(first, last):
        if c.ants[AntRow.STAGE, ant] == Stage.LIVING:
            action = c.ants[AntRow.ACTION, ant]
            if action < 0:
                action = draw_action(c, v, w, ant, c.ants[v.row_at, ant])
            want(c, v, base, ant, action)


@ti.func
def resolve_all(c: ti.template(), v: ti.template(), chunk, tick):
    w, first, last = ants_of(c, chunk)
    base = w * c.size
    for ant in range(first, last):
        if c.ants[AntRow.STAGE, ant] == Stage.LIVING:
            resolve(c, v, base, ant, tick)


@ti.func
def settle_all(c: ti.template(), v: ti.template(), chunk, tick):
    w, first, last = ants_of(c, chunk)
    base = w * c.size
    for ant in range(first, last):
        if c.ants[AntRow.STAGE, ant] == Stage.LIVING:
            settle(c, v, base, ant, chunk, tick)


@ti.func
def commit_all(c: ti.template(), v: ti.template(), chunk, tick):
    w, first, last = ants_of(c, chunk)
    base = w * c.size
    total = ti.cast(0, ti.i64)
    for ant in range(first, last):
        if c.ants[AntRow.STAGE, ant] == Stage.LIVING:
            total += c.rewards[commit(c, v, base, ant, chunk, tick)]
    c.returns[w] += total  # atomic, and integer: the order does not matter


@ti.func
def grow_old_all(c: ti.template(), chunk):
    w, first, last = ants_of(c, chunk)
    base = w * c.size
    for ant in range(first, last):
        grow_old(c, base, ant, chunk)


@ti.func
def before_deaths(c: ti.template(), v: ti.template(), w, tick):
    if c.worlds[WorldRow.RUNNING, w] == 1:
        count_gives(c, w, tick)
        if ti.static(v.lively):
            if c.births == 1:
                give_birth(c, v, w)


@ti.func
def after_deaths(c: ti.template(), w, tick):
    if c.worlds[WorldRow.RUNNING, w] == 1:
        count_deaths(c, w)
        if c.regrowth >= 0:
            regrow(c, w, tick)
        if c.wander > 0:
            if (tick + 1) % c.wander == 0:
                wander(c, w)


@ti.func
def observe_all(c: ti.template(), v: ti.template(), chunk, tick):
    """Observe, choose the next action where the learner asks for it, and learn."""
    w, first, last = ants_of(c, chunk)
    base = w * c.size
    clock = (tick + 1) * c.evaporates
    for ant in range(first, last):
        stage = c.ants[AntRow.STAGE, ant]
        if stage != Stage.VACANT:
            percept, row = observe(c, v, base, ant, clock)
            next_action = -1
            if stage != Stage.NEWBORN:
                if ti.static(v.draws_next_action):
                    if terminates(c, c.ants[AntRow.EVENT, ant]) == 0:
                        next_action = draw_action(c, v, w, ant, row)
                if ti.static(v.alone):
                    learn_alone(c, v, ant, row, next_action)
                elif ti.static(v.together):
                    share_error(c, v, w, chunk, ant, row, next_action)
            c.ants[AntRow.PERCEPT, ant] = percept
            if ti.static(not v.sees_percept):
                c.ants[AntRow.STATE, ant] = row
            c.ants[AntRow.ACTION, ant] = next_action


@ti.func
def learn_together(c: ti.template(), v: ti.template(), w):
    join_sums(c, v, w)
    if ti.static(v.learner.plans):
        remember_shared(c, v, w)
    apply_sums(c, v, w)


@ti.func
def draw_all(c: ti.template(), v: ti.template(), chunk):
    w, first, last = ants_of(c, chunk)
    for ant in range(first, last):
        stage = c.ants[AntRow.STAGE, ant]
        if stage == Stage.LIVING or stage == Stage.DYING:
            draw_pair(c, v, w, chunk, ant)


@ti.func
def plan_together(c: ti.template(), v: ti.template(), w):
    join_sums(c, v, w)
    price_draws(c, v, w)
    apply_sums(c, v, w)


@ti.func
def retire_all(c: ti.template(), chunk):
    """At the end of the tick the dead leave their slots, and the newborn are ants."""
    w, first, last = ants_of(c, chunk)
    for ant in range(first, last):
        if c.ants[AntRow.STAGE, ant] == Stage.NEWBORN:
            c.ants[AntRow.STAGE, ant] = Stage.LIVING
        elif c.ants[AntRow.STAGE, ant] == Stage.DYING:
            c.ants[AntRow.STAGE, ant] = Stage.VACANT
            ti.atomic_min(c.worlds[WorldRow.FIRST_VACANT, w], ant - w * c.n_slots)
            if c.ants[AntRow.NUMBER, ant] < c.n_ants:
                c.first_streams[w * c.n_slots + c.ants[AntRow.NUMBER, ant]] = c.streams[ant]


@ti.func
def stop_at_delivery(c: ti.template(), w):
    if c.ends_at_delivery == 1 and c.worlds[WorldRow.DELIVERIES, w] > 0:
        c.worlds[WorldRow.RUNNING, w] = 0
