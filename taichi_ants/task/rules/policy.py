"""The choice among the five actions, the functions in kernels of `features/choice.py`.

Each choice takes one draw of 64 bits. The upper word decides whether an ant explores, if its rule
has epsilon. The lower word breaks ties, or chooses by weights: with u = word * 2^-32 * (sum of the
weights), the first choice is taken whose cumulative sum of weights exceeds u. Weights and sums are
f64, and sums are from the first weight to the last.
"""

import taichi as ti
from taichi.math import popcnt

from taichi_ants.arithmetic.numbers import exponential, power
from taichi_ants.arithmetic.random_bits import below, high_word, low_word
from taichi_ants.task.constants import FORWARD, GIVE, LEFT, N_ACTIONS, PICK_UP, RIGHT, SEES_GOAL
from taichi_ants.task.rules.actions import bit_number_in


@ti.func
def larger(a, b):
    """Return the larger of two floats in one instruction (`ti.max` needs several, for NaN)."""
    return ti.select(a > b, a, b)


@ti.func
def best_value(values):
    """Return the largest of five action values (f32)."""
    return larger(larger(larger(values[0], values[1]), larger(values[2], values[3])), values[4])


@ti.func
def value_at(values, action):
    """Return the value of an action, by comparisons, which are faster than an index."""
    value = values[0]
    for a in ti.static(range(1, N_ACTIONS)):
        value = ti.select(action == a, values[a], value)
    return value


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
def best_actions(values):
    """Return a bit for each of the five actions with the largest value."""
    best = best_value(values)
    mask = (1 << N_ACTIONS) - 1
    for a in ti.static(range(N_ACTIONS)):
        # Not `values[a] == best`, which would leave no action if values are NaN.
        mask ^= ti.cast(values[a] < best, ti.i32) << a
    return mask


@ti.func
def choose(values, bits, explore_below):
    """Return an epsilon-greedy action from one draw; `explore_below` is epsilon * 2**32, u64.

    Each move that can be the best one has its own branch, here and in `choose_from_masks`: the
    processor goes on with the action that it predicts, and soon notices a wrong prediction.
    """
    action = below(low_word(bits), N_ACTIONS)
    if high_word(bits) >= explore_below:
        others = larger(values[PICK_UP], values[GIVE])
        if values[FORWARD] > larger(larger(values[LEFT], values[RIGHT]), others):
            action = FORWARD
        elif values[LEFT] > larger(larger(values[FORWARD], values[RIGHT]), others):
            action = LEFT
        elif values[RIGHT] > larger(larger(values[LEFT], values[FORWARD]), others):
            action = RIGHT
        else:
            mask = best_actions(values)
            action = bit_number(mask, below(low_word(bits), popcnt(mask)))
    return action


@ti.func
def choose_in_crowd(compass: ti.template(), best, bits, explore_below):
    """Return the action of `choose` without a branch, for crowds; `best` are the `best_actions`."""
    mask = ti.select(high_word(bits) < explore_below, (1 << N_ACTIONS) - 1, best)
    return bit_number_in(compass, mask, below(low_word(bits), popcnt(mask)))


@ti.func
def choose_from_masks(compass: ti.template(), best: ti.template(), state, bits, explore_below):
    """Return the action of `choose`; `best` has the best actions of each state, as bits."""
    action = below(low_word(bits), N_ACTIONS)
    if high_word(bits) >= explore_below:
        mask = ti.cast(best[state], ti.i32)
        if mask == 1 << FORWARD:
            action = FORWARD
        elif mask == 1 << LEFT:
            action = LEFT
        elif mask == 1 << RIGHT:
            action = RIGHT
        else:
            action = bit_number_in(compass, mask, below(low_word(bits), popcnt(mask)))
    return action


@ti.func
def chance_of(values, action, explore_below):
    """Return the probability (f64) with which `choose` returns this action."""
    best, explores = best_actions(values), ti.cast(explore_below, ti.f64) / 4294967296.0
    chance = explores / ti.cast(N_ACTIONS, ti.f64)
    if best >> action & 1 == 1:
        chance += (1.0 - explores) / ti.cast(popcnt(best), ti.f64)
    return chance


@ti.func
def chosen_by(weights: ti.template(), n: ti.template(), word):
    """Return the index of one of n weights (f64), with probabilities proportional to them."""
    total = ti.f64(0.0)
    for i in ti.static(range(n)):
        total = total + weights[i]
    drawn = ti.cast(word, ti.f64) / ti.f64(4294967296.0) * total
    index, cumulative = 0, ti.f64(0.0)
    for i in ti.static(range(n - 1)):
        cumulative = cumulative + weights[i]
        index += ti.cast(cumulative <= drawn, ti.i32)
    return index


@ti.func
def softmax_weights(values, temperature):
    """Return exp((value - largest value) / temperature) of five action values, f64."""
    best = ti.cast(best_value(values), ti.f64)
    weights = ti.Vector([ti.f64(0.0) for _ in ti.static(range(N_ACTIONS))])
    for a in ti.static(range(N_ACTIONS)):
        weights[a] = exponential((ti.cast(values[a], ti.f64) - best) / temperature)
    return weights


@ti.func
def choose_softly(a: ti.template(), values, bits, explore_below):
    """Return the action of an ant `a` by the rule "softmax"; other arguments as in `choose`."""
    action = below(low_word(bits), N_ACTIONS)
    if not high_word(bits) < explore_below:
        action = chosen_by(softmax_weights(values, a.temperature), N_ACTIONS, low_word(bits))
    return action


@ti.func
def chance_of_softly(a: ti.template(), values, action, explore_below):
    """Return the probability (f64) with which `choose_softly` returns this action."""
    weights = softmax_weights(values, a.temperature)
    total = ti.f64(0.0)
    for a in ti.static(range(N_ACTIONS)):
        total = total + weights[a]
    explores = ti.cast(explore_below, ti.f64) / 4294967296.0
    return explores / ti.cast(N_ACTIONS, ti.f64) + (1.0 - explores) * (weights[action] / total)


@ti.func
def attraction(a: ti.template(), level):
    """Return the weight of an open cell by the rule "deneubourg": (k + level)^exponent, f64."""
    return power(a.k + ti.cast(level, ti.f64), a.exponent)


@ti.func
def choose_cell(carries, codes: ti.template(), is_open_at, is_nearer, weights, bits):
    """Return an action by the rule "deneubourg".

    `codes` are those seen left, forward and right. For each of these cells, `is_open_at` is 1 if
    the ant can try to enter it, `is_nearer` is 1 if it is nearer to the queen, and `weights` is its
    `attraction`. An ant with food considers only nearer cells if any of these is open. An ant
    without an open cell turns left or right.
    """
    word = low_word(bits)
    action = below(word, 2) * RIGHT
    if (codes[0] == SEES_GOAL) | (codes[1] == SEES_GOAL) | (codes[2] == SEES_GOAL):
        action = ti.select(carries == 1, GIVE, PICK_UP)
    elif is_open_at.sum() > 0:
        considered = is_open_at
        if carries == 1:
            if (is_open_at * is_nearer).sum() > 0:
                considered = is_open_at * is_nearer
        chosen = weights
        for i in ti.static(range(3)):
            chosen[i] = ti.select(considered[i] == 1, weights[i], ti.f64(0.0))
        action = LEFT + chosen_by(chosen, 3, word)
    return action


# The rules that choose by action values, with their probabilities; the greedy one has own forms.
BY_VALUES = {"softmax": (choose_softly, chance_of_softly)}
# The rules that choose a cell by the levels ahead: its weight, and the choice.
BY_LEVELS = {"deneubourg": (attraction, choose_cell)}
