"""Random worlds with rocks, scattered food items and piles of food."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np

from taichi_ants.errors import AntsError, enough_memory, whole
from taichi_ants.grid.hexgrid import AxialGrid, axial, cube
from taichi_ants.grid.randomness import Stream, choose
from taichi_ants.settings import Setting, checked
from taichi_ants.worlds.validation import parse_ranges
from taichi_ants.worlds.world import World

CLEARING_RADIUS = 3
MAX_SHARE = 0.9  # the largest share of rocks and single food items together among the cells
MAX_DRAWS = 100

_QUEEN = (0, 0, 0)
# Purposes of the streams that draw a world. They are text, so that they differ from the small
# numbers in `constants`. With separate streams, the share of food does not change the rocks.
_STREAM_RANGES = int.from_bytes(b"ranges", "big")
_STREAM_ROCKS = int.from_bytes(b"rocks", "big")
_STREAM_FOOD = int.from_bytes(b"food", "big")
_BATCH_CELLS = 1 << 22  # the most cells under hexagons that are placed at once, to bound memory

Ranges = Annotated[Sequence[int] | None, Setting("size of the world along x, y, z", unit="cells")]
RockShare = Annotated[float, Setting("share of the cells under rocks", least=0, most=MAX_SHARE)]
Piles = Annotated[int, Setting("number of piles of food", most=3)]


@checked
@enough_memory("a world of these ranges")
def open_world(
    seed: int = 0,
    ranges: Ranges = None,
    rock_share: RockShare = 0.15,
    food_share: Annotated[
        float, Setting("single food items as a share of the cells", least=0, most=MAX_SHARE)
    ] = 0.03,
    piles: Annotated[Piles, Setting(least=0)] = 3,
) -> World:
    """Return a random world with rocks, single food items and up to three piles of food.

    The queen is at the origin, and all other cells within distance 3 of her are empty. Rocks are
    hexagons of a random radius from 0 to max(1, min(X, Y, Z) // 20), placed until they cover their
    share of the cells. Pile number k lies on axis k, at three quarters of range k. It is a
    hexagon of radius max(1, range // 16), and replaces rocks. If too few cells are free for the
    share of single food items, all free cells have food. If `ranges` is None, each range is
    drawn from 10 to 100. There are no trails and no listed ants. The same seed gives the same
    world. Raises AntsError if the shares add up to more than 0.9, or if ants could not reach food
    from the queen in any of 100 random worlds.

    >>> worlds.open_world(seed=3, ranges=(8, 8, 8)).ranges
    (8, 8, 8)
    """
    seed = whole("seed", seed)
    if rock_share + food_share > MAX_SHARE:
        raise AntsError(
            f"rock_share {rock_share} and food_share {food_share} add up to more than {MAX_SHARE}; "
            "choose smaller shares, so that ants have space to walk."
        )
    fixed = None if ranges is None else parse_ranges(ranges)
    for attempt in range(MAX_DRAWS):
        words = Stream(seed, _STREAM_RANGES, attempt).bits(3) >> np.uint64(32)
        grid = AxialGrid(fixed or parse_ranges(10 + choose(words, 91)))  # from 10 to 100
        world = _draw(grid, rock_share, food_share, piles, seed, attempt)
        if world.reachable_foods().any():
            return world
    raise AntsError(
        f"in {MAX_DRAWS} open worlds of ranges {fixed or 'drawn at random'}, rock_share "
        f"{rock_share} and food_share {food_share}, no food could be reached from the queen; "
        "choose larger ranges or other shares."
    )


@checked
def far_piles(
    seed: int = 0,
    ranges: Ranges = (30, 30, 30),
    rock_share: RockShare = 0.15,
    piles: Annotated[Piles, Setting(least=1)] = 3,
) -> World:
    """Return an open world, drawn with a seed, in which all food lies in piles far from the queen.

    >>> worlds.far_piles(ranges=(20, 20, 20), piles=1).foods.shape
    (7, 3)
    """
    return open_world(seed, ranges, rock_share, 0.0, piles)


def _draw(
    grid: AxialGrid, rock_share: float, food_share: float, piles: int, seed: int, attempt: int
) -> World:
    rocks = scatter_rocks(grid, rock_share, Stream(seed, _STREAM_ROCKS, attempt))
    food = np.zeros(grid.size, dtype=bool)
    ranges = np.array(grid.ranges)
    if piles:
        radii = np.maximum(1, ranges // 16)
        _, cells = _hexagons(grid, np.diag(3 * ranges // 4)[:piles], radii[:piles])
        food[cells] = True
    rocks &= ~food
    _, clearing = _hexagons(grid, np.array([_QUEEN]), np.array([CLEARING_RADIUS]))
    rocks[clearing] = False
    food[clearing] = False

    free = grid.exists & ~rocks & ~food
    free[clearing] = False
    free_cells = np.flatnonzero(free)
    singles = min(round(food_share * grid.count), len(free_cells))
    # The places of the smallest random words are a sample without replacement.
    if singles:
        words = Stream(seed, _STREAM_FOOD, attempt).bits(len(free_cells))
        food[free_cells[np.argpartition(words, singles - 1)[:singles]]] = True
    return World(
        grid.ranges,
        _QUEEN,
        foods=grid.cells(np.flatnonzero(food)),
        obstacles=grid.cells(np.flatnonzero(rocks)),
    )


def scatter_rocks(grid: AxialGrid, share: float, stream: Stream) -> np.ndarray:
    """Return the cells under random hexagons that together cover `share`, bool (grid.size,).

    Each hexagon takes one draw: the high word for its centre, the low word for its radius. The size
    of batches therefore does not change the result.
    """
    max_radius = max(1, min(grid.ranges) // 20)
    largest = 1 + 3 * max_radius * (max_radius + 1)
    existing = np.flatnonzero(grid.exists).astype(np.int32)
    covered = np.zeros(grid.size, dtype=bool)
    n_covered, target = 0, share * grid.count
    while n_covered < target:
        n_tries = int(2 * (target - n_covered) / largest) + 1
        words = stream.bits(min(n_tries, max(1, _BATCH_CELLS // largest)))
        centres = existing[choose(words >> np.uint64(32), len(existing))]
        radii = choose(words & np.uint64(0xFFFF_FFFF), max_radius + 1)
        rock, cell = _hexagons(grid, grid.cells(centres), radii)
        # A cell counts for the first rock that covers it. The rock that reaches the target is last.
        distinct, first = np.unique(cell, return_index=True)
        gains = np.bincount(rock[first[~covered[distinct]]], minlength=len(words))
        totals = n_covered + np.cumsum(gains)
        last = min(int(np.searchsorted(totals, target)), len(words) - 1)
        covered[cell[rock <= last]] = True
        n_covered = int(totals[last])
    return covered


def _hexagons(
    grid: AxialGrid, centres: np.ndarray, radii: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the existing cells of hexagons, each with its index in `centres` (ascending)."""
    disc = _disc(int(radii.max()))
    sizes = 1 + 3 * radii * (radii + 1)
    hexagon = np.repeat(np.arange(len(radii)), sizes)
    # `disc` is sorted by distance, so a smaller hexagon is the beginning of a larger one.
    rank = np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    cells = cube(axial(centres)[hexagon] + disc[rank])
    inside = (cells < np.array(grid.ranges)).all(axis=1)
    return hexagon[inside], grid.index(cells[inside])


def _disc(radius: int) -> np.ndarray:
    """Return axial steps, int64 (n, 2), to all cells within `radius`, by ascending distance."""
    q, r = np.meshgrid(*[np.arange(-radius, radius + 1)] * 2, indexing="ij")
    steps = np.stack([q.reshape(-1), r.reshape(-1)], axis=1)
    far = cube(steps).max(axis=1)
    order = np.argsort(far, kind="stable")
    return steps[order[: 1 + 3 * radius * (radius + 1)]]
