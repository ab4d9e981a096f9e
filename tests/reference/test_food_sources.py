"""Food that grows back, and food that moves, worked out by hand."""

import itertools

import pytest
from colonies import act, begun, foods_of, load

from taichi_ants.grid.constants import STREAM_QUEEN
from taichi_ants.reference.geometry import neighbour
from taichi_ants.reference.random_stream import RandomStream, stream_state
from taichi_ants.task.constants import GIVE, PICK_UP
from taichi_ants.worlds import World

ANT, SOURCE, QUEEN = (0, 0, 0), (1, 1, 0), (0, 0, 3)


def world(*ants, foods=(SOURCE,), **contents):
    """By default one ant with heading 1 and the food ahead of it."""
    return World((4, 4, 4), QUEEN, foods=foods, ants=ants or [(ANT, 1)], **contents)


def waiting(colony):
    return [source.waiting_since for source in colony.food_sources.food_sources]


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_food_grows_back_so_many_ticks_after_it_was_taken(delay):
    colony = begun(world(), regrowth=delay)
    act(colony, GIVE)  # in vain, so that the clock is not 0
    act(colony, PICK_UP)  # tick 1
    there = [foods_of(colony) == {SOURCE}]
    for _ in range(4):
        act(colony, GIVE)
        there.append(foods_of(colony) == {SOURCE})
    assert there == [ticks >= delay for ticks in range(5)]
    assert (colony.record.regrown, waiting(colony)) == (1, [None])


def test_food_dropped_elsewhere_does_not_grow_back():
    colony = begun(world((ANT, 1), ((1, 0, 0), 3), foods=[]), regrowth=0, lifespan=100)
    load(colony, 0)
    colony.ants[0].own["age"] = 99
    act(colony, GIVE, GIVE)
    assert foods_of(colony) == {ANT}
    act(colony, PICK_UP)
    assert colony.ants[1].carries
    assert (foods_of(colony), colony.record.regrown) == (set(), 0)


# Wandering. The ant of these worlds stands aside and does nothing; all is in a large, free world.
ASIDE = ((0, 0, 6), 4)


def headings(seed, n):
    stream = RandomStream(stream_state(seed, STREAM_QUEEN, 0))
    return [stream.draw()[0] * 6 >> 32 for _ in range(n)]


def seed_of(*wanted):
    """A seed whose first piles wander along these headings."""
    return next(seed for seed in itertools.count() if headings(seed, len(wanted)) == [*wanted])


def wandering(foods, *wanted, pile_move_interval=1, obstacles=(), ants=(ASIDE,), **options):
    place = World((7, 7, 7), (0, 0, 5), foods=foods, obstacles=obstacles, ants=ants)
    return begun(place, seed=seed_of(*wanted), pile_move_interval=pile_move_interval, **options)


LINE = [(1, 0, 0), (2, 0, 0), (3, 0, 0)]  # along heading 0


@pytest.mark.parametrize("heading", range(6))
def test_a_pile_moves_as_one(heading):
    colony = wandering(LINE, heading)
    act(colony, GIVE)
    assert foods_of(colony) == {neighbour(cell, heading) for cell in LINE}
    assert waiting(colony) == [None] * 3
    assert [source.cell for source in colony.food_sources.food_sources] == [
        neighbour(c, heading) for c in LINE
    ]


@pytest.mark.parametrize("ahead", ["ant", "queen", "outside"])
def test_ants_queen_and_the_worlds_end_block_too(ahead):
    cell = {"ant": (3, 0, 0), "queen": (0, 0, 4), "outside": (6, 0, 0)}[ahead]
    heading = 4 if ahead == "queen" else 0
    ants = [ASIDE, ((4, 0, 0), 3)] if ahead == "ant" else [ASIDE]
    colony = wandering([cell], heading, ants=ants)
    act(colony, *[GIVE] * len(ants))
    assert foods_of(colony) == {cell}


def test_piles_stay_what_they_were_at_the_start():
    # Two foods two cells apart are two piles; when they meet they still move one by one.
    colony = wandering([(1, 0, 0), (3, 0, 0)], 0, 3, 3, 0)
    act(colony, GIVE)
    # First to (2, 0, 0); then the second is blocked by it.
    assert foods_of(colony) == {(2, 0, 0), (3, 0, 0)}
    act(colony, GIVE)
    assert foods_of(colony) == {(1, 0, 0), (4, 0, 0)}
