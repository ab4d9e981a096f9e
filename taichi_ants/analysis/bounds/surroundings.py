"""The surroundings of a lone ant in each of its possible states.

Cells are numbered from 0 to n - 1; they are the n cells that an ant can ever enter. The index of a
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
    """The neighbours of the n cells that an ant can enter, arrays (6, n) by heading."""

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
