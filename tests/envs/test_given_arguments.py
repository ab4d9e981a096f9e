"""All environments accept paths, dicts and specs as JSON, check options, and count deliveries."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec

from taichi_ants import AntsError, World, task, worlds

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
