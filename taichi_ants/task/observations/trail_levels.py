"""The three cells ahead; a trail is weak, medium or strong, relative to the strongest ahead."""

from taichi_ants.task.observations.observation import of_codes


def encode(view):
    """Return the load, then a code of each cell, as base-6 digits.

    0 is empty, 1 an obstacle, 5 food or the queen. For an ant without food, 2, 3 and 4 are a trail
    of less than a third, less than two thirds, or more of the strongest ahead. For an ant with
    food, 4 is a cell nearer to the queen.
    """
    index = view.carries
    for k in range(3):
        code = view.codes[k]
        if code == 3:
            code = 5
        elif code != 1:
            level = view.levels[k]
            if view.carries == 1:
                code = 2 * code
            elif level < 1:
                code = 0
            elif level < view.strongest - 2 * level:
                code = 2
            elif level < 2 * (view.strongest - level):
                code = 3
            else:
                code = 4
        index = 6 * index + code
    return index


TRAIL_LEVELS = of_codes(
    "trail_levels",
    encode,
    ("EO123F", "EO--SQ"),
    summary="the three cells ahead, with three strengths of trails",
    letters="1 2 3 trail, from weak to strong",
)
