"""The exact bounds: by hand, and against plain searches in a simulator written only for them."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taichi_ants import reference
from taichi_ants.analysis import dynamic_programming
from taichi_ants.analysis.dynamic_programming import Outcome, exact_bounds
from taichi_ants.errors import AntsError
from taichi_ants.hexgrid import AxialGrid
from taichi_ants.policies import random_policy, trail_follower
from taichi_ants.worlds.paper import paper
from taichi_ants.worlds.world import World

STEPS = [(1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), (1, 0, 1)]

# A state is (cell, heading, taken): `taken` is the cell of the carried food, None without food.
# After the delivery it is None as a whole.
DELIVERED = None


class PlainWorld:
    """The rules for one ant without evaporation, with no thought of speed."""

    def __init__(self, world: World) -> None:
        self.ranges, self.queen = world.ranges, world.queen
        self.foods = set(map(tuple, world.foods.tolist()))
        self.obstacles = set(map(tuple, world.obstacles.tolist()))
        self.trails = {(x, y, z): level for x, y, z, level in world.trails.tolist()}
        [[x, y, z, heading]] = world.ants.tolist()
        self.start = ((x, y, z), heading, None)

    def outcomes(self, state: tuple, action: int) -> list[tuple[tuple | None, int]]:
        """The next states and rewards that an action can have, all equally probable."""
        cell, heading, taken = state
        seen = [self._neighbour(cell, heading + turn) for turn in (-1, 0, 1)]
        foods = self.foods - {taken}
        if action == 3:
            in_view = [target for target in seen if target in foods]
            if taken or not in_view:
                return [(state, -1)]
            return [((cell, (heading + 3) % 6, target), 3) for target in in_view]
        if action == 4:
            return [(DELIVERED, 10)] if taken and self.queen in seen else [(state, -1)]
        target, heading = seen[action], (heading + action - 1) % 6
        if not self._is_empty(target, foods):
            return [((cell, heading, taken), -1)]
        if taken:
            lured = self._distance(target) < self._distance(cell)
        else:
            levels = [self.trails.get(c, 0) for c in seen if self._is_empty(c, foods)]
            level = self.trails.get(target, 0)
            lured = level >= 1 and level >= max(levels) / 2
        return [((target, heading, taken), int(lured))]

    def _is_empty(self, cell: tuple, foods: set) -> bool:
        exists = all(value < size for value, size in zip(cell, self.ranges, strict=True))
        return exists and cell not in foods | self.obstacles | {self.queen}

    @staticmethod
    def _neighbour(cell: tuple, heading: int) -> tuple:
        moved = [a + b for a, b in zip(cell, STEPS[heading % 6], strict=True)]
        return tuple(value - min(moved) for value in moved)

    def _distance(self, cell: tuple) -> int:
        difference = [a - b for a, b in zip(cell, self.queen, strict=True)]
        return max(difference) - min(difference)

    def all_states(self) -> dict[tuple, list[list[tuple[tuple | None, int]]]]:
        """Every state that can be reached, with the outcomes of its five actions."""
        found, todo = {}, [self.start]
        while todo:
            state = todo.pop()
            if state is DELIVERED or state in found:
                continue
            found[state] = [self.outcomes(state, action) for action in range(5)]
            todo += [after for outcomes in found[state] for after, _ in outcomes]
        return found


def search_all_sequences(plain: PlainWorld, max_steps: int) -> tuple[tuple, tuple]:
    """The shortest and the best (return, steps, deliveries) of all sequences of actions."""
    episodes = []
    for actions in product(range(5), repeat=max_steps):
        state, reward = plain.start, 0
        for steps, action in enumerate(actions, start=1):
            [(state, gained)] = plain.outcomes(state, action)
            reward += gained
            if state is DELIVERED or steps == max_steps:
                episodes.append((reward, steps, int(state is DELIVERED)))
                break
    delivered = [episode for episode in episodes if episode[2]]
    shortest = min(delivered, key=lambda episode: (episode[1], -episode[0]))
    return shortest, max(episodes, key=lambda episode: (episode[0], -episode[1], episode[2]))


def search_largest(plain: PlainWorld, max_steps: int) -> Outcome:
    """The largest return, then the fewest steps, then a delivery, with luck at the pick-up."""
    states = plain.all_states()
    best = dict.fromkeys(states, (0, 0, 0))
    best[DELIVERED] = (0, 0, 1)
    for _ in range(max_steps):
        later = {
            state: max(
                (best[after][0] + reward, best[after][1] - 1, best[after][2])
                for outcomes in actions
                for after, reward in outcomes
            )
            for state, actions in states.items()
        }
        best = {**later, DELIVERED: (0, 0, 1)}
    reward, steps, deliveries = best[plain.start]
    return Outcome(reward, -steps, deliveries)


def search_shortest(plain: PlainWorld) -> Outcome | None:
    """Breadth first, with the best return of each state where it is first reached."""
    layer, seen, steps = {plain.start: 0}, set(), 0
    while layer:
        if DELIVERED in layer:
            return Outcome(layer[DELIVERED], steps, 1)
        seen |= set(layer)
        following: dict = {}
        for state, so_far in layer.items():
            for action in range(5):
                for after, reward in plain.outcomes(state, action):
                    if after not in seen:
                        total = so_far + reward
                        following[after] = max(total, following.get(after, total))
        layer, steps = following, steps + 1
    return None


def search_optimal(plain: PlainWorld, discount: float, max_steps: int) -> tuple[float, Outcome]:
    """Value iteration, then the expected outcome of the first of the best actions."""
    states = plain.all_states()

    def action_value(outcomes: list) -> float:
        return sum(reward + discount * values[after] for after, reward in outcomes) / len(outcomes)

    values = dict.fromkeys([*states, DELIVERED], 0.0)
    for _ in range(80):
        values.update({s: max(map(action_value, actions)) for s, actions in states.items()})

    def follow(state: tuple | None, left: int) -> np.ndarray:
        if state is DELIVERED or left == 0:
            return np.array([0.0, 0.0, float(state is DELIVERED)])
        action_values = [action_value(outcomes) for outcomes in states[state]]
        best = next(a for a in range(5) if action_values[a] > max(action_values) - 1e-11)
        branches = [
            follow(after, left - 1) + (reward, 1, 0) for after, reward in states[state][best]
        ]
        return np.mean(branches, axis=0)

    return values[plain.start], Outcome(*follow(plain.start, max_steps))


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
        reference.rollout(world, policy, number=number, max_steps=60, evaporation=False)
        for policy in (random_policy(), trail_follower())
        for number in range(40)
    ]
    assert any(rollout.deliveries for rollout in rollouts)
    assert all(rollout.episode_return <= bounds.largest.episode_return for rollout in rollouts)
    delivered = [rollout for rollout in rollouts if rollout.deliveries]
    assert all(rollout.steps >= bounds.shortest.steps for rollout in delivered)


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
    with pytest.raises(AntsError, match="choose a smaller world, fewer foods or fewer steps"):
        exact_bounds(world, [], max_steps)


def test_every_food_counts_for_the_size(monkeypatch: pytest.MonkeyPatch) -> None:
    # Six states on each of the cells but the queen's: 5 in the row, with one food 30 * (1 + 1).
    world = World((6, 1, 1), (0, 0, 0), [(5, 0, 0)], ants=[((1, 0, 0), 0)])
    monkeypatch.setattr(dynamic_programming, "MAX_STATES", 60)
    exact_bounds(world, [], 10)
    monkeypatch.setattr(dynamic_programming, "MAX_STATES", 59)
    with pytest.raises(AntsError, match="need 60 states over 10 steps, more than the 59"):
        exact_bounds(world, [], 10)
