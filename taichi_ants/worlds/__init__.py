"""Worlds and where they come from: the paper, chance, a drawing, or a name for any of these."""

from taichi_ants.worlds.double_bridge import double_bridge
from taichi_ants.worlds.open_world import far_piles, open_world
from taichi_ants.worlds.paper import paper
from taichi_ants.worlds.registry import build, check_seed_counts, is_drawn, names, register
from taichi_ants.worlds.text_map import from_text, load_map, to_text
from taichi_ants.worlds.world import World

__all__ = [
    "World",
    "build",
    "check_seed_counts",
    "double_bridge",
    "far_piles",
    "from_text",
    "is_drawn",
    "load_map",
    "names",
    "open_world",
    "paper",
    "register",
    "to_text",
]

register("paper", lambda seed: paper(), drawn=False)
register("open", open_world)
register("far_piles", far_piles)
register(
    "double_bridge",
    lambda seed, short=23, long=36, mirrored=False, aside=0: double_bridge(
        short, long, mirrored, aside
    ),
    drawn=False,
)
