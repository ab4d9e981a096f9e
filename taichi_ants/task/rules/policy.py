"""The choice among the five actions."""

import taichi as ti
from taichi.math import popcnt

from taichi_ants.task.constants import N_ACTIONS
from taichi_ants.task.rules.actions import bit_number_in
from taichi_ants.task.rules.random_bits import below, high_word, low_word


@ti.func
def larger(a, b):
    """Return the larger of two floats in one instruction (`ti.max` needs several, for NaN)."""
    return ti.select(a > b, a, b)


@ti.func
def smaller(a, b):
    """Return the smaller of two floats in one instruction."""
    return ti.select(a < b, a, b)


@ti.func
def best_value(values):
    """Return the largest of five action values (f32)."""
    return larger(larger(larger(values[0], values[1]), larger(values[2], values[3])), values[4])


@ti.func
def lowest_bit_number(mask):
    """Return the number of the lowest set bit of a non-zero i32."""
    return popcnt((mask & -mask) - 1)


@ti.func
def bit_number(mask, k):
    """Return the number of the k-th set bit (from 0, ascending) of an i32."""
    rest = mask
    for _ in range(k):
        rest &= rest - 1
    return lowest_bit_number(rest)


@ti.func
def choose(values, bits, explore_below):
    """Return an epsilon-greedy action from one draw of 64 bits, with ties broken at random.

    If the upper word is below `explore_below` (epsilon * 2**32 as u64), the action is random. The
    lower word selects a random action, or breaks ties, so that every decision takes one draw.
    """
    action = 0
    if high_word(bits) < explore_below:
        action = below(low_word(bits), N_ACTIONS)
    else:
        best = best_value(values)
        mask = (1 << N_ACTIONS) - 1
        for a in ti.static(range(N_ACTIONS)):
            # Not `values[a] == best`, which would leave no action if values are NaN.
            mask ^= ti.cast(values[a] < best, ti.i32) << a
        if mask & (mask - 1) == 0:  # one best action: usual, so the branch is well predicted
            action = lowest_bit_number(mask)
        else:
            action = bit_number(mask, below(low_word(bits), popcnt(mask)))
    return action


@ti.func
def choose_in_crowd(compass: ti.template(), values, bits, explore_below):
    """Return the action of `choose`, without a branch: exploration in crowds is unpredictable."""
    best = best_value(values)
    mask = (1 << N_ACTIONS) - 1
    for a in ti.static(range(N_ACTIONS)):
        mask ^= ti.cast(values[a] < best, ti.i32) << a
    mask = ti.select(high_word(bits) < explore_below, (1 << N_ACTIONS) - 1, mask)
    return bit_number_in(compass, mask, below(low_word(bits), popcnt(mask)))


@ti.func
def chance_of(values, action, explore_below):
    """Return the probability (f64) with which `choose` returns this action."""
    best = best_value(values)
    ties, explores = 0, ti.cast(explore_below, ti.f64) / 4294967296.0
    for a in ti.static(range(N_ACTIONS)):
        ties += 1 - ti.cast(values[a] < best, ti.i32)
    chance = explores / ti.cast(N_ACTIONS, ti.f64)
    if not values[action] < best:
        chance += (1.0 - explores) / ti.cast(ties, ti.f64)
    return chance
