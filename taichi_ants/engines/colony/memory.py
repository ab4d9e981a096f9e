"""Lays the worlds and ants of a colony out in memory."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.engines.colony.layout import (
    ANT_GROUND,
    FIRST_TRAIT,
    TALLY_WIDTH,
    AntRow,
    HomeRow,
    Order,
    Stage,
    SumRow,
    WorldRow,
)
from taichi_ants.engines.looks import is_percept
from taichi_ants.engines.packing import compass_of
from taichi_ants.errors import AntsError
from taichi_ants.grid.constants import STREAM_ANT, STREAM_QUEEN
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.grid.randomness import stream_state
from taichi_ants.learners.config import update_weights
from taichi_ants.task.constants import N_ACTIONS, ROW
from taichi_ants.worlds.world import World

if TYPE_CHECKING:
    from taichi_ants.engines.colony.colony import Colony

Which = slice | np.ndarray
ALL = slice(None)  # the worlds, where a bool (W,) would name some
_MOST_NUMBERS = 2**31 - 1  # kernels index arrays by 32 bits
_PLACES = ("cells", "headings")  # what is said of ants at the start


def start_of_episode(colony: Colony) -> dict[str, np.ndarray]:
    """What each episode begins with, as short as it can be said; see `set_to_start`.

    Raises:
        AntsError: A world has too few free cells for the ants.
    """
    worlds, n = colony.worlds, colony.ants
    starts = [
        world.start(seed, n, colony.start) for world, seed in zip(worlds, colony.seeds, strict=True)
    ]
    cells = np.stack([cells for cells, _ in starts])
    ground = _of_each(colony, World.ground)
    np.put_along_axis(ground, cells.astype(np.int64), ANT_GROUND, axis=1)
    levels, dense = _of_each(colony, World.trail_levels), colony.pheromone.dense
    levels = levels if levels.any() else levels[:, :1].copy()  # all cells begin alike
    rows = np.zeros((len(WorldRow), len(worlds)), np.int32)
    rows[WorldRow.RUNNING] = 1
    for row in (WorldRow.TOP, WorldRow.FIRST_VACANT, WorldRow.LIVING, WorldRow.NEXT_NUMBER):
        rows[row] = n
    rows[WorldRow.FIRST_DELIVERY] = -1
    rows[WorldRow.QUEEN_CELL] = [int(colony.grid.index(world.queen)) for world in worlds]
    return {
        # Where the ants start, by world and number.
        "cells": cells,
        "headings": np.array([headings for _, headings in starts], np.int8),
        # What a cell holds, and a mark of the ant on it, see `layout`.
        "ground": ground.reshape(-1),
        # Integer trails: the clock at which a cell's trail has evaporated; dense ones: the levels.
        "level" if dense else "trail": levels.reshape(-1),
        "worlds": rows,
        # Rewards of all ants in this episode.
        "returns": np.zeros(len(worlds), np.int64),
        **homes_arrays(colony, rows, _homes_at_start(colony) if colony.n_homes else ()),
    }


def of_episode(colony: Colony) -> dict[str, np.ndarray]:
    """Room for what changes in an episode, as it is at the start of one."""
    n_worlds, dense = len(colony.worlds), colony.pheromone.dense
    slots, cells = n_worlds * colony.capacity, n_worlds * colony.grid.size
    start = {name: array.copy() for name, array in colony.at_start.items() if name not in _PLACES}
    sees_more = not is_percept(colony.task.sees)
    n_rows = FIRST_TRAIT if colony.ants_change else AntRow.AGE if sees_more else AntRow.STATE
    n_traits = (len(AntRow) if colony.draws_ahead else AntRow.NEXT_ACTION) - FIRST_TRAIT
    made = {
        **start,
        "trail": np.zeros(1 if dense else cells, np.int32),
        "level": np.zeros(cells if dense else 1, np.float32),
        "ants": np.zeros((n_rows, slots), np.int32),
        "traits": np.zeros((n_traits, slots), np.int8),
    }
    set_to_start(colony, made)
    return made


def set_to_start(colony: Colony, arrays: dict[str, np.ndarray], which: Which = ALL) -> None:
    """Set what changes in an episode of these worlds to its start."""
    start, n_worlds = colony.at_start, len(colony.worlds)
    copy_worlds(
        arrays,
        {name: array for name, array in start.items() if name not in _PLACES},
        n_worlds,
        which,
    )
    ants = arrays["ants"].reshape(-1, n_worlds, colony.capacity)
    traits = arrays["traits"].reshape(-1, n_worlds, colony.capacity)
    ants[:, which] = traits[:, which] = 0
    ants[AntRow.NUMBER, which], traits[AntRow.ACTION - FIRST_TRAIT :, which] = -1, -1
    n = start["cells"].shape[1]
    ants[AntRow.CELL][which, :n] = start["cells"][which]
    ants[AntRow.NUMBER][which, :n] = np.arange(n)
    traits[AntRow.HEADING - FIRST_TRAIT][which, :n] = start["headings"][which]
    traits[AntRow.STAGE - FIRST_TRAIT][which, :n] = Stage.LIVING


def _homes_at_start(colony: Colony) -> Iterator[np.ndarray]:
    """What `homes_arrays` needs of each world: a home for each of its foods."""
    for world in colony.worlds:
        cells = colony.grid.index(world.foods)
        yield np.stack([cells, np.full(len(cells), -1), _piles(colony.grid, cells)])


def homes_arrays(
    colony: Colony, rows: np.ndarray, homes_of: Iterable[np.ndarray]
) -> dict[str, np.ndarray]:
    """The homes of all foods and their piles.

    Args:
        colony: Its `n_homes` is the room for homes in each world.
        rows: By `WorldRow`; the numbers of homes and piles are put into it.
        homes_of: Of each world its homes (3, n): HomeRow.CELL, TAKEN and PILE.
    """
    most, n_worlds, size = colony.n_homes, len(colony.worlds), colony.grid.size
    homes = np.zeros((len(HomeRow), max(1, n_worlds * most)), np.int32)
    begins = np.zeros((n_worlds, most + 1), np.int32)
    homes[HomeRow.TAKEN] = -1
    home_of = np.full(n_worlds * size if most else 1, -1, np.int32)
    for w, (cells, taken, piles) in enumerate(homes_of):
        n_piles = int(piles.max(initial=-1)) + 1
        of_world = homes[:, w * most : w * most + len(cells)]
        of_world[HomeRow.CELL], of_world[HomeRow.TAKEN] = cells, taken
        of_world[HomeRow.PILE], of_world[HomeRow.LISTED] = piles, np.argsort(piles, kind="stable")
        begins[w, 1 : n_piles + 1] = np.cumsum(np.bincount(piles, minlength=n_piles))
        rows[WorldRow.HOMES, w], rows[WorldRow.PILES, w] = len(cells), n_piles
        (full,) = np.nonzero(taken < 0)
        home_of[w * size + cells[full]] = w * most + full
    return {
        "homes": homes,
        # By world: where each pile begins in the row HomeRow.LISTED.
        "piles": begins.reshape(-1),
        # The column in `homes` whose food lies in a cell, -1.
        "home_of": home_of,
    }


def _piles(grid: AxialGrid, cells: np.ndarray) -> np.ndarray:
    """The pile of each food: connected cells, numbered in order of their first."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    place = np.full(grid.size, -1, np.int64)
    place[cells] = np.arange(len(cells))
    neighbours = place[cells[:, None] + grid.offsets[None, :]]
    rows, columns = np.nonzero(neighbours >= 0)
    links = (rows, neighbours[rows, columns])
    graph = coo_array((np.ones(len(rows), np.int8), links), shape=(len(cells),) * 2)
    _, labels = connected_components(graph, directed=False)
    _, first, numbers = np.unique(labels, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[numbers].astype(np.int32)


def lasting(colony: Colony, q_values: np.ndarray | None) -> dict[str, np.ndarray]:
    """What outlives an episode.

    Raises:
        AntsError: Tables or memories are too large, or `q_values` has not their shape.
    """
    slots, memory, n_worlds = colony.capacity, colony.memory, len(colony.seeds)
    owners = n_worlds * (slots if colony.one_a_slot else 1)
    sizes = ((1 + memory.tables) * colony.task.n_states * ROW, memory.floats, memory.integers)
    if owners * max(sizes) > _MOST_NUMBERS:
        raise AntsError(
            f"{owners} tables, and what learner {colony.training.learner!r} keeps with each, "
            f"take more than {_MOST_NUMBERS} numbers; take fewer ants, worlds or states, or "
            'make sharing "shared".'
        )
    return {
        "streams": np.zeros(n_worlds * slots, np.uint64),
        **seeded(colony),
        # By world or slot: the tables, further tables of the learner behind each, and its memory.
        "q": _tables(colony, q_values),
        "floats": np.zeros(max(1, owners * memory.floats), np.float32),
        "integers": np.zeros(max(1, owners * memory.integers), np.int32),
    }


def seeded(colony: Colony) -> dict[str, np.ndarray]:
    """What a life begins with, by the seeds of the worlds, and goes on through its episodes."""
    seeds, n_worlds = colony.seed_words, len(colony.seeds)
    numbers = np.arange(colony.capacity, dtype=np.uint64)  # more ants may start later episodes
    first_streams = stream_state(seeds[:, None], STREAM_ANT, numbers[None, :])
    return {
        # By world and ant number: where the streams of the ants that start an episode stopped.
        "first_streams": first_streams.reshape(-1),
        "queen_streams": np.atleast_1d(stream_state(seeds, STREAM_QUEEN, 0)).astype(np.uint64),
        "episodes": np.full(n_worlds, -1, np.int32),  # the number of the present one
    }


def _tables(colony: Colony, q_values: np.ndarray | None) -> np.ndarray:
    """The tables of all worlds or slots; the initial value everywhere without values."""
    n_worlds, own = len(colony.seeds), colony.one_a_slot
    slots, n_states = colony.capacity if own else 1, colony.task.n_states
    q = np.zeros((n_worlds, slots, 1 + colony.memory.tables, n_states, ROW), np.float32)
    q[..., :N_ACTIONS] = colony.training.initial_value
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
    """What worlds and settings determine, and what is used within a tick alone."""
    chunks, shared = len(colony.seeds) * colony.chunks, colony.sharing == "shared"
    pairs = colony.task.n_states * ROW if shared else 0
    sums, cells = max(1, chunks * pairs), len(colony.seeds) * colony.grid.size
    return {
        # 1 for rocks and outside.
        "walls": _of_each(colony, _walls).reshape(-1),
        # A bit for each heading that leads nearer to the queen.
        "closer": _of_each(colony, World.closer).reshape(-1),
        "compass": compass_of(colony.grid),  # see `rules.actions`
        "seeds": colony.seed_words,
        "rewards": colony.task.rewards.by_event(),
        "hyperparameters": np.array([*dict(colony.training.hyperparameters).values(), 0.0]),
        # How far the mean of n errors moves a value, by n; see `set_learning_rate`.
        "weights": np.zeros(2, np.float32),
        # What the ant on a cell wants, see `layout`.
        "wants": np.zeros(cells, np.uint8),
        "spare": np.zeros_like(colony.arrays["level"]),  # the next levels, with diffusion
        "orders": np.ones(len(Order), np.int32),
        # How often members of a team have come to a meeting.
        "come": np.zeros(1, np.int64),
        "tallies": np.zeros(chunks * TALLY_WIDTH, np.int64),
        # By chunk and pair: fixed-point sums of TD errors, the last error, and see SumRow.
        "sums": np.zeros(sums, np.int64),
        "errors": np.zeros(sums, np.float32),
        "sums_of": np.zeros((len(SumRow), sums), np.int32),
        # By chunk: how many pairs have updates, then which.
        "touched": np.zeros(chunks * (pairs + 1), np.int32),
    }


def _walls(world: World) -> np.ndarray:
    walls = ~world.grid.exists
    walls[world.grid.index(world.obstacles)] = True
    return walls.astype(np.uint8)


def _of_each(colony: Colony, make: Callable[[World], np.ndarray]) -> np.ndarray:
    """An array for each world, made once for those that are equal."""
    made = {world: make(world) for world in dict.fromkeys(colony.worlds)}
    return np.stack([made[world] for world in colony.worlds])


def set_learning_rate(colony: Colony) -> None:
    """Set what follows from the learning rate of the episode."""
    most = colony.capacity if colony.sharing == "shared" else 1
    weights, kept = update_weights(colony.learning_rate, most), colony.arrays["weights"]
    if len(weights) > len(kept):  # seldom: Taichi keeps some bytes for good of each array
        kept = colony.arrays["weights"] = np.empty(min(2 * len(weights), most + 1), np.float32)
    kept[: len(weights)], kept[len(weights) :] = weights, weights[-1]


def begin_episode(colony: Colony, which: Which = ALL) -> None:
    """Set everything that an episode of these worlds starts with; tables, memories, streams go on.

    Args:
        which: bool (W,).
    """
    arrays = colony.arrays
    set_learning_rate(colony)
    set_to_start(colony, arrays, which)
    copy_worlds(arrays, {"streams": arrays["first_streams"]}, len(colony.seeds), which)
    arrays["episodes"][which] += 1


def copy_worlds(
    into: dict[str, np.ndarray], source: dict[str, np.ndarray], n_worlds: int, which: Which
) -> None:
    """Copy what belongs to some of the worlds, which lie one after another in the last axis."""
    for name, array in source.items():
        if array.shape[-1] % n_worlds == 0:  # others are not in use
            shape = (*array.shape[:-1], n_worlds, -1)
            into[name].reshape(shape)[..., which, :] = array.reshape(shape)[..., which, :]


def keep_streams(colony: Colony, which: Which = ALL) -> None:
    """At the end of an episode of these worlds, keep the streams of the ants that started it."""
    slots, number = colony.capacity, colony.of_ants(AntRow.NUMBER)
    ours = np.zeros((len(colony.seeds), slots), bool)
    ours[which] = True
    there = (colony.of_ants(AntRow.STAGE) != Stage.VACANT) & ours.reshape(-1)
    (columns,) = np.nonzero(there & (number >= 0) & (number < colony.ants))
    places = columns // slots * slots + number[columns]
    colony.arrays["first_streams"][places] = colony.arrays["streams"][columns]
