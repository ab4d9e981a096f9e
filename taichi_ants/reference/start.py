"""Where the ants stand when an episode starts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from taichi_ants.errors import AntsError
from taichi_ants.grid.constants import N_HEADINGS, STREAM_START_CELL, STREAM_START_HEADING
from taichi_ants.reference.geometry import Cell, distance, existing_cells, listed_cells
from taichi_ants.reference.random_stream import pick, stream_state

if TYPE_CHECKING:
    from taichi_ants.worlds.world import World


def start(world: World, seed: int, n: int = 1, where: str = "nest") -> list[tuple[Cell, int]]:
    """Return cell and heading of each of n ants.

    The ants that the world lists come first. The others take free cells, those nearest to the
    queen if `where` is "nest", any if it is "spread", otherwise in an order that depends on the
    seed; and a heading that depends on the seed.

    Raises:
        AntsError: The world has too few free cells.
    """
    listed = [((x, y, z), heading) for x, y, z, heading in world.ants.tolist()]
    if n <= len(listed):
        return listed[:n]
    taken = {world.queen, *listed_cells(world.foods), *listed_cells(world.obstacles)}
    taken |= {cell for cell, _ in listed}
    free = [
        (
            distance(cell, world.queen) if where == "nest" else 0,
            stream_state(seed, STREAM_START_CELL, number),
            cell,
        )
        for number, cell in enumerate(existing_cells(world.ranges))
        if cell not in taken
    ]
    missing = n - len(listed)
    if missing > len(free):
        raise AntsError(
            f"n is {n}; the world lists {len(listed)} ants and has {len(free)} free cells, "
            "so take fewer ants or a larger world."
        )
    first = [cell for _, _, cell in sorted(free)[:missing]]
    return listed + [
        (cell, pick(stream_state(seed, STREAM_START_HEADING, ant) >> 32, N_HEADINGS))
        for ant, cell in enumerate(first, start=len(listed))
    ]
