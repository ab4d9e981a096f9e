"""Random colonies, trainings and protocols for golden hashes.

Frozen: renamed settings are renamed here, but nothing is drawn in another order or range, because
the recorded hashes belong to these models.
"""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from taichi_ants import AntsError, Colony, Interventions, TrainingConfig, World, protocol
from taichi_ants.interventions import AddAnts, RemoveAnts
from taichi_ants.task import (
    Choice,
    Field,
    Food,
    Labour,
    Life,
    Noise,
    Pheromone,
    Rewards,
    Task,
    Threshold,
    observations,
)
from taichi_ants.task.constants import EMPTY, GIVE, N_ACTIONS, PICK_UP

UNDER = "strongest_under_carriers"
NOISE = "slip and misread"


class Group(NamedTuple):
    """Colonies with kernels of their own, and how they differ from the paper; see `_drawn`."""

    learner: str
    sharing: str
    observation: str
    options: dict[str, Any]


def _group(name: str, **options: Any) -> Group:
    learner, sharing, observation = name.split()
    return Group(learner, sharing, observation, options)


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
    "castes": _group("expected_sarsa shared paper", castes=[None, None, None]),
    "castes_fields": _group("q_learning shared trail_levels", dense=True,
        castes=[("B", "a"), ("trail", "compass")], noise=NOISE, fields="aB"),
    "labour": _group("q_learning shared paper", castes=[None, None], labour=True),
    "labour_nests": _group("q_learning shared paper", castes=[None, None], labour=True, nests=2,
        kinds=2, loads=True, changes=True),
    "labour_fields": _group("dyna_q shared paper", dense=True, traffic="following",
        view="strongest", nests=2, castes=[("a", "compass"), ("c", "trail")], labour=True,
        fields="ac", cues=("a", "compass"), changes=True),
    "labour_traces": _group("sarsa_lambda independent ants_seen", traffic="right_of_way",
        castes=[None, None], labour=True, changes=True),
    "labour_soft": _group("q_learning frozen queues", traffic="following", view=UNDER,
        choice="softmax", noise="slip", castes=[None, None], labour=True),
    "own_choice": _group("q_learning frozen paper", choice="deneubourg", castes=[None, None],
        labour=True, rules={"choice": "golden_hungry"}),
    "own_values": _group("sarsa shared paper", noise="slip",
        rules={"choice": "golden_restless", "reward": "golden_shaped"}),
    "own_deposit": _group("q_learning shared paper", dense=True, fields="B", castes=[None, None],
        labour=True, nests=2,
        rules={"pheromone": {"deposit": "golden_alarm", "evaporation": "exponential"},
            "reward": "golden_demanded"}),
    "own_evaporation": _group("expected_sarsa shared paper", dense=True, changes=True,
        rules={"pheromone": {"deposit": "golden_weaker", "evaporation": "golden_power_law"}}),
    "soft": _group("sarsa shared ants", traffic="right_of_way", choice="softmax", noise=NOISE),
    "blocked": _group("n_step_sarsa independent ants_seen", noise="slip", changes=True),
}  # fmt: skip
PER_GROUP = 12


class Drawn(NamedTuple):
    """The arguments of a colony."""

    world: World
    task: Task
    population: dict[str, Any]
    training: TrainingConfig | None
    seed: int
    sharing: str
    q_values: np.ndarray | None


def colonies_of(group: str, most: int = PER_GROUP) -> Iterator[tuple[str, Drawn]]:
    """Yield the names and arguments of the colonies of a group."""
    learner, sharing, observation, options = GROUPS[group]
    found = 0
    for seed in itertools.count(100 * list(GROUPS).index(group)):
        if found == most:
            return
        drawn = _drawn(seed, learner, sharing, observation, **options)
        if drawn is None:
            continue
        found += 1
        # Two thirds live longer, so that colonies last.
        if found % 3 and (drawn.task.life.lifespan or drawn.task.castes):
            drawn = drawn._replace(task=_living_longer(drawn.task))
        yield f"{group}-{seed}", drawn


def _living_longer(task: Task) -> Task:
    life = replace(task.life, lifespan=task.life.lifespan and 8 * task.life.lifespan)
    castes = {
        name: replace(caste, lifespan=caste.lifespan and 8 * caste.lifespan)
        for name, caste in task.castes.items()
    }
    return replace(task, life=life, castes=castes)


def _drawn(
    seed: int,
    learner: str,
    sharing: str,
    observation: str,
    *,
    dense: bool = False,
    traffic: str = "blocking",
    view: str = "half",
    changes: bool = False,
    fields: str = "",
    cues: tuple[str, str] = ("trail", "compass"),
    choice: str = "greedy",
    noise: str = "",
    nests: int = 1,
    kinds: int = 0,
    loads: bool = False,
    castes: list[tuple[str, str] | None] | tuple[()] = (),
    labour: bool = False,
    rules: dict[str, Any] | None = None,
) -> Drawn | None:
    """Return the colony of a seed, or None if its world is too small.

    Each letter of `fields` names a further pheromone, a capital a dense one. `castes` has the cues
    of each caste.
    """
    rng = np.random.default_rng([seed, 2])
    world = random_world(seed)
    room = int(np.count_nonzero(world.ground() == EMPTY))
    population, task = _rules(rng, min(room, 24), dense, changes)
    training = random_training(rng, learner)
    delivery = str(rng.choice(["terminates", "truncates"]))
    has_table = sharing == "frozen" or rng.random() < 0.6
    chooses = _choice(seed, choice)
    if fields and choice == "deneubourg" and cues[1] == "compass":
        chooses = replace(chooses, carriers_follow=fields[-1])
    by_trails = choice == "deneubourg"
    task = replace(
        task,
        delivery=delivery,
        rewards=_rewards(seed),
        observation=observation,
        pheromone=replace(task.pheromone, view=view),
        fields={name: _field(seed, name, view) for name in fields},
        outbound_cue=cues[0],
        homing_cue=cues[1],
        traffic=traffic,
        turns_at_queen=bool(rng.random() < 0.5),
        choice=chooses,
        noise=_noise(seed, noise),
    )
    drawn = Drawn(
        *(world, task, population, None if by_trails else training),
        *(int(rng.integers(-5, 2**40)), sharing),
        forager(observation) if has_table and not by_trails else None,
    )
    if population["ants"] < 3:
        return None
    try:
        if nests > 1 or kinds:
            drawn = _with_nests(drawn, seed, nests, max(kinds, 1), loads)
        if castes:
            drawn = _with_castes(drawn, seed, castes, labour)
        if drawn.world.n_nests != nests:
            return None
        if rules:
            drawn = drawn._replace(task=_with_rules(drawn.task, rules))
        Colony(
            *(drawn.world, drawn.task, drawn.training, drawn.seed),
            **{**population, "sharing": sharing, "q_values": drawn.q_values},
        )
    except AntsError:
        return None
    return drawn


def _with_rules(task: Task, rules: dict[str, Any]) -> Task:
    castes = task.castes
    if "choice" in rules:  # which has no numbers of castes
        castes = {name: replace(one, k=None, exponent=None) for name, one in castes.items()}
    given = {
        name: replace(getattr(task, name), **one) if isinstance(one, dict) else one
        for name, one in rules.items()
    }
    if "pheromone" in given:
        how = {"half_life": 3.0} if given["pheromone"].evaporation == "exponential" else {}
        cleared = {"half_life": None, "cap": None, "slope": None, "level": 250, **how}
        given["pheromone"] = replace(task.pheromone, **rules["pheromone"], **cleared)
    return replace(task, castes=castes, **given)


def random_world(seed: int, largest: int = 5) -> World:
    """Return a small world with food, rocks, trails and regions, in which an ant can start."""
    rng = np.random.default_rng(seed)
    while True:
        world = _draw_world(rng, largest)
        if world is not None:
            break
    rng = np.random.default_rng([seed, 12])
    cells = rng.permutation(world.grid.cells(np.flatnonzero(world.grid.exists)))
    disc = {"centre": cells[0].tolist(), "radius": int(rng.integers(3))}
    return world.with_regions({"a": cells[: rng.integers(1, 5)], "b": disc})


# Shares of empty cells, food and rocks: open, full of food, full of rocks.
_SHARES = np.array([[0.9, 0.08, 0.02], [0.5, 0.45, 0.05], [0.55, 0.1, 0.35]])
_LEVELS = [0, 1, 2, 3, 5, 12, 25, 100, 124, 125, 126, 250, 400]


def _draw_world(rng: np.random.Generator, largest: int) -> World | None:
    ranges = tuple(int(n) for n in rng.integers(1, largest + 1, 3))
    cells = [c for c in itertools.product(*map(range, ranges)) if min(c) == 0]
    if len(cells) < 3:
        return None
    cells = [cells[i] for i in rng.permutation(len(cells))]
    kinds = rng.choice(["empty", "food", "rock"], len(cells), p=rng.choice(_SHARES))
    kinds[0], kinds[1] = "queen", "empty"
    of = {kind: [c for c, k in zip(cells, kinds, strict=True) if k == kind] for kind in set(kinds)}
    is_open = [cell for cell, kind in zip(cells, kinds, strict=True) if kind != "rock"]
    levels = rng.choice(_LEVELS, len(is_open))
    has_trail = rng.random(len(is_open)) < rng.choice([0.0, 0.3, 0.9])
    trails = [(cell, int(level)) for cell, level in zip(is_open, levels, strict=True)]
    try:
        world = World(
            ranges=ranges,
            queen=cells[0],
            foods=of.get("food", []),
            obstacles=of.get("rock", []),
            trails=[one for one, has in zip(trails, has_trail, strict=True) if has],
            ants=[(of["empty"][0], int(rng.integers(6)))] if rng.random() < 0.7 else [],
        )
        world.start(0)
    except AntsError:
        return None
    return world if len(world.foods) else None


def _rules(
    rng: np.random.Generator, most: int, dense: bool, changes: bool
) -> tuple[dict[str, Any], Task]:
    ants = int(rng.choice([1, rng.integers(1, most + 1), most]))
    births = bool(rng.random() < 0.5)
    capacity = ants + int(rng.integers(0, 6)) if rng.random() < 0.5 else None
    pheromone = random_pheromone(rng, dense)
    lifespan = int(rng.integers(1, 30)) if rng.random() < 0.5 else None
    regrowth = int(rng.choice([0, 0, 1, 2, 7])) if rng.random() < 0.7 else None
    pile_move_interval = int(rng.choice([1, 2, 5])) if rng.random() < 0.5 else None
    if changes:
        lifespan = 9 if not births and lifespan is None else lifespan
        pile_move_interval = (
            3 if regrowth is None and pile_move_interval is None else pile_move_interval
        )
    start = str(rng.choice(["nest", "spread"]))
    life = Life(
        births=births, lifespan=lifespan, regrowth=regrowth, pile_move_interval=pile_move_interval
    )
    task = Task(pheromone=pheromone, evaporation_in_training=True, life=life)
    return {"ants": ants, "capacity": capacity, "start": start}, task


def random_pheromone(rng: np.random.Generator, dense: bool) -> Pheromone:
    """Return a pheromone; a dense one has real numbers as levels."""
    evaporation = str(rng.choice(["linear", "exponential", "none"]))
    half_life = float(rng.choice([0.5, 3.0, 50.0]))
    diffusion = float(rng.choice([0.0, 0.0, 0.05, 0.6, 1.0]))
    deposit = str(rng.choice(["set", "add", "fading", "none"]))
    if dense and evaporation != "exponential":
        diffusion = max(diffusion, 0.05)
    elif not dense:
        evaporation, diffusion = "linear" if evaporation == "exponential" else evaporation, 0.0
    level = int(rng.choice([1, 7, 250]))
    return Pheromone(
        evaporation=evaporation,
        half_life=half_life if evaporation == "exponential" else None,
        diffusion=diffusion,
        deposit=deposit,
        level=250 if deposit == "none" else level,
        cap=int(rng.choice([1, 10, 1000])) if deposit == "add" else None,
        slope=int(rng.choice([1, 10, 100])) if deposit == "fading" else None,
    )


def _field(seed: int, name: str, view: str) -> Field:
    rng = np.random.default_rng([seed, 4, ord(name)])
    rules = vars(random_pheromone(rng, name.isupper()))
    deposited = rng.choice(["with_food", "without_food", "always", "dead_end", "failed_pick_up"])
    if name in "cC":  # so that two cues have different views
        view = "strongest" if view == "half" else "half"
    return Field(**{**rules, "view": view, "deposited_when": str(deposited)})


def random_training(rng: np.random.Generator, learner: str) -> TrainingConfig:
    """Return a configuration with extreme values."""
    own: dict[str, dict[str, Any]] = {
        "dyna_q": {"planning_steps": 2},
        "n_step_sarsa": {"n_steps": 3},
        "sarsa_lambda": {"trace_decay": 0.9},
        "prioritized_sweeping": {"planning_steps": 3, "threshold": 0.1},
    }
    return TrainingConfig(
        learner=learner,
        learning_rate=float(rng.choice([0.01, 0.37, 1.0])),
        discount=float(rng.choice([0.0, 0.9, 0.99])),
        epsilon=float(rng.choice([0.0, 0.05, 0.3, 1.0])),
        epsilon_decay=float(rng.choice([0.3, 0.99, 1.0])),
        min_epsilon=float(rng.choice([0.0, 0.01, 0.2])),
        hyperparameters=own.get(learner, {}),
        learning_rate_decay=float(rng.choice([0.5, 0.9, 1.0])),
        min_learning_rate=float(rng.choice([0.0, 0.1])),
        initial_q=float(rng.choice([0.0, 0.0, 1.7, -3.0])),
    )


def _rewards(seed: int) -> Rewards:
    rng = np.random.default_rng([seed, 5])
    drawn = Rewards(*rng.integers(-1000, 1001, 5).tolist())
    return drawn if rng.random() < 0.4 else Rewards()


def _choice(seed: int, rule: str) -> Choice:
    rng = np.random.default_rng([seed, 7])
    if rule == "softmax":
        return Choice(rule, temperature=float(rng.choice([0.001, 0.3, 1.0, 40.0])))
    if rule == "deneubourg":
        k, exponent = rng.choice([0.01, 1.0, 20.0, 333.3]), rng.choice([0.0, 1.0, 1.7, 2.0, 6.5])
        return Choice(rule, k=float(k), exponent=float(exponent))
    return Choice(rule)


def _noise(seed: int, kinds: str) -> Noise:
    rng = np.random.default_rng([seed, 8])
    slip, misread = (float(rng.choice([0.02, 0.3, 1.0], p=[0.4, 0.5, 0.1])) for _ in "sm")
    return Noise(slip if "slip" in kinds else 0.0, misread if "misread" in kinds else 0.0)


def forager(observation: str) -> np.ndarray:
    """Return a table that picks up, delivers, and follows trails or the way to the queen."""
    sees = observations.get(observation)
    ahead = [sees.cells.index(cell) for cell in (-1, 0, 1)]
    worth = {"E": 0.5, "-": 0.5, "T": 1.25, "S": 1.25, "1": 0.75, "2": 1.0, "3": 1.25}
    q_values = np.zeros((sees.n_states, N_ACTIONS), np.float32)
    for row in range(sees.n_states):
        load, *cells = sees.name_of(row).split()
        letters = [cells[k] for k in ahead]
        if "F" in letters or "Q" in letters:
            q_values[row, GIVE if load == "carrying" else PICK_UP] = 8
        q_values[row, :3] = [worth.get(letter, -1.0) for letter in letters]
    return q_values


def _with_nests(drawn: Drawn, seed: int, nests: int, kinds: int, loads: bool) -> Drawn:
    rng = np.random.default_rng([seed, 3])
    world, life = drawn.world, drawn.task.life
    taken = world.grid.index(world.ants[:, :3])
    free = np.setdiff1d(np.flatnonzero(world.ground() == EMPTY), taken)
    more = min(nests - 1, len(free) - 1, max(0, len(free) + len(taken) - drawn.population["ants"]))
    queens = world.grid.cells(rng.permutation(free)[:more])
    foods = {
        f"kind_{k}": Food(
            pick_up=int(rng.integers(-2, 9)),
            deliver=int(rng.integers(-2, 30)),
            loads=int(rng.integers(1 + (k == 0), 5)) if loads else 1,
            regrowth=int(rng.choice([0, 1, 4])) if k == 0 or rng.random() < 0.7 else None,
        )
        for k in range(kinds)
    }
    stays = kinds > 1 or loads
    interval = None if stays else life.pile_move_interval
    life = replace(life, regrowth=None, pile_move_interval=interval)
    numbers = rng.integers(0, kinds, len(world.foods))
    world = replace(world, other_queens=queens, food_kinds=numbers, trails=world.trails)
    return drawn._replace(world=world, task=replace(drawn.task, foods=foods, life=life))


def _with_castes(
    drawn: Drawn, seed: int, cues: list[tuple[str, str] | None], labour: bool
) -> Drawn:
    rng, task, nests = np.random.default_rng([seed, 9]), drawn.task, drawn.world.n_nests
    castes: dict[str, dict[str, Any]] = {}
    for k, cue in enumerate(cues):
        castes[f"caste_{k}"] = caste = _caste(rng, drawn)
        if cue:
            caste["outbound_cue"], caste["homing_cue"] = cue
        if labour:
            caste["threshold"] = _threshold(rng) if k else Threshold("fixed", 1.5)
        if nests > 1 and k < len(cues) - 1 and rng.random() < 0.3:
            caste["nest"] = int(rng.integers(nests))
    common, way = [one for one in castes.values() if "nest" not in one], rng.random()
    if way < 0.4 and len(common) == len(castes):
        for one, share in zip(common, rng.dirichlet(np.ones(len(common))), strict=True):
            one["share"] = float(share)
    elif way < 0.7 and len(common) > 1:
        common[0]["ants"] = int(rng.integers(0, drawn.population["ants"] // nests + 1))
    divided = Labour(
        "thresholds",
        demand=float(rng.choice([0.1, 0.7, 3.0])),
        relief=float(rng.choice([0.0, 0.3, 5.0])),
        exponent=float(rng.choice([0.0, 1.0, 1.7, 2.0])),
        stop_probability=float(rng.choice([0.05, 0.4, 1.0])),
    )
    return drawn._replace(task=replace(task, castes=castes, labour=divided if labour else Labour()))


def _caste(rng: np.random.Generator, drawn: Drawn) -> dict[str, Any]:
    task, rule = drawn.task, drawn.task.choice.rule
    deposits = str(rng.choice(["all", "all", "none", "trail", ", ".join(task.fields) or "none"]))
    able: dict[str, Any] = {"lifespan": int(rng.integers(1, 25))}
    if rule == "deneubourg":
        able |= {"k": float(rng.choice([0.5, 100.0])), "exponent": float(rng.choice([0, 1.5, 4]))}
    else:
        able["epsilon"] = float(rng.choice([0.0, 0.2, 1.0]))
        able["learning_rate"] = float(rng.choice([0.02, 0.5, 1.0]))
        able["discount"] = float(rng.choice([0.0, 0.5, 0.95]))
    if rule == "softmax":
        able["temperature"] = float(rng.choice([0.1, 5.0]))
    if task.life.lifespan is None and not task.life.births:
        del able["lifespan"]
    found: dict[str, Any] = {name: one for name, one in able.items() if rng.random() < 0.5}
    follows = rule != "deneubourg" and drawn.sharing != "independent"
    if follows and task.observation == "paper" and rng.random() < 0.3:
        found["policy"] = str(rng.choice(["random", "trail_follower"]))
    if found.get("epsilon") == 0.2 and "discount" not in found:
        found["epsilon_spread"] = 0.15
    return {"lays": deposits, **found}


def _threshold(rng: np.random.Generator) -> Threshold:
    kind = str(rng.choice(["fixed", "uniform", "normal"]))
    value, spread = float(rng.choice([0.3, 2.0, 7.0])), float(rng.choice([0.0, 0.3]))
    return Threshold(kind, value) if kind == "fixed" else Threshold(kind, value, spread=spread)


def random_trainings(learner: str, n: int, noisy: bool) -> Iterator[tuple[str, Any]]:
    """Yield names and arguments of `train`: a world, a configuration, a seed and a task."""
    names = {"q_learning": "paper", "sarsa": "ants", "dyna_q": "six_cells", "double_q": "paper"}
    deposits = {"q_learning": "fading", "sarsa": "set", "dyna_q": "none"}
    for number in range(n):
        rng = np.random.default_rng([number, len(learner), 1 + noisy])
        deposit = deposits.get(learner, "add")
        pheromone = Pheromone(
            evaporation=str(rng.choice(["linear", "none"])),
            deposit=deposit,
            level=250 if deposit == "none" else int(rng.choice([1, 7, 250])),
            cap=int(rng.choice([1, 10, 1000])) if deposit == "add" else None,
            slope=int(rng.choice([1, 10, 100])) if deposit == "fading" else None,
            view="strongest" if deposit == "fading" else "half",
        )
        task = Task(
            observation=names.get(learner, "trail_levels"),
            rewards=_rewards(number),
            pheromone=pheromone,
            delivery=str(rng.choice(["terminates", "truncates"])),
            turns_at_queen=bool(rng.random() < 0.3),
            evaporation_in_training=bool(rng.random() < 0.7),
            evaporation_in_evaluation=bool(rng.random() < 0.7),
            choice=_choice(number, "softmax" if noisy else "greedy"),
            noise=_noise(number, NOISE if noisy else ""),
        )
        world = random_world(5000 + 40 * len(learner) + number)
        seed = int(rng.integers(-5, 2**40))
        yield (
            f"{learner}-{number}{'-noisy' * noisy}",
            (*(world, random_training(rng, learner), seed, task),),
        )


_MEASURES = ("deliveries", "living", "carriers")


def random_events(drawn: Drawn) -> list[protocol.Event]:
    """Return a protocol of four events, which the worlds may still not allow."""
    rng, world, task = np.random.default_rng([drawn.seed % 2**32, 21]), drawn.world, drawn.task
    events: list[protocol.Event] = []
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
