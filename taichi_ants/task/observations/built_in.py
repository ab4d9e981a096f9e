"""The observations of the package: functions of a view, and their codes.

All of them return the load, then a code for each cell in view, as digits. A better cell is nearer
to the queen or, for an ant without food, has a stronger trail.
"""

from taichi_ants.task.observations.observation import of_codes


def paper(view):
    """Return the paper's state index."""
    return view.paper_state


def five_cells(view):
    """Return the load, then the paper's codes from behind left to behind right."""
    index = view.carries
    for k in range(5):
        index = 4 * index + view.codes[k]
    return index


def six_cells(view):
    """Return the load, then the paper's codes from behind left clockwise to behind."""
    index = view.carries
    for k in range(6):
        index = 4 * index + view.codes[k]
    return index


def trail_levels(view):
    """Return the load, then a code of each cell ahead.

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


def ants_seen(view):
    """Return the load, then the paper's code of each cell ahead, or 4 for an ant."""
    index = view.carries
    for k in range(3):
        code = view.codes[k]
        if view.ants[k] != 0:
            code = 4
        index = 5 * index + code
    return index


def ants(view):
    """Return the load, then a code of each cell ahead.

    A code is the paper's, or for an ant with the other load 4 on a better cell and 5 otherwise.
    """
    index = view.carries
    for k in range(3):
        code = view.codes[k]
        if view.ants[k] == 2 - view.carries:
            better = view.nearer[k] == 1
            if view.carries == 0:
                better = view.levels[k] > view.own_level
            code = 5
            if better:
                code = 4
        index = 6 * index + code
    return index


def queues(view):
    """Return the load, then a code of each cell ahead: that of `ants`.

    The code is 6 for an ant with the same load on a better cell.
    """
    index = view.carries
    for k in range(3):
        code = view.codes[k]
        if view.ants[k] != 0:
            better = view.nearer[k] == 1
            if view.carries == 0:
                better = view.levels[k] > view.own_level
            if view.ants[k] == 2 - view.carries:
                code = 5
                if better:
                    code = 4
            elif better:
                code = 6
        index = 7 * index + code
    return index


BUILT_IN = (
    of_codes(paper, summary="the three cells ahead, four codes each"),
    of_codes(
        five_cells, cells=(-2, -1, 0, 1, 2), summary="all neighbouring cells except the one behind"
    ),
    of_codes(six_cells, cells=(-2, -1, 0, 1, 2, 3), summary="all neighbouring cells"),
    of_codes(
        trail_levels,
        ("EO123F", "EO--SQ"),
        summary="the three cells ahead, with three strengths of trails",
        letters="1 2 3 trail, from weak to strong",
    ),
    of_codes(
        ants_seen,
        ("EOTFA", "EOSQA"),
        summary="the three cells ahead, distinguishing ants from rocks",
        letters="A another ant",
    ),
    of_codes(
        ants,
        ("EOTFPA", "EOSQPA"),
        summary="the three cells ahead, distinguishing ants with the other load from rocks",
        letters="P ant on a better cell, A ant on a cell that is not better",
    ),
    of_codes(
        queues,
        ("EOTFPAp", "EOSQPAp"),
        summary="like ants, also distinguishing ants with the same load on a better cell",
        letters="P ant with the other load on a better cell, A on a cell that is not better, "
        "p ant with the same load on a better cell",
    ),
)
