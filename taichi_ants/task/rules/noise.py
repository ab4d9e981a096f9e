"""Failures of actions and observations: slips, and cells that ants misread; see `task.Noise`.

A slip, and each cell in view, takes one draw of 64 bits. The upper word decides whether the action
slips or the cell is misread. The lower word chooses the executed action among all five, or the code
seen among the other three, in ascending order.
"""

from typing import Any

import taichi as ti

from taichi_ants.arithmetic.random_bits import advance, below, bits_of, high_word, low_word
from taichi_ants.task.constants import N_ACTIONS
from taichi_ants.task.rules.vision import code_in_view, state_index


@ti.func
def slipped(action, random_state, slip_below):
    """Return the action that an ant executes instead of the chosen one, and the stream after it."""
    after = advance(random_state)
    bits = bits_of(after)
    slips = high_word(bits) < slip_below
    return ti.select(slips, below(low_word(bits), N_ACTIONS), action), after


@ti.func
def misread_code(code, random_state, misread_below):
    """Return the code that an ant sees instead of the true one, and the stream after it."""
    after = advance(random_state)
    bits = bits_of(after)
    other = below(low_word(bits), 3)
    other += ti.cast(other >= code, ti.i32)
    return ti.select(high_word(bits) < misread_below, other, code), after


@ti.func
def misread_paper_state(paper_state, random_state, misread_below):
    """Return the paper's state with misread codes, and the stream after its three draws."""
    left, after = misread_code(code_in_view(paper_state, 0), random_state, misread_below)
    forward, later = misread_code(code_in_view(paper_state, 1), after, misread_below)
    right, last = misread_code(code_in_view(paper_state, 2), later, misread_below)
    return state_index(paper_state >> 6, left, forward, right), last


def entry_of(view: Any, name: str) -> Any:
    """Return a vector of a view by its name, while a kernel compiles."""
    return getattr(view, name)


# Taichi requires this attribute, with any value, of Python functions that kernels call.
entry_of._is_taichi_function = False  # type: ignore[attr-defined]


@ti.func
def misread_view(view: ti.template(), observation: ti.template(), random_state, misread_below):
    """Misread the cells of a view, and return the stream after a draw for each.

    A misread cell has another code, no ant, no trail, no further field, and is not nearer to the
    queen. The paper's state of the view consists of the codes seen. The strongest level ahead does
    not change.
    """
    after = random_state
    for k in ti.static(range(len(observation.cells))):
        code, after = misread_code(view.codes[k], after, misread_below)
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
