"""The adapters in examples/: data sets of Minari, vector environments of Stable-Baselines3."""

import numpy as np
import pytest

from taichi_ants import Colony, Life, Task, TrainingConfig, record_colony, worlds
from taichi_ants.envs.forage import HexForageEnv, HexForageVectorEnv
from taichi_ants.envs.formats import FORMATS, ShownObservations
from taichi_ants.learners.policies import trail_follower


@pytest.mark.filterwarnings("ignore::UserWarning:minari")
@pytest.mark.parametrize("form", FORMATS)
def test_a_data_set_is_the_same_after_minari(form, tmp_path, monkeypatch) -> None:
    minari = pytest.importorskip("minari")
    pytest.importorskip("h5py")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    from examples.minari_data import from_minari, to_minari

    task = Task(life=Life(births=True, lifespan=15, regrowth=0))
    training = TrainingConfig("q_learning", 0.1, 0.9, 0.3, 1.0)
    world = worlds.open_world(5, (6, 6, 6))
    colony = Colony(world, task, training, 7, 4, q_values=trail_follower())
    data = record_colony(colony, 1, 40)
    to_minari(data, "ants/colony-v0", form)
    assert from_minari("ants/colony-v0") == data
    loaded, shown = minari.load_dataset("ants/colony-v0"), ShownObservations(task.sees, form)
    assert loaded.total_episodes == len(data.begins) - 1
    for k, episode in enumerate(loaded.iterate_episodes()):
        rows = slice(data.begins[k], data.begins[k + 1])
        states = [*data.state[rows], data.next_state[rows][-1]]
        assert np.array_equal(episode.observations, shown.show(np.array(states)))
        assert episode.rewards.tolist() == data.reward[rows].tolist()


def adapted(n: int, **settings):
    """The adapter; tests that call this are skipped without Stable-Baselines3."""
    pytest.importorskip("stable_baselines3")
    from examples.sb3_vec_env import SB3VecEnv

    settings = {"observation_format": "one_hot", "max_steps": 60, **settings}
    return SB3VecEnv(HexForageVectorEnv(n, autoreset_mode="SameStep", **settings))


def test_episodes_are_those_of_single_environments_to_the_end() -> None:
    """With what was seen last, and whether the step limit ended it: both ways occur."""
    n, table, rng = 6, trail_follower(), np.random.default_rng(0)
    envs = adapted(n, max_steps=36)
    alone = [HexForageEnv(observation_format="one_hot", max_steps=36) for _ in range(n)]
    assert envs.seed(5) == list(range(5, 5 + n))
    seen = envs.reset()
    assert envs._seeds == [None] * n  # they count for one reset only
    now = [env.reset(seed=5 + i) for i, env in enumerate(alone)]
    assert (seen == np.stack([one for one, _ in now])).all()
    ends = []
    for _ in range(130):
        actions = (table[envs.infos["state"]] + 1.1 * rng.random((n, 5))).argmax(axis=1)
        seen, rewards, dones, infos = envs.step(actions)
        assert rewards.dtype == np.float32
        for i, env in enumerate(alone):
            one, reward, terminated, truncated, _ = env.step(actions[i])
            assert (rewards[i], dones[i]) == (reward, terminated or truncated)
            if dones[i]:
                assert (infos[i]["terminal_observation"] == one).all()
                assert infos[i]["TimeLimit.truncated"] is (truncated and not terminated)
                ends.append(infos[i]["TimeLimit.truncated"])
                one, _ = env.reset()
            else:
                assert infos[i] == {}
            assert (seen[i] == one).all()
    assert {True, False} == set(ends)
