"""The paper's codes of five cells: those ahead, behind left and behind right."""

from taichi_ants.task.observations.observation import of_codes


def encode(view):
    """Return the load, then the codes from behind left to behind right, as base-4 digits."""
    index = view.carries
    for k in range(5):
        index = 4 * index + view.codes[k]
    return index


FIVE_CELLS = of_codes(
    "five_cells",
    encode,
    cells=(-2, -1, 0, 1, 2),
    summary="all neighbouring cells except the one behind",
)
