"""Other people's libraries train on the environments: a few updates with each that is installed."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

from taichi_ants.envs import Event

pytestmark = pytest.mark.slow
ID, COLONY = "taichi_ants/HexForage-v0", "taichi_ants/HexColony-v0"
HOW = {"observation_format": "one_hot", "max_steps": 60}


def test_gymnasiums_wrapper_returns_all_infos_as_tensors() -> None:
    torch = pytest.importorskip("torch")
    pytest.importorskip("array_api_compat")
    from gymnasium.wrappers import NumpyToTorch
    from gymnasium.wrappers.vector import NumpyToTorch as NumpyToTorchVector

    one = NumpyToTorch(gymnasium.make(ID))
    _, info = one.reset(seed=0)
    many = NumpyToTorchVector(gymnasium.make_vec(ID, num_envs=3, max_steps=3))
    many.reset(seed=0)
    for step in range(5):
        said = one.step(torch.tensor(1))[4]
        assert said.keys() == info.keys()
        infos = many.step(torch.ones(3, dtype=torch.int64))[4]
        assert all(torch.is_tensor(value) for value in (*said.values(), *infos.values()))
        assert infos["event"].tolist() == [Event.NONE if step == 3 else Event.ENTERED_EMPTY] * 3


def sb3_envs(name: str = ID, n: int = 4, **more: object):
    """A vector environment of this package, as Stable-Baselines3 takes it."""
    pytest.importorskip("stable_baselines3")
    from examples.sb3_vec_env import SB3VecEnv

    envs = gymnasium.make_vec(name, num_envs=n, autoreset_mode="SameStep", **HOW, **more)
    return SB3VecEnv(envs)


@pytest.mark.parametrize("kind", ["single", "vector", "colony"])
def test_maskable_ppo_takes_only_actions_of_the_mask(kind: str) -> None:
    pytest.importorskip("sb3_contrib")
    from sb3_contrib import MaskablePPO
    from sb3_contrib.common.maskable.evaluation import evaluate_policy
    from sb3_contrib.common.maskable.utils import get_action_masks, is_masking_supported
    from stable_baselines3.common.env_util import make_vec_env

    if kind == "single":
        envs = make_vec_env(ID, 2, env_kwargs=HOW)
    else:
        envs = sb3_envs() if kind == "vector" else sb3_envs(COLONY, 8, ants=4)
    assert is_masking_supported(envs)
    model = MaskablePPO("MlpPolicy", envs, n_steps=32, batch_size=32, n_epochs=1, device="cpu")
    model.learn(128)
    seen, failed = envs.reset(), 0
    for _ in range(60):
        masks = get_action_masks(envs)
        actions, _ = model.predict(seen, action_masks=masks)
        assert masks[np.arange(envs.num_envs), actions].all()
        seen, rewards, _, _ = envs.step(actions)
        failed += (rewards < 0).sum()
    if kind != "colony":  # its ants may want one cell
        assert failed <= 0.1 * 60 * envs.num_envs  # dead ends, where all actions fail
    mean, _ = evaluate_policy(model, envs, n_eval_episodes=2)
    assert np.isfinite(mean)
