"""What pages offer: the form for a new session, and the sliders of the present one.

A choice is a small JSON-compatible dict of names and numbers. Pages choose among the policies that
the command loaded, and cannot name files. The fields of the form are made from the declarations of
the settings, see `taichi_ants.settings`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from taichi_ants import learners, worlds
from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.errors import AntsError, check_one_of, checked_whole, expect
from taichi_ants.features import FEATURES
from taichi_ants.features.rule import Parameters
from taichi_ants.features.support import refuse_unsupported
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.policies import FOLLOWED, Policy, trail_follower
from taichi_ants.live.setup import FORM_SUPPORTS, MOST_ANTS, MOST_TEXT, Setup
from taichi_ants.settings import MISSING, DeclaredSetting, Named, all_of, declared, flat, nested
from taichi_ants.task import Task, observations

WORLDS = {
    "paper": "the paper's world",
    "open": "an open world",
    "far_piles": "three far piles",
    "double_bridge": "a double bridge",
    "map": "your own map",
}
SIZE, SIZES = 30, (10, 180)  # of a random world: default range along each axis; bounds
TASKS = {"paper": "the paper's", "foraging": "foraging", "queueing": "queueing"}
LEARNS, FOLLOWS = "learn ", "file "  # prefixes of the names of policies
BY_HAND = "by hand"
_NEEDED = {"ants", "map", "policy", "seed", "settings", "size", "ticks", "world", "world_seed"}

# 64 ants learn to forage together with these in 60 episodes; see docs/results/foraging.md.
_LEARNING: dict[str, Any] = {
    **{"learning_rate": 0.1, "discount": 0.9, "epsilon": 0.3, "epsilon_decay": 0.92},
    **{"learning_rate_decay": 0.95, "min_learning_rate": 0.01, "initial_q": 10.0},
}

# The page has no castes, which some features require.
_OF_CASTES = tuple(f"task.{feature.group}." for feature in FEATURES if "castes" in feature.example)


def fields() -> Iterator[dict[str, Any]]:
    """Yield the fields of the form, JSON-compatible.

    Each has "path", "kind", "words", "least", "most", "above", "unit", "help", "optional" and
    "default". "only" (a path and its values), "world" and "learner" limit a field to these.
    """
    for setting in all_of(Task):
        is_text = setting.kind is str and not setting.allowed_words
        has_no_field = setting.is_group or is_text or setting.kind is Named
        if not has_no_field and not setting.path.startswith(_OF_CASTES):
            yield _field(setting)
    for setting in declared(TrainingConfig)[1:]:
        default = _LEARNING.get(setting.name, setting.default)
        yield {**_field(setting), "default": default, "learner": ""}
    for name in learners.names():
        for setting in declared(learners.get(name).hyperparameters):
            yield {**_field(setting), "learner": name}
    for name in WORLDS.keys() - {"map"}:
        for setting in worlds.registry.settings_of(name):
            if setting.name != "ranges":
                yield {**_field(setting), "world": name}


def _field(setting: DeclaredSetting) -> dict[str, Any]:
    rule, group = setting.rule, setting.path.rpartition(".")[0]
    default = setting.default if rule.usual is None else rule.usual
    return {
        **{"path": setting.path, "kind": setting.kind.__name__, "words": setting.allowed_words},
        **{"least": rule.least, "most": rule.most, "above": rule.above},
        **{"unit": rule.unit, "help": rule.help, "optional": setting.optional and not rule.only},
        "default": None if default is MISSING else default,
        "only": rule.only and [f"{group}.{rule.only[0]}", *rule.only[1:]],
    }


@dataclass(frozen=True)
class Choices:
    """The choices that pages offer."""

    policies: Mapping[str, Policy]  # policies to follow, in addition to "by hand"

    def __post_init__(self) -> None:
        for policy in self.policies.values():
            refuse_unsupported(
                "the form of the live page",
                policy.task.uses(),
                FORM_SUPPORTS,
                "make a Session in Python, and open its file with --session",
            )

    def as_dict(self) -> dict[str, Any]:
        """Return all choices, JSON-compatible."""
        return {
            "worlds": WORLDS,
            "tasks": {
                name: {"words": words, "settings": flat(Task.named()[name].as_dict(), "task")}
                for name, words in TASKS.items()
            },
            "settings": list(fields()),
            "sees": {name: observations.get(name).summary for name in observations.names()},
            "learners": {
                one: {"words": learners.registry.label(one), "summary": learners.get(one).summary}
                for one in learners.names()
            },
            "by_hand": list(FOLLOWED),
            "policies": {
                name: flat(policy.task.as_dict(), "task") for name, policy in self.policies.items()
            },
            "drawn": [name for name in WORLDS if worlds.registry.is_drawn(name)],
            "sizes": SIZES,
            "most": {"ants": MOST_ANTS, "text": MOST_TEXT},
        }

    def setup(self, chosen: Any) -> Setup:
        """Return the setup that a page has chosen.

        Args:
            chosen: A dict with these keys. "world" is a key of `WORLDS`, "map" a text; "world_seed"
                and "size" apply to random worlds. "settings" are values by the paths of `fields`.
                "policy" is "learn sarsa" (or another learner), "file NAME" or "by hand". "ants" and
                "seed" are numbers; "ticks" is the length of an episode, 0 for no end.

        Raises:
            AntsError: A value is missing or not allowed.
        """
        expect("the choice", chosen, dict)
        if missing := sorted(_NEEDED - chosen.keys()):
            raise AntsError(f"{missing[0]} is missing; choose a value.")
        world, policy, table, name = chosen["world"], chosen["policy"], None, ""
        check_one_of("the world", world, tuple(WORLDS))
        expect("policy", policy, str)
        if policy.startswith(LEARNS):
            name = policy.removeprefix(LEARNS)
            check_one_of("the learner", name, learners.names())
        expect("the map", chosen["map"], str)
        # Several lines cannot be the name of a world or a file.
        named = world if world != "map" else chosen["map"].rstrip() + "\n"
        expect("settings", chosen["settings"], dict)
        offered = {
            field["path"]
            for field in fields()
            if field.get("world", world) == world and field.get("learner", "") in ("", name)
        }
        # Tasks also have settings that the form lacks.
        settings = nested({k: v for k, v in chosen["settings"].items() if k in offered})
        task = Task.from_dict(settings.get("task", {}))
        if policy == BY_HAND:
            table = trail_follower(task.observation)
        elif not name:
            check_one_of("the policy", policy, [f"{FOLLOWS}{name}" for name in self.policies])
            file = self.policies[policy.removeprefix(FOLLOWS)]
            task, table = task.replace(observation=file.observation), file.q_values
        size = checked_whole("the size", chosen["size"], *SIZES)
        shares = table is not None or learners.get(name).td_error is not None
        training = {**_LEARNING, **settings.get("training", {})}
        ranges = {"ranges": [size] * 3} if worlds.registry.is_drawn(world) else {}
        return Setup(
            world=named,
            task=task,
            policy=TrainingConfig(name, **training) if table is None else table,
            ants=chosen["ants"],
            seed=checked_whole("the seed", chosen["seed"], 0),
            ticks_per_episode=chosen["ticks"],
            sharing="shared" if shares else "independent",
            world_seed=checked_whole("the seed of the world", chosen["world_seed"], 0),
            world_settings={**settings.get("world", {}), **ranges},
        )

    def chosen(self, setup: Setup) -> dict[str, Any]:
        """Return the choice for a setup, as closely as the form can represent it."""
        table, is_map = setup.policy, setup.world not in WORLDS
        settings = flat(setup.task.as_dict(), "task")
        settings |= {f"world.{n}": v for n, v in setup.world_settings.items() if n != "ranges"}
        if isinstance(table, TrainingConfig):
            policy = LEARNS + table.learner
            numbers = {**asdict(table), **dict(table.hyperparameters)}
            settings |= {f"training.{n}": v for n, v in numbers.items() if type(v) in (int, float)}
        else:
            policy = BY_HAND
            for name, offered in self.policies.items():
                if np.array_equal(offered.q_values, table):
                    policy = FOLLOWS + name
        return {
            "world": "map" if is_map else setup.world,
            "map": setup.world if is_map else "",
            "world_seed": setup.world_seed,
            "size": setup.world_settings.get("ranges", [SIZE])[0],
            "settings": settings,
            "policy": policy,
            "ants": setup.ants,
            "seed": setup.seed,
            "ticks": setup.ticks_per_episode,
        }


class Value(NamedTuple):
    """A number that a slider shows and changes."""

    value: float  # at present
    least: float
    most: float
    step: float  # of the slider; if it is an int, all values are whole numbers
    path: str  # the name of the intervention, for "task" followed by that of the setting
    edits: Mapping[str, dict[str, Any]] | None = None  # the edits for "0" and "1", for a switch
    help: str = ""  # of a parameter of a rule that a user wrote


def sliders(interventions: Interventions) -> dict[str, Value]:
    """Return the values of the sliders for a colony, by name, if they have an effect there.

    - ants: the number of living ants, and if changed, also at the start of later episodes.
    - epsilon, learning_rate: if changed, they no longer decay.
    - deposit: the `level` of `Pheromone`; slope, cap, half_life, diffusion: as in `Pheromone`.
    - evaporation: 1 if trails evaporate, else 0.
    - RULE.PARAMETER: a parameter of a rule that you wrote.
    """
    colony, pheromone = interventions.colony, interventions.colony.pheromones[0]
    living, rules = int(np.count_nonzero(colony.living[0])), "task.pheromone"
    values = {"ants": Value(max(living, 1), 1, colony.capacity, 1, "ants")}
    if colony.task.needs_table:
        values["epsilon"] = Value(colony.epsilon, 0.0, 1.0, 0.01, "epsilon")
    if colony.sharing != "frozen":
        values["learning_rate"] = Value(colony.learning_rate, 0.0, 1.0, 0.001, "learning_rate")
    numbers = (("deposit", "level", 1000), ("slope", "slope", 100), ("cap", "cap", 10_000))
    for name, setting, largest in numbers:
        number = getattr(pheromone, setting)
        if number is not None and not (setting == "level" and pheromone.deposit == "none"):
            values[name] = Value(int(number), 1, max(largest, int(number)), 1, f"{rules}.{setting}")
    falls, evaporating = pheromone.evaporation != "none", colony.task.pheromone
    if evaporating.evaporation == "none":
        evaporating = replace(evaporating, evaporation="linear")
    if (evaporating.lasting if falls else evaporating).dense == pheromone.dense:
        flag = "evaporation_in_training" if colony.learns else "evaporation_in_evaluation"
        switches: dict[str, dict[str, Any]] = {str(n): {"task": {flag: bool(n)}} for n in (0, 1)}
        if colony.task.pheromone.evaporation == "none":
            switches["1"]["task"]["pheromone.evaporation"] = "linear"
        values["evaporation"] = Value(int(falls), 0, 1, 1, "task", switches)
    if pheromone.half_life is not None:
        half_life = float(pheromone.half_life)
        values["half_life"] = Value(
            half_life, min(1.0, half_life), max(1000.0, half_life), 0.5, f"{rules}.half_life"
        )
    if pheromone.dense:  # integer trails cannot diffuse, and dense trails cannot become integers
        least = 0.0 if pheromone.evaporation == "exponential" else min(0.01, pheromone.diffusion)
        values["diffusion"] = Value(pheromone.diffusion, least, 1.0, 0.01, f"{rules}.diffusion")
    return values | _of_rules(colony.task.rules)


def _of_rules(rules: Mapping[str, Parameters]) -> dict[str, Value]:
    """Return the values of the parameters of rules, by RULE.PARAMETER."""
    values = {}
    for name, parameters in rules.items():
        for setting in declared(type(parameters)):
            value, rule = getattr(parameters, setting.name), setting.rule
            # A bound that is not declared leaves room on the side of the default.
            low = rule.above if rule.least is None else rule.least
            least = min(value, 0, 2 * setting.default) if low is None else low
            most = max(value, 2 * setting.default, least + 1) if rule.most is None else rule.most
            step = 1 if setting.kind is int else 10.0 ** math.floor(math.log10(most - least) - 2)
            least += step * (rule.least is None and rule.above is not None)
            help = f"{rule.help} of the rule {name}, by default {setting.default:g}"
            path = f"task.rules.{name}.{setting.name}"
            values[f"{name}.{setting.name}"] = Value(value, least, most, step, path, help=help)
    return values
