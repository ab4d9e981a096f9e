"""Random streams on the host: splitmix64, the generator that the kernels use too.

A stream is one 64-bit state. A draw adds `GAMMA` to the state and mixes the sum, so the k-th draw
can be computed without the ones before it, and a world drawn today is drawn the same by every
version of NumPy. All arithmetic is modulo 2^64.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from taichi_ants.errors import whole

GAMMA = 0x9E3779B97F4A7C15
_MASK = 0xFFFF_FFFF_FFFF_FFFF


def mix(words: np.ndarray) -> np.ndarray:
    """The output function of splitmix64, a bijection of 64-bit words; uint64 of any shape."""
    # In place on a copy: ten million words at once are usual when a large world is drawn.
    mixed = np.array(words, dtype=np.uint64)
    mixed ^= mixed >> np.uint64(30)
    mixed *= np.uint64(0xBF58476D1CE4E5B9)
    mixed ^= mixed >> np.uint64(27)
    mixed *= np.uint64(0x94D049BB133111EB)
    mixed ^= mixed >> np.uint64(31)
    return mixed


def words_of(values: Any, name: str = "a seed") -> np.ndarray:
    """Whole numbers, or an array or sequence of them, modulo 2^64, as uint64."""
    if isinstance(values, np.ndarray) and values.dtype.kind in "iu":
        return values.astype(np.uint64)
    if isinstance(values, (Sequence, np.ndarray)) and not isinstance(values, str):
        return np.array([whole(name, value) & _MASK for value in values], dtype=np.uint64)
    return np.array(whole(name, values) & _MASK, dtype=np.uint64)


def stream_state(seed: int | np.ndarray, purpose: int, number: int | np.ndarray) -> Any:
    """The state at which the stream of (seed, purpose, number) starts.

    Purpose is one of the `STREAM_...` constants. Seed and number are whole numbers modulo 2^64, or
    integer arrays or lists of them; then the states are uint64 of the broadcast shape. AntsError if
    an argument is not whole.
    """
    state = np.array(0, dtype=np.uint64)
    for name, values in (("seed", seed), ("purpose", purpose), ("number", number)):
        with np.errstate(over="ignore"):  # NumPy warns of single numbers that overflow
            state = mix((state ^ words_of(values, name)) + np.uint64(GAMMA))
    return state if state.ndim else int(state)


class Stream:
    """The random stream of (seed, purpose, number), for drawing worlds on the host."""

    def __init__(self, seed: int, purpose: int, number: int = 0) -> None:
        self.state = int(stream_state(seed, purpose, number))

    def bits(self, size: int) -> np.ndarray:
        """The next draws, 64 random bits each, uint64 (size,)."""
        states = np.arange(1, size + 1, dtype=np.uint64)
        states *= np.uint64(GAMMA)
        states += np.uint64(self.state)
        self.state = (self.state + size * GAMMA) & _MASK
        return mix(states)


def choose(words: np.ndarray, n: int) -> np.ndarray:
    """Maps 32-bit words evenly to [0, n), n at most 2^32: `(word * n) >> 32`; int64."""
    return ((words * np.uint64(n)) >> np.uint64(32)).astype(np.int64)
