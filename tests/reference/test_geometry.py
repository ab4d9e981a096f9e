"""The reference's geometry and random streams, against values worked out by hand."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from taichi_ants.reference.geometry import distance, existing_cells, neighbour, normal_form
from taichi_ants.reference.random_stream import RandomStream, stream_state

COORDINATE = st.integers(-50, 50)
CELL = st.builds(normal_form, COORDINATE, COORDINATE, COORDINATE)


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


def test_a_neighbour_is_brought_to_normal_form():
    # (0, 8, 8) + (1, 0, 0) = (1, 8, 8), minus 1.
    assert neighbour((0, 8, 8), 0) == (0, 7, 7)
    # (2, 1, 0) + (0, 0, 1) = (2, 1, 1), minus 1.
    assert neighbour((2, 1, 0), 4) == (1, 0, 0)


def test_headings_are_taken_modulo_six():
    assert neighbour((0, 0, 0), -1) == neighbour((0, 0, 0), 5) == (1, 0, 1)
    assert neighbour((0, 0, 0), 6) == (1, 0, 0)


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


@given(CELL, CELL)
def test_distance_is_the_number_of_steps_of_a_shortest_way(a, b):
    # Some neighbour is one step nearer, and none is more than one: so a walk of exactly this length
    # exists, and no shorter one.
    away = distance(a, b)
    around = [distance(neighbour(a, heading), b) for heading in range(6)]
    assert min(around) == (1 if a == b else away - 1)
    assert max(around) <= away + 1


@given(CELL, st.integers(0, 5))
def test_three_headings_on_lies_the_opposite(cell, heading):
    assert neighbour(neighbour(cell, heading), heading + 3) == cell


def test_cells_of_a_small_world_in_order():
    # Ranges (2, 2, 1): z is 0 throughout, so x and y run freely over {0, 1}.
    assert existing_cells((2, 2, 1)) == [(0, 0, 0), (0, 1, 0), (1, 0, 0), (1, 1, 0)]
    # Ranges (2, 2, 2): the origin and its six neighbours.
    around = [neighbour((0, 0, 0), heading) for heading in range(6)]
    assert existing_cells((2, 2, 2)) == sorted([(0, 0, 0), *around])


def test_the_papers_world_has_271_cells():
    assert len(existing_cells((10, 10, 10))) == 271


@given(st.tuples(*[st.integers(1, 6)] * 3))
def test_existing_cells_are_those_in_range(ranges):
    x, y, z = ranges
    cells = existing_cells(ranges)
    assert len(cells) == x * y + y * z + z * x - x - y - z + 1
    box = itertools.product(range(7), repeat=3)
    assert cells == [
        cell
        for cell in box
        if min(cell) == 0 and all(c < end for c, end in zip(cell, ranges, strict=True))
    ]


def test_draws_are_those_of_splitmix64():
    # The published sequence of splitmix64 from state 0.
    stream = RandomStream(0)
    assert stream.draw() == (0xE220A839, 0x7B1DCDAF)
    assert stream.draw() == (0x6E789E6A, 0xA1B965F4)
    assert stream.draw() == (0x06C45D18, 0x8009454F)
    assert stream.state == 3 * 0x9E3779B97F4A7C15 % 2**64


def test_streams_differ_by_seed_purpose_and_number():
    arguments = itertools.product((0, 1, 2), repeat=3)
    assert len({stream_state(*triple) for triple in arguments}) == 27


def test_seeds_are_taken_modulo_two_to_the_64():
    assert stream_state(-1, 0, 0) == stream_state(2**64 - 1, 0, 0)
    assert stream_state(2**64 + 5, 1, 7) == stream_state(5, 1, 7)


def test_the_first_stream_state_by_hand():
    # Seed 0, purpose 0, number 0: each of the three steps adds GAMMA and mixes, as a draw does. So
    # the first step gives the first draw from state 0, the second the first draw from that, ...
    state = 0
    for _ in range(3):
        high, low = RandomStream(state).draw()
        state = high << 32 | low
    assert stream_state(0, 0, 0) == state
