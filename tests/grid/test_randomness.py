"""The host's random streams: known values, and one draw or many giving the same."""

import numpy as np
import pytest

from taichi_ants.errors import AntsError
from taichi_ants.grid.randomness import GAMMA, Stream, mix, stream_state

# The first outputs of splitmix64 for the state 1234567, as published with the generator's ports.
PUBLISHED = [
    6457827717110365317,
    3203168211198807973,
    9817491932198370423,
    4593380528125082431,
    16408922859458223821,
]


def test_a_stream_draws_the_published_numbers() -> None:
    stream = Stream(0, 0)
    stream.state = 1234567
    assert stream.bits(5).tolist() == PUBLISHED


def test_the_state_is_the_chain_of_mixes() -> None:
    chained = 0
    for word in (5, 2, 9):
        chained = int(mix(((chained ^ word) + GAMMA) % 2**64))
    assert stream_state(5, 2, 9) == chained


@pytest.mark.parametrize("seed", [0, 1, -1, 2**63, 2**64 - 1, -(2**63)])
def test_arrays_give_what_numbers_give(seed: int) -> None:
    numbers = np.arange(5)
    states = stream_state(seed, 3, numbers)
    assert states.dtype == np.uint64
    assert states.tolist() == [stream_state(seed, 3, n) for n in range(5)]
    assert stream_state([seed, 8], 3, 1).tolist() == [stream_state(s, 3, 1) for s in (seed, 8)]


def test_seeds_count_modulo_two_to_the_64() -> None:
    assert stream_state(-1, 0, 0) == stream_state(2**64 - 1, 0, 0)
    assert stream_state(2**64 + 5, 0, 0) == stream_state(5, 0, 0)
    assert stream_state(np.int64(5), 0, np.uint8(1)) == stream_state(5, 0, 1)


@pytest.mark.parametrize("seed", [1.5, "3", None, np.array([1.5]), [1, 2.0]])
def test_a_seed_must_be_whole(seed: object) -> None:
    with pytest.raises(AntsError, match="seed is"):
        stream_state(seed, 0, 0)
