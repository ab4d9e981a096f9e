"""The paper's codes of all six neighbouring cells."""

from taichi_ants.task.observations.observation import Observation
from taichi_ants.task.states import name_of_codes

CELLS = (-2, -1, 0, 1, 2, 3)


def encode(view):
    """Return the load, then the codes from behind left clockwise to behind, as base-4 digits."""
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
    "all neighbouring cells",
    shape=(2, *[4] * 6),
)
