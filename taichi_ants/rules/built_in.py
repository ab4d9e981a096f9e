"""The built-in rules that are functions; others are words, see `WORDS` in `features/rule.py`.

Functions have the form of the rules that you write, see `taichi_ants.rules.register`. Kernels are
made from them, and the reference calls them. Their docstrings describe models.
"""

from __future__ import annotations

from collections.abc import Callable

FUNCTIONS: dict[str, tuple[Callable[..., float], ...]] = {}  # by kind
