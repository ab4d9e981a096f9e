"""The tables of the engine of independent runs: action values and the model, and their updates."""

import taichi as ti

from taichi_ants.task.constants import N_ACTIONS, N_STATES
from taichi_ants.task.rules.random_bits import advance, below, bits_of, high_word

ROW = 8  # action values of a state: 5, and 3 unused, so that no row straddles a cache line
TABLE = N_STATES * ROW
MODEL = N_STATES * N_ACTIONS

# A model entry packs a visited pair (its offset in the table) and its last seen outcome.
_NEXT_AT, _EVENT_AT, _ENDED_AT = 10, 17, 20

# What an update needs to know of the run: f32 all.
Rates = ti.types.struct(learning_rate=ti.f32, discount=ti.f32, epsilon=ti.f32)


@ti.func
def values_of(q: ti.template(), table, state):
    """The five action values of a state in the Q-table that begins at `table`."""
    row = table + state * ROW
    return ti.Vector([q[row + a] for a in ti.static(range(N_ACTIONS))])


@ti.func
def update(
    td_error: ti.template(), q: ti.template(), table, rates, pair, reward, ended, state, action
):
    """Update a pair (an offset in the table) by its TD error, which is returned.

    `state` is the next state, `action` the next action (-1 where none was drawn); where the
    transition `ended` in a terminal state the discount is 0.
    """
    discount = rates.discount
    if ended == 1:
        discount = 0.0
    value = q[table + pair]
    next_values = values_of(q, table, state)
    error = td_error(value, ti.cast(reward, ti.f32), discount, next_values, action, rates.epsilon)
    q[table + pair] = value + rates.learning_rate * error
    return error


@ti.func
def pack_entry(pair, event, ended, state):
    """A model entry: what was seen last of a pair."""
    return pair | state << _NEXT_AT | event << _EVENT_AT | ended << _ENDED_AT


@ti.func
def entry_pair(entry):
    """The pair of a model entry, its offset in the table."""
    return entry & (TABLE - 1)


@ti.func
def entry_next_state(entry):
    """The next state of a model entry."""
    return entry >> _NEXT_AT & (N_STATES - 1)


@ti.func
def entry_event(entry):
    """The event of a model entry."""
    return entry >> _EVENT_AT & 7


@ti.func
def entry_ended(entry):
    """1 if the transition of a model entry ended in a terminal state."""
    return entry >> _ENDED_AT


@ti.func
def remember(
    entries: ti.template(), slots: ti.template(), model, n_visited, pair, event, ended, state
):
    """Store what was seen last of a pair, new pairs in visiting order; the number of them."""
    count = n_visited
    key = model + pair // ROW * N_ACTIONS + pair % ROW
    if slots[key] == 0:
        count += 1
        slots[key] = count
    entries[model + slots[key] - 1] = pack_entry(pair, event, ended, state)
    return count


@ti.func
def plan(
    td_error: ti.template(),
    q: ti.template(),
    entries: ti.template(),
    rewards: ti.template(),
    table,
    model,
    rates,
    n_visited,
    planning_steps,
    random_state,
):
    """Update pairs drawn from the model; the state of the random stream after it."""
    rng = random_state
    for _ in range(planning_steps):
        rng = advance(rng)
        entry = entries[model + below(high_word(bits_of(rng)), n_visited)]
        update(
            td_error,
            q,
            table,
            rates,
            entry_pair(entry),
            rewards[entry_event(entry)],
            entry_ended(entry),
            entry_next_state(entry),
            -1,
        )
    return rng
