"""Exact bounds on what an ant can achieve in one episode, by dynamic programming.

They hold for an ant that observes the whole world, its own position and the food item it has taken,
so no policy on an ant's observations can do better. There is one ant, trails do not change while it
has no food, and the episode ends at the first delivery (as in the paper's training).

A state is therefore (heading, cell) until the ant picks up a food item. Then it is (food item,
heading, cell) in a world without that item, and without trails, which an ant with food does not
see. Only the choice among several food items in view is random.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from taichi_ants.errors import AntsError, expect, shown
from taichi_ants.features.support import PLAIN, refuse_unsupported
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task import Rewards, Task
from taichi_ants.task.constants import EMPTY, FOOD, GIVE, N_ACTIONS, PICK_UP, QUEEN
from taichi_ants.worlds.world import World

if TYPE_CHECKING:
    from scipy.sparse import csr_array

__all__ = ["EpisodeBounds", "ExpectedEpisode"]
# About a minute on one core, and 2 GB of memory.
MAX_STATES = 2_000_000
# The cost of a step in the search for the shortest delivery. It is above twice the rewards of any
# shortest delivery, and small enough for exact sums.
_STEP = 1 << 32
SUPPORTS = PLAIN
# Differences of action values up to these count as rounding errors: relative to the value of the
# state and, for sums that cancel, relative to the largest value. With a discount of 0.9, a reward
# of 10 that is 300 steps away is therefore ignored.
_RELATIVE_TOLERANCE = 1e-12
_ABSOLUTE_TOLERANCE = 1e-14


class ExpectedEpisode(NamedTuple):
    """The expected outcome of an episode.

    Attributes:
        episode_return: The undiscounted sum of rewards.
        steps: The number of steps.
        deliveries: The probability of a delivery.
    """

    episode_return: float
    steps: float
    deliveries: float


class EpisodeBounds:
    """The decision process of one ant that starts where `world.start(seed=0)` places it.

    Args:
        world: The world, whose trails stay as they are.
        task: The rules.

    Raises:
        AntsError: Trails change while ants learn, no ant can start, or the world is too large.

    >>> bounds = EpisodeBounds(worlds.paper(), Task())
    >>> bounds.shortest()
    ExpectedEpisode(episode_return=45.0, steps=34.0, deliveries=1.0)
    >>> value, outcome = bounds.optimal(discount=0.9, max_steps=600)
    >>> round(value, 2), outcome.deliveries
    (10.37, 1.0)
    """

    def __init__(self, world: World, task: Task) -> None:
        expect("world", world, World)
        expect("task", task, Task)
        refuse_unsupported("an exact bound", world.uses() | task.uses(), SUPPORTS)
        if task.evaporation_in_training and task.pheromone.evaporation != "none":
            raise AntsError(
                "trails evaporate in training, but exact bounds require constant trails; set "
                "`task.evaporation_in_training` to False."
            )
        around = look_around(world)
        cells, headings = world.start(seed=0)
        cell = int(np.searchsorted(around.cells, cells[0]))
        self._start = int(headings[0]) * len(around.cells) + cell
        reached = world.walkable(cells)[around.cells]
        self._build(around, around.food & reached, task.rewards)

    def _build(self, around: Surroundings, food: np.ndarray, paid: Rewards) -> None:
        """Set the rewards, float64 (5, N), and the transition probabilities, sparse (5 N, N)."""
        from scipy.sparse import coo_array

        foods, half = np.unique(around.neighbours[food]), around.n_states
        n = (1 + len(foods)) * half + 1
        if n > MAX_STATES:
            raise AntsError(
                f"the exact bounds of this world need {n} states, but at most {MAX_STATES} are "
                "allowed; use a smaller world or fewer food items."
            )
        # An action that fails changes nothing, and no action does after the delivery.
        follows = np.tile(np.arange(n), (N_ACTIONS, 1))
        self._rewards = np.full((N_ACTIONS, n), float(paid.failed))
        self._rewards[:, -1] = 0.0
        # The order of states: without food, with each food item, and the end after the delivery.
        trail = in_view(around.trail)
        shows_cue = (trail >= 1) & (2 * trail >= trail.max(axis=0))
        moved = np.where(shows_cue, paid.shaping, paid.empty)
        follows[:3, :half] = around.moves(around.empty)
        self._rewards[:3, :half] = np.where(in_view(around.empty), moved, paid.failed)
        seen = in_view(food).sum(axis=0)
        self._rewards[PICK_UP, :half][seen > 0] = paid.pick_up
        # With each food item, whose cell is now empty.
        moved = in_view(np.where(around.nearer, paid.shaping, paid.empty))
        gives = around.sees(around.queen)
        picks = []
        for number, taken in enumerate(foods, start=1):
            carrying = slice(number * half, (number + 1) * half)
            can_enter = around.empty | (around.neighbours == taken)
            follows[:3, carrying] = carrying.start + around.moves(can_enter)
            self._rewards[:3, carrying] = np.where(in_view(can_enter), moved, paid.failed)
            follows[GIVE, carrying.start + gives] = n - 1
            self._rewards[GIVE, carrying.start + gives] = paid.deliver
            takes = around.sees(food & (around.neighbours == taken))
            picks.append((takes, carrying.start + around.turned_round(takes)))
        # A pick-up takes one of the food items in view, each with the same probability.
        certain = np.ones_like(follows, bool)
        certain[PICK_UP, :half] = seen == 0
        takes, taken = np.concatenate(picks, axis=1) if picks else np.empty((2, 0), int)
        shares = np.concatenate([np.ones(certain.sum()), 1 / seen[takes]])
        rows = np.concatenate([np.flatnonzero(certain), PICK_UP * n + takes])
        columns = np.concatenate([follows[certain], taken])
        self._chances = coo_array((shares, (rows, columns)), shape=(N_ACTIONS * n, n)).tocsr()

    def shortest(self) -> ExpectedEpisode | None:
        """Return the outcome of the shortest delivery, None if there is no way.

        Of several shortest ones, it is the one with the largest return. Random choices among
        several food items are assumed to be the best ones.
        """
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import dijkstra

        # tocsr adds up parallel edges. Only loops have any, and no shortest path has a loop.
        actions, n = self._chances.tocoo(), self._chances.shape[1]
        costs = _STEP - self._rewards.reshape(-1)[actions.row]
        graph = coo_array((costs, (actions.row % n, actions.col)), shape=(n, n)).tocsr()
        cost = dijkstra(graph, indices=self._start)[-1]
        if np.isinf(cost):
            return None
        steps = round(cost / _STEP)
        return ExpectedEpisode(float(steps * _STEP - cost), float(steps), 1.0)

    def optimal(self, discount: float, max_steps: int) -> tuple[float, ExpectedEpisode]:
        """Return the largest discounted return without a step limit, and its policy's outcome.

        The policy is followed for at most `max_steps` steps. Of several optimal actions, it takes
        the one with the lowest index. Raises AntsError unless the discount is in [0, 1).
        """
        if not 0 <= discount < 1:
            raise AntsError(
                f"the discount is {shown(discount)}; it must be at least 0 and below 1, because "
                "otherwise the return without a step limit may be unbounded."
            )
        from scipy.sparse import eye_array
        from scipy.sparse.linalg import spsolve

        n = self._chances.shape[1]
        states = np.arange(n)
        policy = self._rewards.argmax(axis=0)
        while True:
            rewards, moved = self._of(policy)
            values = spsolve((eye_array(n) - discount * moved).tocsc(), rewards)
            ahead = self._rewards + discount * (self._chances @ values).reshape(-1, n)
            best = ahead.max(axis=0)
            size = np.abs(best)
            tolerance = _RELATIVE_TOLERANCE * size + _ABSOLUTE_TOLERANCE * size.max()
            improvable = best > ahead[policy, states] + tolerance
            if not improvable.any():
                break
            policy = np.where(improvable, ahead.argmax(axis=0), policy)
        policy = (ahead >= best - tolerance).argmax(axis=0)
        return float(values[self._start]), self._follow(policy, max_steps)

    def _of(self, policy: np.ndarray) -> tuple[np.ndarray, csr_array]:
        """Return the rewards, (N,), and the transition probabilities, (N, N), of a policy."""
        states = np.arange(len(policy))
        return self._rewards[policy, states], self._chances[policy * len(policy) + states]

    def _follow(self, policy: np.ndarray, max_steps: int) -> ExpectedEpisode:
        rewards, moved = self._of(policy)
        moved = moved.T.tocsr()
        at = np.zeros(len(policy))  # the probability of each state
        at[self._start] = 1.0
        total = steps = 0.0
        for _ in range(max_steps):
            total += float(rewards @ at)
            steps += 1.0 - float(at[-1])
            at = moved @ at
        return ExpectedEpisode(total, steps, float(at[-1]))


@dataclass(frozen=True)
class Surroundings:
    """The neighbours of the n cells that an ant can ever enter, arrays (6, n) by heading.

    The index of a state is heading * n + cell, with the number of the cell.
    """

    cells: np.ndarray  # int64 (n,): flat indices
    neighbours: np.ndarray  # int32: index of the cell, -1 if no ant can ever enter it
    empty: np.ndarray  # bool: whether it is empty at the start; food and queen likewise
    food: np.ndarray
    queen: np.ndarray
    nearer: np.ndarray  # bool: whether it is nearer to the queen than the cell itself
    trail: np.ndarray  # int64: its trail, 0 if it is not empty

    @property
    def n_states(self) -> int:
        """The number of states (heading, cell)."""
        return self.neighbours.size

    def moves(self, can_enter: np.ndarray) -> np.ndarray:
        """Return the states after the three moves, int32 (3, 6 n).

        `can_enter`, bool (6, n), has the neighbours that are free; an ant that is blocked turns
        without moving.
        """
        turned = np.arange(self.n_states, dtype=np.int32).reshape(N_HEADINGS, -1)
        return in_view(np.where(can_enter, self.neighbours + turned[:, :1], turned))

    def sees(self, what: np.ndarray) -> np.ndarray:
        """Return the states with neighbours in view that are in `what`, bool (6, n); int64 (S,)."""
        return np.flatnonzero(in_view(what).any(axis=0))

    def turned_round(self, states: np.ndarray) -> np.ndarray:
        """Return the states with the opposite heading, as after a pick-up."""
        return (states + 3 * len(self.cells)) % self.n_states


def look_around(world: World) -> Surroundings:
    """Return the surroundings of all cells that are empty or hold food."""
    ground = world.ground()
    cells = np.flatnonzero((ground == EMPTY) | (ground == FOOD))
    number = np.full(ground.size, -1, np.int32)
    number[cells] = np.arange(len(cells), dtype=np.int32)
    # An ant's cell is not void, so its neighbours are at most on the border of void cells.
    index = cells + world.grid.offsets[:, None].astype(np.int64)
    heading_bits = np.arange(N_HEADINGS)[:, None]
    empty = ground[index] == EMPTY
    return Surroundings(
        cells=cells,
        neighbours=number[index],
        empty=empty,
        food=ground[index] == FOOD,
        queen=ground[index] == QUEEN,
        nearer=(world.closer()[cells] >> heading_bits & 1).astype(bool),
        # int64, because comparisons use twice the greatest level.
        trail=np.where(empty, world.trail_levels()[index], 0).astype(np.int64),
    )


def in_view(ahead: np.ndarray) -> np.ndarray:
    """Return values of neighbours (6, n) as those of the cells in view (3, 6 n), by state."""
    turned = [np.roll(ahead, turn, axis=0) for turn in (1, 0, -1)]
    return np.stack(turned).reshape(3, -1)
