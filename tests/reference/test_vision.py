"""What the reference's ant sees, in micro-worlds whose states are worked out by hand.

Most use the same drawing: ranges (5, 5, 5), the ant A at the origin with heading 1, and the three
cells in its view

        L            heading 0: (1, 0, 0)
            M        heading 1: (1, 1, 0)
        A
            R        heading 2: (0, 1, 0)

State = 64 * carries + 16 * left + 4 * forward + right; E 0, O 1, T or S 2, F or Q 3.
"""

import pytest

from taichi_ants.reference.ants import Ant
from taichi_ants.reference.observations import observe
from taichi_ants.reference.world_state import WorldState
from taichi_ants.task import Pheromone, Task
from taichi_ants.worlds.world import World

A, L, M, R = (0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)
FAR = (0, 0, 4)  # a queen behind the ant, at distance 4; from L 5, from M 5, from R 5


def sees(carries=False, cell=A, heading=1, queen=FAR, **contents) -> int:
    world = World((5, 5, 5), queen, **contents)
    return observe(WorldState(world, Task()), Ant(cell, heading, carries))


@pytest.mark.parametrize(
    ("contents", "state"),
    [
        ({}, 0),  # E E E
        ({"obstacles": [L]}, 16),  # O E E
        ({"obstacles": [L, M, R]}, 21),  # O O O
        ({"foods": [M]}, 12),  # E F E
        ({"foods": [L, R]}, 51),  # F E F: 48 + 3
        ({"trails": [(R, 1)]}, 2),  # E E T: a level of 1 is enough
        ({"trails": [(R, 0)]}, 0),  # below 1 there is no trail
        ({"queen": M}, 4),  # E O E: without food the queen is an obstacle
        ({"foods": [L], "trails": [(M, 7)], "obstacles": [R]}, 57),  # F T O: 48 + 8 + 1
    ],
)
def test_without_food(contents, state):
    assert sees(**contents) == state


@pytest.mark.parametrize(
    ("levels", "state"),
    [
        ((10, 5, 4), 40),  # T T E: 5 is exactly half of 10, 4 is less
        ((11, 5, 6), 34),  # T E T: half of 11 is 5.5
        ((1, 250, 124), 8),  # E T E
        ((3, 250, 125), 10),  # E T T
        ((9, 9, 9), 42),  # T T T
    ],
)
def test_a_trail_is_seen_from_half_of_the_strongest_in_view(levels, state):
    assert sees(trails=list(zip((L, M, R), levels, strict=True))) == state


def test_outside_the_world_there_are_obstacles():
    # From (4, 0, 0), heading 0: (5, 0, 1), (5, 0, 0), (5, 1, 0), none of which exists.
    assert sees(cell=(4, 0, 0), heading=0) == 21
    assert sees(carries=True, cell=(4, 0, 0), heading=0) == 64 + 21


@pytest.mark.parametrize(
    ("queen", "state"),
    [
        # Own distance 4. L: (4,0,0) - (1,0,0) = (3,0,0): 3, nearer. M: (3,-1,0) = (4,0,1): 4, as
        # far as the own cell, so not S. R: (4,-1,0) = (5,0,1): 5.
        ((4, 0, 0), 64 + 32),  # S E E
        # Own distance 4. L: (3,2,0): 3. M: (3,1,0): 3. R: (4,1,0): 4.
        ((4, 2, 0), 64 + 32 + 8),  # S S E
        # Own distance 2. L: (1,2,0): 2. M: (1,1,0): 1. R: (2,1,0): 2.
        ((2, 2, 0), 64 + 8),  # E S E
        # Own distance 4; see FAR.
        (FAR, 64),  # E E E
        # The queen in view: she is at distance 1, so is no other cell nearer than that.
        (L, 64 + 48),  # Q E E
        (M, 64 + 12),  # E Q E
        (R, 64 + 3),  # E E Q
    ],
)
def test_with_food(queen, state):
    assert sees(carries=True, queen=queen) == state


@pytest.mark.parametrize(
    ("view", "levels", "loads", "state"),
    [
        # Left, forward, right; "-" is no ant, 0 an ant without food, 1 one with food.
        ("half", (10, 5, 4), "---", 40),
        ("strongest", (10, 5, 4), "---", 32),
        ("strongest", (10, 9, 10), "---", 34),  # all that are equally strong
        ("strongest", (0, 0, 0), "---", 0),
        ("strongest", (5, 10, 4), "-1-", 16 * 2 + 4),  # a trail under an ant does not count
        ("strongest_under_carriers", (5, 10, 4), "-1-", 4),  # under one with food it does,
        ("strongest_under_carriers", (5, 10, 4), "-0-", 16 * 2 + 4),  # without it does not
        ("strongest_under_carriers", (10, 10, 4), "-1-", 16 * 2 + 4),
    ],
)
@pytest.mark.parametrize("diffusion", [0.0, 1e-9])
def test_which_trails_look_like_one(view, levels, loads, state, diffusion):
    world = World((5, 5, 5), FAR, trails=list(zip((L, M, R), levels, strict=True)))
    moving = WorldState(world, Task(pheromone=Pheromone(view=view, diffusion=diffusion)))
    for cell, load in zip((L, M, R), loads, strict=True):
        if load != "-":
            moving.ants[cell] = Ant(cell, 0, load == "1")
    assert observe(moving, Ant(A, 1)) == state
