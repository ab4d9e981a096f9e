"""The paper's codes, in all six cells around."""

from taichi_ants.task.observations.registry import Observation
from taichi_ants.task.states import name_of_codes

CELLS = (-2, -1, 0, 1, 2, 3)


def encode(view):
    """The load, then the codes from behind left to behind right and behind, as digits of base 4."""
    index = view.carries
    for k in range(6):
        index = 4 * index + view.codes[k]
    return index


SIX_CELLS = Observation(
    "six_cells",
    2 * 4**6,
    encode,
    CELLS,
    name_of_codes(len(CELLS), "EOTF", "EOSQ"),
    "all cells around",
    shape=(2, *[4] * 6),
)
