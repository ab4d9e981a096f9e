"""Plain searches that test the exact bounds, in a separate simulator."""

import numpy as np

from taichi_ants.analysis.bounds import ExpectedEpisode
from taichi_ants.task import Rewards
from taichi_ants.worlds.world import World

STEPS = [(1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), (1, 0, 1)]

# A state is (cell, heading, taken): `taken` is the cell of the carried food, None without food.
# The state after the delivery is None.
DELIVERED = None


PAPERS = Rewards(empty=0, failed=-1, shaping=1, pick_up=3, deliver=10)


class PlainWorld:
    """A slow simulator of one ant without evaporation."""

    def __init__(self, world: World, paid: Rewards = PAPERS) -> None:
        self.paid = paid
        self.ranges, self.queen = world.ranges, world.queen
        self.foods = set(map(tuple, world.foods.tolist()))
        self.obstacles = set(map(tuple, world.obstacles.tolist()))
        self.trails = {(x, y, z): level for x, y, z, level in world.trails.tolist()}
        [[x, y, z, heading]] = world.ants.tolist()
        self.start = ((x, y, z), heading, None)

    def outcomes(self, state: tuple, action: int) -> list[tuple[tuple | None, int]]:
        """Return the possible next states and rewards of an action, all equally probable."""
        cell, heading, taken = state
        seen = [self._neighbour(cell, heading + turn) for turn in (-1, 0, 1)]
        foods = self.foods - {taken}
        if action == 3:
            in_view = [target for target in seen if target in foods]
            if taken or not in_view:
                return [(state, self.paid.failed)]
            return [((cell, (heading + 3) % 6, target), self.paid.pick_up) for target in in_view]
        if action == 4:
            gives = taken and self.queen in seen
            return [(DELIVERED, self.paid.deliver)] if gives else [(state, self.paid.failed)]
        target, heading = seen[action], (heading + action - 1) % 6
        if not self._is_empty(target, foods):
            return [((cell, heading, taken), self.paid.failed)]
        if taken:
            shows_cue = self._distance(target) < self._distance(cell)
        else:
            levels = [self.trails.get(c, 0) for c in seen if self._is_empty(c, foods)]
            level = self.trails.get(target, 0)
            shows_cue = level >= 1 and level >= max(levels) / 2
        return [((target, heading, taken), self.paid.shaping if shows_cue else self.paid.empty)]

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
        """Return all reachable states, with the outcomes of the five actions."""
        found, todo = {}, [self.start]
        while todo:
            state = todo.pop()
            if state is DELIVERED or state in found:
                continue
            found[state] = [self.outcomes(state, action) for action in range(5)]
            todo += [after for outcomes in found[state] for after, _ in outcomes]
        return found


def search_shortest(plain: PlainWorld) -> ExpectedEpisode | None:
    """Return the outcome of the shortest delivery with the best return, by breadth-first search."""
    layer, seen, steps = {plain.start: 0}, set(), 0
    while layer:
        if DELIVERED in layer:
            return ExpectedEpisode(layer[DELIVERED], steps, 1)
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


def search_optimal(
    plain: PlainWorld, discount: float, max_steps: int
) -> tuple[float, ExpectedEpisode]:
    """Return the optimal value by value iteration, and the expected outcome of that policy."""
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

    return values[plain.start], ExpectedEpisode(*follow(plain.start, max_steps))
