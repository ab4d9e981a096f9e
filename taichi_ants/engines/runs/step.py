"""Vision and actions of one ant in one world with packed cells, for the engine of runs."""

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import taichi as ti
from taichi.lang.impl import subscript
from taichi.math import popcnt

from taichi_ants.arithmetic.random_bits import draw_below
from taichi_ants.engines.views import fill_codes, view_type
from taichi_ants.features import NUMBERS, hooks_at, used_by
from taichi_ants.features.feature import Feature
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.kernel_functions import Named, kernel_function, while_compiling
from taichi_ants.task import Task
from taichi_ants.task.constants import FOOD, FORWARD, LEFT, PICK_UP, QUEEN, RIGHT, Event, Reason
from taichi_ants.task.observations import Observation
from taichi_ants.task.rules import actions, vision
from taichi_ants.task.rules.actions import is_open, move_event, step_towards, turned_by
from taichi_ants.task.rules.pheromone import FADING, NONE, level_after_deposit, level_left
from taichi_ants.task.rules.policy import bit_number, lowest_bit_number

# An ant, and the event of its last action.
Ant = ti.types.struct(
    origin=ti.i32,  # the start of its world in `world`, `trails` and `closer`
    cell=ti.i32,
    heading=ti.i32,
    carries=ti.i32,
    carried=ti.i32,  # ticks since the pick-up, for fading deposits
    event=ti.i32,
    random_state=ti.u64,
)


class Rules(NamedTuple):
    """The rules of a task that are compiled into kernels.

    For `deposit` and `half`, see `rules.pheromone` and `Pheromone.view`.
    """

    observation: Observation
    deposit: int
    half: bool
    features: tuple[Feature, ...]
    choice: str

    @classmethod
    def of(cls, task: Task) -> "Rules":
        """Return the rules of a task."""
        pheromone = task.pheromone
        deposit, half = pheromone.numbers["deposits"], pheromone.view == "half"
        return cls(task.sees, deposit, half, used_by(task), task.choice.rule)


@while_compiling
def ant_view(a: Any, ant: Any) -> Named:
    """Return the view of a lone ant, through which hooks of features read it by name.

    Other names are those of the arrays and numbers of kernels.
    """

    def read(name: str) -> Any:
        if name in NUMBERS:
            array, place = NUMBERS[name]
            return subscript(None, getattr(a, array), place)
        return getattr(ant if name in Ant.members else a, name)

    return Named(read)


class Part:
    """A part of an array, from index `first` on, while a kernel compiles."""

    def __init__(self, array: Any, first: Any) -> None:
        self.array, self.first = array, first

    def __getitem__(self, index: Any) -> Any:
        return subscript(None, self.array, self.first + index)


@while_compiling
def parts_of(a: Any, numbers: tuple[str, ...]) -> Named:
    """Return the arguments of a kernel, and the arrays that `layout.join` has joined, by name.

    These are in `a.memory`, or `a` itself. Their first entries are the arguments `numbers`.
    """
    memory = getattr(a, "memory", a)

    def read(name: str) -> Any:
        if name in numbers:
            return subscript(None, memory, numbers.index(name))
        if hasattr(a, name):
            return getattr(a, name)
        return Part(memory, read(f"{name}_at"))

    return Named(read)


@ti.func
def restore(a: ti.template(), base, origin, first, last):
    """Reset the cells from `first` to `last` of a run to those of its world."""
    for c in range(first, last + 1):
        a.cells[base + c] = a.world[origin + c]
    a.cells[base + a.size] = a.size
    a.cells[base + a.size + 1] = -1


@ti.func
def lay(kind: ti.template(), a: ti.template(), base, cell, clock, expiry, carried):
    """Deposit on an empty cell with the stored trail `expiry`; see `rules.pheromone`."""
    level = level_after_deposit(a, kind, level_left(expiry, clock), carried)
    a.cells[base + cell] = clock + level
    a.cells[base + a.size] = ti.min(a.cells[base + a.size], cell)
    a.cells[base + a.size + 1] = ti.max(a.cells[base + a.size + 1], cell)


@ti.func
def ground_of(packed):
    """Return the ground of a packed cell, see `engines.layout`."""
    return (packed >> 31) & packed & 15


@ti.func
def paper_state_of(
    half: ti.template(), predictable: ti.template(), a: ti.template(), base, ant, clock
):
    """Return the paper's state of the ant at `clock`; the cells of its run start at `base`.

    A branch is faster if it is `predictable` whether the ant carries food.
    """
    here = base + ant.cell
    left = a.cells[here + step_towards(a.compass, ant.heading, LEFT)]
    forward = a.cells[here + step_towards(a.compass, ant.heading, FORWARD)]
    right = a.cells[here + step_towards(a.compass, ant.heading, RIGHT)]
    paper_state = 0
    if ti.static(predictable):
        if ant.carries == 1:
            paper_state = state_carrying(a, ant, left, forward, right)
        else:
            paper_state = state_foraging(half, left, forward, right, clock)
    else:
        paper_state = ti.select(
            ant.carries == 1,
            state_carrying(a, ant, left, forward, right),
            state_foraging(half, left, forward, right, clock),
        )
    return paper_state


@ti.func
def state_carrying(a: ti.template(), ant, left, forward, right):
    """Return the paper's state of an ant with food that sees three packed cells."""
    nearer = vision.nearer_from(a.closer[ant.origin + ant.cell], ant.heading)
    return vision.paper_state_carrying(
        ground_of(left), ground_of(forward), ground_of(right), nearer
    )


@ti.func
def state_foraging(half: ti.template(), left, forward, right, clock):
    """Return the paper's state of an ant without food that sees three packed cells."""
    trail_left, trail_forward, trail_right = left - clock, forward - clock, right - clock
    return vision.paper_state_by_level(
        *(half, 0, ground_of(left), ground_of(forward), ground_of(right)),
        *(trail_left, trail_forward, trail_right),
        ti.max(trail_left, ti.max(trail_forward, trail_right)),
    )


@cache
def observe_function(rules: Rules, predictable: bool) -> Callable[..., Any]:
    """Return a `ti.func` (a, base, ant, clock) that returns what an ant sees.

    It returns the paper's state, the state index, and the random stream after possible draws. For
    `predictable`, see `paper_state_of`.
    """
    observation, is_paper = rules.observation, rules.observation.name == "paper"
    in_view = observation.cells
    left, forward, right = observation.ahead
    sees = hooks_at(rules.features)["see"]
    view_of, encode = view_type(observation, False), kernel_function(observation.encode)

    @ti.func
    def see(a: ti.template(), base, ant, clock):
        here = base + ant.cell
        nearer = vision.nearer_from(a.closer[ant.origin + ant.cell], ant.heading)
        view = view_of(carries=ant.carries, own_level=level_left(a.cells[here], clock))
        for k in ti.static(range(len(in_view))):
            towards = (ant.heading + in_view[k] + N_HEADINGS) % N_HEADINGS
            cell = a.cells[here + step_towards(a.compass, towards, FORWARD)]
            view.levels[k] = level_left(cell, clock)
            view.nearer[k] = nearer >> (in_view[k] % N_HEADINGS) & 1
            view.codes[k] = ground_of(cell)
        ahead = ti.max(view.levels[left], view.levels[forward])
        view.strongest = ti.max(ahead, view.levels[right])
        fill_codes(rules.half, "", view, observation)
        return view

    @ti.func
    def observe(a: ti.template(), base, ant, clock):
        paper_state = paper_state_of(rules.half, predictable, a, base, ant, clock)
        state, after = paper_state, ant.random_state
        if ti.static(not is_paper):
            view = see(a, base, ant, clock)
            if ti.static(sees):
                after = vision.misread_view(
                    view, observation, ant.random_state, sees, ant_view(a, ant)
                )
            state = encode(view)
        elif ti.static(sees):  # no view is needed
            state, after = vision.misread_paper_state(
                paper_state, ant.random_state, sees, ant_view(a, ant)
            )
        return paper_state, state, after

    return observe


@ti.func
def act(
    deposit: ti.template(),
    predictable: ti.template(),
    a: ti.template(),
    base,
    ant,
    paper_state,
    action,
    clock,
):
    """Return the ant after its action, with the event, and change the cells.

    Branches are faster if the actions are `predictable`, as those of a learned policy.
    """
    after = ant
    after.event = Event.FAILED
    code = vision.code_in_view(paper_state, action)
    if ti.static(predictable):
        if action <= RIGHT:
            after.heading = actions.turn(a.compass, ant.heading, action)
            after.event = move_event(code)
            if is_open(code):
                after.cell += step_towards(a.compass, after.heading, FORWARD)
                if ant.carries == 1:
                    lay_behind(deposit, a, base, after.cell, clock, ant.carried)
        else:
            after = pick_up_or_give(deposit, a, base, ant, paper_state, action, clock)
    else:
        after, enters = move(a, ant, paper_state, action)
        if enters & ant.carries == 1:
            lay_behind(deposit, a, base, after.cell, clock, ant.carried)
        if exchanges(paper_state, action) != 0:
            after = pick_up_or_give(deposit, a, base, ant, paper_state, action, clock)
    if ti.static(deposit == FADING):
        after.carried = (ant.carried + 1) * after.carries
    return after


@ti.func
def move(a: ti.template(), ant, paper_state, action):
    """Return the ant after a move, without branches, and 1 if it enters a cell.

    Another action is a `FAILED` one, unless `pick_up_or_give` follows.
    """
    after, code = ant, vision.code_in_view(paper_state, action)
    moves = actions.MOVES >> action & 1
    enters = moves & ti.cast(is_open(code), ti.i32)
    after.heading = turned_by(a.compass, ant.heading, action)
    after.event = ti.select(moves == 1, move_event(code), Event.FAILED)
    after.cell += enters * step_towards(a.compass, ant.heading, action)
    return after, enters


@ti.func
def exchanges(paper_state, action):
    """Return a number that is not 0 if an ant that sees food or the queen picks up or gives.

    It needs one comparison, which is rarely true. Nothing could predict whether the action moves.
    """
    return vision.goals_as_seen(paper_state) & -((action + 1) >> 2)


@ti.func
def laid_behind(deposit: ti.template(), a: ti.template(), base, ant, clock):
    """Return the cell that an ant with food has entered, after its deposit."""
    level = level_left(a.cells[base + ant.cell], clock)
    return clock + level_after_deposit(a, deposit, level, ant.carried)


@ti.func
def lay_behind(deposit: ti.template(), a: ti.template(), base, cell, clock, carried):
    if ti.static(deposit != NONE):
        lay(deposit, a, base, cell, clock, a.cells[base + cell], carried)


@ti.func
def pick_up_or_give(
    deposit: ti.template(), a: ti.template(), base, ant, paper_state, action, clock
):
    """Return the ant after an action that is not a move, with the event; see `act`."""
    after, goals = ant, vision.goals_in_view(paper_state)
    after.event = Event.FAILED
    if goals != 0 and action == PICK_UP and ant.carries == 0:
        position = lowest_bit_number(goals)
        if goals & (goals - 1) != 0:  # several food items in view
            k, after.random_state = draw_below(ant.random_state, popcnt(goals))
            position = bit_number(goals, k)
        food = ant.cell + step_towards(a.compass, ant.heading, position)
        if a.regrows == 0:  # else the food grows back before an ant sees the trail under it
            lay(deposit, a, base, food, clock, a.trails[ant.origin + food], 0)
        lay(deposit, a, base, ant.cell, clock, a.cells[base + ant.cell], 0)
        after.heading = actions.turn_round(ant.heading)
        after.carries = 1
        after.event = Event.PICKED_UP
    elif ant.carries == 1 and actions.can_give(action, paper_state):
        after.carries = 0
        after.heading = actions.heading_after_delivery(ant.heading, a.turns_at_queen)
        after.event = Event.DELIVERED
    return after


@ti.func
def reason_of(a: ti.template(), base, before, after, action):
    """Return the `Reason` why an action was blocked or failed."""
    reason = ti.cast(Reason.NONE, ti.i32)
    if after.event == Event.BLOCKED:
        ahead = before.cell + step_towards(a.compass, after.heading, FORWARD)
        ground = ground_of(a.cells[base + ahead])
        reason = Reason.ROCK_OR_EDGE_AHEAD
        if ground == FOOD:
            reason = Reason.FOOD_AHEAD
        elif ground == QUEEN:
            reason = Reason.QUEEN_AHEAD
    elif after.event == Event.FAILED:
        if action == PICK_UP:
            reason = ti.select(
                before.carries == 1, Reason.CARRIES_FOOD_ALREADY, Reason.NO_FOOD_IN_VIEW
            )
        else:
            reason = ti.select(before.carries == 1, Reason.NO_QUEEN_IN_VIEW, Reason.CARRIES_NO_FOOD)
    return reason
