"""The inputs of rules that ants follow and you wrote; only those that a rule reads compile.

A rule of choice reads what the ant sees before its action. A rule of deposits that reads other
pheromones reads those that ants lay before it with the deposits of this tick, see
`Model.lays_in_turn`. A rule of rewards runs when the ant observes at the end of a tick, before it
learns, so it reads levels after the tick.
"""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import accumulate
from typing import Any

import taichi as ti

from taichi_ants.arithmetic.random_bits import high_word, low_word
from taichi_ants.engines.colony.columns import individual
from taichi_ants.engines.colony.steps import (
    cell_ahead,
    cue_level,
    event_reward,
    explore_below_of,
    owner_of,
    table_of,
    trait,
)
from taichi_ants.engines.colony.trail import level_of
from taichi_ants.engines.colony.views import ant_view
from taichi_ants.engines.own_rules import bounded_function
from taichi_ants.features import INPUTS
from taichi_ants.kernel_functions import while_compiling
from taichi_ants.learners.memory import values_of
from taichi_ants.rules import Rule
from taichi_ants.rules.inputs import AHEAD, LEVELS, field_of
from taichi_ants.task.constants import EMPTY
from taichi_ants.task.rules.actions import step_towards
from taichi_ants.task.rules.vision import code_in_view

_CODE, _IS_TRUE, _IS_OPEN, _NEARER = range(4)  # the results of `cell_ahead`
_WORDS = 4294967296.0
Make = dict[str, Callable[[], Any]]  # functions that return the inputs of a rule


class OwnRule:
    """A rule in kernels, with a method for each kind of rule.

    The parameters of the rule begin at a place in `rule_numbers`.
    """

    def __init__(self, rule: Rule, first: int) -> None:
        self.inputs, self.function = tuple(rule.inputs), bounded_function(rule)
        self.places = range(first, first + len(rule.parameters))

    @while_compiling
    def choose(self, c, v, cues, w, ant, state, paper_state, tick, bits):
        """Return an action, i32; see `steps.draw_by_cues`."""
        carries, seen = trait(c.carries, ant), state if v.is_papers else paper_state
        sight = c, v, cues, w, ant, seen, paper_state
        make = {
            "values": lambda: _values(c, v, w, ant, state),
            "codes": lambda: _ahead(*sight, _CODE),
            "is_open": lambda: _ahead(*sight, _IS_OPEN),
            "nearer": lambda: _ahead(*sight, _NEARER) * carries,
            "carries": lambda: carries,
            "paper_state": lambda: seen,
            "epsilon": lambda: _share(explore_below_of(c, v, w, ant)),
            "random": lambda: _share(low_word(bits)),
            "random_2": lambda: _share(high_word(bits)),
            **_of_ants(c, v, w, ant, tick),
        }
        return self.result(c, make | _of_levels(self.inputs, *sight, carries, tick))

    @while_compiling
    def lay(self, c, v, w, ant, level, index, carried, carries, event, paper_state, tick):
        """Return a level, f64; see `trail.deposit`."""
        make: Make = {name: partial(_level, c, v, name, index, tick) for name in self.inputs}
        make |= {
            "level": lambda: level,
            "carried": lambda: carried,
            "carries": lambda: carries,
            "event": lambda: event,
            "paper_state": lambda: paper_state,
            **_of_ants(c, v, w, ant, tick),
        }
        return self.result(c, make)

    @while_compiling
    def evaporate(self, c, level, tick):
        """Return a level, f64; see `trail.evaporate`."""
        return self.result(c, {"level": lambda: level, "tick": lambda: tick})

    @while_compiling
    def pay(self, c, v, cues, w, ant, next_paper_state, tick):
        """Return a reward, i32; see `steps.own_reward`."""
        carries, seen = trait(c.carries, ant), next_paper_state
        make = {
            "reward": lambda: event_reward(c, v, ant),
            "event": lambda: trait(c.event, ant),
            "carries": lambda: carries,
            "paper_state": lambda: trait(c.paper_state, ant),
            "next_paper_state": lambda: next_paper_state,
            **_of_ants(c, v, w, ant, tick),
        }
        sight = c, v, cues, w, ant, seen, seen
        return self.result(c, make | _of_levels(self.inputs, *sight, carries, tick + 1))

    def result(self, c: Any, make: Make) -> Any:
        """Return the result of the rule, for functions that return its inputs."""
        inputs = [make[name]() for name in self.inputs]
        return self.function(*inputs, *(_number(c, place) for place in self.places))


def own_rules(rules: Sequence[Rule]) -> dict[Rule, OwnRule]:
    """Return the rules of a task in kernels."""
    firsts = accumulate((len(rule.parameters) for rule in rules), initial=0)
    return {rule: OwnRule(rule, first) for rule, first in zip(rules, firsts, strict=False)}


@ti.func
def _number(c: ti.template(), place: ti.template()):
    """Return a parameter of a rule."""
    return c.rule_numbers[place]


def _of_ants(c: Any, v: Any, w: Any, ant: Any, tick: Any) -> Make:
    """Return the inputs of all kinds of rules that ants follow."""
    return {
        "trait": lambda: individual(c, w, ant),
        **{name: partial(read, ant_view(c, v, w, ant)) for name, (_, read) in INPUTS.items()},
        "tick": lambda: tick,
    }


def _of_levels(
    names: Sequence[str], c: Any, v: Any, cues: Any, w: Any, ant: Any, seen: Any, paper_state: Any,
    carries: Any, tick: Any,
) -> Make:  # fmt: skip
    """Return those inputs that are levels of the ant's cue or of fields, for rules of ants."""

    def of_own_cell(name: str) -> Any:
        return _level(c, v, name, _place(c, w, ant), tick)

    ahead = partial(_levels, c, v, cues, w, ant, seen=seen, paper_state=paper_state, tick=tick)
    levels: Make = {
        "levels": partial(ahead, number=-1),
        "level": lambda: cue_level(c, v, cues, carries, _place(c, w, ant), tick),
    }
    for name in filter(field_of, names):
        if name.startswith(LEVELS):
            levels[name] = partial(ahead, number=v.field_names.index(field_of(name)))
        else:
            levels[name] = partial(of_own_cell, name)
    return levels


def _level(c: Any, v: Any, name: str, index: Any, tick: Any) -> Any:
    """Return the level of a cell in the pheromone that an input names."""
    return level_of(v.field(c, v.field_names.index(field_of(name))), index, tick)


@ti.func
def _share(word):
    """Return a 32-bit word as a share of all words, f64."""
    return ti.cast(word, ti.f64) / ti.f64(_WORDS)


@ti.func
def _values(c: ti.template(), v: ti.template(), w, ant, state):
    """Return the action values of an ant in a state, f32 (5,)."""
    return values_of(c.q, table_of(c, v, owner_of(c, v, w, ant)), state)


@ti.func
def _place(c: ti.template(), w, ant):
    """Return the place of the cell of an ant in arrays of cells."""
    return w * c.size + c.cell[ant]


@ti.func
def _ahead(
    c: ti.template(), v: ti.template(), cues: ti.template(), w, ant, seen, paper_state,
    which: ti.template()
):  # fmt: skip
    """Return one of the results of `cell_ahead` for the cells ahead, i32 (3,)."""
    values = ti.Vector([0, 0, 0])
    for i in ti.static(range(AHEAD)):
        code, _, opens, nears = cell_ahead(c, v, cues, w, ant, seen, paper_state, i)
        if ti.static(which == _CODE):
            values[i] = code
        elif ti.static(which == _IS_OPEN):
            values[i] = opens
        else:
            values[i] = nears
    return values


@ti.func
def _levels(
    c: ti.template(), v: ti.template(), cues: ti.template(), w, ant, number: ti.template(), seen,
    paper_state, tick
):  # fmt: skip
    """Return the levels ahead of a pheromone, or of the ant's cue for number -1, f64 (3,).

    Cells on which no ant can be have level 0, and so do cells that the ant misreads.
    """
    levels = ti.Vector([ti.f64(0.0), ti.f64(0.0), ti.f64(0.0)])
    carries, heading = trait(c.carries, ant), trait(c.heading, ant)
    for i in ti.static(range(AHEAD)):
        index = _place(c, w, ant) + step_towards(c.compass, heading, i)
        shows = (c.ground[index] & 15 == EMPTY) | (c.ground[index] >> 4 != 0)
        shows = shows & (code_in_view(seen, i) == code_in_view(paper_state, i))
        level = ti.f64(0.0)
        if ti.static(number < 0):
            level = ti.cast(cue_level(c, v, cues, carries, index, tick), ti.f64)
        else:
            level = ti.cast(level_of(ti.static(v.field(c, number)), index, tick), ti.f64)
        levels[i] = ti.select(shows, level, ti.f64(0.0))
    return levels
