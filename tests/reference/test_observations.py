"""The state index of each ant, in drawn worlds whose rows are worked out by hand.

In the drawings 0 to 5 are ants with that heading, F is food, Q the queen, # a rock, t a trail. With
heading 0 an ant looks up; around it lie, from behind left (heading -2) on: down left, up left, up,
up right, down right, and behind it down.
"""

from __future__ import annotations

import numpy as np
import pytest
from colonies import begun, load, training
from plain_runs import run_episode
from random_worlds import random_world

from taichi_ants.reference import OBSERVATIONS, ReferenceColony
from taichi_ants.reference.geometry import neighbour
from taichi_ants.task import Pheromone, observations
from taichi_ants.task.constants import LEFT
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
# The paper's state: T F E, 2, 3, 0.
PERCEPT = 16 * 2 + 4 * 3


def state_of(drawing, observation, slot=0, carries=False, **options):
    """The row that an ant looks at."""
    colony = begun(drawing, observation=observation, **options)
    if carries:
        load(colony, slot)
    return colony.ants[slot].state


def digits(base, *codes):
    return int("".join(map(str, codes)), base)


def test_the_papers_row_is_the_paper_state():
    assert state_of(AROUND, "paper") == PERCEPT
    for seed in range(30):
        colony = ReferenceColony(random_world(seed), None, training(epsilon=1.0), seed)
        for [step] in run_episode(colony, 40):
            assert colony.ants[0].state == colony.ants[0].paper_state == step.next_state


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


# The queen is two cells away: the cells behind left and behind are nearer to her.
HOMEWARDS = """
      .
    .   .
      0
    .   #
      .
    Q
"""


@pytest.mark.parametrize(
    ("observation", "row"),
    [
        ("five_cells", digits(4, 1, 2, 0, 0, 0, 1)),
        ("six_cells", digits(4, 1, 2, 0, 0, 0, 1, 2)),
    ],
)
def test_with_food_the_cells_behind_lure_if_they_are_nearer_to_the_queen(observation, row):
    assert state_of(HOMEWARDS, observation, carries=True) == row


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


# Ant 0 looks up at another one; beside that a rock and the end of the world.
CROWD = """
    3
  #
    0
  .   .
    Q
"""


@pytest.mark.parametrize("carries", [False, True])
@pytest.mark.parametrize("other_carries", [False, True])
def test_another_ant_is_told_from_a_rock_whatever_it_carries(carries, other_carries):
    colony = begun(CROWD, observation="ants_seen")
    load(colony, *([0] if other_carries else []), *([1] if carries else []))
    looking = colony.ants[1]
    assert looking.state == digits(5, int(carries), 1, 4, 1)
    assert looking.paper_state == 64 * carries + 16 + 4 + 1


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


@pytest.mark.parametrize("name", OBSERVATIONS)
def test_ants_choose_and_learn_by_the_row_and_act_by_the_paper_state(name):
    # Left is a trail. Greedy, the ant goes there by a table with one best value, in the row that
    # it looks at; the move pays as the paper's state says, +1; and what it learns stands in that
    # row.
    n_states = observations.get(name).n_states
    q_values = np.zeros((n_states, 5), np.float32)
    q_values[state_of(AROUND, name), LEFT] = 4
    colony = begun(AROUND, training(discount=0.0), "shared", q_values=q_values, observation=name)
    colony.tick()
    [step] = colony.transitions
    assert (step.state, step.action, step.reward) == (state_of(AROUND, name), LEFT, 1)
    assert step.next_state == colony.ants[0].state
    learnt = colony.q_values
    assert learnt.shape == (n_states, 5)
    assert learnt[step.state, LEFT] == 2.5  # 4 + 0.5 * (1 - 4)
