"""The kernels of offline learning.

A single thread computes each sum, in order, so results do not depend on the number of threads. The
last argument, `zero`, is for the guards of `arithmetic.guards`.
"""

import taichi as ti

from taichi_ants.task.constants import N_ACTIONS

_i32 = ti.types.ndarray(dtype=ti.i32, ndim=1)
_u8 = ti.types.ndarray(dtype=ti.u8, ndim=1)
_f32 = ti.types.ndarray(dtype=ti.f32, ndim=1)
_f64 = ti.types.ndarray(dtype=ti.f64, ndim=1)


@ti.func
def best_of(q: ti.template(), row):
    """Return the largest of the five action values that begin at `row`."""
    best = q[row]
    for a in ti.static(range(1, N_ACTIONS)):
        best = ti.max(best, q[row + a])
    return best


@ti.kernel
def replay(
    q: _f32,
    begins: _i32,
    states: _i32,
    actions: _i32,
    rewards: _i32,
    next_states: _i32,
    terminated: _u8,
    n_states: ti.i32,
    learning_rate: ti.f32,
    discount: ti.f32,
    zero: ti.i32,
):
    """Update `q` by Q-learning over the rows of each group, from the first to the last."""
    ti.loop_config(block_dim=1)
    for group in range(begins.shape[0] - 1):
        table = group * n_states * N_ACTIONS
        for i in range(begins[group], begins[group + 1]):
            target = ti.cast(rewards[i], ti.f32)
            if terminated[i] == 0:
                target += discount * best_of(q, table + next_states[i] * N_ACTIONS)
            pair = table + states[i] * N_ACTIONS + actions[i]
            q[pair] += learning_rate * (target - q[pair])


@ti.kernel
def iterate(
    q: _f64,
    values: _f64,
    policy: _f64,
    greedy: ti.i32,
    pairs_begin: _i32,
    pairs: _i32,
    rewards: _f64,
    successors_begin: _i32,
    successors: _i32,
    probabilities: _f64,
    n_states: ti.i32,
    discount: ti.f64,
    lowest: ti.f64,
    tolerance: ti.f64,
    zero: ti.i32,
):
    """Back up all pairs of each group, until no value changes by more than `tolerance`.

    Updates `q` (groups * n_states * 5,) and writes the `values` of states; see `EmpiricalModel`.
    If `greedy`, values are of the best action, otherwise of the `policy` (n_states * 5,).
    """
    ti.loop_config(block_dim=1)
    for group in range(pairs_begin.shape[0] - 1):
        base, change = group * n_states, 2.0 * tolerance + 1.0
        while change > tolerance:
            change = 0.0
            for state in range(n_states):
                row = (base + state) * N_ACTIONS
                value = best_of(q, row)
                if greedy == 0:
                    value = 0.0
                    for a in ti.static(range(N_ACTIONS)):
                        value += policy[state * N_ACTIONS + a] * q[row + a]
                values[base + state] = value
            for pair in range(pairs_begin[group], pairs_begin[group + 1]):
                later = ti.f64(0.0)
                for k in range(successors_begin[pair], successors_begin[pair + 1]):
                    later += probabilities[k] * values[base + successors[k]]
                backed_up = ti.max(rewards[pair] + discount * later, lowest)
                entry = base * N_ACTIONS + pairs[pair]
                change = ti.max(change, ti.abs(backed_up - q[entry]))
                q[entry] = backed_up
