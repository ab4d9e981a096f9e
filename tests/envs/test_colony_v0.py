"""The colony of PettingZoo: its own conformance tests, agents that appear and die, copies."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from pettingzoo.test import parallel_api_test, parallel_seed_test
from same_steps import likely

from taichi_ants import AntsError, Task, worlds
from taichi_ants.envs import Event, colony_v0
from taichi_ants.task import Life
from taichi_ants.task.constants import GIVE, PICK_UP
from taichi_ants.task.task import foraging, paper, queueing

MEADOW = worlds.open_world(3, (8, 8, 8))
LIVELY = replace(foraging(), life=Life(births=True, lifespan=60, regrowth=3))
TASKS = {"paper": paper(), "foraging": foraging(), "queueing": queueing(), "births": LIVELY}


def colony(task: Task = LIVELY, **options):
    return colony_v0.parallel_env(
        **{"world": MEADOW, "task": task, "ants": 5, "max_steps": 120, **options}
    )


@pytest.mark.parametrize(
    "name",
    [
        "paper",
        pytest.param("births", marks=pytest.mark.slow),
        *(pytest.param(name, marks=pytest.mark.long) for name in ("foraging", "queueing")),
    ],
)
def test_pettingzoo_finds_no_fault(name):
    """With births it can only note that not all agents that were possible have lived."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", "'locale.getdefaultlocale'")
        if name == "births":
            warnings.filterwarnings("ignore", "No agents present but not all possible_agents")
        parallel_api_test(colony(TASKS[name]), num_cycles=150)
        parallel_seed_test(lambda: colony(TASKS[name]), num_cycles=30)


def test_agents_are_the_living_ants_by_number():
    """Compare the living ants, and what each observes, earns and does, for two episodes.

    Ants die with food, and others are born into their slots. `test_colony.py` compares all that
    they do with the reference.
    """
    env = colony(observation_format="index", ants=16, max_steps=90)
    rng, ours = np.random.default_rng(8), env._worlds
    for seed in (6, None):
        observations, infos = env.reset(seed=seed)
        ever, step = set(env.agents), 0
        while env.agents:
            living = ours.colony.living[0]
            slots = {f"ant_{ours.colony.numbers[0, k]}": k for k in np.flatnonzero(living)}
            assert set(env.agents) == slots.keys()
            states = {name: ours.colony.states[0, k] for name, k in slots.items()}
            assert {name: observations[name] for name in slots} == states
            assert {name: infos[name]["state"] for name in slots} == states
            actions = {name: int(likely(rng, infos[name]["action_mask"])) for name in env.agents}
            observations, rewards, terminated, truncated, infos = env.step(actions)
            step += 1
            numbers = ours.colony.numbers[0, ours.colony.living[0]]
            for name, k in slots.items():
                assert (rewards[name], infos[name]["event"]) == (
                    ours.rewards[0, k],
                    ours.events[0, k],
                )
                assert terminated[name] == (int(name[4:]) not in numbers)
                assert truncated[name] == (step == 90)
            for name in set(observations) - slots.keys():  # the newborn
                assert name not in ever
                assert (rewards[name], terminated[name], truncated[name]) == (0, False, False)
                assert infos[name]["event"] == Event.NONE
            ever |= set(observations)
        outcome = ours.colony.outcome()
        assert outcome.births[0, 0] > 2
        assert outcome.deaths[0, 0] > 3
        assert ever <= set(env.possible_agents)
        assert step == 90


def test_steps_in_the_wrong_order_and_wrong_actions(capsys):
    env = colony(paper(), max_steps=2)
    assert env.render_mode is None
    with pytest.raises(AssertionError, match=r"^reset\(\) needs to be called before step"):
        env.step({})
    with pytest.raises(AssertionError, match=r"^reset\(\) needs to be called before render"):
        env.render()
    env.reset()
    assert env.render() is None
    right = dict.fromkeys(env.agents, PICK_UP)
    for wrong, said in (
        ({**right, "ant_3": 5}, "ant_3 is 5; give"),
        ({**right, "ant_3": 0.5}, "ant_3 is 0.5; give"),
        ({name: GIVE for name in right if name != "ant_3"}, "ant_3 is None; give"),
        ({**right, "ant_99": 1}, "ant_99 is 1; give"),
    ):
        with pytest.raises(AssertionError, match=rf"^the action of {said} .*\.$"):
            env.step(wrong)
    env.step(right)
    *_, truncated, _ = env.step(right)
    assert truncated == dict.fromkeys(right, True)
    assert env.step({}) == ({}, {}, {}, {}, {})  # with PettingZoo's warning
    with pytest.raises(AntsError, match=r"^world is .*; give the name of a world or a World\.$"):
        colony(world=[MEADOW, MEADOW])
