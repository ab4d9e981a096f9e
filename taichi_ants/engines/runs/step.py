"""One ant in one world, in the packed cells of the engine of independent runs: see and act."""

import taichi as ti
from taichi.math import popcnt

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task.constants import (
    DELIVERED,
    DEPOSIT_LEVEL,
    FAILED,
    FORWARD,
    GIVE,
    LEFT,
    PICK_UP,
    PICKED_UP,
    RIGHT,
)
from taichi_ants.task.rules.actions import is_open, move_event, step_towards, turn, turn_round
from taichi_ants.task.rules.policy import bit_number, lowest_bit_number
from taichi_ants.task.rules.random_bits import advance, below, bits_of, high_word
from taichi_ants.task.rules.vision import (
    code_in_view,
    goals_in_view,
    see_carrying,
    see_foraging,
    state_index,
)

# An ant, and what came of its last action.
Ant = ti.types.struct(
    cell=ti.i32,
    heading=ti.i32,
    carries=ti.i32,
    event=ti.i32,
    random_state=ti.u64,
)

# The cells of a run are followed by the range of those that the episode has changed.
EXTRA_CELLS = 2


@ti.func
def restore(cells: ti.template(), world: ti.template(), base, size, first, last):
    """Set the cells from `first` to `last` back to the world's."""
    for c in range(first, last + 1):
        cells[base + c] = world[c]
    cells[base + size] = size
    cells[base + size + 1] = -1


@ti.func
def deposit(cells: ti.template(), base, size, cell, clock):
    """Set the trail of a cell, as the clock at which it will have evaporated."""
    cells[base + cell] = clock + DEPOSIT_LEVEL
    cells[base + size] = ti.min(cells[base + size], cell)
    cells[base + size + 1] = ti.max(cells[base + size + 1], cell)


@ti.func
def ground_of(packed):
    """What a packed cell holds, see `engines.packing`."""
    return (packed >> 31) & packed & 15


@ti.func
def observe(cells: ti.template(), closer: ti.template(), compass: ti.template(), base, ant, clock):
    """The state that the ant sees at `clock`; the cells of its run begin at `base`."""
    here = base + ant.cell
    left = cells[here + step_towards(compass, ant.heading, LEFT)]
    forward = cells[here + step_towards(compass, ant.heading, FORWARD)]
    right = cells[here + step_towards(compass, ant.heading, RIGHT)]
    state = 0
    if ant.carries == 1:
        # Six bits, one for each heading, written twice so that the turns need no wrap.
        nearer = ti.cast(closer[ant.cell], ti.i32)
        nearer = (nearer | nearer << N_HEADINGS) >> ant.heading
        state = state_index(
            1,
            see_carrying(ground_of(left), nearer >> (N_HEADINGS - 1) & 1),
            see_carrying(ground_of(forward), nearer & 1),
            see_carrying(ground_of(right), nearer >> 1 & 1),
        )
    else:
        trail_left = ti.max(left - clock, 0)
        trail_forward = ti.max(forward - clock, 0)
        trail_right = ti.max(right - clock, 0)
        strongest = ti.max(trail_left, ti.max(trail_forward, trail_right))
        state = state_index(
            0,
            see_foraging(ground_of(left), trail_left, strongest),
            see_foraging(ground_of(forward), trail_forward, strongest),
            see_foraging(ground_of(right), trail_right, strongest),
        )
    return state


@ti.func
def act(cells: ti.template(), compass: ti.template(), base, size, ant, state, action, clock):
    """The ant after its action, with the event; the cells it changes are changed."""
    after = ant
    after.event = FAILED
    if action <= RIGHT:
        after.heading = turn(compass, ant.heading, action)
        code = code_in_view(state, action)
        after.event = move_event(code)
        if is_open(code):
            after.cell += step_towards(compass, after.heading, FORWARD)
            if ant.carries == 1:
                deposit(cells, base, size, after.cell, clock)
    else:
        goals = goals_in_view(state)
        if goals != 0 and action == PICK_UP and ant.carries == 0:
            position = lowest_bit_number(goals)
            if goals & (goals - 1) != 0:  # several foods in view
                after.random_state = advance(ant.random_state)
                word = high_word(bits_of(after.random_state))
                position = bit_number(goals, below(word, popcnt(goals)))
            food = ant.cell + step_towards(compass, ant.heading, position)
            deposit(cells, base, size, food, clock)
            deposit(cells, base, size, ant.cell, clock)
            after.heading = turn_round(ant.heading)
            after.carries = 1
            after.event = PICKED_UP
        elif goals != 0 and action == GIVE and ant.carries == 1:
            after.carries = 0
            after.event = DELIVERED
    return after
