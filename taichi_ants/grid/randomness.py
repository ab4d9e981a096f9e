"""Random streams on the host: splitmix64, the generator that the kernels use too.

A stream is one 64-bit state. A draw adds `GAMMA` to the state and mixes the sum, so the k-th draw
can be computed without the ones before it, and a world drawn today is drawn the same by every
version of NumPy. All arithmetic is modulo 2^64.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from taichi_ants.errors import AntsError, shown, whole

GAMMA = 0x9E3779B97F4A7C15
_FACTOR_1 = 0xBF58476D1CE4E5B9
_FACTOR_2 = 0x94D049BB133111EB
_MASK = 0xFFFF_FFFF_FFFF_FFFF


def mix(words: int | np.ndarray) -> Any:
    """The output function of splitmix64, a bijection of the 64-bit words.

    Args:
        words: A Python integer (taken modulo 2^64) or a uint64 array of any shape.

    Returns:
        An integer for an integer, a uint64 array of the same shape for an array.
    """
    if isinstance(words, int):
        z = words & _MASK
        z = ((z ^ (z >> 30)) * _FACTOR_1) & _MASK
        z = ((z ^ (z >> 27)) * _FACTOR_2) & _MASK
        return z ^ (z >> 31)
    # In place on a copy: ten million words at once are usual when a large world is drawn.
    mixed = np.array(words, dtype=np.uint64, ndmin=1)
    mixed ^= mixed >> np.uint64(30)
    mixed *= np.uint64(_FACTOR_1)
    mixed ^= mixed >> np.uint64(27)
    mixed *= np.uint64(_FACTOR_2)
    mixed ^= mixed >> np.uint64(31)
    return mixed.reshape(np.shape(words))


def _words(name: str, values: object) -> int | np.ndarray:
    """Whole numbers modulo 2^64: an int for a number, a uint64 array for an array or a list."""
    if isinstance(values, np.ndarray) and values.ndim and values.dtype.kind in "iu":
        return values.astype(np.uint64)
    if isinstance(values, (list, tuple)):
        return np.array([whole(name, value) & _MASK for value in values], dtype=np.uint64)
    return whole(name, values) & _MASK


def _plus_gamma(words: int | np.ndarray) -> int | np.ndarray:
    return words + GAMMA if isinstance(words, int) else words + np.uint64(GAMMA)


def _xor(left: int | np.ndarray, right: int | np.ndarray) -> int | np.ndarray:
    if isinstance(left, int) and isinstance(right, int):
        return left ^ right
    return np.bitwise_xor(np.asarray(left, np.uint64), np.asarray(right, np.uint64))


def stream_state(seed: int | np.ndarray, purpose: int, number: int | np.ndarray) -> Any:
    """The state at which the stream of (seed, purpose, number) starts.

    Args:
        seed: Any whole number, taken modulo 2^64, or an integer array or list of them.
        purpose: What the stream is for, one of the `STREAM_...` constants.
        number: Which stream of that purpose, or an integer array or list; broadcast with `seed`.

    Returns:
        An integer if all three are numbers, else a uint64 array of the broadcast shape.

    Raises:
        AntsError: An argument is not whole.
    """
    state = mix(_plus_gamma(_words("seed", seed)))
    state = mix(_plus_gamma(_xor(state, _words("purpose", purpose))))
    return mix(_plus_gamma(_xor(state, _words("number", number))))


class Stream:
    """A random stream with its state, for drawing worlds on the host.

    `size` draws at once give what `size` single draws give.
    """

    def __init__(self, seed: int, purpose: int, number: int = 0) -> None:
        """Starts the stream of (seed, purpose, number), see `stream_state`."""
        self.state = int(stream_state(seed, purpose, number))

    def bits(self, size: int | None = None) -> Any:
        """64 random bits as an integer, or, with `size`, a uint64 array of shape (size,)."""
        if size is None:
            self.state = (self.state + GAMMA) & _MASK
            return mix(self.state)
        states = np.arange(1, size + 1, dtype=np.uint64)
        states *= np.uint64(GAMMA)
        states += np.uint64(self.state)
        self.state = (self.state + size * GAMMA) & _MASK
        return mix(states)

    def below(self, n: int, size: int | None = None) -> Any:
        """A whole number in [0, n), or, with `size`, an int64 array of shape (size,).

        Raises:
            AntsError: `n` is below 1 or above 2^32 (a choice uses 32 bits of a draw).
        """
        n = whole("n", n)
        if not 1 <= n <= 1 << 32:
            raise AntsError(f"n is {shown(n)}; a choice needs between 1 and 2^32 possibilities.")
        if size is None:
            return choose(self.bits() >> 32, n)
        return choose(self.bits(size) >> np.uint64(32), n)


def choose(words: int | np.ndarray, n: int) -> Any:
    """Maps 32-bit words evenly to [0, n), n <= 2^32: `(word * n) >> 32`; int64 for arrays."""
    if isinstance(words, int):
        return (words * n) >> 32
    return ((words * np.uint64(n)) >> np.uint64(32)).astype(np.int64)
