"""Cells in view that ants see differently, by the hooks `see` of features."""

from typing import Any

import taichi as ti

from taichi_ants.kernel_functions import while_compiling
from taichi_ants.task.rules.vision import code_in_view, state_index


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
    """Return a vector of a view by its name, while a kernel compiles."""
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
