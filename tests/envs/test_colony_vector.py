"""The vector environment of ants: as single worlds."""

from dataclasses import replace

import numpy as np
import pytest
from same_steps import assert_same, likely

from taichi_ants import AntsError, worlds
from taichi_ants.envs import Event
from taichi_ants.envs.colony import HexColonyVectorEnv
from taichi_ants.envs.colony_v0 import parallel_env
from taichi_ants.task.task import foraging

ANTS = 6
MEADOW = worlds.open_world(3, (8, 8, 8))


@pytest.mark.parametrize(
    ("form", "delivery"),
    [("cells", "truncates"), ("index", "terminates"), ("one_hot", "terminates")],
)
def test_each_world_is_the_parallel_environment_of_its_seed(form, delivery):
    """Different worlds in one batch; observations, rewards, states, masks and events."""
    places = [MEADOW, worlds.open_world(4, (8, 8, 8))]
    rules = {"task": foraging(), "observation_format": form, "ants": ANTS, "max_steps": 20}
    ends = {**rules, "task": replace(foraging(), delivery=delivery)}
    many = HexColonyVectorEnv(2 * ANTS, places, **ends)
    delivered = 0
    single = [parallel_env(one, **rules) for one in places]
    seen, infos = many.reset(seed=7)
    theirs = [env.reset(seed=7 + w) for w, env in enumerate(single)]
    rng = np.random.default_rng(1)
    for _ in range(20):
        for w, (observations, said) in enumerate(theirs):
            for i in range(ANTS):
                assert_same(seen[w * ANTS + i], np.asarray(observations[f"ant_{i}"]))
                assert seen[w * ANTS + i] in many.single_observation_space
                assert said[f"ant_{i}"].keys() == {"state", "action_mask", "event", "deliveries"}
                for name, value in said[f"ant_{i}"].items():
                    if name != "deliveries" or delivery == "truncates":
                        assert_same(infos[name][w * ANTS + i], value)
        actions = likely(rng, infos["action_mask"])
        seen, rewards, terminated, truncated, infos = many.step(actions)
        assert all(infos[f"_{name}"].all() for name in ("state", "event", "action_mask"))
        over, last = terminated | truncated, infos.get("final_info", {})
        if over.any():
            seen[over] = np.stack(infos["final_obs"][over])
            for name in ("state", "event", "action_mask", "deliveries"):
                infos[name][over] = last[name][over]
        delivers = infos["event"] == Event.DELIVERED
        assert np.array_equal(terminated, delivers & (delivery == "terminates"))
        assert (infos["deliveries"][terminated] == 1).all()
        delivered += delivers.sum()
        theirs = []
        for w, env in enumerate(single):
            given = {f"ant_{i}": actions[w * ANTS + i] for i in range(ANTS)}
            observations, paid, _, ends, said = env.step(given)
            theirs.append((observations, said))
            for i in range(ANTS):
                assert rewards[w * ANTS + i] == paid[f"ant_{i}"]
                assert truncated[w * ANTS + i] == ends[f"ant_{i}"]
    assert truncated.all()
    assert delivered > 1


def test_worlds_have_whole_numbers_of_ants():
    with pytest.raises(AntsError, match=r"^num_envs is 7; .* a multiple of ants, 6.*\.$"):
        HexColonyVectorEnv(7, MEADOW, ants=ANTS)
