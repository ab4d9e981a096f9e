"""The state index of each ant, in drawn worlds whose rows are worked out by hand.

In the drawings 0 to 5 are ants with that heading, F is food, Q the queen, # a rock, t a trail. With
heading 0 an ant looks up; around it lie, from behind left (heading -2) on: down left, up left, up,
up right, down right, and behind it down.
"""

import pytest
from colonies import begun, load

from taichi_ants.reference.geometry import neighbour
from taichi_ants.reference.observations import OBSERVATIONS
from taichi_ants.task import Pheromone
from taichi_ants.task.observations.built_in import BUILT_IN
from taichi_ants.worlds import World

# Around the ant from behind left on: a rock, a trail, food, nothing, a trail; behind it the queen.
AROUND = """
trail = 8
    F
  t   .
    0
  #   t
    Q
"""


def state_of(drawing, observation, slot=0, carries=False, **options):
    """The row that an ant looks at."""
    colony = begun(drawing, observation=observation, **options)
    if carries:
        load(colony, slot)
    return colony.ants[slot].state


def digits(base, *codes):
    return int("".join(map(str, codes)), base)


def test_the_reference_has_each_observation_of_the_package():
    assert list(OBSERVATIONS) == [one.name for one in BUILT_IN]


@pytest.mark.parametrize(
    ("observation", "row"),
    [
        ("five_cells", digits(4, 0, 1, 2, 3, 0, 2)),
        ("six_cells", digits(4, 0, 1, 2, 3, 0, 2, 1)),  # without food the queen looks O
        ("trail_levels", digits(6, 0, 4, 5, 0)),
        ("ants_seen", digits(5, 0, 2, 3, 0)),
        ("ants", digits(6, 0, 2, 3, 0)),
        ("queues", digits(7, 0, 2, 3, 0)),
    ],
)
def test_without_food(observation, row):
    assert state_of(AROUND, observation) == row


@pytest.mark.parametrize(
    ("observation", "row"),
    [
        # The queen is beside the ant, so no cell is nearer; food looks O, trails are not seen.
        ("paper", 64 + 4),
        ("five_cells", digits(4, 1, 1, 0, 1, 0, 0)),
        ("six_cells", digits(4, 1, 1, 0, 1, 0, 0, 3)),
        ("trail_levels", digits(6, 1, 0, 1, 0)),
        ("ants_seen", digits(5, 1, 0, 1, 0)),
        ("ants", digits(6, 1, 0, 1, 0)),
        ("queues", digits(7, 1, 0, 1, 0)),
    ],
)
def test_with_food(observation, row):
    assert state_of(AROUND, observation, carries=True) == row


A = (0, 0, 0)
FAR = (0, 0, 4)


def with_trails(observation, levels, pheromone=None):
    """The row of an ant with heading 1 for these levels at headings -2, -1, ... relative to it."""
    trails = [(neighbour(A, 1 - 2 + turn), level) for turn, level in enumerate(levels)]
    world = World((5, 5, 5), FAR, trails=trails, ants=[(A, 1)])
    return state_of(world, observation, pheromone=pheromone or Pheromone())


@pytest.mark.parametrize(
    ("levels", "codes"),
    [
        # Behind left, left, forward, right, behind right. The strongest ahead is 10.
        ((5, 10, 4, 0, 4), (2, 2, 0, 0, 0)),
        ((900, 10, 5, 4, 5), (2, 2, 2, 0, 2)),  # what lies behind does not count for the strongest
        ((1, 0, 0, 0, 0), (2, 0, 0, 0, 0)),  # nothing ahead: a trail of 1 is seen
    ],
)
def test_trails_behind_are_measured_against_the_strongest_ahead(levels, codes):
    assert with_trails("five_cells", levels) == digits(4, 0, *codes)
    assert with_trails("six_cells", levels) == digits(4, 0, *codes, 0)


P, OTHER, AHEAD = 4, 5, 6  # ants: other load on a better cell, on any other; same load on a better


@pytest.mark.parametrize(("levels", "code"), [((7, 6), P), ((6, 6), OTHER), ((0, 6), OTHER)])
def test_without_food_a_better_cell_has_a_stronger_trail_than_the_ants_own(levels, code):
    ahead = neighbour(A, 0)
    trails = list(zip((ahead, A), levels, strict=True))
    world = World((5, 5, 5), FAR, trails=trails, ants=[(A, 0), (ahead, 0)])
    colony = begun(world, observation="queues")
    assert colony.ants[0].state == digits(7, 0, 0, AHEAD if code == P else 1, 0)
    load(colony, 1)
    colony.observe(colony.ants[0])
    assert colony.ants[0].state == digits(7, 0, 0, code, 0)
    assert colony.ants[0].paper_state == 4  # what it can do goes by the paper's state
