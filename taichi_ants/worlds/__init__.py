"""Worlds: the paper's, random worlds, the double bridge, text maps, and a registry of names."""

from taichi_ants.worlds.double_bridge import double_bridge
from taichi_ants.worlds.open_world import far_piles, open_world
from taichi_ants.worlds.registry import build, names, paper, register
from taichi_ants.worlds.text_map import from_text, load_map, to_text
from taichi_ants.worlds.world import World

__all__ = [
    "World", "build", "double_bridge", "far_piles", "from_text", "load_map", "names", "open_world",
    "paper", "register", "to_text",
]  # fmt: skip
__dir__ = __all__.copy  # completion lists only public names
