"""The kernel of the double bridge's published model: a task a colony."""

import taichi as ti

from taichi_ants.task.rules.random_bits import advance, bits_of, high_word, low_word


@ti.func
def power(base, n):
    """A whole power as products from the left, so that every machine rounds alike."""
    product = ti.f64(1.0)
    for _ in range(n):
        product *= base
    return product


@ti.kernel
def cross(
    took: ti.types.ndarray(dtype=ti.u8, ndim=2),
    states: ti.types.ndarray(dtype=ti.u64, ndim=1),
    short: ti.i32,
    long: ti.i32,
    k: ti.f64,
    n: ti.i32,
    opens: ti.i32,
):
    """Let the ants of all colonies choose, see `goss.choices`; writes `took`.

    Ants under way are known by it alone: an ant that arrives has chosen so many steps ago. The
    streams `states` give one draw a step, the high word for the nest. Ants before `opens` draw too.
    """
    for colony in range(took.shape[0]):
        state = states[colony]
        marks = ti.Vector([0, 0, 0, 0])  # at the nest: short, long; at the food: short, long
        for step in range(took.shape[1] // 2):
            state = advance(state)
            bits = bits_of(state)
            for end in ti.static(range(2)):
                if step >= short:
                    marks[2 * end] += took[colony, 2 * (step - short) + 1 - end]
                if step >= long:
                    marks[2 * end + 1] += 1 - took[colony, 2 * (step - long) + 1 - end]
                to_short = power(k + marks[2 * end], n)
                to_long = power(k + marks[2 * end + 1], n)
                word = high_word(bits)
                if ti.static(end == 1):
                    word = low_word(bits)
                takes_short = ti.cast(
                    ti.cast(word, ti.f64) * (to_short + to_long) < to_short * 4294967296.0, ti.i32
                )
                if 2 * step + end < opens:
                    takes_short = 0
                marks[2 * end] += takes_short
                marks[2 * end + 1] += 1 - takes_short
                took[colony, 2 * step + end] = ti.cast(takes_short, ti.u8)
