"""The paper's codes of all six neighbouring cells."""

from taichi_ants.task.observations.observation import of_codes


def encode(view):
    """Return the load, then the codes from behind left clockwise to behind, as base-4 digits."""
    index = view.carries
    for k in range(6):
        index = 4 * index + view.codes[k]
    return index


SIX_CELLS = of_codes(
    "six_cells", encode, cells=(-2, -1, 0, 1, 2, 3), summary="all neighbouring cells"
)
