"""How the ants of a colony learn: one table for all, or one each.

One shared table: all ants choose and compute their TD errors by the table as it stood at the start
of the tick. For each pair the n errors are summed as 64-bit fixed-point numbers, so that their
order does not matter, and the value moves by weights[n] times their mean, which is what n updates
in turn towards one target would give. Every chunk of ants sums for itself; nothing is atomic.
"""

import taichi as ti

from taichi_ants.engines.colony.arrays import (
    ACTION,
    COUNT,
    EVENT,
    LATEST,
    MODEL_SIZE,
    NUMBER,
    OUTCOME,
    STATE,
    VISITED,
)
from taichi_ants.engines.runs.learning import (
    MODEL,
    ROW,
    TABLE,
    Rates,
    entry_ended,
    entry_event,
    entry_next_state,
    entry_pair,
    pack_entry,
    plan,
    remember,
    update,
    values_of,
)
from taichi_ants.task.constants import DELIVERED, N_ACTIONS
from taichi_ants.task.rules.policy import choose
from taichi_ants.task.rules.random_bits import advance, below, bits_of, high_word

_ONE = 4294967296.0  # fixed-point numbers have 32 binary places
_LARGEST = 2147483648.0  # and an error must lie below this


@ti.func
def rates_of(c: ti.template(), w):
    """Learning rate, discount and epsilon of a world."""
    return Rates(c.rates[3 * w], c.rates[3 * w + 1], c.rates[3 * w + 2])


@ti.func
def draw_action(c: ti.template(), w, table, ant, state):
    """The ant's choice in a state, by the table that begins at `table`."""
    c.streams[ant] = advance(c.streams[ant])
    return choose(values_of(c.q, table, state), bits_of(c.streams[ant]), c.explore_below[w])


@ti.func
def learn_alone(
    td_error: ti.template(), plans: ti.template(), c: ti.template(), k: ti.template(), w, ant, seen,
    next_action,
):  # fmt: skip
    """Update the ant's own table, as an ant that is alone does."""
    rates, event = rates_of(c, w), c.ants[EVENT, ant]
    ended = ti.cast(event == DELIVERED, ti.i32) & (1 - k.continuing)
    table, model = ant * TABLE, ant * MODEL
    pair = c.ants[STATE, ant] * ROW + c.ants[ACTION, ant]
    update(td_error, c.q, table, rates, pair, c.rewards[event], ended, seen, next_action)
    if ti.static(plans):
        known = c.ants[VISITED, ant]
        known = remember(c.entries, c.slots_of, model, known, pair, event, ended, seen)
        c.ants[VISITED, ant] = known
        c.streams[ant] = plan(
            td_error,
            c.q,
            c.entries,
            c.rewards,
            table,
            model,
            rates,
            known,
            k.planning_steps,
            c.streams[ant],
        )


@ti.func
def error_of(td_error: ti.template(), c: ti.template(), w, pair, event, ended, seen, next_action):
    """The TD error of a pair (its offset in the table) by the shared table of a world."""
    rates, table = rates_of(c, w), w * TABLE
    discount = rates.discount
    if ended == 1:
        discount = 0.0
    error = td_error(
        c.q[table + pair],
        ti.cast(c.rewards[event], ti.f32),
        discount,
        values_of(c.q, table, seen),
        next_action,
        rates.epsilon,
    )
    if not ti.abs(error) < _LARGEST:
        c.q[table + pair] = ti.math.nan  # a fixed-point number would hide it
    return error


@ti.func
def share_error(
    td_error: ti.template(), plans: ti.template(), c: ti.template(), k: ti.template(), w, chunk,
    ant, seen, next_action,
):  # fmt: skip
    """Add the TD error of an ant to the sums of its chunk, and what it saw."""
    event = c.ants[EVENT, ant]
    ended = ti.cast(event == DELIVERED, ti.i32) & (1 - k.continuing)
    state, action = c.ants[STATE, ant], c.ants[ACTION, ant]
    pair = state * ROW + action
    error = error_of(td_error, c, w, pair, event, ended, seen, next_action)
    place = chunk * MODEL + state * N_ACTIONS + action
    add_to_sums(c, chunk, state * N_ACTIONS + action, error, fixed(error), 1)
    if ti.static(plans):
        note_outcome(c, place, c.ants[NUMBER, ant], pack_entry(pair, event, ended, seen))


@ti.func
def fixed(error):
    """An error as a fixed-point number: f32 -> i64."""
    return ti.cast(ti.floor(ti.cast(error, ti.f64) * _ONE + 0.5), ti.i64)


@ti.func
def add_to_sums(c: ti.template(), chunk, key, error, total, count):
    """Add `count` updates of a pair to a chunk's sums, the last of them with this error."""
    place, listed = chunk * MODEL + key, chunk * (MODEL + 1)
    known = c.sums_of[COUNT, place]
    if known == 0:
        c.touched[listed] += 1
        c.touched[listed + c.touched[listed]] = key
        c.sums[place] = 0
        c.sums_of[LATEST, place] = -1
    c.sums_of[COUNT, place] = known + count
    c.sums[place] += total
    c.errors[place] = error


@ti.func
def note_outcome(c: ti.template(), place, number, outcome):
    """Note what an ant saw of a pair, for the model; the highest ant number's outcome stays."""
    if number > c.sums_of[LATEST, place]:
        c.sums_of[LATEST, place] = number
        c.sums_of[OUTCOME, place] = outcome


@ti.func
def join_sums(c: ti.template(), k: ti.template(), w):
    """Bring the sums of all chunks of a world into its first one."""
    first = w * k.chunks
    for chunk in range(first + 1, first + k.chunks):
        listed = chunk * (MODEL + 1)
        for i in range(c.touched[listed]):
            key = c.touched[listed + 1 + i]
            place = chunk * MODEL + key
            count = c.sums_of[COUNT, place]
            add_to_sums(c, first, key, c.errors[place], c.sums[place], count)
            latest, outcome = c.sums_of[LATEST, place], c.sums_of[OUTCOME, place]
            note_outcome(c, first * MODEL + key, latest, outcome)
            c.sums_of[COUNT, place] = 0
        c.touched[listed] = 0


@ti.func
def apply_sums(c: ti.template(), k: ti.template(), w):
    """Move the shared values of a world by their joined errors, and forget these."""
    chunk, table = w * k.chunks, w * TABLE
    listed = chunk * (MODEL + 1)
    for i in range(c.touched[listed]):
        key = c.touched[listed + 1 + i]
        place = chunk * MODEL + key
        pair = table + key // N_ACTIONS * ROW + key % N_ACTIONS
        count = c.sums_of[COUNT, place]
        error = c.errors[place]
        rate = c.rates[3 * w]
        if count > 1:
            mean = ti.cast(c.sums[place], ti.f64) / (ti.cast(count, ti.f64) * _ONE)
            error = ti.cast(mean, ti.f32)
            rate = c.weights[count]
        c.q[pair] += rate * error
        c.sums_of[COUNT, place] = 0
    c.touched[listed] = 0


@ti.func
def remember_shared(c: ti.template(), k: ti.template(), w):
    """Store the joined outcomes in the shared model, new pairs in ascending order."""
    chunk, model = w * k.chunks, w * MODEL
    listed = chunk * (MODEL + 1)
    n = c.touched[listed]
    for i in range(2, n + 1):  # insertion sort: short lists, nearly always known pairs
        key = c.touched[listed + i]
        j = i - 1
        while j >= 1 and c.touched[listed + ti.max(j, 1)] > key:
            c.touched[listed + j + 1] = c.touched[listed + j]
            j -= 1
        c.touched[listed + j + 1] = key
    for i in range(1, n + 1):
        key = c.touched[listed + i]
        if c.slots_of[model + key] == 0:
            c.worlds[MODEL_SIZE, w] += 1
            c.slots_of[model + key] = c.worlds[MODEL_SIZE, w]
        outcome = c.sums_of[OUTCOME, chunk * MODEL + key]
        c.entries[model + c.slots_of[model + key] - 1] = outcome


@ti.func
def draw_pair(c: ti.template(), w, chunk, ant):
    """One planning draw of an ant: count an update of a visited pair."""
    c.streams[ant] = advance(c.streams[ant])
    drawn = below(high_word(bits_of(c.streams[ant])), c.worlds[MODEL_SIZE, w])
    entry = c.entries[w * MODEL + drawn]
    pair = entry_pair(entry)
    key = pair // ROW * N_ACTIONS + pair % ROW
    add_to_sums(c, chunk, key, 0.0, ti.cast(0, ti.i64), 1)
    note_outcome(c, chunk * MODEL + key, 0, entry)


@ti.func
def price_draws(td_error: ti.template(), c: ti.template(), k: ti.template(), w):
    """The errors of all pairs that were drawn, by the table at the start of the round."""
    chunk = w * k.chunks
    listed = chunk * (MODEL + 1)
    for i in range(c.touched[listed]):
        place = chunk * MODEL + c.touched[listed + 1 + i]
        entry = c.sums_of[OUTCOME, place]
        error = error_of(
            td_error,
            c,
            w,
            entry_pair(entry),
            entry_event(entry),
            entry_ended(entry),
            entry_next_state(entry),
            -1,
        )
        c.errors[place] = error
        c.sums[place] = fixed(error) * c.sums_of[COUNT, place]
