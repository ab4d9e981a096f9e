"""Food that grows back, and food that moves, worked out by hand."""

from __future__ import annotations

import itertools

import pytest
from colonies import act, begun, foods_of, load, n_draws

from taichi_ants.grid.constants import STREAM_QUEEN
from taichi_ants.reference.geometry import neighbour
from taichi_ants.reference.random_stream import RandomStream, stream_state
from taichi_ants.task.constants import FORWARD, GIVE, PICK_UP
from taichi_ants.worlds import World

ANT, SOURCE, QUEEN = (0, 0, 0), (1, 1, 0), (0, 0, 3)


def world(*ants, foods=(SOURCE,), **contents):
    """By default one ant with heading 1 and the food ahead of it."""
    return World((4, 4, 4), QUEEN, foods=foods, ants=ants or [(ANT, 1)], **contents)


def waiting(colony):
    return [source.waiting_since for source in colony.food_sources.food_sources]


def turn(colony, heading, slot=0):
    ant = colony.ants[slot]
    ant.heading = heading
    colony.observe(ant)


def test_without_regrowth_food_is_gone():
    colony = begun(world())
    act(colony, PICK_UP)
    for _ in range(20):
        act(colony, GIVE)
    assert foods_of(colony) == set()
    assert colony.record.regrown == 0


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


def test_food_that_grows_back_at_once_is_seen_at_once():
    colony = begun(world((ANT, 1), ((2, 2, 0), 4)), regrowth=0)
    act(colony, PICK_UP, GIVE)
    assert colony.ants[1].state >> 2 & 3 == 3
    act(colony, GIVE, PICK_UP)
    assert [ant.carries for ant in colony.ants.values()] == [True, True]
    assert colony.record.regrown == 2
    assert foods_of(colony) == {SOURCE}


def test_food_waits_while_an_ant_stands_on_its_place():
    colony = begun(world(), regrowth=1)
    act(colony, PICK_UP)
    assert waiting(colony) == [0]
    turn(colony, 1)
    act(colony, FORWARD)  # enters the place in the very tick in which it would grow back
    assert colony.ants[0].cell == SOURCE
    act(colony, GIVE)
    assert (foods_of(colony), waiting(colony)) == (set(), [0])
    act(colony, FORWARD)  # leaves
    assert (foods_of(colony), waiting(colony)) == ({SOURCE}, [None])
    assert colony.record.regrown == 1


def test_food_waits_under_dropped_food_which_counts_for_nothing_when_taken():
    # Ant 0 takes the food, steps on its place and dies there; ant 1 takes what it dropped.
    colony = begun(world((ANT, 1), ((2, 2, 0), 4)), regrowth=2, lifespan=100)
    act(colony, PICK_UP, GIVE)
    turn(colony, 1)
    act(colony, FORWARD, GIVE)
    colony.ants[0].age = 99
    act(colony, GIVE, GIVE)
    assert (foods_of(colony), waiting(colony)) == ({SOURCE}, [0])
    assert (colony.record.regrown, colony.record.deaths) == (0, 1)
    act(colony, GIVE)
    assert (foods_of(colony), waiting(colony)) == ({SOURCE}, [0])
    # Taken in tick 4, long after the own food's delay: that grows back in the same tick.
    act(colony, PICK_UP)
    assert colony.ants[1].carries
    assert (foods_of(colony), waiting(colony), colony.record.regrown) == ({SOURCE}, [None], 1)


def test_food_dropped_elsewhere_does_not_grow_back():
    colony = begun(world((ANT, 1), ((1, 0, 0), 3), foods=[]), regrowth=0, lifespan=100)
    load(colony, 0)
    colony.ants[0].age = 99
    act(colony, GIVE, GIVE)
    assert foods_of(colony) == {ANT}
    act(colony, PICK_UP)
    assert colony.ants[1].carries
    assert (foods_of(colony), colony.record.regrown) == (set(), 0)


def test_food_sources_are_full_again_at_the_start_of_an_episode():
    colony = begun(world())
    act(colony, PICK_UP)
    assert waiting(colony) == [0]
    colony.end_episode()
    colony.begin_episode()
    assert (foods_of(colony), waiting(colony)) == ({SOURCE}, [None])


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


@pytest.mark.parametrize("pile_move_interval", [1, 2, 3])
def test_it_moves_every_so_many_ticks(pile_move_interval):
    colony = wandering([(0, 0, 0)], 0, 0, pile_move_interval=pile_move_interval)
    places = []
    for _ in range(2 * pile_move_interval):
        act(colony, GIVE)
        places += foods_of(colony)
    assert places == [(0, 0, 0)] * (pile_move_interval - 1) + [(1, 0, 0)] * pile_move_interval + [
        (2, 0, 0)
    ]
    assert n_draws(colony.queen_stream.state, stream_state(seed_of(0, 0), STREAM_QUEEN, 0)) == 2


def test_what_is_blocked_stays_and_blocks_what_is_behind():
    # The line points at a rock; the fourth food lies beside the first, its way is free.
    beside = neighbour((1, 0, 0), 4)
    colony = wandering([*LINE, beside], 0, obstacles=[(4, 0, 0)])
    act(colony, GIVE)
    assert foods_of(colony) == {*LINE, neighbour(beside, 0)}


@pytest.mark.parametrize("ahead", ["ant", "queen", "outside"])
def test_ants_queen_and_the_worlds_end_block_too(ahead):
    cell = {"ant": (3, 0, 0), "queen": (0, 0, 4), "outside": (6, 0, 0)}[ahead]
    heading = 4 if ahead == "queen" else 0
    ants = [ASIDE, ((4, 0, 0), 3)] if ahead == "ant" else [ASIDE]
    colony = wandering([cell], heading, ants=ants)
    act(colony, *[GIVE] * len(ants))
    assert foods_of(colony) == {cell}


def test_each_pile_has_a_draw_in_the_order_of_its_first_food():
    # Lexicographic order: (0, 3, 0) and (1, 3, 0) are the first pile, (3, 0, 0) the second.
    colony = wandering([(3, 0, 0), (1, 3, 0), (0, 3, 0)], 3, 0)
    act(colony, GIVE)
    assert foods_of(colony) == {neighbour((0, 3, 0), 3), neighbour((1, 3, 0), 3), (4, 0, 0)}


def test_piles_stay_what_they_were_at_the_start():
    # Two foods two cells apart are two piles; when they meet they still move one by one.
    colony = wandering([(1, 0, 0), (3, 0, 0)], 0, 3, 3, 0)
    act(colony, GIVE)
    # First to (2, 0, 0); then the second is blocked by it.
    assert foods_of(colony) == {(2, 0, 0), (3, 0, 0)}
    act(colony, GIVE)
    assert foods_of(colony) == {(1, 0, 0), (4, 0, 0)}


def test_food_sources_whose_food_is_missing_go_along():
    # The ant takes the food at (1, 0, 0) of a pile of two and goes away. The pile moves along 0:
    # the place (1, 0, 0) moves onto (2, 0, 0), which the other food has left.
    foods = [(1, 0, 0), (2, 0, 0)]
    colony = wandering(foods, 0, ants=[((0, 0, 0), 0)], pile_move_interval=2, regrowth=3)
    act(colony, PICK_UP)
    act(colony, GIVE)
    assert [source.cell for source in colony.food_sources.food_sources] == [(2, 0, 0), (3, 0, 0)]
    assert (foods_of(colony), waiting(colony)) == ({(3, 0, 0)}, [0, None])
    act(colony, GIVE)
    assert foods_of(colony) == {(3, 0, 0)}
    before = [source.cell for source in colony.food_sources.food_sources]
    act(
        colony, GIVE
    )  # tick 3: it grows back where its food source is, and then all wander once more
    assert colony.record.regrown == 1
    moved = [source.cell for source in colony.food_sources.food_sources]
    second = headings(seed_of(0), 2)[1]
    assert moved == [neighbour(cell, second) for cell in before]
    assert foods_of(colony) == set(moved)


@pytest.mark.parametrize("ahead", ["queen", "outside"])
def test_a_waiting_food_source_stays_before_queen_and_worlds_end(ahead):
    cell, heading = {"queen": ((0, 0, 4), 4), "outside": ((6, 0, 0), 0)}[ahead]
    ant = (neighbour(cell, 2), 5)
    colony = wandering([cell], heading, ants=[ant], regrowth=50)
    act(colony, PICK_UP)
    assert (colony.food_sources.food_sources[0].cell, waiting(colony)) == (cell, [0])


def test_a_waiting_food_source_walks_over_ants_and_food_but_not_over_rocks():
    # The taken food's food source at (1, 0, 0) comes to lie under the ant, or stays beside a rock.
    for obstacles, expected in (((), (0, 0, 0)), ([neighbour((1, 0, 0), 5)], (1, 0, 0))):
        heading = 5 if obstacles else 3
        colony = wandering(
            [(1, 0, 0)], heading, ants=[((0, 0, 0), 0)], obstacles=obstacles, regrowth=50
        )
        act(colony, PICK_UP)
        assert [source.cell for source in colony.food_sources.food_sources] == [expected]
    # The front food is blocked by a rock; the waiting food source behind it moves onto the same
    # cell.
    colony = wandering(
        [(1, 0, 0), (2, 0, 0)], 0, obstacles=[(3, 0, 0)], ants=[((0, 0, 0), 0)], regrowth=1
    )
    act(colony, PICK_UP)
    assert [source.cell for source in colony.food_sources.food_sources] == [(2, 0, 0), (2, 0, 0)]
    assert (foods_of(colony), waiting(colony)) == ({(2, 0, 0)}, [0, None])


def test_food_taken_after_it_wandered_grows_back_where_it_was_taken():
    colony = wandering([(0, 0, 0)], 0, ants=[((2, 0, 0), 3)], pile_move_interval=100, regrowth=1)
    # As after an earlier walk of the pile, from (0, 0, 0) to (1, 0, 0).
    colony.food_sources.move_piles(
        colony.world, RandomStream(stream_state(seed_of(0), STREAM_QUEEN, 0))
    )
    turn(colony, 3)
    act(colony, PICK_UP)
    assert (foods_of(colony), waiting(colony)) == (set(), [0])
    act(colony, GIVE)
    assert foods_of(colony) == {(1, 0, 0)}


def test_trails_do_not_wander():
    place = World((7, 7, 7), (0, 0, 5), foods=[(1, 0, 0)], trails=[((1, 0, 0), 9)], ants=[ASIDE])
    colony = begun(place, seed=seed_of(0), pile_move_interval=1)
    act(colony, GIVE)
    assert foods_of(colony) == {(2, 0, 0)}
    assert [cell for cell in colony.world.ground if colony.world.trail.level(cell)] == [(1, 0, 0)]
