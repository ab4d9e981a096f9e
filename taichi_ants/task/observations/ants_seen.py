"""The three cells ahead; another ant is told from a rock."""

from taichi_ants.task.observations.registry import Observation
from taichi_ants.task.states import name_of_codes


def encode(view):
    """The load, then a code of each cell as a digit of base 5: the paper's, and 4 for an ant."""
    index = view.carries
    for k in range(3):
        code = view.codes[k]
        if view.ants[k] != 0:
            code = 4
        index = 5 * index + code
    return index


ANTS_SEEN = Observation(
    "ants_seen",
    2 * 5**3,
    encode,
    name_of=name_of_codes(3, "EOTFA", "EOSQA"),
    summary="the three cells ahead, other ants told from rocks",
    letters="A another ant",
    shape=(2, 5, 5, 5),
)
