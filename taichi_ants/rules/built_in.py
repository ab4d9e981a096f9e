"""The built-in rules of each kind: words that the engine implements, and functions.

Functions have the form of the rules that you write, see `taichi_ants.rules.register`. Kernels are
made from them, and the reference calls them. Their docstrings describe models.
"""

from __future__ import annotations

from collections.abc import Callable

WORDS = {
    "choice": ("greedy", "softmax", "deneubourg"),
    "deposit": ("set", "add", "fading", "none"),
    "evaporation": ("linear", "exponential", "none"),
    "reward": ("by_event",),
}
FUNCTIONS: dict[str, tuple[Callable[..., float], ...]] = {}  # by kind
