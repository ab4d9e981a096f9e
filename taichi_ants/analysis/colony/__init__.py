"""The scaling study of the colony: its data, the limits, what was found, tables and figures.

Imports no Taichi.
"""

from taichi_ants.analysis.bounds.limits import Limits, limits_of
from taichi_ants.analysis.colony.contrasts import judge_all
from taichi_ants.analysis.colony.findings import Finding, find
from taichi_ants.analysis.colony.study import Arena, ColonyStudy, Condition, Record

__all__ = [
    "Arena",
    "ColonyStudy",
    "Condition",
    "Finding",
    "Limits",
    "Record",
    "find",
    "judge_all",
    "limits_of",
]
