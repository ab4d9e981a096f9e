"""Ants that want the same cell, or stand in each other's way, in drawn micro-worlds.

In the drawings 0 to 5 are ants with that heading, numbered in reading order; F food, Q the queen.
"""

from __future__ import annotations

from dataclasses import replace

import pytest
from colonies import act, begun, cells_of, foods_of, load

from taichi_ants.reference.actions import Intent, winners
from taichi_ants.reference.ants import Ant
from taichi_ants.reference.geometry import neighbour, normal_form
from taichi_ants.reference.random_stream import RandomStream
from taichi_ants.task.constants import FORWARD, GIVE, LEFT, PICK_UP, RIGHT
from taichi_ants.worlds import World, from_text

MASK = 2**64 - 1


def mix(z):
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9 & MASK
    z = (z ^ z >> 27) * 0x94D049BB133111EB & MASK
    return z ^ z >> 31


def key(world: World, cell, tick):
    """The rule once more: a hash of the number of the ant's cell and the tick."""
    gamma = 0x9E3779B97F4A7C15
    place = int(world.grid.index(cell))
    return mix((mix(place + gamma & MASK) ^ tick) + gamma & MASK)


# Ant 0 heads down and to the right (2), ant 1 up (0); both want the cell between them.
TWO_TO_ONE = """
    Q
  2   .
    .
  .   .
    0
"""


@pytest.mark.parametrize("tick", range(8))
def test_of_two_to_one_cell_the_smaller_hash_wins(tick):
    colony = begun(TWO_TO_ONE)
    world = from_text(TWO_TO_ONE)
    for _ in range(tick):
        act(colony, GIVE, GIVE)  # in vain, so that they stay
    first, second = cells_of(colony)
    wanted = neighbour(first, 2)
    assert wanted == neighbour(second, 0)
    winner = 0 if key(world, first, tick) < key(world, second, tick) else 1
    act(colony, FORWARD, FORWARD)
    assert cells_of(colony) == ([wanted, second] if winner == 0 else [first, wanted])
    assert colony.ants[winner].reward == 0
    assert colony.ants[1 - winner].reward == -1
    assert (colony.record.moves, colony.record.blocked) == (2, 1)
    assert colony.record.episode_return == -2 * tick - 1


def test_each_of_the_two_wins_at_some_tick():
    world = from_text(TWO_TO_ONE)
    first, second = [tuple(cell) for cell in world.ants[:, :3].tolist()]
    won = {key(world, first, tick) < key(world, second, tick) for tick in range(8)}
    assert won == {False, True}


def test_who_wins_does_not_depend_on_the_numbers_of_the_ants():
    colony = begun(TWO_TO_ONE)
    world = from_text(TWO_TO_ONE)
    renumbered = begun(replace(world, ants=world.ants[::-1]))
    assert cells_of(renumbered) == cells_of(colony)[::-1]
    for _ in range(2):
        act(colony, FORWARD, FORWARD)
        act(renumbered, FORWARD, FORWARD)
        assert cells_of(renumbered) == cells_of(colony)[::-1]


def test_a_loser_turns_nevertheless():
    # Ant 1, heading 1, turns left to the cell that ant 0 wants; whoever loses looks there now.
    colony = begun(TWO_TO_ONE.replace("0", "1"))
    act(colony, FORWARD, LEFT)
    assert [colony.ants[slot].heading for slot in (0, 1)] == [2, 0]
    assert colony.record.blocked == 1


@pytest.mark.parametrize("n", range(2, 7))
def test_of_up_to_six_around_a_cell_one_gets_in(n):
    # The cell in the middle is free; all around it face it. The queen is far off.
    middle = (2, 2, 0)
    ants = [(neighbour(middle, heading), (heading + 3) % 6) for heading in range(n)]
    world = World((5, 5, 5), (0, 0, 4), ants=ants)
    colony = begun(world)
    keys = [key(world, cell, 0) for cell, _ in ants]
    winner = keys.index(min(keys))
    act(colony, *[FORWARD] * n)
    assert [ant.cell == middle for ant in colony.ants.values()] == [k == winner for k in range(n)]
    assert [ant.reward for ant in colony.ants.values()] == [-(k != winner) for k in range(n)]


def wish(slot, heading, target):
    return Intent(Ant((slot, 0, 0), 0, slot=slot), FORWARD, heading, target)


def test_equal_hashes_are_decided_by_the_heading():
    # All cells get the same number, so all hashes are equal.
    intents = [wish(slot, heading, (9, 0, 0)) for slot, heading in enumerate((4, 1))]
    assert winners(intents, 0, lambda cell: 7) == {1}
    assert winners(intents[::-1], 0, lambda cell: 7) == {1}


def test_those_who_want_different_cells_all_win():
    intents = [wish(slot, 0, (slot, 0, 1)) for slot in range(4)]
    assert winners(intents, 3, lambda cell: cell[0]) == {0, 1, 2, 3}


SWAP = """
3   Q
  .
0
"""


def test_two_that_want_to_swap_are_both_blocked():
    colony = begun(SWAP)
    before = cells_of(colony)
    # Each sees the other as an obstacle ahead; the lower one has the world's end on its left.
    assert [colony.ants[slot].state >> 2 & 3 for slot in (0, 1)] == [1, 1]
    act(colony, FORWARD, FORWARD)
    assert cells_of(colony) == before
    assert [colony.ants[slot].reward for slot in (0, 1)] == [-1, -1]
    assert (colony.record.moves, colony.record.blocked) == (2, 2)


CHAIN = """
.   Q
  .
0
  .
0
  .
0
"""


def test_of_a_chain_only_the_first_gets_on():
    # A cell to enter must be empty at the start of the tick.
    colony = begun(CHAIN)
    first, second, third = cells_of(colony)
    act(colony, FORWARD, FORWARD, FORWARD)
    assert cells_of(colony) == [neighbour(first, 0), second, third]
    assert [ant.reward for ant in colony.ants.values()] == [0, -1, -1]
    # There is a gap now: the second can go on, the third sees it still.
    assert [colony.ants[slot].state >> 2 & 3 for slot in (1, 2)] == [0, 1]
    act(colony, GIVE, FORWARD, FORWARD)
    assert cells_of(colony) == [neighbour(first, 0), first, third]


def test_ants_see_each_other_as_obstacles_with_and_without_food():
    colony = begun(SWAP)
    # The upper ant, heading 3, sees: left (heading 2) the cell in the middle, ahead the other ant,
    # right (heading 4) the end of the world.
    assert colony.ants[0].state == 4 * 1 + 1
    load(colony, 0, 1)
    sees = colony.ants[0].state - 64
    assert (sees >> 2 & 3, sees & 3) == (1, 1)


# Both ants have the food ahead.
ONE_FOOD = """
  F
1   5
  .
Q
"""


@pytest.mark.parametrize("tick", range(6))
def test_of_two_that_want_one_food_one_gets_it(tick):
    colony = begun(ONE_FOOD)
    world = from_text(ONE_FOOD)
    for _ in range(tick):
        act(colony, GIVE, GIVE)
    first, second = cells_of(colony)
    food = neighbour(first, 1)
    assert food == neighbour(second, 5)
    assert foods_of(colony) == {food}
    winner = 0 if key(world, first, tick) < key(world, second, tick) else 1
    act(colony, PICK_UP, PICK_UP)
    gets, loses = colony.ants[winner], colony.ants[1 - winner]
    assert (gets.reward, gets.carries, gets.heading) == (3, True, [4, 2][winner])
    # The loser keeps its heading: nothing but the reward tells it.
    assert (loses.reward, loses.carries, loses.heading) == (-1, False, [5, 1][winner])
    assert cells_of(colony) == [first, second]
    assert foods_of(colony) == set()
    # Trail on the food's cell and on the winner's own, not on the loser's.
    levels = [colony.world.trail.level(cell) for cell in (food, gets.cell, loses.cell)]
    assert levels == [249, 249, 0]
    assert (colony.record.moves, colony.record.blocked) == (0, 0)


def test_each_of_the_two_gets_the_food_at_some_tick():
    world = from_text(ONE_FOOD)
    first, second = [tuple(cell) for cell in world.ants[:, :3].tolist()]
    won = {key(world, first, tick) < key(world, second, tick) for tick in range(6)}
    assert won == {False, True}


# Both ants have both foods in view.
TWO_FOODS = World(
    (4, 4, 4),
    (0, 0, 3),
    foods=[(1, 0, 0), (1, 1, 0)],
    ants=[((0, 0, 0), 0), ((2, 1, 0), 3)],
)


def test_of_two_foods_each_draws_one_before_it_is_known_who_wins():
    n_taken = set()
    for seed in range(12):
        colony = begun(TWO_FOODS, seed=seed)
        streams = [RandomStream(ant.stream.state) for ant in colony.ants.values()]
        # In the order left, forward, right: ant 0 sees (1, 0, 0) ahead and (1, 1, 0) to the right,
        # ant 1 sees (1, 1, 0) ahead and (1, 0, 0) to the right.
        highs = [stream.draw()[0] * 2 >> 32 for stream in streams]
        first, second = [(1, 0, 0), (1, 1, 0)][highs[0]], [(1, 1, 0), (1, 0, 0)][highs[1]]
        act(colony, PICK_UP, PICK_UP)
        assert foods_of(colony) == {(1, 0, 0), (1, 1, 0)} - {first, second}
        assert sum(ant.carries for ant in colony.ants.values()) == len({first, second})
        # One draw each, the loser's as well.
        assert [ant.stream.state for ant in colony.ants.values()] == [s.state for s in streams]
        n_taken.add(len({first, second}))
    assert n_taken == {1, 2}


def test_food_moved_into_is_an_obstacle_and_a_trail_pays():
    # Ahead food, to the right a trail.
    colony = begun("""
F   .
  t
0   .
  .
Q
""")
    act(colony, FORWARD)
    assert (colony.ants[0].reward, colony.ants[0].heading) == (-1, 0)
    act(colony, RIGHT)
    assert (colony.ants[0].reward, colony.ants[0].heading) == (1, 1)


RING = """
    3
  2   4
    Q
  1   5
    0
"""


def test_six_around_the_queen_give_in_one_tick():
    colony = begun(RING)
    load(colony, *range(6))
    assert all(ant.state >> 2 & 3 == 3 for ant in colony.ants.values())
    act(colony, *[GIVE] * 6)
    assert [ant.reward for ant in colony.ants.values()] == [10] * 6
    assert not any(ant.carries for ant in colony.ants.values())
    assert colony.record.deliveries == 6
    assert colony.record.deliveries == 6
    assert colony.record.first_delivery == 1
    assert colony.record.episode_return == 60


def test_two_chains_that_meet_in_a_crowd_keep_one_ant_per_cell():
    # A filled disc of 19 cells but for the queen: nobody can move, whatever they do.
    around = [(q, r) for q in range(-2, 3) for r in range(-2, 3) if abs(q - r) <= 2]
    disc = [normal_form(q, r, 0) for q, r in around]
    world = World((3, 3, 3), (0, 0, 0), ants=[(cell, 0) for cell in disc if cell != (0, 0, 0)])
    colony = begun(world)
    before = cells_of(colony)
    act(colony, *[FORWARD] * 18)
    assert cells_of(colony) == before
    assert len(set(before)) == 18
    assert colony.record.blocked == 18
