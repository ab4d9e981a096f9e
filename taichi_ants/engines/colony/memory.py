"""Lays the worlds and ants of a colony out in memory."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.engines.colony.layout import (
    ANT_GROUND,
    AntRow,
    HomeRow,
    Stage,
    SumRow,
    TallyRow,
    WorldRow,
)
from taichi_ants.engines.colony.population import Population
from taichi_ants.engines.packing import compass_of
from taichi_ants.errors import AntsError
from taichi_ants.grid.constants import STREAM_ANT, STREAM_QUEEN
from taichi_ants.grid.randomness import stream_state
from taichi_ants.learners.config import update_weights
from taichi_ants.task import Life
from taichi_ants.task.constants import N_ACTIONS, ROW
from taichi_ants.worlds.world import World

if TYPE_CHECKING:
    from taichi_ants.engines.colony.colony import Colony

_MOST_NUMBERS = 2**31 - 1  # kernels index arrays by 32 bits


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


def allocate(colony: Colony, q_values: np.ndarray | None) -> dict[str, np.ndarray]:
    """All that changes and outlives a tick, before the first episode.

    Raises:
        AntsError: Tables or memories are too large, or `q_values` has not their shape.
    """
    layout, population = colony.layout, colony.population
    seeds = colony.seed_words
    n_worlds, slots = len(seeds), population.slots
    cells = n_worlds * layout.size
    dense, homes = colony.pheromone.dense, layout.homes
    first_streams = np.zeros((n_worlds, slots), np.uint64)
    numbers = np.arange(population.ants, dtype=np.uint64)
    first_streams[:, : population.ants] = stream_state(seeds[:, None], STREAM_ANT, numbers[None, :])
    owners = n_worlds * (slots if colony.one_a_slot else 1)
    memory = colony.memory
    tables = (1 + memory.tables) * colony.task.n_states * ROW
    for size in (tables, memory.floats, memory.integers):
        if owners * size > _MOST_NUMBERS:
            raise AntsError(
                f"{owners} tables, and what learner {colony.training.learner!r} keeps with each, "
                f"take more than {_MOST_NUMBERS} numbers; take fewer ants, worlds or states, or "
                'sharing="shared".'
            )
    return {
        # What a cell holds, and a mark of the ant on it, see `layout`.
        "ground": np.zeros(cells, np.uint8),
        # Integer trails: the clock at which a cell's trail has evaporated.
        "trail": np.zeros(1 if dense else cells, np.int32),
        # Dense trails: the levels.
        "level": np.zeros(cells if dense else 1, np.float32),
        # The column in `homes` of the place whose food lies in a cell, -1.
        "home_of": np.full(cells if homes else 1, -1, np.int32),
        "ants": np.zeros((len(AntRow), n_worlds * slots), np.int32),
        "streams": np.zeros(n_worlds * slots, np.uint64),
        # By world and ant number: where the streams of the ants that start an episode stopped.
        "first_streams": first_streams.reshape(-1),
        "worlds": np.zeros((len(WorldRow), n_worlds), np.int32),
        "queen_streams": np.atleast_1d(stream_state(seeds, STREAM_QUEEN, 0)).astype(np.uint64),
        # Rewards of all ants in this episode.
        "returns": np.zeros(n_worlds, np.int64),
        "homes": np.zeros((len(HomeRow), max(1, n_worlds * homes)), np.int32),
        # By world: where each pile begins in the row HomeRow.LISTED.
        "piles": np.zeros(n_worlds * (homes + 1) + 1, np.int32),
        # By world or slot: the tables, further tables of the learner behind each, and its memory.
        "q": _tables(colony, q_values),
        "floats": np.zeros(max(1, owners * memory.floats), np.float32),
        "integers": np.zeros(max(1, owners * memory.integers), np.int32),
    }


def _tables(colony: Colony, q_values: np.ndarray | None) -> np.ndarray:
    """The tables of all worlds or slots; zeros without values."""
    n_worlds, own = len(colony.seeds), colony.one_a_slot
    slots, n_states = colony.population.slots if own else 1, colony.task.n_states
    q = np.zeros((n_worlds, slots, 1 + colony.memory.tables, n_states, ROW), np.float32)
    if q_values is not None:
        leading, form = q_values.shape[:-2], f"{n_states}, {N_ACTIONS}"
        if leading not in ((), (n_worlds,)) and not (own and leading == (n_worlds, slots)):
            raise AntsError(
                f"q_values has shape {q_values.shape}; give ({form}), ({n_worlds}, {form}) for one "
                f"table a world, or ({n_worlds}, {slots}, {form}) for one a slot, if they are not "
                "shared."
            )
        given = q_values.reshape(*leading, *[1] * (2 - len(leading)), 1, n_states, N_ACTIONS)
        q[..., :N_ACTIONS] = given
    return q.reshape(-1)


def constants(colony: Colony) -> dict[str, np.ndarray]:
    """What worlds and configurations determine, and what is used within a tick alone."""
    layout, chunks = colony.layout, len(colony.seeds) * colony.chunks
    shared = colony.sharing == "shared"
    pairs = colony.task.n_states * N_ACTIONS
    cells = len(colony.seeds) * layout.size
    sums = chunks * pairs if shared else 1
    most_updates = colony.population.slots if shared else 1
    return {
        # 1 for rocks and outside.
        "walls": layout.walls.reshape(-1),
        # A bit for each heading that leads nearer to the queen.
        "closer": layout.closer.reshape(-1),
        "compass": layout.compass,  # see `rules.actions`
        "seeds": colony.seed_words,
        "rewards": colony.task.rewards.by_event(),
        "hyperparameters": np.array([*dict(colony.training.hyperparameters).values(), 0.0]),
        # How far the mean of n errors moves a value, by n.
        "weights": update_weights(colony.training.learning_rate, most_updates),
        # What other ants need to know of the ant on a cell, see `layout`.
        "crowd": np.zeros(cells if colony.task.traffic.shared else 1, np.uint8),
        "spare": np.zeros_like(colony.arrays["level"]),  # the next levels, with diffusion
        "tallies": np.zeros((len(TallyRow), chunks), np.int32),
        # By chunk and pair: fixed-point sums of TD errors, the last error, and see SumRow.
        "sums": np.zeros(sums, np.int64),
        "errors": np.zeros(sums, np.float32),
        "sums_of": np.zeros((len(SumRow), sums), np.int32),
        # By chunk: how many pairs have updates, then which.
        "touched": np.zeros(chunks * (pairs + 1) if shared else 1, np.int32),
    }


def fill_episode(colony: Colony) -> None:
    """Set everything that an episode starts with; tables, memories and streams stay."""
    arrays, layout = colony.arrays, colony.layout
    slots, n = colony.population.slots, colony.population.ants
    n_worlds = len(layout.worlds)
    ground = arrays["ground"].reshape(n_worlds, -1)
    ground[:] = layout.ground
    np.put_along_axis(ground, layout.start_cells.astype(np.int64), ANT_GROUND, axis=1)
    target = "level" if colony.pheromone.dense else "trail"
    arrays[target].reshape(n_worlds, -1)[:] = layout.levels
    arrays["ants"][:] = 0
    ants = arrays["ants"].reshape(len(AntRow), n_worlds, slots)
    ants[AntRow.CELL, :, :n] = layout.start_cells
    ants[AntRow.HEADING, :, :n] = layout.start_headings
    ants[AntRow.STAGE, :, :n] = Stage.LIVING
    ants[AntRow.NUMBER] = -1
    ants[AntRow.NUMBER, :, :n] = np.arange(n)
    ants[AntRow.ACTION] = -1
    streams = arrays["streams"].reshape(n_worlds, slots)
    streams[:, :n] = arrays["first_streams"].reshape(n_worlds, slots)[:, :n]
    worlds = arrays["worlds"]
    worlds[:] = 0
    worlds[WorldRow.RUNNING] = 1
    for row in (WorldRow.TOP, WorldRow.FIRST_VACANT, WorldRow.LIVING, WorldRow.NEXT_NUMBER):
        worlds[row] = n
    worlds[WorldRow.FIRST_DELIVERY] = -1
    worlds[WorldRow.QUEEN_CELL] = layout.queens
    arrays["returns"][:] = 0
    if layout.homes:
        _fill_homes(arrays, layout)


def _fill_homes(arrays: dict[str, np.ndarray], layout: Layout) -> None:
    n_worlds = len(layout.worlds)
    arrays["home_of"][:] = -1
    home_of = arrays["home_of"].reshape(n_worlds, -1)
    for w, (cells, piles) in enumerate(zip(layout.home_cells, layout.home_piles, strict=True)):
        first = w * layout.homes
        rows = arrays["homes"][:, first : first + len(cells)]
        rows[HomeRow.CELL], rows[HomeRow.TAKEN] = cells, -1
        rows[HomeRow.PILE] = piles
        rows[HomeRow.LISTED] = np.argsort(piles, kind="stable")
        home_of[w, cells] = first + np.arange(len(cells))
        arrays["worlds"][WorldRow.HOMES, w] = len(cells)
        arrays["worlds"][WorldRow.PILES, w] = n_piles = int(piles.max(initial=-1)) + 1
        begins = w * (layout.homes + 1)
        counts = np.bincount(piles, minlength=n_piles)
        arrays["piles"][begins : begins + n_piles + 1] = np.concatenate([[0], np.cumsum(counts)])
