"""The form for a new session: world, settings and policy.

A choice is a small JSON-compatible dict of names and numbers. Pages choose among the policies that
the command loaded, and cannot name files. The fields of the form are made from the declarations of
the settings, see `taichi_ants.settings`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from taichi_ants import learners, worlds
from taichi_ants.errors import AntsError, check_one_of, checked_whole, expect
from taichi_ants.features import FEATURES
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

# With these settings, 64 ants learn to forage together in 60 episodes; see docs/foraging.md.
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
        for setting in worlds.settings_of(name):
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
                name: {"words": learners.label(name), "summary": learners.get(name).summary}
                for name in learners.names()
            },
            "by_hand": list(FOLLOWED),
            "policies": {
                name: flat(policy.task.as_dict(), "task") for name, policy in self.policies.items()
            },
            "drawn": [name for name in WORLDS if worlds.is_drawn(name)],
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
        ranges = {"ranges": [size] * 3} if worlds.is_drawn(world) else {}
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
