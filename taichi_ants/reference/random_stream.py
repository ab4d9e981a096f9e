"""Random streams: splitmix64 in Python integers.

A stream depends only on (seed, purpose, number), so runs do not change each other's draws.
"""

from __future__ import annotations

from dataclasses import dataclass

_MASK_64 = 0xFFFFFFFFFFFFFFFF
_MASK_32 = 0xFFFFFFFF
_GAMMA = 0x9E3779B97F4A7C15
WORDS = 4294967296.0  # random 32-bit words


def _mix(z: int) -> int:
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & _MASK_64
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & _MASK_64
    return z ^ (z >> 31)


def hash_of(*numbers: int) -> int:
    """Return a hash of integers in this order, in 0 .. 2**64 - 1; each is taken modulo 2**64."""
    state = 0
    for number in numbers:
        state = _mix(((state ^ number) + _GAMMA) & _MASK_64)
    return state


# The first state of a stream, from its seed, purpose (a constant STREAM_*) and number.
stream_state = hash_of


@dataclass(slots=True)
class RandomStream:
    """A stream of random draws, defined by its state in 0 .. 2**64 - 1."""

    state: int

    def draw(self) -> tuple[int, int]:
        """Return the high and the low word of the next draw, each in 0 .. 2**32 - 1."""
        self.state = (self.state + _GAMMA) & _MASK_64
        bits = _mix(self.state)
        return bits >> 32, bits & _MASK_32


def pick(word: int, n: int) -> int:
    """Return a choice among 0 .. n - 1 from a random 32-bit word."""
    return (word * n) >> 32
