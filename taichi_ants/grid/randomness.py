"""Random streams on the host: splitmix64, the generator that the kernels also use.

A stream is one 64-bit state. A draw adds `GAMMA` to the state and mixes the sum, so the k-th draw
can be computed without the draws before it. Worlds therefore do not depend on the version of NumPy.
All arithmetic is modulo 2^64.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from taichi_ants.errors import whole

GAMMA = 0x9E3779B97F4A7C15
_MASK = 0xFFFF_FFFF_FFFF_FFFF


def mix(words: np.ndarray) -> np.ndarray:
    """Return the output of splitmix64, a bijection of 64-bit words: uint64 of any shape."""
    # In place on a copy, because a large world takes ten million words at once.
    mixed = np.array(words, dtype=np.uint64)
    mixed ^= mixed >> np.uint64(30)
    mixed *= np.uint64(0xBF58476D1CE4E5B9)
    mixed ^= mixed >> np.uint64(27)
    mixed *= np.uint64(0x94D049BB133111EB)
    mixed ^= mixed >> np.uint64(31)
    return mixed


def words_of(values: Any, name: str = "a seed") -> np.ndarray:
    """Return a whole number, or an array or sequence of them, modulo 2^64, as uint64."""
    if isinstance(values, np.ndarray) and values.dtype.kind in "iu":
        return values.astype(np.uint64)
    if isinstance(values, (Sequence, np.ndarray)) and not isinstance(values, str):
        return np.array([whole(name, value) & _MASK for value in values], dtype=np.uint64)
    return np.array(whole(name, values) & _MASK, dtype=np.uint64)


def stream_state(seed: int | np.ndarray, purpose: int, number: int | np.ndarray) -> Any:
    """Return the initial state of the stream of (seed, purpose, number).

    The purpose is one of the `STREAM_...` constants. Seed and number are whole numbers modulo 2^64,
    or arrays or lists of them. The state is an int, or for arrays uint64 of the broadcast shape.
    Raises AntsError if an argument is not whole.
    """
    state = np.array(0, dtype=np.uint64)
    for name, values in (("seed", seed), ("purpose", purpose), ("number", number)):
        with np.errstate(over="ignore"):  # NumPy warns of single numbers that overflow
            state = mix((state ^ words_of(values, name)) + np.uint64(GAMMA))
    return state if state.ndim else int(state)


class Stream:
    """The random stream of (seed, purpose, number), from which the host draws worlds."""

    def __init__(self, seed: int, purpose: int, number: int = 0) -> None:
        self.state = int(stream_state(seed, purpose, number))

    def bits(self, size: int) -> np.ndarray:
        """Return the next draws, 64 random bits each, uint64 (size,)."""
        states = np.arange(1, size + 1, dtype=np.uint64)
        states *= np.uint64(GAMMA)
        states += np.uint64(self.state)
        self.state = (self.state + size * GAMMA) & _MASK
        return mix(states)


def choose(words: np.ndarray, n: int) -> np.ndarray:
    """Return 32-bit words mapped evenly to [0, n), n at most 2^32: `(word * n) >> 32`, int64."""
    return ((words * np.uint64(n)) >> np.uint64(32)).astype(np.int64)
