"""The paper's world."""

from taichi_ants.worlds.world import World


def paper() -> World:
    """Return the paper's world: 271 cells, one food item, and a trail along the whole x axis."""
    return World(
        ranges=(10, 10, 10),
        queen=(0, 9, 9),
        foods=[(9, 0, 0)],
        trails=[((i, 0, 0), 25) for i in range(-8, 9)],
        ants=[((0, 8, 8), 0)],
    )
