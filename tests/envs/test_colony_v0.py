"""The colony of PettingZoo: its own conformance tests, agents that appear and die, copies."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from colonies import act, training
from pettingzoo.test import parallel_api_test, parallel_seed_test
from same_colonies import assert_equal

from taichi_ants import AntsError, Task, worlds
from taichi_ants.envs import Event, colony_v0
from taichi_ants.reference import ReferenceColony
from taichi_ants.task import Life
from taichi_ants.task.constants import GIVE, N_ACTIONS, PICK_UP
from taichi_ants.task.task import foraging, paper, queueing

MEADOW = worlds.open_world(3, (8, 8, 8))
LIVELY = replace(foraging(), life=Life(births=True, lifespan=60, regrowth=3))
TASKS = {"paper": paper(), "foraging": foraging(), "queueing": queueing(), "births": LIVELY}


def colony(task: Task = LIVELY, **options):
    return colony_v0.parallel_env(
        **{"world": MEADOW, "task": task, "ants": 5, "max_steps": 120, **options}
    )


def guided(infos: dict, rng: np.random.Generator) -> dict[str, int]:
    """Actions that can succeed, giving and picking up above all."""
    worth = np.array([0, 0, 0, 1, 1])
    return {
        name: int((said["action_mask"] * (rng.random(N_ACTIONS) + worth)).argmax())
        for name, said in infos.items()
    }


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


def test_agents_are_the_ants_of_the_reference_by_number():
    """Who lives, what each sees, earns and does, until the end of two episodes.

    Ants die with food, and others are born into their slots, whose trails begin anew.
    """
    env = colony(observation_format="index", ants=16, max_steps=90)
    rules = replace(LIVELY, evaporation_in_evaluation=LIVELY.evaporation_in_training)
    table = np.zeros((rules.n_states, N_ACTIONS), np.float32)
    plain = ReferenceColony(*(MEADOW, rules, training(), 6, 16), sharing="frozen", q_values=table)
    rng = np.random.default_rng(8)
    for seed in (6, None):
        observations, infos = env.reset(seed=seed)
        plain.begin_episode()
        ever, step = set(env.agents), 0
        while env.agents:
            ants = {f"ant_{ant.number}": ant for ant in plain.ants.values()}
            assert_equal(env._worlds.colony, plain)
            assert set(env.agents) == ants.keys()
            assert {name: observations[name] for name in ants} == {
                name: ant.state for name, ant in ants.items()
            }
            assert {infos[name]["state"] for name in ants} == {ant.state for ant in ants.values()}
            acting = list(env.agents)
            actions = guided({name: infos[name] for name in acting}, rng)
            in_order = sorted(ants.items(), key=lambda item: item[1].slot)
            act(plain, *(actions[name] for name, _ in in_order))
            observations, rewards, terminated, truncated, infos = env.step(actions)
            step += 1
            for name in acting:
                assert rewards[name] == ants[name].reward
                assert terminated[name] == (ants[name] not in plain.ants.values())
                assert truncated[name] == (step == 90)
            for passed in plain.transitions:
                assert infos[f"ant_{passed.number}"]["event"] == passed.event
            for name in set(observations) - set(acting):  # the newborn
                assert name not in ever
                assert (rewards[name], terminated[name], truncated[name]) == (0, False, False)
                assert infos[name]["event"] == Event.NONE
            ever |= set(observations)
        plain.end_episode()
        assert plain.record.births > 2
        assert plain.record.deaths > 3
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
