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
from taichi_ants.task import Rewards
from taichi_ants.task.constants import EMPTY, FOOD, GIVE, N_ACTIONS, PICK_UP, QUEEN
from taichi_ants.worlds.geometry import walkable
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
        paid: What each event pays.
    """

    start: int
    foraging: Phase
    after_pick_up: np.ndarray
    foods_in_view: np.ndarray
    n_foods: int
    paid: Rewards
    _around: Surroundings
    _food_cells: np.ndarray

    def carrying(self, food: int) -> Phase:
        """The phase from the pick-up of a food, which leaves its cell empty, to the delivery."""
        around, paid = self._around, self.paid
        can_enter = around.empty | (around.neighbours == self._food_cells[food])
        lure = np.where(around.nearer, paid.lure, paid.empty)
        rewards = by_move(np.where(can_enter, lure, paid.failed))
        gives = around.sees(around.queen)
        return _phase(around, can_enter, rewards, GIVE, gives, paid.give, paid.failed)

    def pick_ups(self, food: int) -> tuple[np.ndarray, np.ndarray]:
        """The ends of `foraging` that can take a food, and the states in which it is carried."""
        ends = np.flatnonzero((self.foods_in_view == food).any(axis=1))
        return ends, self.after_pick_up[ends]


@dataclass(frozen=True)
class Surroundings:
    """What lies at each heading of each cell on which an ant can ever stand.

    Attributes:
        cells: int64 (n,): their flat indices.
        neighbours: int32 (6, n): the number of the neighbour, -1 if no ant can ever stand there.
        empty, food, queen: bool (6, n): what it holds at the start.
        nearer: bool (6, n): whether it is nearer to the queen than the cell itself.
        trail: int32 (6, n): its trail level at the start.
    """

    cells: np.ndarray
    neighbours: np.ndarray
    empty: np.ndarray
    food: np.ndarray
    queen: np.ndarray
    nearer: np.ndarray
    trail: np.ndarray

    @property
    def n_states(self) -> int:
        """Number of states (heading, cell)."""
        return self.neighbours.size

    def moves(self, can_enter: np.ndarray) -> np.ndarray:
        """int32 (3, 6 n): where the moves lead if these neighbours, bool (6, n), can be entered.

        An ant that is blocked turns without moving.
        """
        turned = np.arange(self.n_states, dtype=np.int32).reshape(N_HEADINGS, -1)
        moved = np.where(can_enter, self.neighbours + turned[:, :1], turned)
        return by_move(moved).reshape(3, -1)

    def sees(self, what: np.ndarray) -> np.ndarray:
        """int64 (S,): the states in which some cell in view is of a kind, bool (6, n)."""
        return np.flatnonzero(by_move(what).any(axis=0))

    def turned_round(self, states: np.ndarray) -> np.ndarray:
        """The same states with the opposite heading, as after a pick-up."""
        return (states + 3 * len(self.cells)) % self.n_states


def look_around(world: World) -> Surroundings:
    """The surroundings of all cells that are empty or hold food."""
    ground = world.ground()
    cells = np.flatnonzero((ground == EMPTY) | (ground == FOOD))
    number = np.full(ground.size, -1, np.int32)
    number[cells] = np.arange(len(cells), dtype=np.int32)
    # An ant's cell exists, so its neighbours lie at worst on the border of void cells.
    index = cells + world.grid.offsets[:, None].astype(np.int64)
    heading_bits = np.arange(N_HEADINGS)[:, None]
    return Surroundings(
        cells=cells,
        neighbours=number[index],
        empty=ground[index] == EMPTY,
        food=ground[index] == FOOD,
        queen=ground[index] == QUEEN,
        nearer=(world.closer()[cells] >> heading_bits & 1).astype(bool),
        trail=world.trail_levels()[index],
    )


def by_move(ahead: np.ndarray) -> np.ndarray:
    """From (6, n), by the direction of a neighbour, to (3, 6, n), by move and heading."""
    return np.stack([np.roll(ahead, turn, axis=0) for turn in (1, 0, -1)])


def build_transitions(world: World, paid: Rewards | None = None) -> Transitions:
    """The tables of a world, for one ant that starts where `world.start(seed=0)` places it.

    Args:
        world: The world.
        paid: What each event pays; None is the paper's.
    """
    paid = paid or Rewards()
    around = look_around(world)
    start_cells, start_headings = world.start(seed=0)
    start_cell = int(np.searchsorted(around.cells, start_cells[0]))
    reached = walkable(world.grid, world.ground(), start_cells)[around.cells]
    food_in_reach = around.food & reached
    exits = around.sees(food_in_reach)
    seen = by_move(food_in_reach).reshape(3, -1)
    seen_cells = by_move(around.neighbours).reshape(3, -1)
    food_cells = np.unique(seen_cells[seen])
    foods_in_view = np.where(seen, np.searchsorted(food_cells, seen_cells), -1)[:, exits].T
    rewards = _foraging_rewards(around, paid)
    return Transitions(
        start=int(start_headings[0]) * len(around.cells) + start_cell,
        foraging=_phase(around, around.empty, rewards, PICK_UP, exits, paid.pick_up, paid.failed),
        after_pick_up=around.turned_round(exits),
        foods_in_view=foods_in_view,
        n_foods=len(food_cells),
        paid=paid,
        _around=around,
        _food_cells=food_cells,
    )


def _phase(
    around: Surroundings,
    can_enter: np.ndarray,
    move_rewards: np.ndarray,
    exit_action: int,
    exits: np.ndarray,
    exit_reward: int,
    failed_reward: int,
) -> Phase:
    """A phase in which these neighbours can be entered; moves towards them pay (3, 6, n).

    A pick-up or give that fails changes nothing.
    """
    n_states = around.n_states
    successors = np.empty((N_ACTIONS, n_states), np.int32)
    successors[:3] = around.moves(can_enter)
    successors[[PICK_UP, GIVE]] = np.arange(n_states)
    successors[exit_action, exits] = n_states + np.arange(exits.size)
    rewards = np.full((N_ACTIONS, n_states), failed_reward, np.int64)
    rewards[:3] = move_rewards.reshape(3, -1)
    rewards[exit_action, exits] = exit_reward
    return Phase(successors, rewards, exits, exit_reward, failed_reward)


def _foraging_rewards(around: Surroundings, paid: Rewards) -> np.ndarray:
    """Rewards of the moves, (3, 6, n), of an ant without food."""
    # Only empty cells show a trail. 64 bits, because twice the greatest level needs them.
    levels = by_move(np.where(around.empty, around.trail, 0).astype(np.int64))
    is_trail = (levels >= 1) & (2 * levels >= levels.max(axis=0))
    rewards = np.where(is_trail, paid.lure, paid.empty)
    return np.where(by_move(around.empty), rewards, paid.failed)
