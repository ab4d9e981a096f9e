"""The exact bounds: by hand, and against plain searches."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_runs import rollout
from plain_search import (
    PlainWorld,
    search_all_sequences,
    search_largest,
    search_optimal,
    search_shortest,
)

from taichi_ants.analysis.bounds import episodes as dynamic_programming
from taichi_ants.analysis.bounds.episodes import Outcome, exact_bounds
from taichi_ants.analysis.bounds.transitions import build_transitions
from taichi_ants.errors import AntsError
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.learners.policies import random_policy, trail_follower
from taichi_ants.task import Rewards, Task
from taichi_ants.worlds.paper import paper
from taichi_ants.worlds.world import World


def assert_outcome(outcome: Outcome, expected: Outcome) -> None:
    assert vars(outcome) == pytest.approx(vars(expected))


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


@settings(max_examples=40, deadline=None)
@given(world=small_worlds(), max_steps=st.integers(1, 25))
def test_bounds_agree_with_plain_searches(world: World, max_steps: int) -> None:
    bounds = exact_bounds(world, [0.5], max_steps)
    plain = PlainWorld(world)
    assert bounds.shortest == search_shortest(plain)
    assert bounds.largest == search_largest(plain, max_steps)
    [optimal] = bounds.optimal
    value, outcome = search_optimal(plain, 0.5, max_steps)
    assert optimal.value == pytest.approx(value, abs=1e-9)
    assert_outcome(optimal.outcome, outcome)


@pytest.mark.parametrize("max_steps", [4, 5, 6])
def test_bounds_agree_with_all_sequences_of_actions(max_steps: int) -> None:
    # Queen, ant, trail, food in a row; the ant faces away from the queen.
    world = World((4, 1, 1), (0, 0, 0), [(3, 0, 0)], trails=[((2, 0, 0), 1)], ants=[((1, 0, 0), 0)])
    shortest, largest = search_all_sequences(PlainWorld(world), max_steps)
    bounds = exact_bounds(world, [], max_steps)
    assert bounds.shortest == Outcome(*shortest) == Outcome(15, 4, 1)
    assert bounds.largest == Outcome(*largest)


# The world of the paper. On the line of the cells (i, 0, 0) the queen is at i = -9, the ant at
# i = -8, the food at i = 9. An ant sees only neighbours, so it must come to a neighbour of the
# food, 16 cells away at least, pick up (1), come back to a neighbour of the queen, 16 cells again,
# and give (1): 34 steps. On the line that works, as a pick-up turns the ant round. Each move earns
# at most 1, and on the line it does: 16 + 3 + 16 + 10 = 45.
PAPERS_SHORTEST = Outcome(45, 34, 1)


def test_the_shortest_delivery_in_the_world_of_the_paper() -> None:
    assert exact_bounds(paper(), []).shortest == PAPERS_SHORTEST


def test_a_small_discount_factor_makes_the_shortest_delivery_optimal() -> None:
    [optimal] = exact_bounds(paper(), [0.9]).optimal
    ways = (1 - 0.9**16) / (1 - 0.9)
    assert optimal.value == pytest.approx(ways + 0.9**16 * 3 + 0.9**17 * ways + 0.9**33 * 10)
    assert optimal.outcome == PAPERS_SHORTEST


def test_a_large_discount_factor_makes_the_ant_walk_the_trail_forever() -> None:
    # After the first 16 cells of the trail it turns round: four moves beside the trail earn
    # nothing, the fifth comes back to the trail two cells before the turn, and 14 more lead to the
    # other end. So 19 steps earn 15: 600 = 16 + 30 * 19 + 14 steps earn 16 + 30 * 15 + 10.
    [optimal] = exact_bounds(paper(), [0.99]).optimal
    assert optimal.outcome == Outcome(476, 600, 0)
    turn_and_way = 0.99**4 * (1 - 0.99**15) / (1 - 0.99) / (1 - 0.99**19)
    first_way = (1 - 0.99**16) / (1 - 0.99)
    assert optimal.value == pytest.approx(first_way + 0.99**16 * turn_and_way)


def test_the_largest_return_in_the_world_of_the_paper() -> None:
    largest = exact_bounds(paper(), [], 600).largest
    assert largest == Outcome(491, 600, 1)
    # With exactly the steps of the shortest delivery nothing is better.
    assert exact_bounds(paper(), [], 34).largest == PAPERS_SHORTEST
    # One step less: walk on the trail and pick up at the end. 16 + 3, and 15 or 16 moves home.
    assert exact_bounds(paper(), [], 33).largest == Outcome(35, 33, 0)
    assert exact_bounds(paper(), [], 1).largest == Outcome(1, 1, 0)


def test_no_policy_exceeds_the_bounds() -> None:
    world = World(
        (4, 3, 2),
        (0, 0, 0),
        [(3, 0, 0), (3, 2, 0)],
        [(2, 0, 0)],
        [((1, 1, 0), 3), ((2, 1, 0), 3)],
        [((1, 0, 0), 0)],
    )
    bounds = exact_bounds(world, [0.9], 60)
    assert bounds.shortest is not None
    rollouts = [
        rollout(
            world,
            policy,
            number=number,
            max_steps=60,
            task=Task(evaporation_in_evaluation=False),
        )
        for policy in (random_policy(), trail_follower())
        for number in range(40)
    ]
    assert all(run.returns[0] <= bounds.largest.episode_return for run in rollouts)
    delivered = [run for run in rollouts if run.deliveries[0]]
    assert delivered
    assert all(run.steps[0] >= bounds.shortest.steps for run in delivered)


def test_a_pick_up_of_one_of_two_foods_is_luck_for_the_bounds_and_chance_for_the_optimum() -> None:
    # Eight cells, y = 1 above, x to the right. The ant at A looks towards the queen and sees the
    # foods 1 and 2; all else is rock.
    #     # # 2 #
    #     Q 1 A #
    # Food 1 opens the way: the ant, turned round, turns back in two blocked moves (-2), goes to the
    # queen's neighbour (+1) and gives: 3 - 2 + 1 + 10 = 12 in 5 steps.
    # Food 2 opens only its own cell, as far from the queen: a blocked move (-1), the move there
    # (0), then again and again two blocked moves and the move back. After the pick-up, the sixth
    # step completes -1 + 0 - 2 + 0: 3 - 3 = 0 in 6 steps.
    world = World(
        (4, 2, 1),
        (0, 0, 0),
        foods=[(1, 0, 0), (2, 1, 0)],
        obstacles=[(0, 1, 0), (1, 1, 0), (3, 0, 0), (3, 1, 0)],
        ants=[((2, 0, 0), 3)],
    )
    bounds = exact_bounds(world, [0.5], 6)
    assert bounds.shortest == bounds.largest == Outcome(12, 5, 1)
    [optimal] = bounds.optimal
    assert optimal.outcome == Outcome((12 + 0) / 2, (5 + 6) / 2, 0.5)
    food_1 = -1 - 0.5 + 0.25 * 1 + 0.125 * 10
    cycle = (-1 - 0.5) / (1 - 0.125)
    food_2 = -1 + 0.25 * cycle
    assert optimal.value == pytest.approx(3 + 0.5 * (food_1 + food_2) / 2)


@pytest.mark.parametrize(
    ("levels", "rewards"),
    [
        # Left, forward, right: what is at least half of the strongest is seen as a trail.
        ((1, 2, 0), [1, 1, 0]),
        ((1, 3, 0), [0, 1, 0]),
        ((2, 4, 3), [1, 1, 1]),
        ((0, 0, 0), [0, 0, 0]),
        ((1_000_000_000, 499_999_999, 500_000_000), [1, 0, 1]),
    ],
)
def test_moves_onto_trails_earn_what_the_ant_sees(
    levels: tuple[int, int, int], rewards: list[int]
) -> None:
    # The ant looks up the x axis from the middle of its row: x + 1 is ahead, z + 1 and y + 1 lead
    # to its left and right, in normal form.
    ahead = [(2, 0, 1), (2, 0, 0), (2, 1, 0)]
    world = World(
        (3, 3, 3),
        (0, 2, 2),
        trails=list(zip(ahead, levels, strict=True)),
        ants=[((1, 0, 0), 0)],
    )
    transitions = build_transitions(world)
    assert transitions.foraging.rewards[:, transitions.start].tolist() == [*rewards, -1, -1]


def test_moves_earn_what_the_caller_pays() -> None:
    world = World((4, 1, 1), (0, 0, 0), [(2, 0, 0)], trails=[((1, 0, 0), 9)], ants=[((1, 0, 0), 0)])
    paid = Rewards(empty=-2, failed=-7, lure=5, pick_up=11, give=40)
    transitions = build_transitions(world, paid)
    usual = build_transitions(world)
    assert (transitions.foraging.exit_reward, transitions.carrying(0).exit_reward) == (11, 40)
    by_usual = {0: -2, -1: -7, 1: 5, 3: 11, 10: 40}
    for phase, other in (
        (transitions.foraging, usual.foraging),
        (transitions.carrying(0), usual.carrying(0)),
    ):
        assert (phase.rewards == np.vectorize(by_usual.get)(other.rewards)).all()
        assert phase.failed_reward == -7


def test_a_food_behind_another_is_never_reached() -> None:
    # Queen, ant and two foods in a row: the second only comes into view when the first is gone,
    # and then the ant carries.
    world = World((4, 1, 1), (0, 0, 0), [(2, 0, 0), (3, 0, 0)], ants=[((1, 0, 0), 0)])
    alone = World((4, 1, 1), (0, 0, 0), [(2, 0, 0)], [(3, 0, 0)], ants=[((1, 0, 0), 0)])
    bounds = exact_bounds(world, [0.9], 10)
    assert bounds == exact_bounds(alone, [0.9], 10)
    assert bounds.shortest == Outcome(13, 2, 1)


@pytest.mark.parametrize("foods", [[], [(5, 0, 0)]])
def test_a_world_without_a_delivery_has_no_shortest_one(foods: list) -> None:
    # The only food, if any, lies behind a rock.
    world = World((6, 1, 1), (0, 0, 0), foods, [(3, 0, 0)], ants=[((1, 0, 0), 0)])
    bounds = exact_bounds(world, [0.9], 10)
    assert bounds.shortest is None
    assert bounds.largest.deliveries == 0
    assert bounds.optimal[0].outcome.deliveries == 0


def test_equal_actions_are_decided_by_the_lowest_number() -> None:
    # Three cells in a row: the ant in the middle between queen and rock can only fail, for ever.
    world = World((3, 1, 1), (0, 0, 0), obstacles=[(2, 0, 0)], ants=[((1, 0, 0), 0)])
    [at_once, later] = exact_bounds(world, [0.0, 0.9], 7).optimal
    assert at_once.outcome == later.outcome == Outcome(-7, 7, 0)
    assert at_once.value == -1
    assert later.value == pytest.approx(-10)


def test_an_ant_that_is_not_listed_starts_by_the_seed_zero() -> None:
    placed = World((4, 3, 2), (0, 0, 0), [(3, 0, 0)])
    [cell], [heading] = placed.start(seed=0)
    listed = World(
        (4, 3, 2), (0, 0, 0), [(3, 0, 0)], ants=[(placed.grid.cells(cell).tolist(), int(heading))]
    )
    assert exact_bounds(placed, [0.9], 50) == exact_bounds(listed, [0.9], 50)


@pytest.mark.parametrize("discount", [-0.1, 1.0, 1.5, float("nan")])
def test_a_discount_out_of_range_is_refused(discount: float) -> None:
    with pytest.raises(AntsError, match=str(discount)):
        exact_bounds(paper(), [0.9, discount])


@pytest.mark.parametrize("max_steps", [0, -3, 2.5, 10**9])
def test_a_step_limit_out_of_range_is_refused(max_steps: float) -> None:
    with pytest.raises(AntsError, match="max_steps"):
        exact_bounds(paper(), [], max_steps)


@pytest.mark.parametrize(
    ("world", "max_steps"),
    [
        # A million cells.
        (World((1000, 1000, 1), (0, 0, 0)), 1),
        # Few states, but too many steps.
        (paper(), 10_000_000),
    ],
)
def test_a_world_that_is_too_large_is_refused(world: World, max_steps: int) -> None:
    with pytest.raises(AntsError, match=r"choose a smaller world.* fewer foods.* to get them\.$"):
        exact_bounds(world, [], max_steps)


@pytest.mark.parametrize(
    ("foods", "obstacles", "states"),
    [
        # Six states on each cell but the queen's, in the phase without food and in one for each
        # food that can come into view.
        ([], [], 6 * 5),
        ([(5, 0, 0)], [], 6 * 5 * 2),
        ([(4, 0, 0), (5, 0, 0)], [], 6 * 5 * 2),
        ([(5, 0, 0)], [(4, 0, 0)], 6 * 4),
    ],
)
def test_every_food_in_reach_counts_for_the_size(
    foods: list, obstacles: list, states: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    world = World((6, 1, 1), (0, 0, 0), foods, obstacles, ants=[((1, 0, 0), 0)])
    # No world is refused for less than its first phase on all cells, the queen's included: 36.
    least = max(states, 6 * 6)
    monkeypatch.setattr(dynamic_programming, "MAX_STATES", least)
    exact_bounds(world, [], 10)
    monkeypatch.setattr(dynamic_programming, "MAX_STATES", least - 1)
    with pytest.raises(AntsError, match=f"need {least} states, more than the {least - 1}"):
        exact_bounds(world, [], 10)
