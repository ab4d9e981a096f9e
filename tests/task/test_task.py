"""What a task can be, how it is written down, and what is refused."""

import dataclasses
import json

import numpy as np
import pytest
from random_rewards import random_rewards
from refusals import refused

from taichi_ants import At, Colony, TrainingConfig, train, worlds
from taichi_ants.errors import AntsError
from taichi_ants.features.cues import CUES
from taichi_ants.interventions import from_dict
from taichi_ants.protocol import Every, When
from taichi_ants.task import (
    Choice,
    Field,
    Life,
    Noise,
    Pheromone,
    Rewards,
    Task,
    Threshold,
    Traffic,
    observations,
)
from taichi_ants.task.observations import Observation, observation


def test_a_task_can_be_written_as_json():
    for task in (
        Task(),
        Task("six_cells", random_rewards(3), delivery="truncates", evaporation_in_training=True),
        Task(pheromone=Pheromone("exponential", 7.5, 0.1, "add", 9, 99), life=Life(True, 5, 0, 2)),
    ):
        assert Task.from_dict(json.loads(json.dumps(task.as_dict()))) == task
    assert Task.from_dict({"rewards": {"deliver": 5}}) == Task(rewards=Rewards(deliver=5))
    assert Task.from_dict({"traffic": "following"}) == Task(traffic=Traffic.named()["following"])


@pytest.fixture
def _no_observation_stays(monkeypatch):
    monkeypatch.setattr(observation.OBSERVATIONS, "yours", dict(observation.OBSERVATIONS.yours))


def always_zero(view):
    return 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"n_states": 0}, "n_states of 'mine' is 0; it must lie between 1"),
        ({"encode": 3}, "encode of 'mine' is 3; it must be a function of one argument"),
        ({"cells": (0, 1)}, r"cells of 'mine' is \(0, 1\); it must be a tuple of -1, 0, 1"),
        ({"name_of": int}, "name_of fails .the name of state 0 is 0; it must be text.;"),
        ({"cells": (-1, 0, 1, 4)}, "optionally -2, 2 and 3"),
        ({"reads": ("a", "a")}, r"reads of 'mine' is \('a', 'a'\); it must be a tuple of names"),
        ({"reads": ("level",)}, r"reads of 'mine' is \('level',\); it must be a tuple of names"),
        ({"shape": (2, 2)}, r"shape of 'mine' is \(2, 2\); it must be a tuple of .*n_states, 1;"),
    ],
)
@pytest.mark.usefixtures("_no_observation_stays")
def test_an_observation_that_cannot_be(changes, message):
    mine = Observation("mine", 1, always_zero)
    with pytest.raises(AntsError, match=message):
        observations.register(dataclasses.replace(mine, **changes))


@pytest.mark.parametrize("name", observations.names())
def test_each_row_has_a_name_of_its_own(name):
    """All but those that cannot be, which have a dash."""
    one = observations.get(name)
    names = [name for name in map(one.name_of, range(one.n_states)) if "-" not in name]
    assert len(set(names)) == len(names) >= 128


def test_the_numbers_that_kernels_take():
    pheromone = Pheromone("exponential", half_life=1, diffusion=0.6)
    assert (pheromone.decay, type(pheromone.decay)) == (np.float32(0.5), np.float32)
    assert (pheromone.share, type(pheromone.share)) == (np.float32(0.1), np.float32)
    assert Pheromone("exponential", 50).decay == np.float32(0.5**0.02)
    assert [
        Pheromone(evaporation, diffusion=diffusion).dense
        for evaporation in ("linear", "none", "exponential")
        for diffusion in (0, 0.1)
    ] == [False, True, False, True, True, True]


HOME = {"home": {"deposited_when": "without_food"}}


def test_cues_are_fields_of_the_task():
    task = Task(fields=HOME, homing_cue="home")
    assert task == Task().replace(fields=HOME, homing_cue="home") == Task.from_dict(task.as_dict())
    assert task.fields["home"] == Field(deposited_when="without_food")
    assert Task(life={"regrowth": 3}) == Task().replace(life={"regrowth": 3})


def castes(**settings):
    return lambda: Task(castes={"a": settings})


SENSES = ", ".join(CUES)
UNLESS, UNKNOWN, ADD = (
    "; leave it out unless `",
    "is not a setting; choose ",
    "or the name of a field",
)
CELLS = Choice("deneubourg", carriers_follow="trail")
WIDE = {"distribution": "uniform", "value": 1, "spread": 2}
REFUSED = [
    (lambda: Pheromone(half_life=10), f"task.pheromone.half_life` is 10.0{UNLESS}evaporation`"),
    (lambda: Pheromone("none", half_life=10), f"task.pheromone.half_life` is 10.0{UNLESS}evapor"),
    (lambda: Pheromone(cap=10), f"task.pheromone.cap` is 10{UNLESS}deposit` is 'add'."),
    (lambda: Pheromone(slope=10), f"task.pheromone.slope` is 10{UNLESS}deposit` is 'fading'."),
    (lambda: Pheromone(deposit="none", level=3), f"task.pheromone.level` is 3{UNLESS}deposit`"),
    (lambda: Traffic(reward_pushed=True), f"task.traffic.reward_pushed` is True{UNLESS}swap`"),
    (lambda: Traffic(carriers_first=True), f"task.traffic.carriers_first` is True{UNLESS}swap`"),
    (lambda: Traffic(swap="yes"), "task.traffic.swap` is 'yes'"),
    (lambda: Task(traffic="left"), "is 'left'; it must be a Traffic, or one of blocking, r"),
    (lambda: Choice("greedy", temperature=2.0), f"task.choice.temperature` is 2.0{UNLESS}rule`"),
    (lambda: Noise(slip=1.5), "task.noise.slip` is 1.5; it must be between 0 and 1."),
    (lambda: Task(choice=CELLS, homing_cue="trail"), "which ants with food follow already"),
    (lambda: Task("ants", choice="deneubourg"), "task.observation` is 'ants'; it must be 'paper'"),
    (lambda: Task(homing_cue="hoem"), f"is 'hoem'; it must be one of {SENSES}, trail, {ADD}"),
    (lambda: Task(outbound_cue="compass"), f"is 'compass'; it must be one of trail, {ADD}"),
    *(
        (lambda name=name: Task(fields={name: {}}), f"has a field {name!r}, a name that is taken")
        for name in ("trail", "compass", "all", "none")
    ),
    (lambda: Field(slop=3), f"task.fields.NAME.slop` {UNKNOWN}slope."),
    (lambda: Task(fiels={}), f"task.fiels` {UNKNOWN}fields."),
    (lambda: At(3, remove_ant=3), f"at.remove_ant` {UNKNOWN}remove_ants."),
    (lambda: Threshold().replace(valu=1), f"task.castes.NAME.threshold.valu` {UNKNOWN}value."),
    (castes(threshold={"valu": 3}), f"task.castes.a.threshold.valu` {UNKNOWN}value."),
    (castes(threshold=-1), "task.castes.a.threshold.value` is -1; it must be between 0 and 1e+06."),
    (castes(threshold=3), f"task.castes.a.threshold` is 'fixed'{UNLESS}task.labour.rule`"),
    (castes(threshold=WIDE), "it must be at most the value, 1.0"),
    (lambda: Task(labour="thresholds"), "ants have no thresholds; add a caste"),
    (lambda: Task(castes={"a": 3}), "task.castes.a` is 3; it must be a table of settings."),
    (lambda: Task(castes={f"a{k}": {} for k in range(17)}), "at most 16"),
    (castes(share=0.3), "add up to 0.3; they must add up to 1"),
    (lambda: Task(castes={"a": {"share": 0.7}, "b": {"share": 0.7}}), "add up to 1.4"),
    (castes(share=1, ants=2), "task.castes.a.ants` is 2, but `share` is 1.0; give one of them."),
    (castes(k=2), "because `task.choice.rule` is 'greedy'"),
    (castes(lays="trail, home"), f"'home'; it must be one of all, none, trail, {ADD}"),
    (castes(homing_cue="home"), f"is 'home'; it must be one of {SENSES}, trail, {ADD}"),
]


CELLWISE, SOFTLY, FROZEN = (
    Task(choice="deneubourg"),
    Task(choice="softmax"),
    {"sharing": "frozen"},
)
LEARNS = TrainingConfig("expected_sarsa", 0.1, 0.9, 0.1, 1.0)
TABLE = np.zeros((128, 5), np.float32)
COLONIES = [
    (lambda: paper_colony(CELLWISE, LEARNS), "so ants choose without action values, but sharing"),
    (
        lambda: paper_colony(CELLWISE, LEARNS, q_values=TABLE, **FROZEN),
        'set sharing to "frozen" and training to None, and leave out q_values',
    ),
    (
        lambda: train(worlds.paper(), LEARNS, 0, 1, task=SOFTLY),
        "learner 'expected_sarsa' takes the mean over epsilon-greedy actions",
    ),
    (lambda: paper_colony(SOFTLY, LEARNS), "learner 'expected_sarsa'"),
    (
        lambda: paper_colony(castes()(), **FROZEN),
        "`task.castes` has a, which a colony with given actions does not support",
    ),
    (
        lambda: paper_colony(castes(policy="random")(), LEARNS, sharing="independent"),
        "`task.castes.a.policy` is 'random', but sharing is \"independent\"",
    ),
    (
        lambda: paper_colony(castes(ants=3)(), LEARNS, ants=5),
        "the castes have 3 ants in nest 0, but 5 ants start there",
    ),
]


def paper_colony(task, training=None, **options):
    Colony(worlds.paper(), task, training, **options).begin_episode()


EVENTS = [
    (lambda: At(1), "`at` has no intervention; give one or more of remove_ants"),
    (lambda: At(-1, trail=0), "`at.tick` is -1; it must be between"),
    (lambda: At(3, remove_ants=1.5), "`remove_ants.share` is 1.5; it must be between 0 and 1"),
    (lambda: At(3, remove_ants={"shar": 1}), "`remove_ants.shar` is not a setting; choose share"),
    (lambda: At(3, remove_ants={"number": 1, "share": 0.5}), "has number and share; give one of"),
    (lambda: At(3, clear=[[1, 2]]), "`clear.cells` is [[1, 2]]; it must be a list of cells, each"),
    (lambda: At(3, move=[[1, 2, 0]]), "`move.cells` is ((1, 2, 0),); it must be the cell to"),
    (lambda: At(3, task="following"), "`at.task` is 'following'; it must be a table of settings"),
    (lambda: Every(5, stop=2, trail=0), "`every.stop` is 2, before the first event"),
    (lambda: When("living", trail=0), "`when` needs a bound"),
    (lambda: from_dict({"explode": 1}), "the name of an intervention is 'explode'"),
    (lambda: At(3, trail="gate"), "`at.trail` is 'gate'; it must be a level, which is a whole"),
    (lambda: At(3, trail=2.5), "`at.trail` is 2.5; it must be a level"),
    (lambda: At(3, ants=0.5), "`at.ants` is 0.5; it must be a whole number of ants, or a table of"),
]


@pytest.mark.parametrize(
    ("make", "says"),
    REFUSED + COLONIES + EVENTS,
    ids=[says[:40] for _, says in REFUSED + COLONIES + EVENTS],
)
def test_what_is_refused(make, says):
    refused(says, make)
