"""Exact bounds on what an ant can achieve in one episode, by dynamic programming.

They hold for an ant that knows the whole world, its own place in it and what it has taken, so no
policy on what an ant sees can do better. One ant, trails that do not change while it has no food,
and the episode ends at the first delivery (as in the paper's training).

So a state is (heading, cell) until the ant picks up a food, and then (food, heading, cell) in a
world without that food, where trails no longer matter, since an ant with food does not see them.
Chance only decides which of several foods in view a pick-up takes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from taichi_ants.analysis.bounds.surroundings import Surroundings, in_view, look_around
from taichi_ants.errors import AntsError, shown
from taichi_ants.task import Rewards, Task
from taichi_ants.task.constants import GIVE, N_ACTIONS, PICK_UP
from taichi_ants.worlds.world import World

if TYPE_CHECKING:
    from scipy.sparse import csr_array

# About a minute on one core, and 2 GB of memory.
MAX_STATES = 2_000_000
# Of a step in searching the shortest delivery; above twice the rewards of any shortest one, and so
# small that the sums are exact.
_STEP = 1 << 32
# Action values this close count as equal, since the same sums in another order differ by rounding:
# relative to the value of the state, and, for sums that cancel to almost nothing, relative to the
# largest value. So a goal of 10 goes unnoticed after 300 steps with a discount factor of 0.9.
_RELATIVE_TOLERANCE = 1e-12
_ABSOLUTE_TOLERANCE = 1e-14


class Outcome(NamedTuple):
    """Undiscounted return, steps and deliveries (0 or 1) of an episode; means over chances."""

    episode_return: float
    steps: float
    deliveries: float


class EpisodeBounds:
    """The decision process of one ant that starts where `world.start(seed=0)` places it.

    States are numbered: first those without food, then those with each of the foods, last the one
    after the delivery, where nothing happens any more.

    Raises:
        AntsError: Trails change while ants learn, no ant can start, or the world is too large.
    """

    def __init__(self, world: World, task: Task) -> None:
        changes = task.evaporation_in_training and task.pheromone.evaporation != "none"
        if changes or task.pheromone.diffusion:
            raise AntsError("exact bounds are known for worlds without evaporation only.")
        around = look_around(world)
        cells, headings = world.start(seed=0)
        cell = int(np.searchsorted(around.cells, cells[0]))
        self._start = int(headings[0]) * len(around.cells) + cell
        reached = world.walkable(cells)[around.cells]
        self._build(around, around.food & reached, task.rewards)

    def _build(self, around: Surroundings, food: np.ndarray, paid: Rewards) -> None:
        """Set the rewards, float64 (5, N), and the chances of what follows, sparse (5 N, N)."""
        from scipy.sparse import coo_array

        foods, half = np.unique(around.neighbours[food]), around.n_states
        n = (1 + len(foods)) * half + 1
        if n > MAX_STATES:
            raise AntsError(
                f"the exact bounds of this world need {n} states, more than the {MAX_STATES} that "
                "are allowed; choose a smaller world or fewer foods to get them."
            )
        # What fails changes nothing; after the delivery all does.
        follows = np.tile(np.arange(n), (N_ACTIONS, 1))
        self._rewards = np.full((N_ACTIONS, n), float(paid.failed))
        self._rewards[:, -1] = 0.0
        # Without food.
        trail = in_view(around.trail)
        lured = (trail >= 1) & (2 * trail >= trail.max(axis=0))
        moved = np.where(lured, paid.shaping, paid.empty)
        follows[:3, :half] = around.moves(around.empty)
        self._rewards[:3, :half] = np.where(in_view(around.empty), moved, paid.failed)
        seen = in_view(food).sum(axis=0)
        self._rewards[PICK_UP, :half][seen > 0] = paid.pick_up
        # With each food, whose cell is empty now.
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
        # A pick-up takes any of the foods in view.
        certain = np.ones_like(follows, bool)
        certain[PICK_UP, :half] = seen == 0
        takes, taken = np.concatenate(picks, axis=1) if picks else np.empty((2, 0), int)
        shares = np.concatenate([np.ones(certain.sum()), 1 / seen[takes]])
        rows = np.concatenate([np.flatnonzero(certain), PICK_UP * n + takes])
        columns = np.concatenate([follows[certain], taken])
        self._chances = coo_array((shares, (rows, columns)), shape=(N_ACTIONS * n, n)).tocsr()

    def shortest(self) -> Outcome | None:
        """The fewest steps to a delivery, and among these the largest return; None without one.

        The ant is lucky where a pick-up chooses among several foods.
        """
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import dijkstra

        # Where actions lead to one state, it is the state that they leave.
        actions, n = self._chances.tocoo(), self._chances.shape[1]
        costs = _STEP - self._rewards.reshape(-1)[actions.row]
        graph = coo_array((costs, (actions.row % n, actions.col)), shape=(n, n)).tocsr()
        cost = dijkstra(graph, indices=self._start)[-1]
        if np.isinf(cost):
            return None
        steps = round(cost / _STEP)
        return Outcome(float(steps * _STEP - cost), float(steps), 1.0)

    def optimal(self, discount: float, max_steps: int) -> tuple[float, Outcome]:
        """The largest discounted return without a step limit, and what its policy yields.

        The policy is followed for at most `max_steps` steps. Where several actions are optimal, it
        takes the one with the lowest number.

        Raises:
            AntsError: The discount is not in [0, 1).
        """
        if not 0 <= discount < 1:
            raise AntsError(
                f"the discount is {shown(discount)}, so there is no optimal policy: unless it is "
                "at least 0 and below 1 the return without step limit may grow without bound."
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
        """The rewards of a policy, (N,), and the chances of what follows, (N, N)."""
        states = np.arange(len(policy))
        return self._rewards[policy, states], self._chances[policy * len(policy) + states]

    def _follow(self, policy: np.ndarray, max_steps: int) -> Outcome:
        rewards, moved = self._of(policy)
        moved = moved.T.tocsr()
        at = np.zeros(len(policy))  # the chance to be in each state
        at[self._start] = 1.0
        total = steps = 0.0
        for _ in range(max_steps):
            total += float(rewards @ at)
            steps += 1.0 - float(at[-1])
            at = moved @ at
        return Outcome(total, steps, float(at[-1]))
