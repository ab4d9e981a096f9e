"""The world of the paper."""

from __future__ import annotations

from taichi_ants.worlds.world import World


def paper() -> World:
    """The paper's world: 271 cells, one food, and a trail along the x axis from end to end."""
    return World(
        ranges=(10, 10, 10),
        queen=(0, 9, 9),
        foods=[(9, 0, 0)],
        trails=[((i, 0, 0), 25) for i in range(-8, 9)],
        ants=[((0, 8, 8), 0)],
    )
