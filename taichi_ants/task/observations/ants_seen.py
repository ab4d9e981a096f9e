"""The three cells ahead; another ant is told from a rock."""

from taichi_ants.task.observations.registry import Observation
from taichi_ants.task.states import name_of_codes


def row(look):
    """The load, then a code of each cell as a digit of base 5: the paper's, and 4 for an ant."""
    index = look.carries
    for k in range(3):
        code = look.codes[k]
        if look.ants[k] != 0:
            code = 4
        index = 5 * index + code
    return index


ANTS_SEEN = Observation(
    "ants_seen",
    2 * 5**3,
    row,
    name_of=name_of_codes(3, "EOTFA", "EOSQA"),
    summary="the three cells ahead, other ants told from rocks",
    letters="A another ant",
    shape=(2, 5, 5, 5),
)
