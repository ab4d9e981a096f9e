"""The three cells ahead; a trail is weak, middling or strong, relative to the strongest ahead."""

from taichi_ants.task.observations.registry import Observation
from taichi_ants.task.states import name_of_codes


def encode(view):
    """The load, then a code of each cell as a digit of base 6.

    0 empty, 1 obstacle, 2 to 4 a trail of less than a third, of less than two thirds, or of more of
    the strongest ahead; 5 food or queen. For an ant with food 4 is nearer to the queen.
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


TRAIL_LEVELS = Observation(
    "trail_levels",
    2 * 6**3,
    encode,
    name_of=name_of_codes(3, "EO123F", "EO--SQ"),
    summary="the three cells ahead, a trail in three strengths",
    letters="1 2 3 a trail, weak to strong",
    shape=(2, 6, 6, 6),
)
