"""Vector environments under Stable-Baselines3."""

from __future__ import annotations

import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import SyncVectorEnv

from taichi_ants import AntsError
from taichi_ants.envs.forage import HexForageEnv, HexForageVectorEnv
from taichi_ants.learners.policies import trail_follower


def test_without_stable_baselines3_a_sentence_names_the_extra(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "stable_baselines3.common.vec_env", None)
    monkeypatch.delitem(sys.modules, "taichi_ants.envs.sb3", raising=False)
    with pytest.raises(ImportError, match=r'run pip install -e "\.\[sb3\]" in your clone\.$'):
        import taichi_ants.envs.sb3  # noqa: F401


def made(n: int = 4, **settings):
    """The adapter; tests that call this are skipped without Stable-Baselines3."""
    pytest.importorskip("stable_baselines3")
    from taichi_ants.envs.sb3 import SB3VecEnv

    settings = {"observation_format": "one_hot", "max_steps": 60, **settings}
    return SB3VecEnv(HexForageVectorEnv(n, autoreset_mode="SameStep", **settings))


@pytest.mark.slow
def test_episodes_are_those_of_single_environments_to_the_end() -> None:
    """With what was seen last, and whether the step limit ended it: both ways occur."""
    n, table, rng = 6, trail_follower(), np.random.default_rng(0)
    envs = made(n, max_steps=36)
    alone = [HexForageEnv(observation_format="one_hot", max_steps=36) for _ in range(n)]
    assert envs.seed(5) == list(range(5, 5 + n))
    seen = envs.reset()
    now = [env.reset(seed=5 + i) for i, env in enumerate(alone)]
    assert (seen == np.stack([one for one, _ in now])).all()
    ends = []
    for _ in range(130):
        actions = (table[envs.infos["state"]] + 1.1 * rng.random((n, 5))).argmax(axis=1)
        seen, rewards, dones, infos = envs.step(actions)
        assert rewards.dtype == np.float32
        assert isinstance(infos, list)
        for i, env in enumerate(alone):
            one, reward, terminated, truncated, _ = env.step(actions[i])
            assert rewards[i] == reward
            assert dones[i] == (terminated or truncated)
            if dones[i]:
                assert infos[i].keys() == {"terminal_observation", "TimeLimit.truncated"}
                assert (infos[i]["terminal_observation"] == one).all()
                assert infos[i]["TimeLimit.truncated"] is (truncated and not terminated)
                ends.append(infos[i]["TimeLimit.truncated"])
                one, _ = env.reset()
            else:
                assert infos[i] == {}
            assert (seen[i] == one).all()
    assert {True, False} == set(ends)


def test_ants_of_a_colony_end_together_at_the_step_limit() -> None:
    pytest.importorskip("stable_baselines3")
    from taichi_ants.envs.sb3 import SB3VecEnv

    how = {"ants": 3, "max_steps": 5, "observation_format": "index"}
    envs = SB3VecEnv(gymnasium.make_vec("taichi_ants/HexColony-v0", num_envs=6, **how))
    beside = gymnasium.make_vec("taichi_ants/HexColony-v0", num_envs=6, **how)
    assert envs.seed(7) == list(range(7, 13))
    assert (envs.reset() == beside.reset(seed=7)[0]).all()
    for step in range(1, 12):
        *_, dones, infos = envs.step(np.ones(6, int))
        *_, said = beside.step(np.ones(6, int))
        assert dones.all() == dones.any() == (step % 5 == 0)
        for number, info in enumerate(infos):
            if step % 5:
                assert info == {}
            else:
                assert info["terminal_observation"] == said["final_obs"][number]
                assert info["TimeLimit.truncated"] is True


def test_seeds_count_for_the_next_reset_only() -> None:
    envs = made(2, world="paper")
    envs.seed(3)
    assert envs._seeds == [3, 4]
    envs.reset()
    assert envs._seeds == [None, None]


def test_what_sb3_asks_of_single_environments() -> None:
    envs = made(3, render_mode="rgb_array")
    envs.reset()
    assert envs.get_attr("render_mode") == ["rgb_array"] * 3
    assert envs.has_attr("action_masks")
    assert not envs.has_attr("nothing")
    assert (np.stack(envs.env_method("action_masks")) == envs.infos["action_mask"]).all()
    (mask,) = envs.env_method("action_masks", indices=1)
    assert mask.dtype == bool
    assert envs.env_is_wrapped(HexForageEnv, indices=[0, 2]) == [False, False]
    assert envs.render().shape == (2 * 720, 2 * 1280, 3)
    envs.set_attr("note", 1)
    assert envs.get_attr("note", 0) == [1]
    with pytest.raises(AntsError, match=r"indices is \[0\]; all environments share"):
        envs.set_attr("note", 2, indices=[0])
    with pytest.raises(AntsError, match="method_name is 'reset'"):
        envs.env_method("reset")


def test_environments_that_begin_anew_at_another_time_are_refused() -> None:
    made(1)
    from taichi_ants.envs.sb3 import SB3VecEnv

    with pytest.raises(AntsError, match="is 'NextStep'; Stable-Baselines3 requires \"SameStep\""):
        SB3VecEnv(HexForageVectorEnv(2))
    with pytest.raises(AntsError, match="NextStep"):
        SB3VecEnv(SyncVectorEnv([HexForageEnv]))
    with pytest.raises(AntsError, match=r"must be a gymnasium\.vector\.VectorEnv"):
        SB3VecEnv(HexForageEnv())  # type: ignore[arg-type]


@pytest.mark.parametrize("form", ["one_hot", "cells", "index"])
def test_sb3_accepts_the_spaces_of_single_environments(form: str) -> None:
    pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.env_checker import check_env

    check_env(HexForageEnv(observation_format=form, max_steps=50))  # type: ignore[arg-type]
