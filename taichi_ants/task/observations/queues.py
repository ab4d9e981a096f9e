"""The three cells ahead; ants differ from rocks, and ants worth following from other ants."""

from taichi_ants.task.observations.observation import of_codes


def encode(view):
    """Return the load, then a code of each cell, as base-7 digits.

    Codes are those of `ants`, and 6 for an ant with the same load on a better cell.
    """
    index = view.carries
    for k in range(3):
        code = view.codes[k]
        if view.ants[k] != 0:
            better = view.nearer[k] == 1
            if view.carries == 0:
                better = view.levels[k] > view.own_level
            if view.ants[k] == 2 - view.carries:
                code = 5
                if better:
                    code = 4
            elif better:
                code = 6
        index = 7 * index + code
    return index


QUEUES = of_codes(
    "queues",
    encode,
    ("EOTFPAp", "EOSQPAp"),
    summary="like ants, also distinguishing ants with the same load on a better cell",
    letters=(
        "P ant with the other load on a better cell, A on a cell that is not better, "
        "p ant with the same load on a better cell"
    ),
)
