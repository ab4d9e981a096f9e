"""The paper's state of an ant, 0 to 127: its load and the codes of the three cells ahead.

The hooks `see` of features let ants see cells differently.
"""

from typing import Any

import taichi as ti

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.kernel_functions import while_compiling
from taichi_ants.task.constants import EMPTY, SEES_CUE, SEES_OBSTACLE

DEAD_END = SEES_OBSTACLE << 4 | SEES_OBSTACLE << 2 | SEES_OBSTACLE  # of an ant without food


@ti.func
def see_by_level(half: ti.template(), code, level, strongest):
    """Return the code of a cell for an ant that follows a pheromone; `code` is 0 if it is empty.

    An empty cell shows a cue if its `level` is at least 1 and at least the `strongest` in view, or
    half of it if `half`. The level of cells that are not empty is 0 or less.
    """
    shows_cue = 0
    if ti.static(half):
        shows_cue = ti.cast(2 * level >= ti.max(strongest, 2), ti.i32)
    else:
        shows_cue = ti.cast(level >= ti.max(strongest, 1), ti.i32)
    return code | shows_cue * SEES_CUE


@ti.func
def see_carrying(ground, nearer):
    """Return the code of a cell for an ant with food; `nearer` is 1 if nearer to the queen."""
    return ground >> 2 | (ti.cast(ground == EMPTY, ti.i32) & nearer) * SEES_CUE


@ti.func
def paper_state_by_level(
    half: ti.template(), carries: ti.template(), left, forward, right,
    trail_left, trail_forward, trail_right, strongest,
):  # fmt: skip
    """Return the paper's state of an ant that follows a pheromone, by three contents and levels."""
    shift = ti.static(2 * carries)
    return state_index(
        carries,
        see_by_level(half, left >> shift & 3, trail_left, strongest),
        see_by_level(half, forward >> shift & 3, trail_forward, strongest),
        see_by_level(half, right >> shift & 3, trail_right, strongest),
    )


@ti.func
def paper_state_carrying(left, forward, right, nearer):
    """Return the paper's state of an ant with food; `nearer` is the result of `nearer_from`."""
    return state_index(
        1,
        see_carrying(left, nearer >> (N_HEADINGS - 1) & 1),
        see_carrying(forward, nearer & 1),
        see_carrying(right, nearer >> 1 & 1),
    )


@ti.func
def nearer_from(closer, heading):
    """Return a bit for each neighbour, clockwise from the one forward: 1 if nearer to the queen.

    `closer` has a bit for each heading, starting with heading 0.
    """
    # Repeating the six bits avoids a wrap-around.
    nearer = ti.cast(closer, ti.i32)
    return (nearer | nearer << N_HEADINGS) >> heading


@ti.func
def state_index(carries, left, forward, right):
    """Return the index of a state, 0 to 127."""
    return ((carries << 2 | left) << 2 | forward) << 2 | right


@ti.func
def code_in_view(state, position):
    """Return the code at position 0 (left), 1 (forward) or 2 (right) of a state.

    At the positions 3 and 4, which are the actions that do not move, the code is 0.
    """
    return state << (2 * position) >> 4 & 3


@ti.func
def goals_as_seen(state):
    """Return the bits of a state that are set where the code is that of food or queen."""
    return state & (state >> 1) & 21


@ti.func
def goals_in_view(state):
    """Return a bit for each cell in view that is food or queen: 0 left, 1 forward, 2 right."""
    both = state & (state >> 1)  # bits 4, 2 and 0 are set where a code is 3
    return (both >> 4) & 1 | (both >> 1) & 2 | (both & 1) << 2


@ti.func
def seen_code(code, random_state, hooks: ti.template(), ant: ti.template()):
    """Return the code that an ant sees instead of the true one, and the stream after it."""
    seen, after = code, random_state
    for see in ti.static(hooks):
        seen, after = see(ant, seen, after)
    return seen, after


@ti.func
def misread_paper_state(paper_state, random_state, hooks: ti.template(), ant: ti.template()):
    """Return the paper's state with the codes that an ant sees, and the stream after them."""
    left, after = seen_code(code_in_view(paper_state, 0), random_state, hooks, ant)
    forward, later = seen_code(code_in_view(paper_state, 1), after, hooks, ant)
    right, last = seen_code(code_in_view(paper_state, 2), later, hooks, ant)
    return state_index(paper_state >> 6, left, forward, right), last


@while_compiling
def entry_of(view: Any, name: str) -> Any:
    return getattr(view, name)


@ti.func
def misread_view(
    view: ti.template(), observation: ti.template(), random_state, hooks: ti.template(),
    ant: ti.template()
):  # fmt: skip
    """Let an ant see the cells of a view differently, and return the stream after all of them.

    A misread cell has another code, no ant, no trail, no further field, and is not nearer to the
    queen. The paper's state of the view consists of the codes seen. The strongest level ahead does
    not change.
    """
    after = random_state
    for k in ti.static(range(len(observation.cells))):
        code, after = seen_code(view.codes[k], after, hooks, ant)
        if code != view.codes[k]:
            view.codes[k], view.levels[k], view.nearer[k] = code, 0, 0
            view.ants[k], view.other_nest_ants[k] = 0, 0
            for i in ti.static(range(len(observation.reads))):
                entry_of(view, observation.reads[i])[k] = 0
    left, forward, right = ti.static(observation.ahead)
    view.paper_state = state_index(
        view.carries, view.codes[left], view.codes[forward], view.codes[right]
    )
    return after
