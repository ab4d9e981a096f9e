"""Measures: registered functions of the state of a colony or of finished runs, and their series.

`Colony.run(..., measures=("deliveries", "entropy"), every=100)` reads measures. `register` adds
your own. docs/reference/measures.md lists the built-in ones.
"""

from taichi_ants.measures.built_in import BUILT_IN, shortest_path
from taichi_ants.measures.finished import Run
from taichi_ants.measures.measure import Measure, get, names, register
from taichi_ants.measures.series import Series

__all__ = ["BUILT_IN", "Measure", "Run", "Series", "get", "names", "register", "shortest_path"]
__dir__ = __all__.copy  # completion lists only public names
