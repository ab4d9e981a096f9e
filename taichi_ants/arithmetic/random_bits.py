"""Random numbers of ants: SplitMix64 (Steele, Lea and Flood 2014), with a 64-bit state per ant.

Because each ant has its own state, checkpoints resume exactly, results do not depend on the number
of threads, and the reference draws the same numbers.
"""

import taichi as ti

_GAMMA = 0x9E3779B97F4A7C15
_MIX_1 = 0xBF58476D1CE4E5B9
_MIX_2 = 0x94D049BB133111EB


@ti.func
def advance(state):
    """Return the next state of a stream: u64 -> u64."""
    return state + ti.u64(_GAMMA)


@ti.func
def bits_of(state):
    """Return the 64 random bits of a state: u64 -> u64."""
    z = state
    z = (z ^ (z >> ti.u64(30))) * ti.u64(_MIX_1)
    z = (z ^ (z >> ti.u64(27))) * ti.u64(_MIX_2)
    return z ^ (z >> ti.u64(31))


@ti.func
def high_word(bits):
    """Return the upper 32 of 64 bits, as u64."""
    return bits >> ti.u64(32)


@ti.func
def low_word(bits):
    """Return the lower 32 of 64 bits, as u64."""
    return bits & ti.u64(0xFFFFFFFF)


@ti.func
def joined(low, high):
    """Return 64 bits from two words, i32."""
    return low_word(ti.cast(low, ti.u64)) | ti.cast(high, ti.u64) << ti.u64(32)


@ti.func
def below(word, n):
    """Return a whole number in [0, n) from a 32-bit word, as i32 (Lemire 2019, no rejection)."""
    return ti.cast((word * ti.cast(n, ti.u64)) >> ti.u64(32), ti.i32)


@ti.func
def draw_below(state, n):
    """Return a whole number in [0, n) from the upper word of the next draw, and the next state."""
    after = advance(state)
    return below(high_word(bits_of(after)), n), after


@ti.func
def stream_of(seed, purpose, number):
    """Return the first state of a random stream, see `randomness.stream_state`."""
    h = bits_of(advance(seed))
    h = bits_of(advance(h ^ ti.cast(purpose, ti.u64)))
    return bits_of(advance(h ^ number))
