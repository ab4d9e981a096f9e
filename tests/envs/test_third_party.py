"""Other people's libraries train on the environments: a few updates with each that is installed."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from command_lines import ROOT

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


def test_tianshou_trains_a_dqn() -> None:
    pytest.importorskip("tianshou")
    from tianshou.algorithm import DQN
    from tianshou.algorithm.modelfree.dqn import DiscreteQLearningPolicy
    from tianshou.algorithm.optim import AdamOptimizerFactory
    from tianshou.data import Collector, VectorReplayBuffer
    from tianshou.env import DummyVectorEnv
    from tianshou.trainer import OffPolicyTrainerParams
    from tianshou.utils.net.common import Net

    envs = DummyVectorEnv([lambda: gymnasium.make(ID, **HOW) for _ in range(3)])
    space = envs.action_space[0]
    policy = DiscreteQLearningPolicy(
        model=Net(state_shape=(14,), action_shape=5, hidden_sizes=(16,)),
        action_space=space,
        eps_training=0.5,
    )
    learner = DQN(policy=policy, optim=AdamOptimizerFactory(lr=1e-3), target_update_freq=10)
    buffer = VectorReplayBuffer(1000, 3)
    result = learner.run_training(
        OffPolicyTrainerParams(
            training_collector=Collector(learner, envs, buffer, exploration_noise=True),
            max_epochs=1,
            epoch_num_steps=200,
            collection_step_num_env_steps=50,
            show_progress=False,
            verbose=False,
            batch_size=16,
            update_step_num_gradient_steps_per_sample=0.1,
        )
    )
    assert result is not None
    kept = buffer.info[: len(buffer)]
    assert len(buffer) >= 200
    assert set(np.unique(kept.event)) <= set(Event)
    assert kept.action_mask.shape[1] == 5


def test_torchrl_reads_each_info_and_trains_a_dqn() -> None:
    torch = pytest.importorskip("torch")
    pytest.importorskip("torchrl")
    from torchrl.envs import GymWrapper, check_env_specs
    from torchrl.modules import QValueActor
    from torchrl.objectives import DQNLoss

    env = GymWrapper(gymnasium.make(ID, **HOW), categorical_action_encoding=True)
    env.auto_register_info_dict()
    check_env_specs(env)
    actor = QValueActor(torch.nn.Linear(14, 5), in_keys=["observation"], spec=env.action_spec)
    loss = DQNLoss(actor, action_space=env.action_spec, delay_value=False)
    optimiser = torch.optim.Adam(loss.parameters(), lr=1e-2)
    before = actor.module[0].module.weight.detach().clone()
    for _ in range(3):
        batch = env.rollout(80, actor)  # an episode
        assert {"state", "action_mask", "event", "reason"} <= set(batch["next"].keys())
        assert batch["next", "truncated"].any() == (len(batch) == 60)
        optimiser.zero_grad()
        loss(batch)["loss"].backward()
        optimiser.step()
    assert (before != actor.module[0].module.weight).any()


def sb3_envs(name: str = ID, n: int = 4, **more: object):
    """A vector environment of this package, as Stable-Baselines3 takes it."""
    pytest.importorskip("stable_baselines3")
    from examples.sb3_vec_env import SB3VecEnv

    envs = gymnasium.make_vec(name, num_envs=n, autoreset_mode="SameStep", **HOW, **more)
    return SB3VecEnv(envs)


def test_agents_of_sb3_train() -> None:
    """On-policy and off-policy, with SB3's monitor of episodes around it."""
    envs = sb3_envs()
    from stable_baselines3 import DQN, PPO
    from stable_baselines3.common.evaluation import evaluate_policy
    from stable_baselines3.common.vec_env import VecMonitor

    watched = VecMonitor(envs)
    model = PPO("MlpPolicy", watched, n_steps=64, batch_size=64, n_epochs=1, device="cpu")
    model.learn(256)
    assert len(model.ep_info_buffer) == 4
    assert all(info["l"] <= 60 for info in model.ep_info_buffer)
    DQN("MlpPolicy", sb3_envs(), learning_starts=32, buffer_size=500, device="cpu").learn(128)
    mean, _ = evaluate_policy(model, watched, n_eval_episodes=4)
    assert np.isfinite(mean)


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


def test_torchrl_acts_in_a_colony_with_births() -> None:
    """With the wrapper of docs/environments_reference.md."""
    pytest.importorskip("torchrl")
    pytest.importorskip("pettingzoo")
    from torchrl.envs.libs.pettingzoo import PettingZooWrapper

    from taichi_ants import Life, Task, World
    from taichi_ants.envs import colony_v0

    page = (ROOT / "docs" / "environments_reference.md").read_text("utf-8")
    code = page[page.index("from pettingzoo.utils import BaseParallelWrapper") :].split("```")[0]
    names: dict = {}
    exec(compile(code, "environments_reference.md", "exec"), names)
    world = World((3, 3, 1), (0, 0, 0), foods=[(2, 0, 0), (0, 2, 0)])
    env = colony_v0.parallel_env(world, Task(life=Life(births=True)), ants=1, max_steps=400)
    wrapped = PettingZooWrapper(names["WithUnborn"](env), use_mask=True, done_on_any=False, seed=1)
    alive = wrapped.rollout(400)["ant", "mask"].sum(dim=1)
    assert alive[0] == 1
    assert alive[-1] == 3


@pytest.mark.parametrize("name", [ID, COLONY])
def test_skrl_wraps_vector_environments(name: str) -> None:
    torch = pytest.importorskip("torch")
    pytest.importorskip("skrl")
    from skrl.envs.wrappers.torch import wrap_env

    more = {"ants": 2} if name == COLONY else {}
    envs = wrap_env(gymnasium.make_vec(name, num_envs=4, observation_format="one_hot", **more))
    assert envs.reset()[0].shape == (4, 14)
    assert envs.step(torch.ones(4, 1, dtype=torch.int64))[1].shape == (4, 1)


def test_gymnasium_records_videos_of_colonies(tmp_path) -> None:
    pytest.importorskip("moviepy")
    from gymnasium.wrappers.vector import RecordVideo

    made = gymnasium.make_vec(COLONY, num_envs=4, ants=2, max_steps=3, render_mode="rgb_array")
    envs = RecordVideo(made, str(tmp_path), video_length=3)
    envs.reset(seed=0)
    for _ in range(4):
        envs.step(np.ones(4, int))
    envs.close()
    assert list(tmp_path.glob("*.mp4"))
