"""What no colony can exceed where food grows back at once, whatever it has learned.

All hold in the long run, for ants that neither die nor are born, and food that stays in place.

- Time: an ant needs a number of ticks from one delivery to the next, at least that of the shortest
  cycle queen -> food -> queen over (cell, heading, carrying). Food that grows back in the tick in
  which it is taken never leaves its cell free, so that the ground stays the same and this is a
  shortest path. In company a cycle can be shorter than alone: an ant that is blocked by another
  turns on the spot, which an ant alone can do only beside walls. So the limit of many ants lets
  them turn on the spot everywhere.
- Food: a food taken in tick t with regrowth k is back at the end of tick t + k at the earliest,
  and can be taken in tick t + k + 1: a place of food gives at most one in k + 1 ticks. And it is
  taken from its neighbour cells. The ant that picks up in tick t leaves in t + 1 at the earliest;
  the cell must be empty when a tick starts, so that the next ant enters in t + 2 and picks up in
  t + 3. An ant that stays, since it can give to a queen next to it, needs three ticks for one and
  the same food as well: give, turn (a pick-up turns it round), pick up; only with food on both
  sides it takes two. So a neighbour cell serves one food once in 3 ticks, and all foods around it
  together once in 3, or once in 2 beside the queen. What all places give together is a maximum
  flow from places of food through neighbour cells.
- Queen: for the same reason each of the queen's neighbour cells serves one delivery in 3 ticks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichi_ants.analysis.bounds.surroundings import look_around
from taichi_ants.task.constants import EMPTY, QUEEN
from taichi_ants.worlds.geometry import walkable
from taichi_ants.worlds.world import World

TICKS_A_CELL = 3
TICKS_A_CELL_BESIDE_QUEEN = 2


@dataclass(frozen=True)
class Limits:
    """The limits of one world; inf or 0 where nothing can be delivered.

    Attributes:
        cycle: Ticks from one delivery to the next of one ant alone, in the long run.
        crowd_cycle: The same of an ant that can turn on the spot everywhere.
        food: Foods that can be taken, per 1000 ticks.
        queen: Foods that can be given, per 1000 ticks.
    """

    cycle: float
    crowd_cycle: float
    food: float
    queen: float

    def deliveries(self, ants: int) -> float:
        """The most that so many ants can deliver per 1000 ticks in the long run."""
        cycle = self.cycle if ants == 1 else self.crowd_cycle
        return min(ants * 1000 / cycle, self.food, self.queen)


def limits_of(world: World) -> Limits:
    """The limits of a world."""
    cycles = shortest_cycle(world, can_stay=False), shortest_cycle(world, can_stay=True)
    return Limits(*cycles, food_limit(world), queen_limit(world))


def food_limit(world: World, regrowth: int = 0) -> float:
    """The most foods that can be taken per 1000 ticks."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import maximum_flow

    reachable = _reachable(world)
    foods = world.grid.index(world.foods)
    around = foods[:, None] + world.grid.offsets
    food, direction = np.nonzero(reachable[around])
    if not len(food):
        return 0.0
    cells, cell = np.unique(around[food, direction], return_inverse=True)
    beside_queen = (world.ground()[cells[:, None] + world.grid.offsets] == QUEEN).any(axis=1)
    # Flows are integers: in units of one food in `unit` ticks.
    unit = TICKS_A_CELL * TICKS_A_CELL_BESIDE_QUEEN * (regrowth + 1)
    per_cell = np.where(beside_queen, unit // TICKS_A_CELL_BESIDE_QUEEN, unit // TICKS_A_CELL)
    first_cell, sink = 1 + len(foods), 1 + len(foods) + len(cells)
    edges = (  # from a source to the foods, from these to cells, from these to a sink
        (0, 1 + np.arange(len(foods)), unit // (regrowth + 1)),
        (1 + food, first_cell + cell, unit // TICKS_A_CELL),
        (first_cell + np.arange(len(cells)), sink, per_cell),
    )
    broad = (np.broadcast_arrays(*edge) for edge in edges)
    rows, columns, most = (np.concatenate(part) for part in zip(*broad, strict=True))
    graph = coo_array((most.astype(np.int32), (rows, columns)), shape=(sink + 1, sink + 1)).tocsr()
    return 1000 * int(maximum_flow(graph, 0, sink).flow_value) / unit


def queen_limit(world: World) -> float:
    """The most foods that can be given per 1000 ticks."""
    around = int(world.grid.index(world.queen)) + world.grid.offsets
    return 1000 * int(_reachable(world)[around].sum()) / TICKS_A_CELL


def _reachable(world: World) -> np.ndarray:
    """bool (grid.size,): empty cells to which a way over empty cells leads from the queen."""
    return walkable(world.grid, world.ground(), world.grid.index(world.queen) + world.grid.offsets)


def shortest_cycle(world: World, can_stay: bool) -> float:
    """The least mean number of ticks from one delivery to the next, inf if there is no way.

    A delivery leaves the ant where it is, so it is the end of one walk and the start of the next.

    Args:
        world: The world; its ground stays as it is.
        can_stay: Whether a move can also turn the ant on the spot where nothing is in its way.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    # A node is (carrying, heading, cell); edges are moves, blocked or not, and pick-ups.
    around = look_around(world)
    half = around.n_states
    moves = [around.moves(around.empty)]
    if can_stay:
        moves.append(around.moves(np.zeros_like(around.empty)))
    walks = [np.stack([np.arange(half), move]) for move in np.concatenate(moves)]
    picks = around.sees(around.food)
    pick_ups = np.stack([picks, around.turned_round(picks) + half])
    edges = np.concatenate([*walks, *[walk + half for walk in walks], pick_ups], axis=1)
    ones = np.ones(edges.shape[1], np.int8)
    graph = coo_array((ones, tuple(edges)), shape=(2 * half, 2 * half)).tocsr()
    # Where a carrying ant can give; no ant comes to a cell that holds food.
    gives = around.sees(around.queen)
    gives = gives[world.ground()[around.cells[gives % len(around.cells)]] == EMPTY]
    mean, horizon = np.inf, 64  # short walks are found quickly, and mostly enough
    while len(gives):
        walked = dijkstra(graph, indices=gives, unweighted=True, limit=horizon)
        ticks = walked[:, half + gives] + 1
        mean = least_mean_cycle(ticks)
        # If so, a cycle of walks with one beyond the horizon has a greater mean.
        enough = np.isfinite(mean) and mean + (len(gives) - 1) * (mean - ticks.min()) <= horizon
        if enough or horizon >= 2 * half:  # no walk is longer
            break
        horizon *= 4
    return mean


def least_mean_cycle(lengths: np.ndarray) -> float:
    """The least mean length of an edge over all cycles of a complete graph, by Karp's theorem.

    Args:
        lengths: Float (n, n), from each node to each; inf where there is no edge.
    """
    n = len(lengths)
    walks = np.full((n + 1, n), np.inf)  # the shortest walk of k edges that ends in a node
    walks[0] = 0.0  # from anywhere
    for k in range(n):
        walks[k + 1] = (walks[k][:, None] + lengths).min(axis=0)
    ends = np.isfinite(walks[n])
    if not ends.any():
        return np.inf
    with np.errstate(invalid="ignore"):
        means = (walks[n] - walks[:n]) / (n - np.arange(n))[:, None]
    return float(means[:, ends].max(axis=0).min())
