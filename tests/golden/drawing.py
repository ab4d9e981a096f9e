"""The models of golden hashes: colonies, trainings and protocols, from generators of the tests."""

import contextlib
import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import frozen_rules
import numpy as np
from random_castes import with_castes
from random_choices import NOISE, random_choice, random_noise
from random_colonies import RandomColony, random_colony, random_task, random_training, with_nests
from random_worlds import random_world

from taichi_ants import AntsError, Colony, Interventions, World, protocol
from taichi_ants.interventions import AddAnts, RemoveAnts
from taichi_ants.task import Rewards, Task
from taichi_ants.task.constants import EMPTY

UNDER = "strongest_under_carriers"


class Group(NamedTuple):
    """Colonies with kernels of their own, and how they differ from the paper.

    Attributes:
        drawn: Arguments of `random_colony`.
        nests, kinds, loads: Of `with_nests`.
        castes: The cues of each caste; a number, if these are the task's.
        labour: Whether castes have thresholds.
        rules: Rules of users, by setting of the task.
    """

    drawn: dict[str, Any]
    nests: int = 1
    kinds: int = 0
    loads: bool = False
    castes: int | list[tuple[str, str]] = 0
    labour: bool = False
    rules: dict[str, Any] = {}  # noqa: RUF012 - nobody writes it


def _group(names: str, **options: Any) -> Group:
    drawn = dict(zip(("learner", "sharing", "observation"), names.split(), strict=True))
    others = {name: options.pop(name) for name in Group._fields if name in options}
    return Group({"dense": False, **drawn, **options}, **others)


GROUPS = {
    "plain": _group("q_learning shared paper"),
    "life": _group("q_learning shared paper", changes=True),
    "frozen": _group("q_learning frozen six_cells", view="strongest", fields="A",
        cues=("trail", "A"), changes=True),
    "planning": _group("dyna_q independent ants_seen", changes=True),
    "two_tables": _group("double_q independent paper", dense=True, noise="misread"),
    "sweeping": _group("prioritized_sweeping independent trail_levels", fields="a"),
    "n_step": _group("n_step_sarsa independent ants", traffic="right_of_way", fields="ab",
        cues=("trail", "b"), changes=True),
    "traces": _group("sarsa_lambda independent five_cells", choice="softmax"),
    "nests": _group("dyna_q shared queues", traffic="following", view=UNDER, nests=3, kinds=2,
        loads=True, changes=True),
    "piles": _group("sarsa shared ants", dense=True, traffic="right_of_way", nests=2, kinds=3,
        changes=True),
    "followers": _group("q_learning frozen paper", dense=True, traffic="following",
        choice="deneubourg", noise=NOISE, fields="aB", cues=("a", "compass")),
    "branches": _group("q_learning frozen paper", choice="deneubourg", fields="aB",
        cues=("a", "B")),
    "castes": _group("expected_sarsa shared paper", castes=3),
    "castes_fields": _group("q_learning shared trail_levels", dense=True,
        castes=[("B", "a"), ("trail", "compass")], noise=NOISE, fields="aB"),
    "labour": _group("q_learning shared paper", castes=2, labour=True),
    "labour_nests": _group("q_learning shared paper", castes=2, labour=True, nests=2,
        kinds=2, loads=True, changes=True),
    "labour_fields": _group("dyna_q shared paper", dense=True, traffic="following",
        view="strongest", nests=2, castes=[("a", "compass"), ("c", "trail")], labour=True,
        fields="ac", cues=("a", "compass"), changes=True),
    "labour_traces": _group("sarsa_lambda independent ants_seen", traffic="right_of_way",
        castes=2, labour=True, changes=True),
    "labour_soft": _group("q_learning frozen queues", traffic="following", view=UNDER,
        choice="softmax", noise="slip", castes=2, labour=True),
    "own_choice": _group("q_learning frozen paper", choice="deneubourg", castes=2,
        labour=True, rules={"choice": "hungry"}),
    "own_values": _group("sarsa shared paper", noise="slip",
        rules={"choice": "restless", "reward": "golden_shaped"}),
    "own_deposit": _group("q_learning shared paper", dense=True, fields="B", castes=2,
        labour=True, nests=2,
        rules={"pheromone": {"deposit": "golden_alarm", "evaporation": "exponential"},
            "reward": "demanded"}),
    "own_evaporation": _group("expected_sarsa shared paper", dense=True, changes=True,
        rules={"pheromone": {"deposit": "weaker", "evaporation": "power_law"}}),
    "soft": _group("sarsa shared ants", traffic="right_of_way", choice="softmax", noise=NOISE),
    "blocked": _group("n_step_sarsa independent ants_seen", noise="slip", changes=True),
}  # fmt: skip
PER_GROUP = 12


def colonies_of(name: str, most: int = PER_GROUP) -> Iterator[tuple[str, RandomColony]]:
    """Yield the names and arguments of the colonies of a group, with its rules registered."""
    found = 0
    with frozen_rules.registered() if GROUPS[name].rules else contextlib.nullcontext():
        for seed in itertools.count(100 * list(GROUPS).index(name)):
            if found == most:
                return
            drawn = _drawn(seed, GROUPS[name])
            if drawn is None:
                continue
            found += 1
            # Two thirds live longer, so that colonies last.
            if found % 3 and (drawn.task.life.lifespan or drawn.task.castes):
                drawn = replace(drawn, task=_living_longer(drawn.task))
            yield f"{name}-{seed}", drawn


def _living_longer(task: Task) -> Task:
    life = replace(task.life, lifespan=task.life.lifespan and 8 * task.life.lifespan)
    castes = {
        name: replace(caste, lifespan=caste.lifespan and 8 * caste.lifespan)
        for name, caste in task.castes.items()
    }
    return replace(task, life=life, castes=castes)


def _drawn(seed: int, group: Group) -> RandomColony | None:
    """Return the colony of a seed, or None if its world is too small."""
    drawn = random_colony(seed, rewards=_rewards(seed), **group.drawn)
    drawn.population["ends_at_delivery"] = False
    if drawn.population["ants"] < 3:
        return None
    try:
        if group.nests > 1 or group.kinds:
            drawn = with_nests(drawn, seed, group.nests, max(group.kinds, 1), group.loads)
        if isinstance(group.castes, list):
            drawn = with_castes(drawn, seed, len(group.castes), group.labour, group.castes)
        elif group.castes:
            drawn = with_castes(drawn, seed, group.castes, group.labour, None)
        if drawn.world.n_nests != group.nests:
            return None
        if group.rules:
            drawn = replace(drawn, task=_with_rules(drawn.task, group.rules))
        Colony(*drawn.model, **drawn.options)
    except AntsError:
        return None
    return drawn


def _with_rules(task: Task, rules: dict[str, Any]) -> Task:
    castes = task.castes
    if "choice" in rules:  # which has no numbers of castes
        castes = {name: replace(caste, k=None, exponent=None) for name, caste in castes.items()}
    settings = dict(rules)
    if "pheromone" in rules:
        changed = replace(task.pheromone, **rules["pheromone"])  # not all that are drawn fit
        cleared = {"half_life": changed.half_life and 3.0, "cap": None, "slope": None, "level": 250}
        settings["pheromone"] = replace(task.pheromone, **rules["pheromone"], **cleared)
    return replace(task, castes=castes, **settings)


def _rewards(seed: int) -> Rewards:
    rng = np.random.default_rng([seed, 5])
    drawn = Rewards(*rng.integers(-1000, 1001, 5).tolist())
    return drawn if rng.random() < 0.4 else Rewards()


def random_trainings(learner: str, n: int, noisy: bool) -> Iterator[tuple[str, Any]]:
    """Yield names and arguments of `train`: a world, a configuration, a seed and a task."""
    names = {"q_learning": "paper", "sarsa": "ants", "dyna_q": "six_cells", "double_q": "paper"}
    deposits = {"q_learning": "fading", "sarsa": "set", "dyna_q": "none"}
    for number in range(n):
        rng = np.random.default_rng([number, len(learner), 1 + noisy])
        task = random_task(
            *(rng, deposits.get(learner, "add"), _rewards(number)),
            observation=names.get(learner, "trail_levels"),
            choice=random_choice(number, "softmax" if noisy else "greedy"),
            noise=random_noise(number, NOISE if noisy else ""),
        )
        world = random_world(5000 + 40 * len(learner) + number)
        seed = int(rng.integers(-5, 2**40))
        yield (
            f"{learner}-{number}{'-noisy' * noisy}",
            (*(world, random_training(rng, learner), seed, task),),
        )


_MEASURES = ("deliveries", "living", "carriers")


def random_events(drawn: RandomColony) -> list[protocol.ProtocolEvent]:
    """Return a protocol of four events, which the worlds may still not allow."""
    rng, world, task = np.random.default_rng([drawn.seed % 2**32, 21]), drawn.world, drawn.task
    events: list[protocol.ProtocolEvent] = []
    while len(events) < 4:
        kind = ("at", "every", "when")[rng.integers(3)]
        when: dict[str, Any] = {"tick": int(rng.integers(30))}
        if kind == "every":
            when = {"ticks": int(rng.integers(1, 6)), "start": int(rng.integers(30))}
        elif kind == "when":
            when = {"measure": str(rng.choice(_MEASURES)), "above": float(rng.integers(-1, 7))}
            when |= {"interval": int(rng.integers(1, 5)), "once": bool(rng.random() < 0.5)}
        try:
            change = _intervention(rng, world, task, kind == "when")
            events.append(protocol.EVENTS[kind].from_dict({**when, **change}))
        except AntsError:
            continue
    return events


def _intervention(
    rng: np.random.Generator, world: World, task: Task, conditional: bool
) -> dict[str, Any]:
    ground, grid = world.ground(), world.grid
    some: Any = rng.permutation(grid.cells(np.flatnonzero(grid.exists)))[: rng.integers(1, 5)]
    some = some.tolist() if rng.random() < 0.7 else str(rng.choice(["a", "b"]))
    free = grid.cells(np.flatnonzero((ground == EMPTY) & grid.exists)).tolist()
    full = grid.cells(np.flatnonzero((ground != EMPTY) & grid.exists)).tolist()
    what = {"what": str(rng.choice(["rock", "food", "food"])), "cells": some}
    if what["what"] == "food" and task.foods:
        what["kind"] = str(rng.choice(list(task.foods)))
    able: dict[str, Any] = {
        "remove_ants": int(rng.integers(0, 4)) if rng.random() < 0.5 else float(rng.random()),
        "add_ants": int(rng.integers(0, 4)) if rng.random() < 0.5 else {"cells": some},
        "clear": some,
        "move": [full[rng.integers(len(full))], free[rng.integers(len(free))]],
        "place": what,
        "trail": {"level": int(rng.choice([0, 1, 20, 250])), "cells": some},
    }
    if not conditional:
        able["task"] = {"turns_at_queen": bool(rng.random() < 0.5)}
        able["epsilon"] = float(rng.random())
    name = str(rng.choice(list(able)))
    return {name: able[name]}


def disturb(colony: Colony) -> None:
    """Add two ants to each world and remove one, where there is room."""
    interventions = Interventions(colony, lasting=False)
    with contextlib.suppress(AntsError):
        interventions.apply(AddAnts(number=2))
    interventions.apply(RemoveAnts(number=1))
