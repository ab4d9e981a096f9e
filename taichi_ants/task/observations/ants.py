"""The three cells ahead; ants with the other load differ from rocks."""

from taichi_ants.task.observations.observation import of_codes


def encode(view):
    """Return the load, then a code for each cell, as base-6 digits.

    A code is the paper's, or for an ant with the other load 4 on a better cell and 5 otherwise. A
    better cell is nearer to the queen or, for an ant without food, has a stronger trail.
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


ANTS = of_codes(
    "ants",
    encode,
    ("EOTFPA", "EOSQPA"),
    summary="the three cells ahead, distinguishing ants with the other load from rocks",
    letters="P ant on a better cell, A ant on a cell that is not better",
)
