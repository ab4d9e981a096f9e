"""Measures: registered functions of the state of a colony, and their series over time.

`Colony.run(..., measures=("deliveries", "entropy"), every=100)` reads measures. `register` adds
your own. docs/measures.md lists the built-in ones.
"""

from taichi_ants.measures.ants import share_in
from taichi_ants.measures.measure import Measure
from taichi_ants.measures.paths import shortest_path
from taichi_ants.measures.registry import ARRAYS, BUILT_IN, check_part, get, names, register
from taichi_ants.measures.series import Series

__all__ = [
    "ARRAYS",
    "BUILT_IN",
    "Measure",
    "Series",
    "check_part",
    "get",
    "names",
    "register",
    "share_in",
    "shortest_path",
]
__dir__ = __all__.copy  # completion lists only public names
