"""The three cells ahead; an ant with the other load is told from a rock."""

from taichi_ants.task.observations.registry import Observation
from taichi_ants.task.states import name_of_codes


def encode(view):
    """The load, then a code of each cell as a digit of base 6: the paper's, 4 or 5 for other loads.

    4 is an ant on a better cell: nearer to the queen, or without food with a stronger trail.
    """
    index = view.carries
    for k in range(3):
        code = view.codes[k]
        if view.ants[k] == 2 - view.carries:
            better = view.nearer[k] == 1
            if view.carries == 0:
                better = view.levels[k] > view.own_level
            code = 5
            if better:
                code = 4
        index = 6 * index + code
    return index


ANTS = Observation(
    "ants",
    2 * 6**3,
    encode,
    name_of=name_of_codes(3, "EOTFPA", "EOSQPA"),
    summary="the three cells ahead, ants with the other load told from rocks",
    letters="P ant on a better cell, A ant on no better one",
    shape=(2, 6, 6, 6),
)
