"""The reference's geometry and random streams, against values worked out by hand."""

from __future__ import annotations

import pytest

from taichi_ants.reference.geometry import distance, existing_cells, neighbour, normal_form
from taichi_ants.reference.random_stream import RandomStream, stream_state


@pytest.mark.parametrize(
    ("given_form", "expected"),
    [
        ((5, 3, 8), (2, 0, 5)),  # minus 3
        ((0, 0, 0), (0, 0, 0)),
        ((-8, 0, 0), (0, 8, 8)),  # plus 8: a cell of the paper's trail
        ((-1, -1, -1), (0, 0, 0)),
    ],
)
def test_normal_form_has_minimum_zero(given_form, expected):
    assert normal_form(*given_form) == expected


def test_the_six_neighbours_go_clockwise_from_plus_x():
    around_origin = [neighbour((0, 0, 0), heading) for heading in range(6)]
    assert around_origin == [(1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), (1, 0, 1)]


@pytest.mark.parametrize(
    ("a", "b", "expected"),
    [
        ((0, 0, 0), (0, 0, 0), 0),
        ((1, 0, 0), (0, 1, 1), 2),  # (1, -1, -1), plus 1: (2, 0, 0)
        ((1, 0, 0), (0, 1, 0), 2),  # (1, -1, 0), plus 1: (2, 0, 1)
        ((3, 1, 0), (0, 0, 0), 3),
        ((0, 9, 9), (9, 0, 0), 18),  # queen and food of the paper: (-9, 9, 9), plus 9
    ],
)
def test_distance(a, b, expected):
    assert distance(a, b) == expected
    assert distance(b, a) == expected


def test_the_papers_world_has_271_cells():
    assert len(existing_cells((10, 10, 10))) == 271


def test_the_first_stream_state_by_hand():
    # Seed 0, purpose 0, number 0: each of the three steps adds GAMMA and mixes, as a draw does. So
    # the first step gives the first draw from state 0, the second the first draw from that, ...
    state = 0
    for _ in range(3):
        high, low = RandomStream(state).draw()
        state = high << 32 | low
    assert stream_state(0, 0, 0) == state
