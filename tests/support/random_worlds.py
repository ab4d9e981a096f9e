"""Small random worlds with food, rocks, trails of all strengths, regions, and at most one ant."""

import itertools

import numpy as np

from taichi_ants.errors import AntsError
from taichi_ants.worlds import World


def random_world(seed: int, largest_range: int = 5) -> World:
    """Return the random world of a seed, in which an ant can start."""
    rng = np.random.default_rng(seed)
    while True:
        world = _draw(rng, largest_range)
        if world is not None:
            return world.with_regions(_regions(np.random.default_rng([seed, 12]), world))


def _regions(rng: np.random.Generator, world: World) -> dict[str, object]:
    """Return a region of some cells, and one around a cell; they may overlap."""
    cells = rng.permutation(world.grid.cells(np.flatnonzero(world.grid.exists)))
    disc = {"centre": cells[0].tolist(), "radius": int(rng.integers(3))}
    return {"a": cells[: rng.integers(1, 5)], "b": disc}


def _draw(rng: np.random.Generator, largest_range: int) -> World | None:
    ranges = tuple(int(n) for n in rng.integers(1, largest_range + 1, 3))
    cells = [c for c in itertools.product(*map(range, ranges)) if min(c) == 0]
    if len(cells) < 3:
        return None
    cells = [cells[i] for i in rng.permutation(len(cells))]
    kinds = rng.choice(["empty", "food", "rock"], len(cells), p=rng.choice(_SHARES))
    kinds[0], kinds[1] = "queen", "empty"
    empty = [cell for cell, kind in zip(cells, kinds, strict=True) if kind == "empty"]
    open_to_trail = [cell for cell, kind in zip(cells, kinds, strict=True) if kind != "rock"]
    levels = rng.choice([0, 1, 2, 3, 5, 12, 25, 100, 124, 125, 126, 250, 400], len(open_to_trail))
    has_trail = rng.random(len(open_to_trail)) < rng.choice([0.0, 0.3, 0.9])
    ants = [(empty[0], int(rng.integers(6)))] if rng.random() < 0.7 else []
    try:
        world = World(
            ranges=ranges,
            queen=cells[0],
            foods=[c for c, kind in zip(cells, kinds, strict=True) if kind == "food"],
            obstacles=[c for c, kind in zip(cells, kinds, strict=True) if kind == "rock"],
            trails=[
                (cell, int(level))
                for cell, level, has in zip(open_to_trail, levels, has_trail, strict=True)
                if has
            ],
            ants=ants,
        )
        world.start(0)
    except AntsError:
        return None
    return world if len(world.foods) else None


# Shares of empty cells, food and rocks: open, full of food, full of rocks.
_SHARES = np.array([[0.9, 0.08, 0.02], [0.5, 0.45, 0.05], [0.55, 0.1, 0.35]])
