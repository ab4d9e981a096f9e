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
from taichi.lang.impl import subscript

from taichi_ants.arithmetic.random_bits import high_word, low_word
from taichi_ants.engines.colony import steps
from taichi_ants.engines.colony.columns import function, individual, trait
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

_CODE, _, _IS_OPEN, _NEARER = range(4)  # the results of `cell_ahead`
_WORDS = 4294967296.0
Inputs = dict[str, Any]  # values of kernels, or functions that return them


class OwnRule:
    """A rule in kernels, with a method for each kind of rule.

    The parameters of the rule begin at a place in `rule_numbers`.
    """

    def __init__(self, rule: Rule, first: int) -> None:
        self.names, self.function = tuple(rule.inputs), bounded_function(rule)
        self.places = range(first, first + len(rule.parameters))

    @while_compiling
    def choose(self, c, v, cues, w, ant, state, paper_state, tick, bits):
        """Return an action, i32; see `steps.draw_action`."""
        sight = c, v, cues, w, ant, state if v.is_papers else paper_state, paper_state

        def ahead(result):
            results = (steps.cell_ahead(*sight, i) for i in range(AHEAD))
            return ti.Vector([of_cell[result] for of_cell in results])

        def share(word):
            return ti.cast(word, ti.f64) / _WORDS

        def values():
            return values_of(c.q, steps.table_of(c, v, steps.owner_of(c, v, w, ant)), state)

        inputs = {
            "values": values,
            "codes": lambda: ahead(_CODE),
            "is_open": lambda: ahead(_IS_OPEN),
            "nearer": lambda: ahead(_NEARER) * trait(c.carries, ant),
            "paper_state": sight[-2],
            "epsilon": lambda: share(steps.explore_below_of(c, v, w, ant)),
            "random": lambda: share(low_word(bits)),
            "random_2": lambda: share(high_word(bits)),
        }
        return self.result(c, inputs | _of_sight(self.names, *sight, tick, tick))

    @while_compiling
    def lay(self, c, v, w, ant, level, index, carried, carries, event, paper_state, tick):
        """Return a level, f64; see `trail.deposit`."""
        inputs = {"level": level, "carried": carried, "carries": carries, "event": event}
        inputs |= {"paper_state": paper_state, **_of_ant(c, v, w, ant, tick)}
        levels = {name: partial(_level, c, v, name, index, tick) for name in self.names}
        return self.result(c, levels | inputs)

    @while_compiling
    def evaporate(self, c, level, tick):
        """Return a level, f64; see `trail.evaporate`."""
        return self.result(c, {"level": level, "tick": tick})

    @while_compiling
    def pay(self, c, v, cues, w, ant, next_paper_state, tick):
        """Return a reward, i32; see `steps.own_reward`."""
        inputs = {
            "reward": lambda: steps.event_reward(c, v, ant),
            "event": lambda: trait(c.event, ant),
            "paper_state": lambda: trait(c.paper_state, ant),
            "next_paper_state": next_paper_state,
        }
        sight = c, v, cues, w, ant, next_paper_state, next_paper_state
        return self.result(c, inputs | _of_sight(self.names, *sight, tick, tick + 1))

    def result(self, c: Any, inputs: Inputs) -> Any:
        """Return the result of the rule for its inputs, among others."""
        made = (inputs[name] for name in self.names)
        values = [value() if callable(value) else value for value in made]
        return self.function(*values, *(subscript(None, c.rule_numbers, k) for k in self.places))


def own_rules(rules: Sequence[Rule]) -> dict[Rule, OwnRule]:
    firsts = accumulate((len(rule.parameters) for rule in rules), initial=0)
    return {rule: OwnRule(rule, first) for rule, first in zip(rules, firsts, strict=False)}


def _of_ant(c: Any, v: Any, w: Any, ant: Any, tick: Any) -> Inputs:
    """Return the inputs of all kinds of rules that ants follow."""
    of_features = {
        name: partial(read, ant_view(c, v, w, ant)) for name, (_, read) in INPUTS.items()
    }
    return {"trait": lambda: individual(c, w, ant), "tick": tick, **of_features}


def _of_sight(
    names: Sequence[str], c: Any, v: Any, cues: Any, w: Any, ant: Any, seen: Any, paper_state: Any,
    tick: Any, level_tick: Any,
) -> Inputs:  # fmt: skip
    """Return the inputs of rules of choice and of rewards, among them levels in `level_tick`."""
    here, carries = w * c.size + ant_view(c, v, w, ant).cell, partial(trait, c.carries, ant)

    def of_cue(index: Any) -> Any:
        return steps.cue_level(c, v, cues, carries(), index, level_tick)

    def ahead(level_at: Callable[[Any], Any]) -> Any:
        """Return levels ahead, f64 (3,): 0 where no ant can be, and in cells that are misread."""
        levels = []
        for i in range(AHEAD):
            index = here + step_towards(c.compass, trait(c.heading, ant), i)
            shows = _shows(c, index, seen, paper_state, i)
            levels.append(ti.select(shows, ti.cast(level_at(index), ti.f64), 0.0))
        return ti.Vector(levels)

    inputs = {"carries": carries, "level": partial(of_cue, here), "levels": partial(ahead, of_cue)}
    for name in filter(field_of, names):
        of_field = partial(_level, c, v, name, tick=level_tick)
        is_ahead = name.startswith(LEVELS)
        inputs[name] = partial(ahead, of_field) if is_ahead else partial(of_field, here)
    return inputs | _of_ant(c, v, w, ant, tick)


def _level(c: Any, v: Any, name: str, index: Any, tick: Any) -> Any:
    """Return the level of a cell in the pheromone that an input names."""
    return level_of(v.field(c, v.field_names.index(field_of(name))), index, tick)


@function
def _shows(c, index, seen, paper_state, i: ti.template()):
    """Return whether an ant can be on the cell ahead of an ant, which the ant does not misread."""
    shows = (c.ground[index] & 15 == EMPTY) | (c.ground[index] >> 4 != 0)
    return shows & (code_in_view(seen, i) == code_in_view(paper_state, i))
