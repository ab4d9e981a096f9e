"""Upper bounds on deliveries of colonies with any policy, in worlds whose food grows back at once.

Both hold in the long run, for ants that neither die nor are born, and food that stays in place.

- Time: an ant needs at least the ticks of the shortest cycle queen -> food -> queen over (cell,
  heading, carrying) from one delivery to the next. Food grows back before an ant can enter its
  cell, so the ground does not change. An ant that another blocks turns on the spot, so the bound
  allows turns on the spot everywhere. With right of way, it also allows an ant without food to be
  pushed from every cell onto each neighbour while it turns to either side or not.
- Queen: an ant that delivers in tick t leaves its cell in t + 1 at the earliest. If the next ant
  can enter in that tick, by pushing or following, it delivers in t + 2; if not, it enters in t + 2
  and delivers in t + 3. An ant that stays needs as many ticks: it delivers, picks up (which turns
  it round) and turns back, one tick less if a delivery turns it round. So each neighbour cell of
  the queen serves one delivery in 3 ticks, or in 2.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from taichi_ants import Task, World
from taichi_ants.analysis.bounds import Surroundings, look_around
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task.constants import EMPTY


class Limits(NamedTuple):
    """The bounds of one world."""

    cycle: float  # the fewest ticks between two deliveries of an ant; inf if it cannot deliver
    queen: float  # the most deliveries per 1000 ticks that the cells around the queen allow

    def deliveries(self, ants: int) -> float:
        """Return the most that this number of ants can deliver per 1000 ticks in the long run."""
        return min(ants * 1000 / self.cycle, self.queen)


def limits_of(world: World, task: Task) -> Limits:
    """Return the bounds of a world with the traffic rules of a task."""
    around = world.grid.index(world.queen) + world.grid.offsets
    cells = int(world.walkable(around)[around].sum())
    ticks = 2 if task.traffic.shared or task.turns_at_queen else 3
    return Limits(shortest_cycle(world, task), 1000 * cells / ticks)


def shortest_cycle(world: World, task: Task) -> float:
    """Return the least mean number of ticks from one delivery to the next, inf if there is no way.

    A delivery does not move the ant, so a cycle is a chain of walks between delivery states.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    # A node is (carrying, heading, cell); edges are moves, blocked or not, pushes and pick-ups.
    around = look_around(world)
    half = around.n_states
    moves = [*around.moves(around.empty), *around.moves(np.zeros_like(around.empty))]
    walks = [np.stack([np.arange(half), move]) for move in moves]
    pushes = _pushes(around) if task.traffic.swap else []
    picks = around.sees(around.food)
    pick_ups = np.stack([picks, around.turned_round(picks) + half])
    edges = np.concatenate([*walks, *[walk + half for walk in walks], *pushes, pick_ups], axis=1)
    ones = np.ones(edges.shape[1], np.int8)
    graph = coo_array((ones, tuple(edges)), shape=(2 * half, 2 * half)).tocsr()
    # The states in which a carrier can deliver; no ant can enter a cell with food.
    gives = around.sees(around.queen)
    gives = gives[world.ground()[around.cells[gives % len(around.cells)]] == EMPTY]
    mean, horizon = np.inf, 64  # short walks are found quickly and usually suffice
    while len(gives):
        begins = around.turned_round(gives) if task.turns_at_queen else gives
        walked = dijkstra(graph, indices=begins, unweighted=True, limit=horizon)
        ticks = walked[:, half + gives] + 1
        mean = least_mean_cycle(ticks)
        # If so, a cycle that includes a walk beyond the horizon has a greater mean.
        enough = np.isfinite(mean) and mean + (len(gives) - 1) * (mean - ticks.min()) <= horizon
        if enough or horizon >= 2 * half:  # no walk is longer
            break
        horizon *= 4
    return mean


def _pushes(around: Surroundings) -> list[np.ndarray]:
    """Return edges onto each neighbour that can be empty, turned or not; int64 (2, n) each."""
    n = len(around.cells)
    edges = []
    for neighbours, empty in zip(around.neighbours, around.empty, strict=True):
        (cells,) = np.nonzero(empty)
        for heading in range(N_HEADINGS):
            for turn in (-1, 0, 1):
                onto = (heading + turn) % N_HEADINGS * n + neighbours[cells]
                edges.append(np.stack([heading * n + cells, onto]))
    return edges


def least_mean_cycle(lengths: np.ndarray) -> float:
    """Return the smallest mean edge length of a cycle; missing edges (n, n) have the length inf."""
    mean, walks = np.inf, lengths  # the shortest walks of k edges, from each node to each
    for k in range(1, len(lengths) + 1):
        mean = min(mean, float(walks.diagonal().min()) / k)
        walks = (walks[:, :, None] + lengths).min(axis=1)
    return mean
