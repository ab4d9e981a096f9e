"""What an ant alone in its world can do, as tables over the full state of the world.

An episode ends at the first delivery, so it has two phases. While the ant forages, the ground and
the trails are as at the start (evaporation off), and the state is (heading, cell). Once it has
taken a food, the state is (heading, cell) in a world without that food; trails no longer matter,
since an ant with food does not see them. Both phases are deterministic except for which of several
foods in view a pick-up takes.

A cell here is a number in 0..n-1 among those that an ant can ever stand on, and the number of a
state is heading * n + cell.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task import rewards as reward_table
from taichi_ants.task.constants import EMPTY, FOOD, GIVE, N_ACTIONS, PICK_UP, QUEEN
from taichi_ants.worlds.world import World


@dataclass(frozen=True)
class Phase:
    """One phase of an episode as a deterministic graph.

    Its states are numbered 0..6n-1. They are followed by one end for each state in which the
    phase can be left (by a pick-up or a give), 6n..6n+S-1.

    Attributes:
        successors: int32 (5, 6 n): the state or end in which each action leaves the ant.
        rewards: int64 (5, 6 n): the reward of each action.
        exits: int64 (S,): the states in which the phase can be left, ascending.
        exit_reward: The reward of leaving it.
        failed_reward: The reward of a pick-up or give that cannot be done; the state stays.
    """

    successors: np.ndarray
    rewards: np.ndarray
    exits: np.ndarray
    exit_reward: int
    failed_reward: int

    @property
    def n_states(self) -> int:
        """Number of states, without the ends."""
        return self.successors.shape[1]

    def scored(self, factor: int, step: int) -> Phase:
        """The same phase with every reward r replaced by factor * r + step."""
        return replace(
            self,
            rewards=factor * self.rewards + step,
            exit_reward=factor * self.exit_reward + step,
            failed_reward=factor * self.failed_reward + step,
        )


@dataclass(frozen=True)
class Transitions:
    """The tables of one world.

    Attributes:
        start: The state in which the ant starts to forage.
        foraging: The phase up to the pick-up.
        after_pick_up: int64 (S,): for each end of `foraging` the state in which the ant starts to
            carry, the same for every food.
        foods_in_view: int64 (S, 3): for each end the foods to the left, forward and right, numbers
            in 0..n_foods-1, or -1 for none.
        n_foods: Number of foods that the ant can come to see, and so of carrying phases.
    """

    start: int
    foraging: Phase
    after_pick_up: np.ndarray
    foods_in_view: np.ndarray
    n_foods: int
    _surroundings: _Surroundings
    _food_cells: np.ndarray

    def carrying(self, food: int) -> Phase:
        """The phase from the pick-up of a food, which leaves its cell empty, to the delivery."""
        around = self._surroundings
        can_enter = around.empty | (around.neighbours == self._food_cells[food])
        paid = reward_table.REWARDS
        lure = np.where(around.nearer, paid.lure, paid.empty)
        rewards = _by_move(np.where(can_enter, lure, paid.failed))
        exits = np.flatnonzero(_by_move(around.queen).any(axis=0))
        return _phase(around.neighbours, can_enter, rewards, GIVE, exits, paid.give)

    def pick_ups(self, food: int) -> tuple[np.ndarray, np.ndarray]:
        """The ends of `foraging` that can take a food, and the states in which it is carried."""
        ends = np.flatnonzero((self.foods_in_view == food).any(axis=1))
        return ends, self.after_pick_up[ends]


@dataclass(frozen=True)
class _Surroundings:
    """What lies at each heading of each cell on which an ant can ever stand; arrays (6, n).

    Attributes:
        neighbours: int32: the number of the neighbour, -1 if no ant can ever stand there.
        empty, food, queen: bool: what it holds at the start.
        nearer: bool: whether it is nearer to the queen than the cell itself.
        trail: int32: its trail level at the start.
    """

    neighbours: np.ndarray
    empty: np.ndarray
    food: np.ndarray
    queen: np.ndarray
    nearer: np.ndarray
    trail: np.ndarray


def build_transitions(world: World) -> Transitions:
    """The tables of a world, for one ant that starts where `world.start(seed=0)` places it."""
    ground = world.ground()
    cells = np.flatnonzero((ground == EMPTY) | (ground == FOOD))
    around = _look_around(world, ground, cells)
    start_cells, start_headings = world.start(seed=0)
    start_cell = int(np.searchsorted(cells, start_cells[0]))

    seen = _by_move(around.food & _reachable(around, start_cell)).reshape(3, -1)
    seen_cells = _by_move(around.neighbours).reshape(3, -1)
    exits = np.flatnonzero(seen.any(axis=0))
    food_cells = np.unique(seen_cells[seen])
    foods_in_view = np.where(seen, np.searchsorted(food_cells, seen_cells), -1)[:, exits].T
    heading, cell = np.divmod(exits, len(cells))
    return Transitions(
        start=int(start_headings[0]) * len(cells) + start_cell,
        foraging=_phase(
            around.neighbours,
            around.empty,
            _foraging_rewards(around),
            PICK_UP,
            exits,
            reward_table.REWARDS.pick_up,
        ),
        after_pick_up=(heading + 3) % N_HEADINGS * len(cells) + cell,
        foods_in_view=foods_in_view,
        n_foods=len(food_cells),
        _surroundings=around,
        _food_cells=food_cells,
    )


def _look_around(world: World, ground: np.ndarray, cells: np.ndarray) -> _Surroundings:
    number = np.full(ground.size, -1, np.int32)
    number[cells] = np.arange(len(cells), dtype=np.int32)
    # An ant's cell exists, so its neighbours lie at worst on the border of void cells.
    index = cells + world.grid.offsets[:, None].astype(np.int64)
    heading_bits = np.arange(N_HEADINGS)[:, None]
    return _Surroundings(
        neighbours=number[index],
        empty=ground[index] == EMPTY,
        food=ground[index] == FOOD,
        queen=ground[index] == QUEEN,
        nearer=(world.closer()[cells] >> heading_bits & 1).astype(bool),
        trail=world.trail_levels()[index],
    )


def _phase(
    neighbours: np.ndarray,
    can_enter: np.ndarray,
    move_rewards: np.ndarray,
    exit_action: int,
    exits: np.ndarray,
    exit_reward: int,
) -> Phase:
    """Put a phase together from what a move to each neighbour (6, n) does.

    An ant that is blocked turns without moving; a pick-up or give that fails changes nothing.
    """
    n = neighbours.shape[1]
    states = np.arange(N_HEADINGS * n, dtype=np.int32)
    turned = states.reshape(N_HEADINGS, n)
    moved = np.where(can_enter, neighbours + turned[:, :1], turned)
    successors = np.empty((N_ACTIONS, states.size), np.int32)
    successors[:3] = _by_move(moved).reshape(3, -1)
    successors[[PICK_UP, GIVE]] = states
    successors[exit_action, exits] = states.size + np.arange(exits.size)
    paid = reward_table.REWARDS
    rewards = np.full((N_ACTIONS, states.size), paid.failed, np.int64)
    rewards[:3] = move_rewards.reshape(3, -1)
    rewards[exit_action, exits] = exit_reward
    return Phase(successors, rewards, exits, exit_reward, paid.failed)


def _by_move(ahead: np.ndarray) -> np.ndarray:
    """From (6, n), by the direction of a neighbour, to (3, 6, n), by move and heading."""
    return np.stack([np.roll(ahead, turn, axis=0) for turn in (1, 0, -1)])


def _foraging_rewards(around: _Surroundings) -> np.ndarray:
    """Rewards of the moves, (3, 6, n), of an ant without food."""
    # Only empty cells show a trail. 64 bits, because twice the greatest level needs them.
    levels = _by_move(np.where(around.empty, around.trail, 0).astype(np.int64))
    is_trail = (levels >= 1) & (2 * levels >= levels.max(axis=0))
    paid = reward_table.REWARDS
    rewards = np.where(is_trail, paid.lure, paid.empty)
    return np.where(_by_move(around.empty), rewards, paid.failed)


def _reachable(around: _Surroundings, start: int) -> np.ndarray:
    """bool (n,): the cells that an ant without food can reach over empty cells."""
    reached = np.zeros(around.empty.shape[1], bool)
    frontier = np.array([start])
    while frontier.size:
        reached[frontier] = True
        ahead = around.neighbours[:, frontier][around.empty[:, frontier]]
        frontier = np.unique(ahead[~reached[ahead]])
    return reached
