"""What a page can choose from for a new session: worlds, rules, and who decides what ants do.

A choice is a small JSON-able dict of names and numbers; policies are those that the command was
given, so no page ever names a file.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import combinations
from typing import Any

import numpy as np

from taichi_ants import learners, task, worlds
from taichi_ants.errors import AntsError, check_one_of, checked_whole, expect, shown
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.policies import FOLLOWED, Policy, trail_follower
from taichi_ants.live.setup import MOST_ANTS, MOST_TEXT, Setup
from taichi_ants.task import Life, Pheromone, Task, observations
from taichi_ants.task.traffic import Traffic

# Rules of what comes and goes, which stand beside those of any task.
LIFE = ("births", "deaths", "regrowth", "wanders")
WORLDS = {
    "paper": "the paper's world",
    "open": "an open world",
    "far_piles": "three far piles",
    "double_bridge": "a double bridge",
    "map": "a map of your own",
}
DRAWN = tuple(filter(worlds.is_drawn, WORLDS))  # at random, with equal ranges of any size
SIZE, SIZES = 30, (10, 180)  # the usual one; the least and the largest
TASKS = {
    "paper": ("the paper's", task.paper()),
    "foraging": ("foraging", task.foraging()),
    "queueing": ("queueing", task.queueing()),
}
RULES = {  # what each adds to the paper's rules, in words
    "rising": "Trails rise towards food",
    "right_of_way": "Ants with food have right of way",
    "queues": "Queues move as one",
    "falls": "Trails evaporate while ants learn",
    "spreads": "Trails halve and spread instead",
    "births": "Each delivery brings an ant",
    "deaths": "Ants die after 3000 ticks",
    "regrowth": "Food grows back at once",
    "wanders": "Piles of food wander",
}
LEARNS, FOLLOWS = "learn ", "file "  # how the names of policies begin
BY_HAND = "by hand"

# What 64 ants need to learn to forage together in 60 episodes; see docs/foraging.md.
_LEARNING: dict[str, Any] = {
    **{"learning_rate": 0.1, "discount": 0.9, "epsilon": 0.3, "epsilon_decay": 0.92},
    **{"learning_rate_decay": 0.95, "min_learning_rate": 0.01, "initial_value": 10.0},
}


def task_of(rules: Iterable[str], sees: str) -> Task:
    """The paper's task with some of the `RULES`, and an observation.

    Raises:
        AntsError: There is no such rule or observation.
    """
    chosen = set(rules)
    for rule in chosen:
        check_one_of("a rule", rule, tuple(RULES))
    queues = "queues" in chosen
    how: dict[str, Any] = {}
    if "rising" in chosen:
        view = "strongest_under_carriers" if queues else "strongest"
        how = {"deposit": "fading", "level": 500, "view": view}
    if "spreads" in chosen:
        how |= {"evaporation": "exponential", "half_life": 100, "diffusion": 0.05}
    traffic = "following" if queues else "right_of_way" if "right_of_way" in chosen else "blocking"
    return Task(
        observation=sees,
        pheromone=Pheromone(**how),
        traffic=Traffic.named(traffic),
        turns_at_queen=queues,
        evaporation_in_training="falls" in chosen,
        life=Life(
            births="births" in chosen,
            lifespan=3000 if "deaths" in chosen else None,
            regrowth=0 if "regrowth" in chosen else None,
            wander=20 if "wanders" in chosen else None,
        ),
    )


@cache
def rules_of(rules: Task) -> tuple[str, ...] | None:
    """The `RULES` that make a task, as few as possible; None if it has others."""
    for n in range(len(RULES) + 1):
        for chosen in combinations(RULES, n):
            if task_of(chosen, rules.observation) == rules:
                return chosen
    return None


@dataclass(frozen=True)
class Choices:
    """What pages can choose from.

    Attributes:
        policies: By their names, besides learning and the one that is made by hand.
    """

    policies: Mapping[str, Policy]

    def as_dict(self) -> dict[str, Any]:
        """What a page offers, as JSON can hold it."""
        return {
            "worlds": WORLDS,
            "tasks": {
                name: {"words": words, "rules": rules_of(rules), "sees": rules.observation}
                for name, (words, rules) in TASKS.items()
            },
            "rules": RULES,
            "life": LIFE,
            "sees": {name: observations.get(name).summary for name in observations.names()},
            "learners": {
                name: {"words": learners.label(name), "summary": learners.get(name).summary}
                for name in learners.names()
            },
            "by_hand": list(FOLLOWED),
            "policies": {
                name: {"sees": policy.observation, "rules": rules_of(policy.task)}
                for name, policy in self.policies.items()
            },
            "drawn": DRAWN,
            "sizes": SIZES,
            "most": {"ants": MOST_ANTS, "text": MOST_TEXT},
        }

    def setup(self, chosen: Any) -> Setup:
        """The session that a page has chosen.

        Args:
            chosen: {"world": of `WORLDS`, "map": text, "world_seed", "size": of a world that is
                drawn, "rules": list of `RULES`, or None for those of a policy, "sees": an
                observation, "policy": "learn sarsa", "file NAME" or "by hand", "ants", "seed",
                "ticks": of an episode, 0 for one without end}.

        Raises:
            AntsError: Something is not allowed, or is not there.
        """
        expect("what was chosen", chosen, dict)
        known = ("world", "map", "world_seed", "size", "rules", "sees", "policy")
        for name in {*known, "ants", "seed", "ticks"} - chosen.keys():
            raise AntsError(f"{name} is not chosen; choose it.")
        policy, table, name = chosen["policy"], None, ""
        expect("policy", policy, str)
        rules = self._task(chosen)
        if policy.startswith(LEARNS):
            name = policy.removeprefix(LEARNS)
            check_one_of("the learner", name, learners.names())
        elif policy == BY_HAND:
            table = trail_follower(rules.observation)
        else:
            table = self._file(policy).q_values
        world = chosen["world"]
        check_one_of("the world", world, tuple(WORLDS))
        size = checked_whole("the size", chosen["size"], *SIZES)
        shares = table is not None or learners.get(name).td_error is not None
        return Setup(
            world=_map(chosen["map"]) if world == "map" else world,
            task=rules,
            policy=TrainingConfig(name, **_LEARNING) if table is None else table,
            ants=checked_whole("how many ants", chosen["ants"], 1, MOST_ANTS),
            seed=checked_whole("the seed", chosen["seed"], 0),
            ticks_per_episode=checked_whole("ticks an episode", chosen["ticks"], 0, 1_000_000),
            sharing="shared" if shares else "own",
            world_seed=checked_whole("the seed of the world", chosen["world_seed"], 0),
            world_settings={"ranges": [size] * 3} if world in DRAWN else {},
        )

    def chosen(self, setup: Setup) -> dict[str, Any]:
        """What a page would have to choose for a session, as near as it can come."""
        table, is_map = setup.policy, setup.world not in WORLDS
        if isinstance(table, TrainingConfig):
            policy = LEARNS + table.learner
        else:
            named = self.policies.items()
            same = (name for name, one in named if np.array_equal(one.q_values, table))
            policy = next((FOLLOWS + name for name in same), BY_HAND)
        return {
            "world": "map" if is_map else setup.world,
            "map": setup.world if is_map else "",
            "world_seed": setup.world_seed,
            "size": setup.world_settings.get("ranges", [SIZE])[0],
            "rules": rules_of(setup.task),
            "sees": setup.task.observation,
            "policy": policy,
            "ants": setup.ants,
            "seed": setup.seed,
            "ticks": setup.ticks_per_episode,
        }

    def _file(self, policy: str) -> Policy:
        name = policy.removeprefix(FOLLOWS)
        check_one_of("the policy", name, tuple(self.policies))
        return self.policies[name]

    def _task(self, chosen: dict[str, Any]) -> Task:
        rules, sees = chosen["rules"], chosen["sees"]
        if chosen["policy"].startswith(FOLLOWS):
            policy = self._file(chosen["policy"])
            sees = policy.observation
            if rules is None:
                return policy.task
        expect("rules", rules, list)
        for rule in rules:
            expect("a rule", rule, str)
        expect("sees", sees, str)
        return task_of(rules, sees)


def _map(text: Any) -> str:
    """The text of a map, never the name of a world or of a file."""
    expect("the map", text, str)
    if len(text) > MOST_TEXT or "\n" not in text:
        raise AntsError(
            f"the map is {shown(text)}; it must have several lines, of at most {MOST_TEXT} "
            "characters together."
        )
    return text
