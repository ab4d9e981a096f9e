"""The vector environment of ants: as single worlds, in all autoreset modes, seeded and copied."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from same_steps import assert_same

from taichi_ants import AntsError, Task, worlds
from taichi_ants.envs.colony import HexColonyVectorEnv
from taichi_ants.envs.colony_v0 import parallel_env
from taichi_ants.task.task import foraging

ANTS = 6
GOES_ON = Task(delivery="truncates")
SAME, NEXT, DISABLED = AutoresetMode.SAME_STEP, AutoresetMode.NEXT_STEP, AutoresetMode.DISABLED
MEADOW = worlds.open_world(3, (8, 8, 8))


def ants_of(n_worlds: int = 2, task: Task = GOES_ON, **options) -> HexColonyVectorEnv:
    given = {"world": MEADOW, "ants": ANTS, "max_steps": 20, "observation_format": "index"}
    return HexColonyVectorEnv(n_worlds * ANTS, task=task, **{**given, **options})


def guided(masks: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Actions that can succeed, giving and picking up above all."""
    return (masks * (rng.random(masks.shape) + [0, 0, 0, 1, 1])).argmax(axis=1)


@pytest.mark.parametrize("form", ["cells", "index", "one_hot"])
def test_each_world_is_the_parallel_environment_of_its_seed(form):
    """Different worlds in one batch; observations, rewards, states, masks and events."""
    places = [MEADOW, worlds.open_world(4, (8, 8, 8))]
    rules = {"task": foraging(), "observation_format": form}
    many = ants_of(2, world=places, **{**rules, "task": replace(foraging(), delivery="truncates")})
    single = [parallel_env(one, ants=ANTS, max_steps=20, **rules) for one in places]
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
                    assert_same(infos[name][w * ANTS + i], value)
                    assert infos[f"_{name}"].all()
        actions = guided(infos["action_mask"], rng)
        seen, rewards, terminated, truncated, infos = many.step(actions)
        if "final_obs" in infos:
            seen, infos = np.stack(infos["final_obs"]), infos["final_info"]
        assert not terminated.any()
        theirs = []
        for w, env in enumerate(single):
            given = {f"ant_{i}": actions[w * ANTS + i] for i in range(ANTS)}
            observations, paid, _, ends, said = env.step(given)
            theirs.append((observations, said))
            for i in range(ANTS):
                assert rewards[w * ANTS + i] == paid[f"ant_{i}"]
                assert truncated[w * ANTS + i] == ends[f"ant_{i}"]
    assert truncated.all()


def play(env: HexColonyVectorEnv, steps: int) -> list[tuple]:
    """What each step of an episode, or of several, has returned; the modes see the same actions."""
    rng = np.random.default_rng(3)
    told = []
    waits = False
    for _ in range(steps):
        actions = rng.integers(0, 5, env.num_envs)
        if waits and env.metadata["autoreset_mode"] is NEXT:
            told.append(env.step(np.zeros_like(actions)))
        elif waits and env.metadata["autoreset_mode"] is DISABLED:
            told.append(env.reset())
        told.append(env.step(actions))
        waits = told[-1][3].all()
    return told


def test_the_autoreset_modes_differ_in_when_they_begin_alone():
    """Two episodes and a half; the first step after the end is where the modes differ."""
    told = {}
    for mode in (SAME, NEXT, DISABLED):
        env = ants_of(autoreset_mode=mode)
        env.reset(seed=5)
        told[mode] = play(env, 50)
    begins = [20, 41]
    for mode in (NEXT, DISABLED):
        resets = [told[mode].pop(k - n) for n, k in enumerate(begins)]
        for number, reset in enumerate(resets):
            last = told[SAME][19 + 20 * number]
            assert_same(reset[0], last[0])  # the same step has the observation of the next one
            for name in ("state", "action_mask"):
                assert_same(reset[-1][name], last[-1][name])
        for step, ours in enumerate(told[SAME]):
            theirs = told[mode][step]
            assert_same(ours[1:4], theirs[1:4])
            assert ours[3].all() == ours[3].any() == (step in (19, 39))
            final = ours[-1].get("final_info", ours[-1])
            if "final_obs" in ours[-1]:
                assert_same(np.stack(ours[-1]["final_obs"]), theirs[0])
            else:
                assert_same(ours[0], theirs[0])
            assert ("final_obs" in ours[-1]) == (step in (19, 39))
            for name in ("state", "action_mask", "event", "deliveries"):
                assert_same(final[name], theirs[-1][name])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"num_envs": 7}, "num_envs is 7; .* a multiple of ants, 6"),
        ({"autoreset_mode": "never"}, "autoreset_mode is 'never'; it must be one of NextStep"),
        (
            {"task": Task(), "autoreset_mode": NEXT},
            "autoreset_mode is 'NextStep', but the next episode of an ant",
        ),
        ({"task": "maze"}, "task is 'maze'; it must be one of paper, fetching,"),
    ],
)
def test_arguments_that_are_not_allowed(options, said):
    given = {"num_envs": 2 * ANTS, "ants": ANTS, "world": MEADOW, "task": GOES_ON, **options}
    with pytest.raises(AntsError, match=rf"^{said}.*\.$"):
        HexColonyVectorEnv(**given)
