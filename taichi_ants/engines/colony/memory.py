"""Lays the worlds and ants of a colony out in memory."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.engines.colony.population import Population
from taichi_ants.engines.packing import compass_of
from taichi_ants.errors import AntsError
from taichi_ants.grid.constants import STREAM_ANT, STREAM_QUEEN
from taichi_ants.grid.randomness import stream_state
from taichi_ants.learners.config import update_weights
from taichi_ants.task import Life
from taichi_ants.task.constants import N_ACTIONS, N_STATES
from taichi_ants.worlds.world import World

if TYPE_CHECKING:
    from taichi_ants.engines.colony.colony import Colony

_ROW = 8
_MODEL = N_STATES * N_ACTIONS


class Layout:
    """What stays the same in all episodes: worlds, starts and places of food."""

    def __init__(
        self, worlds: Sequence[World], life: Life, population: Population, seeds: Sequence[int]
    ) -> None:
        grids = {world.ranges for world in worlds}
        if len(grids) > 1:
            raise AntsError(f"the worlds have the ranges {sorted(grids)}; all must have the same.")
        self.worlds = tuple(worlds)
        self.grid = worlds[0].grid
        self.size = self.grid.size
        self.ground = np.stack(self._of_each(World.ground))
        self.levels = np.stack(self._of_each(World.trail_levels))
        self.walls = np.stack(self._of_each(self._walls)).astype(np.uint8)
        self.closer = np.stack(self._of_each(World.closer))
        self.compass = compass_of(self.grid)
        self.queens = np.array([int(self.grid.index(world.queen)) for world in worlds], np.int32)
        starts = [
            world.start(seed, population.ants, population.start)
            for world, seed in zip(worlds, seeds, strict=True)
        ]
        self.start_cells = np.stack([cells for cells, _ in starts])
        self.start_headings = np.stack([headings for _, headings in starts])
        moving = life.regrowth is not None or life.wander is not None
        self.homes = max((len(world.foods) for world in worlds), default=0) if moving else 0
        self.home_cells = self._of_each(lambda world: self.grid.index(world.foods))
        self.home_piles = self._of_each(lambda world: self._piles(self.grid.index(world.foods)))

    def _of_each(self, make: Callable[[World], np.ndarray]) -> list[np.ndarray]:
        """An array for each world, made once for those that are equal."""
        made = {world: make(world) for world in dict.fromkeys(self.worlds)}
        return [made[world] for world in self.worlds]

    def _walls(self, world: World) -> np.ndarray:
        walls = ~self.grid.exists
        walls[self.grid.index(world.obstacles)] = True
        return walls

    def _piles(self, cells: np.ndarray) -> np.ndarray:
        """The pile of each place of food: connected places, numbered in order of their first."""
        if not self.homes:
            return np.zeros(len(cells), np.int32)
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        place = np.full(self.size, -1, np.int64)
        place[cells] = np.arange(len(cells))
        neighbours = place[cells[:, None] + self.grid.offsets[None, :]]
        rows, columns = np.nonzero(neighbours >= 0)
        links = (rows, neighbours[rows, columns])
        graph = coo_array((np.ones(len(rows), np.int8), links), shape=(len(cells),) * 2)
        _, labels = connected_components(graph, directed=False)
        _, first, numbers = np.unique(labels, return_index=True, return_inverse=True)
        return np.argsort(np.argsort(first))[numbers].astype(np.int32)


def allocate(colony: Colony, seeds: np.ndarray, plans: bool, chunks: int) -> dict[str, np.ndarray]:
    """All arrays of `colony_arrays.Arrays` but `q`, before the first episode."""
    from taichi_ants.engines.colony import arrays as names

    layout, population, training = colony.layout, colony.population, colony.training
    sharing = colony.sharing
    n_worlds, slots, size = len(seeds), population.slots, layout.size
    cells = n_worlds * size
    dense, homes = colony.pheromone.dense, layout.homes
    tables = n_worlds * (slots if sharing == "own" else 1)
    shared = sharing == "shared"
    model = tables * _MODEL if plans else 1
    sums = n_worlds * chunks * _MODEL if shared else 1
    first_streams = np.zeros((n_worlds, slots), np.uint64)
    numbers = np.arange(population.ants, dtype=np.uint64)
    first_streams[:, : population.ants] = stream_state(seeds[:, None], STREAM_ANT, numbers[None, :])
    return {
        "ground": np.zeros(cells, np.uint8),
        "trail": np.zeros(1 if dense else cells, np.int32),
        "level": np.zeros(cells if dense else 1, np.float32),
        "spare": np.zeros(cells if dense else 1, np.float32),
        "walls": layout.walls.reshape(-1),
        "closer": layout.closer.reshape(-1),
        "home_of": np.full(cells if homes else 1, -1, np.int32),
        "compass": layout.compass,
        "ants": np.zeros((names.ANT_ROWS, n_worlds * slots), np.int32),
        "streams": np.zeros(n_worlds * slots, np.uint64),
        "first_streams": first_streams.reshape(-1),
        "worlds": np.zeros((names.WORLD_ROWS, n_worlds), np.int32),
        "queen_streams": np.atleast_1d(stream_state(seeds, STREAM_QUEEN, 0)).astype(np.uint64),
        "seeds": seeds.copy(),
        "rewards": colony.task.rewards.by_event(),
        "returns": np.zeros(n_worlds, np.int64),
        "tallies": np.zeros((names.TALLY_ROWS, n_worlds * chunks), np.int32),
        "homes": np.zeros((names.HOME_ROWS, max(1, n_worlds * homes)), np.int32),
        "piles": np.zeros(n_worlds * (homes + 1) + 1, np.int32),
        "rates": np.tile(
            np.array([training.learning_rate, training.discount, 0], np.float32), n_worlds
        ),
        "explore_below": np.zeros(n_worlds, np.uint64),
        "entries": np.zeros(model, np.int32),
        "slots_of": np.zeros(model, np.int32),
        "weights": update_weights(training.learning_rate, slots if shared else 1),
        "sums": np.zeros(sums, np.int64),
        "errors": np.zeros(sums, np.float32),
        "sums_of": np.zeros((names.SUM_ROWS, sums), np.int32),
        "touched": np.zeros(n_worlds * chunks * (_MODEL + 1) if shared else 1, np.int32),
    }


def allocate_tables(
    n_worlds: int, slots: int, own: bool, q_values: np.ndarray | None
) -> np.ndarray:
    """The Q-tables, one a slot if `own`, else one a world, see `Colony`; zeros without values."""
    q = np.zeros((n_worlds, slots if own else 1, N_STATES, _ROW), np.float32)
    if q_values is not None:
        leading = q_values.shape[:-2]
        if leading not in ((), (n_worlds,)) and not (own and leading == (n_worlds, slots)):
            raise AntsError(
                f"q_values has shape {q_values.shape}; give (128, 5), ({n_worlds}, 128, 5) for one "
                f"table a world, or ({n_worlds}, {slots}, 128, 5) for one a slot, if they are not "
                "shared."
            )
        q[..., :N_ACTIONS] = q_values if len(leading) == 2 else q_values[..., None, :, :]
    return q.reshape(-1)


def fill_episode(colony: Colony) -> None:
    """Set everything that an episode starts with; tables, models and streams stay."""
    from taichi_ants.engines.colony import arrays as names

    arrays, layout, epsilon = colony.arrays, colony.layout, colony.epsilon
    slots, n = colony.population.slots, colony.population.ants
    n_worlds = len(layout.worlds)
    ground = arrays["ground"].reshape(n_worlds, -1)
    ground[:] = layout.ground
    np.put_along_axis(ground, layout.start_cells.astype(np.int64), names.ANT_GROUND, axis=1)
    target = "level" if colony.pheromone.dense else "trail"
    arrays[target].reshape(n_worlds, -1)[:] = layout.levels
    visited = arrays["ants"][names.VISITED].copy()
    arrays["ants"][:] = 0
    arrays["ants"][names.VISITED] = visited
    ants = arrays["ants"].reshape(names.ANT_ROWS, n_worlds, slots)
    ants[names.CELL, :, :n] = layout.start_cells
    ants[names.HEADING, :, :n] = layout.start_headings
    ants[names.LIFE, :, :n] = names.LIVING
    ants[names.NUMBER] = -1
    ants[names.NUMBER, :, :n] = np.arange(n)
    ants[names.ACTION] = -1
    streams = arrays["streams"].reshape(n_worlds, slots)
    streams[:, :n] = arrays["first_streams"].reshape(n_worlds, slots)[:, :n]
    model_size = arrays["worlds"][names.MODEL_SIZE].copy()
    worlds = arrays["worlds"]
    worlds[:] = 0
    worlds[names.MODEL_SIZE] = model_size
    worlds[names.RUNNING] = 1
    worlds[names.TOP] = worlds[names.FIRST_VACANT] = worlds[names.LIVING_ANTS] = n
    worlds[names.NEXT_NUMBER] = n
    worlds[names.FIRST_DELIVERY] = -1
    worlds[names.QUEEN_CELL] = layout.queens
    arrays["returns"][:] = 0
    arrays["rates"][2::3] = epsilon
    arrays["explore_below"][:] = int(epsilon * 4294967296.0)
    if layout.homes:
        _fill_homes(arrays, layout)


def _fill_homes(arrays: dict[str, np.ndarray], layout: Layout) -> None:
    from taichi_ants.engines.colony import arrays as names

    n_worlds = len(layout.worlds)
    arrays["home_of"][:] = -1
    home_of = arrays["home_of"].reshape(n_worlds, -1)
    for w, (cells, piles) in enumerate(zip(layout.home_cells, layout.home_piles, strict=True)):
        first = w * layout.homes
        rows = arrays["homes"][:, first : first + len(cells)]
        rows[names.HOME_CELL], rows[names.HOME_TAKEN] = cells, -1
        rows[names.HOME_PILE] = piles
        rows[names.HOME_LISTED] = np.argsort(piles, kind="stable")
        home_of[w, cells] = first + np.arange(len(cells))
        arrays["worlds"][names.HOMES, w] = len(cells)
        arrays["worlds"][names.PILES, w] = n_piles = int(piles.max(initial=-1)) + 1
        begins = w * (layout.homes + 1)
        counts = np.bincount(piles, minlength=n_piles)
        arrays["piles"][begins : begins + n_piles + 1] = np.concatenate([[0], np.cumsum(counts)])
