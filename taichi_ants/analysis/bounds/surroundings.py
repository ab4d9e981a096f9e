"""The surroundings of an ant that is alone in its world, in every state in which it can be.

A cell here is a number in 0..n-1 among those on which an ant can ever stand, and the number of a
state is heading * n + cell.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task.constants import EMPTY, FOOD, QUEEN
from taichi_ants.worlds.world import World


@dataclass(frozen=True)
class Surroundings:
    """The neighbours of each cell on which an ant can ever stand, arrays (6, n) by heading."""

    cells: np.ndarray  # int64 (n,): flat indices
    neighbours: np.ndarray  # int32: the number, -1 where no ant can ever stand
    empty: np.ndarray  # bool: what it holds at the start
    food: np.ndarray
    queen: np.ndarray
    nearer: np.ndarray  # bool: to the queen than the cell itself
    trail: np.ndarray  # int64: the trail that it shows, 0 where it is not empty

    @property
    def n_states(self) -> int:
        """Number of states (heading, cell)."""
        return self.neighbours.size

    def moves(self, can_enter: np.ndarray) -> np.ndarray:
        """int32 (3, 6 n): where the moves lead if these neighbours, bool (6, n), can be entered.

        An ant that is blocked turns without moving.
        """
        turned = np.arange(self.n_states, dtype=np.int32).reshape(N_HEADINGS, -1)
        return in_view(np.where(can_enter, self.neighbours + turned[:, :1], turned))

    def sees(self, what: np.ndarray) -> np.ndarray:
        """int64 (S,): the states in which some cell in view is of a kind, bool (6, n)."""
        return np.flatnonzero(in_view(what).any(axis=0))

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
    empty = ground[index] == EMPTY
    return Surroundings(
        cells=cells,
        neighbours=number[index],
        empty=empty,
        food=ground[index] == FOOD,
        queen=ground[index] == QUEEN,
        nearer=(world.closer()[cells] >> heading_bits & 1).astype(bool),
        # 64 bits, since twice the greatest level needs them.
        trail=np.where(empty, world.trail_levels()[index], 0).astype(np.int64),
    )


def in_view(ahead: np.ndarray) -> np.ndarray:
    """From (6, n), by the direction of a neighbour, to (3, 6 n), by place in view and state."""
    turned = [np.roll(ahead, turn, axis=0) for turn in (1, 0, -1)]
    return np.stack(turned).reshape(3, -1)
