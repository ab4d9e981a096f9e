"""Where the ants of a world start."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from taichi_ants.errors import AntsError, check_one_of, shown, whole
from taichi_ants.grid.constants import N_HEADINGS, STREAM_START_CELL, STREAM_START_HEADING
from taichi_ants.grid.randomness import choose, stream_state
from taichi_ants.task.constants import EMPTY

if TYPE_CHECKING:
    from taichi_ants.worlds.world import World

Start = Literal["nest", "spread"]
STARTS: tuple[str, ...] = get_args(Start)


def place(world: World, seed: int, n: int, where: str) -> tuple[np.ndarray, np.ndarray]:
    """Flat indices and headings, both int32 (n,), see `World.start`."""
    seed, n = whole("seed", seed), whole("n", n)
    if n < 1:
        raise AntsError(f"n is {shown(n)}; there must be at least 1 ant.")
    check_one_of("where", where, STARTS)
    listed = world.grid.index(world.ants[:n, :3])
    headings = world.ants[:n, 3]
    wanted = n - len(listed)
    if wanted:
        placed = _free_cells(world, seed, wanted, listed, where)
        numbers = np.arange(len(listed), n)
        words = stream_state(seed, STREAM_START_HEADING, numbers) >> np.uint64(32)
        listed = np.concatenate([listed, placed])
        headings = np.concatenate([headings, choose(words, N_HEADINGS)])
    return listed.astype(np.int32), headings.astype(np.int32)


def first_starts(world: World, seeds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cell and heading, int32 (n,), of the first ant by each seed, uint64 (n,), in the nest."""
    if len(world.ants) or not len(seeds):
        listed = world.grid.index(world.ants[:1, :3]), world.ants[:1, 3]
        cells, headings = (np.broadcast_to(one, len(seeds)) for one in listed)
        return cells.astype(np.int32), headings.astype(np.int32)
    free = np.flatnonzero(world.ground() == EMPTY)
    if not len(free):
        place(world, 0, 1, "nest")  # says that there is no room
    distance = world.distances()[free]
    nearest = free[distance == distance.min()]
    numbers = world.grid.number(world.grid.cells(nearest))
    words = stream_state(seeds[:, None], STREAM_START_CELL, numbers[None, :])
    headings = choose(stream_state(seeds, STREAM_START_HEADING, 0) >> np.uint64(32), N_HEADINGS)
    return nearest[words.argmin(axis=1)].astype(np.int32), headings.astype(np.int32)


def _free_cells(world: World, seed: int, n: int, taken: np.ndarray, where: str) -> np.ndarray:
    """The first n free cells by their distance to the queen ("nest" only), then by a hash."""
    free = world.ground() == EMPTY
    free[taken] = False
    index = np.flatnonzero(free)
    if n > len(index):
        raise AntsError(
            f"{shown(n + len(taken))} ants are asked for; this world has room for "
            f"{len(index) + len(taken)}, so ask for fewer ants or choose a larger world."
        )
    if where == "nest":
        distance = world.distances()[index]
        # Only the cells up to the distance at which n are complete need a hash and an order.
        last = np.searchsorted(np.cumsum(np.bincount(distance)), n)
        index, distance = index[distance <= last], distance[distance <= last]
    words = stream_state(seed, STREAM_START_CELL, world.grid.number(world.grid.cells(index)))
    if where == "nest":
        return index[np.lexsort((words, distance))[:n]]
    # The cells of the n smallest words are a sample without replacement.
    first = np.argpartition(words, n - 1)[:n]
    return index[first[np.argsort(words[first])]]
