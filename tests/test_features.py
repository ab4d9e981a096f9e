"""Features: what a task or a world uses is refused wherever it is not supported, also if new."""

import re
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pytest

from taichi_ants import (
    AntsError,
    Colony,
    TrainingConfig,
    World,
    evaluate,
    record,
    record_colony,
    rollout,
    task,
    trace_training,
    train,
    worlds,
)
from taichi_ants.analysis.bounds import EpisodeBounds
from taichi_ants.envs.colony import HexColonyVectorEnv
from taichi_ants.envs.colony_v0 import parallel_env
from taichi_ants.envs.forage import HexForageEnv, HexForageVectorEnv
from taichi_ants.features.support import COLONY, LONE
from taichi_ants.learners.policies import Policy
from taichi_ants.live.choices import Choices
from taichi_ants.live.setup import Setup
from taichi_ants.reference.colony import ReferenceColony
from taichi_ants.settings import Setting, declared
from taichi_ants.studies.points import ColonyPoint, RunPoint
from taichi_ants.task import Task

WORLD, LEARNER = worlds.paper(), TrainingConfig("q_learning", 0.1, 0.9, 0.1, 1.0)
TABLE = np.zeros((128, 5), np.float32)
NESTS = World((7, 7, 7), (0, 6, 0), [(0, 0, 5)], other_queens=[(6, 0, 0)])


@dataclass(frozen=True, repr=False)
class ToyTask(Task, path="task"):
    """A task with a feature that no set names."""

    toy: Annotated[bool, Setting("a feature")] = False


def record_from(rules):
    """Record a colony with these rules, which are set after it was made."""
    colony = Colony(WORLD, Task(), LEARNER)
    colony.task = rules
    return record_colony(colony, 1, 1)


def form(rules):
    """Offer a policy with these rules on the live page; its file cannot name unknown settings."""
    policy = type("Known", (Policy,), {"task": rules})
    return Choices({"mine": policy(TABLE, "paper", {})})


LONE_RUNS = {
    "train": lambda rules: train(WORLD, LEARNER, 0, 1, task=rules),
    "evaluate": lambda rules: evaluate(WORLD, TABLE, task=rules),
    "rollout": lambda rules: rollout(WORLD, TABLE, task=rules),
    "trace_training": lambda rules: trace_training(WORLD, LEARNER, task=rules),
    "record": lambda rules: record(WORLD, task=rules),
    "RunPoint": lambda rules: RunPoint(WORLD, rules, LEARNER),
}
ENVIRONMENTS = {
    "HexForageEnv": lambda rules: HexForageEnv(task=rules),
    "HexForageVectorEnv": lambda rules: HexForageVectorEnv(task=rules),
    "HexColonyVectorEnv": lambda rules: HexColonyVectorEnv(task=rules),
    "colony_v0": lambda rules: parallel_env(task=rules),
}
COLONIES = {
    "Colony": lambda rules: Colony(WORLD, rules, LEARNER),
    "ReferenceColony": lambda rules: ReferenceColony(WORLD, rules, LEARNER, 0),
    "ColonyPoint": lambda rules: ColonyPoint(WORLD, rules, LEARNER),
    "live page": lambda rules: Setup("paper", rules, LEARNER),
}
OTHERS = {
    "form": form,
    "record_colony": record_from,
    "EpisodeBounds": lambda rules: EpisodeBounds(WORLD, rules),
}
ALL = {**LONE_RUNS, **ENVIRONMENTS, **COLONIES, **OTHERS}


@pytest.mark.parametrize("who", ALL)
def test_a_new_feature_is_refused_wherever_no_set_names_it(who):
    """Without it, the same call is accepted."""
    ALL[who](ToyTask())
    with pytest.raises(
        AntsError, match=r"^`task\.toy` is True, which .* does not support; [^.]*\.$"
    ):
        ALL[who](ToyTask(toy=True))


ALONE = ["HexForageEnv", "EpisodeBounds"]
# Changes of the paper's task, the message after "`task.", and who does not support it.
REFUSED = [
    (
        {"life": {"births": True}},
        "life.births` is True",
        [*LONE_RUNS, *ALONE, "HexColonyVectorEnv"],
    ),
    ({"life": {"regrowth": 0}}, "life.regrowth` is 0", [*LONE_RUNS, "EpisodeBounds"]),
    ({"pheromone": {"diffusion": 0.5}}, "pheromone.diffusion` is 0.5", [*LONE_RUNS, *ALONE]),
    (
        {"pheromone": {"evaporation": "exponential"}},
        "pheromone.evaporation` is 'exponential'",
        [*LONE_RUNS, "HexForageVectorEnv"],
    ),
    ({"fields": {"home": {}}}, "fields` has home", [*LONE_RUNS, "HexForageEnv", "form"]),
    ({"homing_cue": "trail"}, "homing_cue` is 'trail'", [*LONE_RUNS, "form"]),
    ({"foods": {"sap": {}, "seed": {}}}, "foods` has sap, seed", [*LONE_RUNS, *OTHERS]),
    ({"castes": {"a": {}}}, "castes` has a", [*LONE_RUNS, *ENVIRONMENTS, *OTHERS]),
    ({"choice": "deneubourg"}, "choice.rule` is 'deneubourg'", [*LONE_RUNS, *ENVIRONMENTS]),
    ({"choice": "deneubourg"}, "choice.rule` is 'deneubourg'", ["record_colony"]),
    ({"choice": "softmax"}, "choice.rule` is 'softmax'", [*ENVIRONMENTS]),
    ({"noise": {"slip": 0.1}}, "noise.slip` is 0.1", ["EpisodeBounds"]),
]


@pytest.mark.parametrize(
    ("changes", "words", "who"), [(*row, who) for *row, several in REFUSED for who in several]
)
def test_features_are_refused_where_they_are_not_supported(changes, words, who):
    message = rf"^`task\.{re.escape(words)}, which .* does not support; [^.]*\.$"
    with pytest.raises(AntsError, match=message):
        ALL[who](Task().replace(**changes))


@pytest.mark.parametrize("run", [
    lambda: train(NESTS, LEARNER, 0, 1),
    lambda: HexForageEnv(NESTS),
    lambda: EpisodeBounds(NESTS, Task()),
    lambda: record_colony(Colony(NESTS, Task(), LEARNER)),
])  # fmt: skip
def test_worlds_of_several_nests_are_for_colonies(run):
    with pytest.raises(AntsError, match=r"the world has 2 nests, which .* does not support"):
        run()


def test_colonies_support_all_features_and_sets_name_no_other():
    """A renamed setting must be renamed in the sets, too."""
    known = {"reads", "nests", "kinds of food"}
    for one in declared(Task):
        inner = declared(one.kind) if one.is_group else ()
        own = {f"{one.name}.{setting.name}" for setting in inner}
        assert one.name in COLONY or own <= COLONY | {"pheromone.view"}, one.path
        known |= {one.name, *own}
    assert {feature.partition("=")[0] for feature in COLONY | LONE} <= known


def test_tasks_use_what_differs_from_the_paper():
    assert Task().uses() == WORLD.uses() == {}
    rules = Task().replace(
        observation="ants", fields={"home": {}}, choice="softmax", noise={"slip": 0.25}
    )
    assert rules.uses() == {
        "observation=ants": "`task.observation` is 'ants'",
        "fields": "`task.fields` has home",
        "choice.rule=softmax": "`task.choice.rule` is 'softmax'",
        "choice.temperature": "`task.choice.temperature` is 1.0",
        "noise.slip": "`task.noise.slip` is 0.25",
    }
    assert set(task.queueing().uses()) <= LONE | {"observation=queues"} | {
        f"traffic.{name}" for name in ("swap", "follow", "carriers_first", "reward_pushed")
    } | {"pheromone.view=strongest_under_carriers"}
