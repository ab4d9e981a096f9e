"""Checks of rules and observations that you wrote; `taichi-ants check` checks learners, too."""

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np

from taichi_ants import rules, runtime, worlds
from taichi_ants.engines.colony.colony import Colony
from taichi_ants.engines.own_rules import difference
from taichi_ants.errors import AntsError, checked_whole
from taichi_ants.features import FEATURES
from taichi_ants.features.fields import OCCASIONS, TRAIL
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.reference import ReferenceColony
from taichi_ants.rules import Rule
from taichi_ants.rules.rule import drawn_parameters
from taichi_ants.task import Task, observations
from taichi_ants.task.constants import EMPTY
from taichi_ants.worlds import World

SEEDS, TICKS = 6, 60
__all__ = ["RuleCheck", "check_observation", "check_rule"]
__dir__ = __all__.copy  # completion lists only public names
# Of ants: views of a colony, and the same in the reference.
_COMPARED = {
    **{"headings": "heading", "carrying": "carries", "paper_states": "paper_state"},
    **{"states": "state", "actions": "action", "events": "event", "rewards": "reward"},
}


class RuleCheck(NamedTuple):
    """The result of a check of a rule, or of an observation.

    Attributes:
        rule: The name of the rule, or of the observation.
        inputs: The number of drawn inputs that were compared; 0 for an observation.
        ticks: The number of ticks of drawn colonies that were compared.
        difference: The first difference, or an empty string.
        fields: The names of the fields that the rule reads, which models that use it must have.
    """

    rule: str
    inputs: int
    ticks: int
    difference: str
    fields: tuple[str, ...] = ()

    def __str__(self) -> str:
        compared = f"{self.ticks} ticks of {SEEDS} colonies"
        if self.inputs:
            compared = f"{self.inputs} drawn inputs and {compared}"
        noun = "field" if len(self.fields) == 1 else "fields"
        reads = f" (reads the {noun} {' and '.join(self.fields)})" if self.fields else ""
        return f"{self.rule}{reads}: {compared}: {self.difference or 'equal'}"


def check_rule(name: str, inputs: int = 4000) -> RuleCheck:
    """Return the result of a comparison of a rule in kernels with its Python function.

    First the results for a number of drawn `inputs` are compared, then small drawn colonies that
    use the rule. After each tick, cells, headings, loads, paper states, actions, events, rewards,
    states, levels and action values must be equal in every bit. AntsError if there is no rule of
    this name.

    >>> @rules.register("deposit")
    ... def refresh(level, carries, most=200):
    ...     return max(level, most * carries)
    >>> print(testing.check_rule("refresh", inputs=100))
    refresh: 100 drawn inputs and 360 ticks of 6 colonies: equal
    """
    rule = rules.get(name)
    checked_whole("inputs", inputs)
    runtime.start()
    fault, ticks = difference(rule, inputs), 0
    if not fault:
        ticks, fault = _compared(lambda seed: _task(rule, seed))
    return RuleCheck(name, inputs, ticks, fault, rule.fields)


def check_observation(name: str) -> RuleCheck:
    """Return the result of a comparison of an observation in kernels with its Python function.

    Small drawn colonies that use it are compared as in `check_rule`. The reference computes the
    view by a separate implementation. AntsError if there is no observation of this name.

    >>> print(testing.check_observation("six_cells"))
    six_cells: 360 ticks of 6 colonies: equal
    """
    observation = observations.get(name)
    runtime.start()

    def task_of(seed: int) -> Task:  # kernels are compiled for two tasks only
        noise, cue = {"misread": 0.2 * (seed % 2)}, ("compass", "trail")[seed % 2]
        common = _common(observation.reads, seed % 2)
        return common.replace(observation=name, homing_cue=cue, noise=noise)

    return RuleCheck(name, 0, *_compared(task_of), observation.reads)


def _compared(task_of: Callable[[int], Task]) -> tuple[int, str]:
    """Return the equal ticks of drawn colonies with the task of each seed, and a difference."""
    ticks = 0
    try:
        for seed in range(SEEDS):
            colony, plain = _colonies(task_of(seed), seed)
            for tick in range(TICKS):
                colony.tick()
                plain.tick(last=tick == TICKS - 1)
                if fault := _difference(colony, plain):
                    return ticks, f"seed {seed}, tick {tick}: {fault}"
                ticks += 1
    except AntsError:
        raise
    except Exception as error:  # of the Python function or the observation
        return ticks, f"seed {seed} fails: {type(error).__name__}: {error}"
    return ticks, ""


def _task(rule: Rule, seed: int) -> Task:
    """Return a drawn task that uses a rule, with drawn parameters within their ranges.

    Kernels are compiled for two tasks only, with one nest and with two; others differ in numbers.
    """
    drawn, numbers = seed % 2, drawn_parameters(rule, np.random.default_rng([seed, 17]))
    settings: dict = {"rules": {rule.name: numbers}}
    for feature in FEATURES:
        if any(name in rule.inputs for name in feature.inputs):
            settings |= feature.example
    if rule.kind == "choice":
        settings |= {"choice": {"rule": rule.name}, "noise": {"misread": 0.2 * drawn}}
    elif rule.kind == "reward":
        settings |= {"reward": rule.name, "homing_cue": ("compass", "trail")[drawn]}
    else:
        second = {"deposited_when": [*OCCASIONS][seed % 5], rule.kind: rule.name}
        settings |= {"pheromone": {rule.kind: rule.name}, "fields": {"second": second}}
    return _common(rule.fields, drawn).replace(**settings)


def _common(fields: Iterable[str], drawn: int) -> Task:
    return Task().replace(
        fields={name: {"deposited_when": "always"} for name in fields if name != TRAIL},
        evaporation_in_training=True,
        traffic=("blocking", "following")[drawn],
        pheromone={"diffusion": 0.1 * drawn},
    )


def _world(seed: int) -> World:
    """Return a small open world; with two nests for two of four seeds, one of them odd."""
    world = worlds.open_world(seed, ranges=(5, 5, 5))
    if seed % 4 in (0, 3):
        return world
    distances = np.where(world.ground() == EMPTY, world.distances(), 0)
    other = world.grid.cells(distances.argmax()).tolist()
    return World(world.ranges, [world.queen, other], world.foods, world.obstacles)


def _colonies(task: Task, seed: int) -> tuple[Colony, ReferenceColony]:
    world = _world(seed)
    learner = TrainingConfig("sarsa", 0.2, 0.9, 0.4, 1.0) if task.needs_table else None
    sharing: Any = "frozen" if learner is None else "shared"
    schedule: Any = ("by_world", "by_chunk")[seed % 2]
    colony = Colony(world, task, learner, seed, 12, sharing=sharing, schedule=schedule)
    plain = ReferenceColony(world, task, learner, seed, 12, sharing=sharing)
    colony.begin_episode(TICKS)
    plain.begin_episode()
    return colony, plain


def _difference(colony: Colony, plain: ReferenceColony) -> str:
    """Return the first difference of a colony from its reference, or an empty string."""
    ours, grid = colony.snapshot(), colony.grid
    order = np.argsort(colony.numbers[0])
    ants = [plain.ants[slot] for slot in sorted(plain.ants, key=lambda n: plain.ants[n].number)]
    pairs: dict[str, tuple] = {
        "cells": (grid.cells(colony.cells[0, order]), [ant.cell for ant in ants])
    }
    for view, name in _COMPARED.items():
        pairs[view] = getattr(colony, view)[0, order], [getattr(ant, name) for ant in ants]
    ground = list(plain.world.ground)
    places = grid.index(np.array(ground, np.int64).reshape(-1, 3))
    for name, trail in plain.world.pheromones.items():
        levels = [trail.level(cell) for cell in ground]
        pairs[f"levels of {name}"] = ours.fields[name][places], levels
    pairs["action values"] = colony.q_values[0], plain.q_values
    for what, (kernel, twin) in pairs.items():
        expected = np.asarray(twin).astype(kernel.dtype)
        if not np.array_equal(kernel, expected):
            at = np.unravel_index(np.argmax(kernel != expected), kernel.shape)
            return f"{what} are {kernel[at]} in kernels, but {expected[at]} in the reference"
    return ""
