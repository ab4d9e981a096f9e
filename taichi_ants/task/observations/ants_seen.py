"""The three cells ahead; ants differ from rocks."""

from taichi_ants.task.observations.observation import of_codes


def encode(view):
    """Return the load, then the paper's code of each cell or 4 for an ant, as base-5 digits."""
    index = view.carries
    for k in range(3):
        code = view.codes[k]
        if view.ants[k] != 0:
            code = 4
        index = 5 * index + code
    return index


ANTS_SEEN = of_codes(
    "ants_seen",
    encode,
    ("EOTFA", "EOSQA"),
    summary="the three cells ahead, distinguishing ants from rocks",
    letters="A another ant",
)
