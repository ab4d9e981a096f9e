"""The three cells ahead; ants are told from rocks, and those worth following from others."""

from taichi_ants.task.observations.registry import Observation
from taichi_ants.task.states import name_of_codes


def row(look):
    """The load, then a code of each cell as a digit of base 7.

    As `ants`, and 6 for an ant with the same load on a better cell.
    """
    index = look.carries
    for k in range(3):
        code = look.codes[k]
        if look.ants[k] != 0:
            better = look.nearer[k] == 1
            if look.carries == 0:
                better = look.levels[k] > look.own_level
            if look.ants[k] == 2 - look.carries:
                code = 5
                if better:
                    code = 4
            elif better:
                code = 6
        index = 7 * index + code
    return index


QUEUES = Observation(
    "queues",
    2 * 7**3,
    row,
    name_of=name_of_codes(3, "EOTFPAp", "EOSQPAp"),
    summary="as ants; also ants with the same load on a better cell",
    letters="P other load, p same load: ant on a better cell, A ant on no better one",
    shape=(2, 7, 7, 7),
)
