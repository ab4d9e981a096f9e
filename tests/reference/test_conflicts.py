"""Ants that want the same cell, or stand in each other's way, in drawn micro-worlds.

In the drawings 0 to 5 are ants with that heading, numbered in reading order; F food, Q the queen.
"""

import pytest
from colonies import act, begun, foods_of

from taichi_ants.grid.randomness import GAMMA, mix
from taichi_ants.reference.actions import Intent, winners
from taichi_ants.reference.ants import Ant
from taichi_ants.reference.geometry import neighbour
from taichi_ants.reference.random_stream import RandomStream
from taichi_ants.task.constants import FORWARD, PICK_UP
from taichi_ants.worlds import World


def key(world: World, cell, tick):
    """The rule once more: a hash of the number of the ant's cell and the tick."""
    inner = int(mix((int(world.grid.index(cell)) + GAMMA) % 2**64))
    return int(mix(((inner ^ tick) + GAMMA) % 2**64))


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
