"""The paper's codes of five cells: those ahead, behind left and behind right."""

from taichi_ants.task.observations.observation import Observation
from taichi_ants.task.states import name_of_codes

CELLS = (-2, -1, 0, 1, 2)


def encode(view):
    """Return the load, then the codes from behind left to behind right, as base-4 digits."""
    index = view.carries
    for k in range(5):
        index = 4 * index + view.codes[k]
    return index


FIVE_CELLS = Observation(
    "five_cells",
    2 * 4**5,
    encode,
    CELLS,
    name_of_codes(len(CELLS), "EOTF", "EOSQ"),
    "all neighbouring cells except the one behind",
    shape=(2, *[4] * 5),
)
