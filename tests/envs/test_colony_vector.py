"""The vector environment of ants: as single worlds, in all autoreset modes, seeded and copied."""

from __future__ import annotations

import copy
import pickle
import resource
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from gymnasium.error import InvalidAction, ResetNeeded
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import DictInfoToList, RecordEpisodeStatistics

from taichi_ants import AntsError, Task, worlds
from taichi_ants.envs import Event
from taichi_ants.envs.colony import HexColonyVectorEnv
from taichi_ants.envs.colony_v0 import parallel_env
from taichi_ants.task.constants import GIVE
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


def assert_same(one, other) -> None:
    """Compare what two steps or resets have returned, down to the infos."""
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        one, other = list(one.values()), list(other.values())
    if isinstance(one, (tuple, list)):
        for mine, its in zip(one, other, strict=True):
            assert_same(mine, its)
    elif one is None or isinstance(one, str):
        assert one == other
    else:
        assert one.dtype == other.dtype
        if one.dtype == object and len(one):
            assert_same([*one], [*other])
        else:
            assert np.array_equal(one, other)


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


def test_the_step_that_only_begins_the_next_episode_pays_nothing():
    env = ants_of(autoreset_mode=NEXT, max_steps=1)
    env.reset(seed=1)
    nothing_to_take = np.full(env.num_envs, 3)
    for begins in (False, True, False, True):
        _, rewards, terminated, truncated, infos = env.step(nothing_to_take)
        assert not terminated.any()
        assert (truncated != begins).all()
        assert (rewards == (0 if begins else -1)).all()
        assert (infos["event"] == (Event.NONE if begins else Event.FAILED)).all()


def test_single_worlds_begin_anew_while_others_go_on():
    """With a mask; a world that is reset as another one ends at another time, and feels nothing."""
    env, alone = ants_of(autoreset_mode=DISABLED), ants_of(1, autoreset_mode=DISABLED)
    env.reset(seed=8)
    alone.reset(seed=8)
    rng, before = np.random.default_rng(2), np.zeros(0)
    mask = np.arange(2 * ANTS) >= ANTS  # the second world
    for step in range(20):
        if step == 9:
            seen, infos = env.reset(options={"reset_mask": mask})
            assert np.array_equal(infos["_state"], mask)
            assert_same(seen[:ANTS], before)
        actions = rng.integers(0, 5, env.num_envs)
        told, other = env.step(actions), alone.step(actions[:ANTS])
        for k in range(4):
            assert_same(told[k][:ANTS], other[k])
        before = other[0]
    assert np.array_equal(told[3], ~mask)
    with pytest.raises(ResetNeeded, match=r"^the episode of environment 0 has ended; "):
        env.step(actions)
    env.reset(options={"reset_mask": ~mask})
    for _ in range(9):
        assert not told[3][ANTS:].any()
        told = env.step(actions)
    assert np.array_equal(told[3], mask)


def test_worlds_that_were_seeded_anew_are_as_in_a_new_environment():
    env, new = ants_of(), ants_of()
    env.reset(seed=1)
    for step in range(5):
        env.step(np.full(env.num_envs, step % 3))
    mask = np.arange(2 * ANTS) < ANTS
    seen, _ = env.reset(seed=[9, None], options={"reset_mask": mask})
    fresh, _ = new.reset(seed=9)
    assert_same(seen[:ANTS], fresh[:ANTS])
    seen, fresh = env.reset(seed=4), new.reset(seed=4)
    assert_same(seen, fresh)
    assert_same(play(env, 25), play(new, 25))
    one, other = ants_of(), ants_of()
    assert not np.array_equal(one.reset()[0], other.reset()[0])  # drawn seeds differ


def test_an_ant_that_delivers_is_terminated_and_goes_on():
    """Where delivery terminates; a batch in which food lies beside the nest."""
    env = ants_of(task=Task(), max_steps=300)
    _, infos = env.reset(seed=2)
    rng = np.random.default_rng(5)
    delivered = 0
    for _ in range(299):
        before = infos["state"]
        seen, rewards, terminated, truncated, infos = env.step(guided(infos["action_mask"], rng))
        assert not truncated.any()
        assert ("final_obs" in infos) == terminated.any()
        assert np.array_equal(infos["event"] == Event.NONE, terminated)
        assert Event.DELIVERED not in infos["event"]
        if terminated.any():
            gave = infos["final_info"]["event"] == Event.DELIVERED
            assert np.array_equal(terminated, gave)
            delivered += gave.sum()
            assert (rewards[gave] == 10).all()
            assert np.array_equal(infos["_final_obs"], gave)
            assert_same(np.stack(infos["final_obs"][gave]), seen[gave])  # it goes on from there
            assert (before[gave] >= 64).all()
            assert (seen[gave] < 64).all()
    assert delivered > 5


def test_what_users_register_and_wrap():
    """Made by Gymnasium without a warning; its wrappers read infos and episodes."""
    gymnasium.register(
        "tests/Colony-v0", vector_entry_point="taichi_ants.envs.colony:HexColonyVectorEnv"
    )
    env = gymnasium.make_vec("tests/Colony-v0", num_envs=64, max_steps=5)
    assert (env.num_envs, env.metadata["autoreset_mode"]) == (64, SAME)
    seen, _ = env.reset(seed=1)
    assert seen in env.observation_space
    assert env.single_observation_space.shape == (4,)
    env.action_space.seed(1)
    listed = DictInfoToList(RecordEpisodeStatistics(env))
    listed.reset(seed=1)
    for _ in range(5):
        *_, infos = listed.step(env.action_space.sample())
    assert len(infos) == 64
    assert set(infos[0]) == {
        *("state", "action_mask", "event", "deliveries", "final_obs", "final_info", "episode")
    }
    assert infos[0]["final_info"]["event"] in (
        Event.ENTERED_EMPTY,
        Event.ENTERED_CUE,
        Event.BLOCKED,
        Event.FAILED,
    )
    assert infos[3]["episode"]["l"] == 5


def test_copies_and_pickles_go_on_alike():
    env = ants_of(task=foraging(), observation_format="cells", render_mode="rgb_array")
    env.reset(seed=3)
    play(env, 7)
    assert env.render()[1].shape[2] == 3
    others = [copy.deepcopy(env), pickle.loads(pickle.dumps(env))]
    expected = play(env, 25)
    for other in others:
        assert_same(play(other, 25), expected)


def test_pictures_of_each_world():
    env = ants_of(render_mode="rgb_array")
    with pytest.raises(ResetNeeded):
        env.render()
    env.reset(seed=1)
    pictures = env.render()
    assert len(pictures) == env.num_envs  # as Gymnasium's RecordVideo expects
    first, second = pictures[0], pictures[ANTS]
    assert first is pictures[ANTS - 1]
    assert first.dtype == np.uint8
    assert (first != second).any()  # the ants stand elsewhere
    assert ants_of().render() is None


def test_steps_in_the_wrong_order_and_wrong_actions():
    env = ants_of()
    right = np.zeros(env.num_envs, int)
    with pytest.raises(ResetNeeded):
        env.step(right)
    mask = np.zeros(env.num_envs, bool)
    mask[:ANTS] = True
    with pytest.raises(ResetNeeded):
        env.reset(options={"reset_mask": mask})
    env.reset()
    for wrong in (right + 5, right - 1, right[:-1], right + 0.0, None):
        with pytest.raises(InvalidAction, match=r"^(the actions are|an action is) .*\.$"):
            env.step(wrong)
    for wrong, error in (
        (mask[:-1], ValueError),
        (np.roll(mask, 1), ValueError),
        (~mask & mask, ValueError),
        (mask.astype(int), TypeError),
        (mask.tolist(), TypeError),
    ):
        with pytest.raises(error, match=r"^reset_mask .*\.$"):
            env.reset(options={"reset_mask": wrong})
    with pytest.raises(ValueError, match=r"^seed is .*; give a whole number, or a list of 2\.$"):
        env.reset(seed=[1, 2, 3])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"num_envs": 7}, "num_envs is 7; .* a multiple of ants, 6"),
        ({"ants": 0}, "ants is 0; "),
        ({"autoreset_mode": "never"}, "autoreset_mode is 'never'; it must be one of NextStep"),
        (
            {"task": Task(), "autoreset_mode": NEXT},
            "autoreset_mode is 'NextStep', but the next episode of an ant",
        ),
        ({"task": "maze"}, "task is 'maze'; it must be one of paper, fetching,"),
        ({"world": "nowhere"}, "there is no world 'nowhere'"),
        ({"world": []}, "world is .*; give the name of a world"),
        ({"world": 3}, "world is 3; give the name of a world"),
        ({"start": "there"}, "start is 'there'; "),
        ({"max_steps": 0}, "max_steps is 0; "),
        ({"observation_format": "text"}, "observation_format is 'text'; "),
        ({"evaporation": "off"}, "evaporation is 'off'; it must be True or False"),
        ({"render_mode": "human"}, "render_mode is 'human'; it must be one of rgb_array"),
    ],
)
def test_arguments_that_are_not_allowed(options, said):
    given = {"num_envs": 2 * ANTS, "ants": ANTS, "world": MEADOW, "task": GOES_ON, **options}
    with pytest.raises(AntsError, match=rf"^{said}.*\.$"):
        HexColonyVectorEnv(**given)


def test_memory_does_not_grow_with_environments_that_are_closed():
    def loop(times: int) -> int:
        for _ in range(times):
            env = ants_of(4)
            env.reset(seed=1)
            env.step(np.full(env.num_envs, GIVE))
            env.close()
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    first = loop(30)
    assert loop(100) - first < 2000  # kibibytes


def test_worlds_with_several_nests_and_kinds_of_food():
    """Both kinds of food are picked up and delivered, with their own rewards."""
    kinds = {"seed": {"deliver": 7}, "nectar": {"pick_up": 5, "deliver": 9}}
    world = worlds.World(
        (8, 8, 8), queen=[(0, 7, 7), (7, 0, 0)], foods=[((3, 0, 0), 0), ((0, 3, 0), 1)]
    )
    env = ants_of(1, task=GOES_ON.replace(foods=kinds), world=world, max_steps=3000, start="spread")
    env.reset(seed=1)
    made = env.rollout("trail_follower", 3000, epsilon=0.1)
    paid = made.rewards[made.events == Event.PICKED_UP], made.rewards[made.events == 5]
    assert [sorted(one) for one in paid] == [[3, 5], [7, 9]]
