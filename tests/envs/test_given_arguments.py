"""All environments accept paths, dicts and specs as JSON, check options, and count deliveries."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from command_lines import environment
from gymnasium.envs.registration import EnvSpec
from gymnasium.error import ResetNeeded

from taichi_ants import AntsError, Life, World, task, worlds
from taichi_ants.envs import Event

ID, COLONY = "taichi_ants/HexForage-v0", "taichi_ants/HexColony-v0"
MAZE = [1] * 16 + [3] + [1] * 16 + [4]  # delivers in the paper's world
# No map can show these trails, because their levels differ.
TRAILS = World((6, 6, 1), (0, 0, 0), foods=[(5, 0, 0)], trails=[((2, 0, 0), 5), ((3, 0, 0), 9)])


def one(**given: Any) -> Any:
    return gymnasium.make(ID, **given)


def many(**given: Any) -> Any:
    return gymnasium.make_vec(ID, num_envs=2, **given)


def ants(**given: Any) -> Any:
    return gymnasium.make_vec(COLONY, num_envs=8, ants=4, **given)


def agents(**given: Any) -> Any:
    pytest.importorskip("pettingzoo")
    from taichi_ants.envs import colony_v0

    return colony_v0.parallel_env(ants=4, **given)


def played(env: Any) -> str:
    """The results of three steps forward."""
    env.reset(seed=3)
    vector = isinstance(env, gymnasium.vector.VectorEnv)
    action: Any = [1] * env.num_envs if vector else 1
    if hasattr(env, "possible_agents"):
        action = dict.fromkeys(env.agents, 1)
    return str([env.step(action) for _ in range(3)])


@pytest.mark.parametrize("made", [one, many, ants, agents])
def test_worlds_and_tasks_in_all_their_forms(made: Any, tmp_path: Path) -> None:
    path = tmp_path / "map.txt"
    path.write_text(worlds.to_text(worlds.paper()), "utf-8")
    usual = played(made())
    for given in (
        *({"world": path}, {"world": str(path)}, {"world": worlds.paper().as_dict()}),
        *({"task": task.paper().as_dict()}, {"task": "paper"}, {"task": task.paper()}),
    ):
        assert played(made(**given)) == usual
    assert played(made(task="fetching")) == played(made(task=task.fetching())) != usual


@pytest.mark.parametrize("made", [one, many, ants])
def test_a_spec_is_json_that_creates_the_environment_again(made: Any, tmp_path: Path) -> None:
    path = tmp_path / "map.txt"
    path.write_text(worlds.to_text(worlds.paper()), "utf-8")
    several = [] if made is one else [{"world": [TRAILS, TRAILS]}] if made is many else []
    for given in ({"world": TRAILS}, {"world": path, "task": task.fetching()}, *several):
        env = made(**given)
        spec = EnvSpec.from_json(env.spec.to_json())
        again = gymnasium.make(spec) if made is one else gymnasium.make_vec(spec)
        assert played(again) == played(env)


@pytest.mark.parametrize("made", [one, many, ants, agents])
def test_an_option_of_reset_is_used_or_refused(made: Any) -> None:
    env = made()
    env.reset(options={})
    for options in ({"world": "open"}, {"seed": 1}):
        with pytest.raises(AntsError, match=f"options has the key '{next(iter(options))}', but "):
            env.reset(options=options)


def test_a_step_after_the_end_is_called_so() -> None:
    env = one()
    with pytest.raises(ResetNeeded, match=r"no episode has begun; call reset\(\) before step"):
        env.unwrapped.step(1)
    env.reset()
    for action in MAZE:
        env.step(action)
    with pytest.raises(ResetNeeded, match=r"the episode has ended; call reset\(\) before step"):
        env.step(1)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
@pytest.mark.parametrize("delivery", ["terminates", "continues"])
def test_deliveries_are_counted_by_step_and_by_rollout(mode: str, delivery: str) -> None:
    limit = 34 if mode == "Disabled" else 90
    how = {"autoreset_mode": mode, "delivery": delivery, "max_steps": limit}
    stepped, rolled = many(**how), many(**how)
    for env in (stepped, rolled):
        env.reset(seed=0)
    actions = np.array([[action] * 2 for action in MAZE])
    for row in actions:
        infos = stepped.step(row)[4]
    rolled.rollout(actions)
    ended = mode == "SameStep" and delivery == "terminates"
    counted = infos["final_info"]["deliveries"] if ended else infos["deliveries"]
    assert counted.tolist() == [1, 1]
    assert infos["deliveries"].tolist() == [1 - ended] * 2
    if mode != "Disabled":
        infos, others = (env.step([1, 1])[4]["deliveries"] for env in (stepped, rolled))
        assert infos.tolist() == others.tolist() == [int(delivery == "continues")] * 2


def test_deliveries_of_ants_in_colonies() -> None:
    """Each trip is an episode if deliveries terminate; else an ant counts all of them."""
    world = World((4, 1, 1), (0, 0, 0), foods=[(3, 0, 0)], ants=[((2, 0, 0), 0)])
    for delivery in ("terminates", "truncates"):
        rules = task.Task(life=Life(regrowth=0), delivery=delivery, turns_at_queen=True)
        env = gymnasium.make_vec(COLONY, num_envs=1, ants=1, world=world, task=rules)
        env.reset(seed=0)
        expected = 0
        for action in [3, 1, 4, 1, 3, 1, 4, 1]:
            infos = env.step([action])[4]
            if infos["event"][0] == Event.DELIVERED:
                expected += 1
            if "final_info" in infos:
                assert infos["final_info"]["deliveries"][0] == 1
            assert infos["deliveries"][0] == expected
        assert expected == (0 if delivery == "terminates" else 2)


def test_completion_lists_public_names_and_imports_nothing() -> None:
    code = (
        "import sys, taichi_ants; names = dir(taichi_ants); assert 'envs' in names\n"
        "assert not {'numpy', 'gymnasium', 'taichi'} & sys.modules.keys()\n"
        "assert taichi_ants.envs.Event.DELIVERED == 5\n"
        "public = [getattr(taichi_ants, name) for name in names]\n"
        "for one in [taichi_ants, *public]:\n"
        "    if hasattr(one, '__all__'): assert sorted(one.__all__) == dir(one), one\n"
        "print(dir(taichi_ants.task)[:3], dir(taichi_ants.testing))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=environment(None)
    )
    assert done.stdout == (
        "['Caste', 'Choice', 'Field'] "
        "['RuleCheck', 'check_learner', 'check_observation', 'check_rule']\n"
    ), done.stderr


def test_paths_where_paths_are_allowed(tmp_path: Path) -> None:
    from taichi_ants import save_policy
    from taichi_ants.learners.policies import frozen_policy

    path = tmp_path / "policy.npz"
    save_policy(path, np.eye(128, 5, dtype=np.float32), {})
    assert task.Caste(policy=path) == task.Caste(policy=str(path))  # type: ignore[arg-type]
    assert np.array_equal(frozen_policy(path), frozen_policy(str(path)))
    env = many()
    env.reset(seed=0)
    first = env.rollout(path, 3, seed=1).actions
    env.reset(seed=0)
    assert np.array_equal(env.rollout(str(path), 3, seed=1).actions, first)


def test_a_colony_is_no_single_environment() -> None:
    with pytest.raises(AntsError, match=r"use gymnasium\.make_vec"):
        gymnasium.make("taichi_ants/HexColony-v0")
