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

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from taichi_ants.analysis.bounds.transitions import look_around
from taichi_ants.task.constants import EMPTY, QUEEN
from taichi_ants.worlds.geometry import walkable
from taichi_ants.worlds.world import World

TICKS_A_CELL = 3
TICKS_A_CELL_BESIDE_QUEEN = 2
_FIRST_HORIZON = 64


@dataclass(frozen=True)
class Limits:
    """The limits of one world; inf or 0 where nothing can be delivered.

    Attributes:
        first: Ticks to the first delivery of one ant alone, from its start.
        cycle: Ticks from one delivery to the next of one ant alone, in the long run.
        crowd_cycle: The same of an ant that can turn on the spot everywhere.
        food: Foods that can be taken, per 1000 ticks.
        queen: Foods that can be given, per 1000 ticks.
    """

    first: float
    cycle: float
    crowd_cycle: float
    food: float
    queen: float

    def deliveries(self, ants: int) -> float:
        """The most that so many ants can deliver per 1000 ticks in the long run."""
        cycle = self.cycle if ants == 1 else self.crowd_cycle
        return min(ants * 1000 / cycle, self.food, self.queen)


def limits_of(world: World, seed: int = 0, regrowth: int = 0) -> Limits:
    """The limits of a world.

    Args:
        world: The world.
        seed: Where and how one ant starts.
        regrowth: Ticks until a food grows back; of the food's limit alone, the cycles are those
            of food that grows back at once.
    """
    alone, crowd = _Walks(world, can_stay=False), _Walks(world, can_stay=True)
    cells, headings = world.start(seed, 1)
    return Limits(
        first=alone.first_delivery(int(cells[0]), int(headings[0])),
        cycle=alone.cycle(),
        crowd_cycle=crowd.cycle(),
        food=food_limit(world, regrowth),
        queen=queen_limit(world),
    )


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
    source_edges = (np.zeros(len(foods), int), 1 + np.arange(len(foods)))
    sink_edges = (first_cell + np.arange(len(cells)), np.full(len(cells), sink))
    rows = np.concatenate([source_edges[0], 1 + food, sink_edges[0]])
    columns = np.concatenate([source_edges[1], first_cell + cell, sink_edges[1]])
    most = np.concatenate(
        [
            np.full(len(foods), unit // (regrowth + 1)),
            np.full(len(food), unit // TICKS_A_CELL),
            per_cell,
        ]
    ).astype(np.int32)
    graph = coo_array((most, (rows, columns)), shape=(sink + 1, sink + 1)).tocsr()
    return 1000 * int(maximum_flow(graph, 0, sink).flow_value) / unit


def queen_limit(world: World) -> float:
    """The most foods that can be given per 1000 ticks."""
    around = int(world.grid.index(world.queen)) + world.grid.offsets
    return 1000 * int(_reachable(world)[around].sum()) / TICKS_A_CELL


def _reachable(world: World) -> np.ndarray:
    """bool (grid.size,): empty cells to which a way over empty cells leads from the queen."""
    return walkable(world.grid, world.ground(), world.grid.index(world.queen) + world.grid.offsets)


class _Walks:
    """Shortest walks of an ant between deliveries, as paths in a graph.

    A node is (carrying, heading, cell); edges are moves, blocked or not, and pick-ups. A delivery
    leaves the ant where it is, so it is the end of one walk and the start of the next.

    Args:
        world: The world; its ground stays as it is.
        can_stay: Whether a move can also turn the ant on the spot where nothing is in its way.
    """

    def __init__(self, world: World, can_stay: bool) -> None:
        from scipy.sparse import coo_array

        around = look_around(world)
        self._cells, self._half = around.cells, around.n_states
        moves = [around.moves(around.empty)]
        if can_stay:
            moves.append(around.moves(np.zeros_like(around.empty)))
        states = np.arange(self._half)
        walks = [np.stack([states, move]) for move in np.concatenate(moves)]
        picks = around.sees(around.food)
        pick_ups = np.stack([picks, around.turned_round(picks) + self._half])
        rows, columns = np.concatenate(
            [*walks, *[walk + self._half for walk in walks], pick_ups], axis=1
        )
        ones, size = np.ones(len(rows), np.int8), 2 * self._half
        self._graph = coo_array((ones, (rows, columns)), shape=(size, size)).tocsr()
        # Where a carrying ant can give; no ant comes to a cell that holds food.
        gives = around.sees(around.queen)
        self._gives = gives[world.ground()[self._cells[gives % len(self._cells)]] == EMPTY]

    def first_delivery(self, cell: int, heading: int) -> float:
        """Ticks to a delivery of an ant that starts on a cell (flat index) without food."""
        start = heading * len(self._cells) + int(np.searchsorted(self._cells, cell))
        for horizon in self._horizons():
            ticks = self._to_deliveries([start], horizon).min(initial=np.inf)
            if np.isfinite(ticks):
                return float(ticks)
        return np.inf

    def cycle(self) -> float:
        """The least mean number of ticks from one delivery to the next, inf if there is no way."""
        n = len(self._gives)
        for horizon in self._horizons() if n else ():
            ticks = self._to_deliveries(self._gives, horizon)
            mean = least_mean_cycle(ticks)
            # If so, a cycle of up to n walks with one beyond the horizon has a greater mean.
            if np.isfinite(mean) and mean + (n - 1) * (mean - ticks.min()) <= horizon:
                return mean
        return np.inf

    def _horizons(self) -> Iterator[int]:
        """Lengths up to which to search for walks: short ones are quick, and mostly enough."""
        horizon = _FIRST_HORIZON
        while horizon < 2 * self._half:
            yield horizon
            horizon *= 4
        yield 2 * self._half

    def _to_deliveries(self, starts: np.ndarray | list[int], horizon: int) -> np.ndarray:
        """Ticks (starts, gives) from states without food to each state after a delivery."""
        from scipy.sparse.csgraph import dijkstra

        steps = dijkstra(self._graph, indices=starts, unweighted=True, limit=horizon)
        return steps[:, self._half + self._gives] + 1


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
