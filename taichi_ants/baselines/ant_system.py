"""Ant colony optimisation, applied to the shortest path from the queen to food.

- Ant System: M. Dorigo, V. Maniezzo, A. Colorni. Ant system: optimization by a colony of
  cooperating agents. IEEE Transactions on Systems, Man, and Cybernetics, Part B 26 (1996), 29-41.
- MAX-MIN Ant System: T. Stuetzle, H. H. Hoos. MAX-MIN Ant System. Future Generation Computer
  Systems 16 (2000), 889-914.

In each iteration, every ant walks at random from the queen until it reaches food. Its walk without
loops is its *tour*. Pheromone tau is on *arcs*, the steps from a cell to a neighbour. An ant takes
an arc out of its cell with a probability proportional to tau^alpha. It goes straight back only out
of a dead end (as in Dorigo and Stuetzle, Ant Colony Optimization, 2004, section 1.3). After each
iteration all tau decrease by the share rho, and tours of length L add 1 / L to each of their arcs.
There is no heuristic eta, because ants cannot sense where food is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, get_args

import numpy as np

from taichi_ants import runtime
from taichi_ants.baselines.open_cells import open_cells
from taichi_ants.errors import AntsError
from taichi_ants.grid.constants import N_HEADINGS, STREAM_TOUR
from taichi_ants.grid.randomness import stream_state
from taichi_ants.settings import Count, Seed, Setting, checked_arguments
from taichi_ants.worlds.world import World

Method = Literal["ant_system", "max_min"]
METHODS: tuple[str, ...] = get_args(Method)
# Default shares of evaporation, from the papers.
EVAPORATION = {"ant_system": 0.5, "max_min": 0.02}
# MAX-MIN: probability of the best tour after convergence, from the paper.
P_BEST = 0.05
_MAX_ENTRIES = 1 << 28  # elements of each array of tours: a gibibyte


@dataclass(frozen=True)
class Search:
    """Results of colonies, as arrays (colonies, iterations).

    `shortest` is the number of steps from the queen to the nearest food. `best`, int32, is the
    length of the shortest tour in each iteration, 0 if there was none. `mean`, float64, is the mean
    length, NaN if there was none. `lost`, int32, is the number of ants that gave up.
    """

    shortest: int
    best: np.ndarray
    mean: np.ndarray
    lost: np.ndarray

    @property
    def found(self) -> np.ndarray:
        """int64 (colonies,): the first iteration, from 1, with a shortest tour; 0 if none has."""
        hits = self.best == self.shortest
        return np.where(hits.any(axis=1), hits.argmax(axis=1) + 1, 0)


@checked_arguments
def search(
    world: World,
    method: Annotated[Method, Setting()] = "max_min",
    *,
    iterations: Count = 200,
    ants: Count = 32,
    colonies: Count = 20,
    alpha: Annotated[int, Setting(least=1, most=8)] = 1,
    evaporation: Annotated[float | None, Setting(above=0, most=1)] = None,
    max_steps: Count = 100_000,
    seed: Seed = 0,
    threads: int | None = None,
) -> Search:
    """Return results of independent colonies that search for the shortest path.

    Args:
        world: The world; its trails and listed ants have no effect.
        method: "ant_system": all ants deposit. "max_min": the best ant of the iteration deposits,
            and tau stays between bounds that depend on the shortest tour so far.
        iterations, ants: The number of iterations, and of ants in each colony.
        colonies: The number of colonies; more colonies do not change the first ones.
        alpha: The exponent of pheromone in the choice of arcs.
        evaporation: rho; None means 0.5, or 0.02 with "max_min".
        max_steps: The number of steps after which an ant gives up and deposits nothing.

    Raises:
        AntsError: An argument is not allowed, or no food is reachable.
    """
    rho = EVAPORATION[method] if evaporation is None else evaporation
    _, neighbours, is_food, start, shortest = open_cells(world)
    n, n_ants = len(neighbours), colonies * ants
    if n * n_ants > _MAX_ENTRIES:
        raise AntsError(
            f"{colonies} colonies of {ants} ants in a world of {n} open cells need arrays of "
            f"{n * n_ants} entries; at most {_MAX_ENTRIES} are allowed, so choose fewer ants."
        )
    numbers = np.arange(colonies)[:, None] * 2**32 + np.arange(ants)
    states = stream_state(seed, STREAM_TOUR, numbers).reshape(-1)

    runtime.start(threads)
    from taichi_ants.baselines.kernels import lay, walk  # imports Taichi

    tau = np.ones((colonies, N_HEADINGS * n))
    place, tours = np.zeros((2, n_ants, n), np.int32)
    lengths = np.zeros(n_ants, np.int32)
    ways = max(2.0, float((neighbours >= 0).sum(axis=1).mean()) - 1)  # mean choices per cell
    so_far = np.zeros(colonies)  # the shortest tours, 0 for none
    best, lost = np.zeros((2, colonies, iterations), np.int32)
    mean = np.full((colonies, iterations), np.nan)
    with runtime.quiet():
        for i in range(iterations):
            walk(
                *(neighbours, is_food, start, tau, alpha, max_steps),
                *(states, place, tours, lengths),
            )
            by_colony = lengths.reshape(colonies, ants)
            lost[:, i] = (by_colony == 0).sum(axis=1)
            has = lost[:, i] < ants
            now = np.where(has, np.where(by_colony, by_colony, n).min(axis=1), 0)
            best[:, i] = now
            mean[has, i] = by_colony[has].sum(axis=1) / (ants - lost[has, i])
            first = (so_far == 0) & has
            so_far = np.where(first | (has & (now < so_far)), now, so_far)
            start_tau, lowest, highest = _limits(method, rho, ants, ways, so_far)
            tau[first] = start_tau[first, None]
            deposits = np.where(by_colony > 0, 1 / np.maximum(by_colony, 1), 0)
            if method == "max_min":
                winner = by_colony == now[:, None]
                deposits[~(winner & (winner.cumsum(axis=1) == 1))] = 0  # the first one on a tie
            lay(tau, rho, tours, lengths, deposits.reshape(-1), lowest, highest)
    return Search(shortest, best, mean, lost)


def _limits(
    method: str, rho: float, ants: int, ways: float, shortest: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return initial tau and its lower and upper bounds, from the `shortest` tours so far.

    The initial tau is the equilibrium if all ants take that tour. tau is 1 until food is found.
    """
    found = shortest > 0
    length = np.where(found, shortest, 1.0)
    if method == "ant_system":
        return ants / length, np.zeros(len(length)), np.full(len(length), np.inf)
    highest = 1 / (rho * length)
    right = P_BEST ** (1 / length)  # probability of the right choice at one cell
    lowest = np.minimum(highest * (1 - right) / ((ways - 1) * right), highest)
    return highest, np.where(found, lowest, 1), np.where(found, highest, 1)
