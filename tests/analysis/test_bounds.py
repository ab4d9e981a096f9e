"""The exact bounds: by hand, and against plain searches."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_search import PlainWorld, search_optimal, search_shortest

from taichi_ants.analysis import bounds as exact_bounds
from taichi_ants.analysis.bounds import EpisodeBounds, ExpectedEpisode
from taichi_ants.errors import AntsError
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.task import Rewards, Task
from taichi_ants.worlds import paper
from taichi_ants.worlds.world import World


def assert_outcome(outcome: ExpectedEpisode, expected: ExpectedEpisode) -> None:
    assert outcome == pytest.approx(expected)


@st.composite
def small_worlds(draw: st.DrawFn) -> World:
    ranges = draw(st.sampled_from([(3, 3, 1), (2, 2, 2), (5, 1, 1), (3, 2, 2), (4, 2, 1)]))
    grid = AxialGrid(ranges)
    cells = [tuple(cell) for cell in grid.cells(np.flatnonzero(grid.exists)).tolist()]
    queen, ant, *others = draw(st.permutations(cells))
    n_foods = draw(st.integers(0, min(3, len(others))))
    n_obstacles = draw(st.integers(0, min(3, len(others) - n_foods)))
    obstacles = others[n_foods : n_foods + n_obstacles]
    levels = draw(st.lists(st.sampled_from([0, 1, 2, 3, 4, 1_000_000_000]), max_size=len(cells)))
    return World(
        ranges,
        queen,
        foods=others[:n_foods],
        obstacles=obstacles,
        trails=[
            (cell, level)
            for cell, level in zip(cells, levels, strict=False)
            if cell not in obstacles
        ],
        ants=[(ant, draw(st.integers(0, 5)))],
    )


def bounds_of(world: World, rewards: Rewards | None = None) -> EpisodeBounds:
    return EpisodeBounds(world, Task(rewards=rewards or Rewards()))


@settings(max_examples=60, deadline=None)
@given(
    world=small_worlds(),
    max_steps=st.integers(1, 25),
    paid=st.none() | st.tuples(*[st.integers(-12, 12)] * 5),
)
def test_bounds_agree_with_plain_searches_for_any_rewards(
    world: World, max_steps: int, paid: tuple | None
) -> None:
    rewards = Rewards(*paid) if paid else Rewards()
    bounds, plain = bounds_of(world, rewards), PlainWorld(world, rewards)
    assert bounds.shortest() == search_shortest(plain)
    expected_value, expected = search_optimal(plain, 0.5, max_steps)
    value, outcome = bounds.optimal(0.5, max_steps)
    assert value == pytest.approx(expected_value, abs=1e-9)
    assert_outcome(outcome, expected)


# The world of the paper. On the line of the cells (i, 0, 0) the queen is at i = -9, the ant at
# i = -8, the food at i = 9. An ant sees only neighbours, so it must come to a neighbour of the
# food, 16 cells away at least, pick up (1), come back to a neighbour of the queen, 16 cells again,
# and give (1): 34 steps. On the line that works, as a pick-up turns the ant round. Each move earns
# at most 1, and on the line it does: 16 + 3 + 16 + 10 = 45.
PAPERS_SHORTEST = ExpectedEpisode(45, 34, 1)


def test_the_shortest_delivery_in_the_world_of_the_paper() -> None:
    assert bounds_of(paper()).shortest() == PAPERS_SHORTEST


def test_a_small_discount_factor_makes_the_shortest_delivery_optimal() -> None:
    value, outcome = bounds_of(paper()).optimal(0.9, 600)
    ways = (1 - 0.9**16) / (1 - 0.9)
    assert value == pytest.approx(ways + 0.9**16 * 3 + 0.9**17 * ways + 0.9**33 * 10)
    assert outcome == PAPERS_SHORTEST


def test_a_large_discount_factor_makes_the_ant_walk_the_trail_forever() -> None:
    # After the first 16 cells of the trail it turns round: four moves beside the trail earn
    # nothing, the fifth comes back to the trail two cells before the turn, and 14 more lead to the
    # other end. So 19 steps earn 15: 600 = 16 + 30 * 19 + 14 steps earn 16 + 30 * 15 + 10.
    value, outcome = bounds_of(paper()).optimal(0.99, 600)
    assert outcome == ExpectedEpisode(476, 600, 0)
    turn_and_way = 0.99**4 * (1 - 0.99**15) / (1 - 0.99) / (1 - 0.99**19)
    first_way = (1 - 0.99**16) / (1 - 0.99)
    assert value == pytest.approx(first_way + 0.99**16 * turn_and_way)


def test_equal_actions_are_decided_by_the_lowest_number() -> None:
    # Three cells in a row: the ant in the middle between queen and rock can only fail, for ever.
    world = World((3, 1, 1), (0, 0, 0), obstacles=[(2, 0, 0)], ants=[((1, 0, 0), 0)])
    assert bounds_of(world).optimal(0.0, 7) == (-1, ExpectedEpisode(-7, 7, 0))
    assert bounds_of(world).optimal(0.9, 7) == (pytest.approx(-10), ExpectedEpisode(-7, 7, 0))


@pytest.mark.parametrize(
    ("foods", "obstacles", "states"),
    [
        # Six states on each cell but the queen's, without food and with each food that can come
        # into view, and the delivery.
        ([], [], 6 * 5 + 1),
        ([(5, 0, 0)], [], 6 * 5 * 2 + 1),
        ([(4, 0, 0), (5, 0, 0)], [], 6 * 5 * 2 + 1),
        ([(5, 0, 0)], [(4, 0, 0)], 6 * 4 + 1),
    ],
)
def test_every_food_in_reach_counts_for_the_size(
    foods: list, obstacles: list, states: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    world = World((6, 1, 1), (0, 0, 0), foods, obstacles, ants=[((1, 0, 0), 0)])
    monkeypatch.setattr(exact_bounds, "MAX_STATES", states)
    bounds_of(world)
    monkeypatch.setattr(exact_bounds, "MAX_STATES", states - 1)
    with pytest.raises(AntsError, match=f"need {states} states, but at most {states - 1} are"):
        bounds_of(world)
