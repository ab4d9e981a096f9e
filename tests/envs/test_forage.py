"""One ant as a Gymnasium environment, and many of them in one vector environment."""

import copy
import pickle
import warnings
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import InvalidAction, ResetNeeded
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from refusals import refused
from same_steps import assert_same, likely

from taichi_ants import Pheromone, Task, World, task, worlds
from taichi_ants.envs import Event, Reason
from taichi_ants.envs.forage import HexForageEnv, HexForageVectorEnv
from taichi_ants.envs.formats import FORMATS

ID = "taichi_ants/HexForage-v0"
SMALL = [worlds.open_world(seed, (8, 8, 8)) for seed in range(3)]
SETTINGS: list[dict[str, Any]] = [
    {},
    {"task": task.foraging().replace(evaporation_in_training=True), "delivery": "continues"},
    {
        "task": Task(pheromone=Pheromone(deposit="add")),
        "delivery": "truncates",
        "observation_format": "one_hot",
    },
]


@pytest.mark.parametrize("settings", SETTINGS, ids=["paper", "foraging", "adding"])
@pytest.mark.parametrize("mode", AutoresetMode, ids=lambda mode: mode.value)
def test_many_ants_equal_single_environments(mode, settings):
    n, rng, settings = 6, np.random.default_rng(1), {**settings, "max_steps": 40}
    ours = gymnasium.make_vec(ID, num_envs=n, world=SMALL, autoreset_mode=mode, **settings)
    one_by_one = [
        lambda i=i: gymnasium.make(ID, world=SMALL[i % len(SMALL)], **settings) for i in range(n)
    ]
    theirs = SyncVectorEnv(one_by_one, autoreset_mode=mode)
    assert ours.single_observation_space == theirs.single_observation_space
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    assert ours.metadata["autoreset_mode"] is mode
    first, other = ours.reset(seed=5), theirs.reset(seed=5)
    assert_same(first, other)
    masks, delivered = first[1]["action_mask"], 0
    for step in range(100):
        actions = likely(rng, masks)
        now, then = ours.step(actions), theirs.step(actions)
        assert_same(now, then, f"step {step}")
        delivered += (now[4]["event"] == Event.DELIVERED).sum()
        if "final_info" in now[4]:
            delivered += (now[4]["final_info"]["event"] == Event.DELIVERED).sum()
        masks, ended = now[4]["action_mask"], now[2] | now[3]
        if mode is AutoresetMode.DISABLED and ended.any():
            now, then = (env.reset(options={"reset_mask": ended.copy()}) for env in (ours, theirs))
            assert_same(now, then, f"reset after {step}")
            masks = np.where(ended[:, None], now[1]["action_mask"], masks)
    assert delivered > 2


@pytest.mark.parametrize("observation_format", FORMATS)
@pytest.mark.parametrize("rules", [None, task.queueing()], ids=["paper", "queueing"])
def test_gymnasium_has_nothing_to_say(rules, observation_format):
    for world in ("paper", "open"):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            env = gymnasium.make(
                f"taichi_ants.envs:{ID}",
                world=world,
                task=rules,
                observation_format=observation_format,
                render_mode="rgb_array",
            )
            check_env(env.unwrapped)


def test_infos_have_the_same_numbers_after_each_reset_and_step():
    """A corridor with the queen behind the ant: each event, with the reason where there is one."""
    world = World((5, 5, 1), (0, 0, 0), foods=[(3, 0, 0)], ants=[((1, 0, 0), 0)])
    env = gymnasium.make(ID, world=world)
    kinds = dict.fromkeys(("state", "event", "reason", "deliveries"), np.int64)
    kinds["action_mask"] = np.ndarray
    _, info = env.reset(seed=0)
    codes = [(info["event"], info["reason"])]
    for action in (3, 4, 0, 2, 1, 3, 3, 4, 1, 1, 4):
        *_, terminated, truncated, info = env.step(action)
        assert {name: type(value) for name, value in info.items()} == kinds
        codes.append((info["event"], info["reason"]))
    assert codes == [
        (Event.NONE, Reason.NONE),
        (Event.FAILED, Reason.NO_FOOD_IN_VIEW),
        (Event.FAILED, Reason.CARRIES_NO_FOOD),
        (Event.BLOCKED, Reason.ROCK_OR_EDGE_AHEAD),
        (Event.ENTERED_EMPTY, Reason.NONE),
        (Event.BLOCKED, Reason.FOOD_AHEAD),
        (Event.PICKED_UP, Reason.NONE),
        (Event.FAILED, Reason.CARRIES_FOOD_ALREADY),
        (Event.FAILED, Reason.NO_QUEEN_IN_VIEW),
        (Event.ENTERED_CUE, Reason.NONE),
        (Event.BLOCKED, Reason.QUEEN_AHEAD),
        (Event.DELIVERED, Reason.NONE),
    ]
    assert (terminated, truncated) == (True, False)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_copies_go_on_alike(copied):
    rng = np.random.default_rng(0)
    for env, draw in (
        (HexForageEnv(SMALL[0], max_steps=30, render_mode="rgb_array"), lambda: rng.integers(5)),
        (HexForageVectorEnv(5, SMALL, max_steps=30), lambda: rng.integers(0, 5, 5)),
    ):
        env.reset(seed=2)
        env.step(draw())
        if isinstance(env, HexForageEnv):
            env.render()
        twin = copied(env)
        for _ in range(25):
            action = draw()
            one, other = env.step(action), twin.step(action)
            for part in range(4):
                np.testing.assert_array_equal(one[part], other[part])


def test_callers_own_what_an_environment_returns():
    """Later steps leave it as it is, and changes of it have no effect on later steps."""
    env, actions = HexForageEnv(), [1, 1, 0, 2, 3, 4] * 3
    env.reset(seed=0)
    expected = [str(env.step(action)) for action in actions]
    for _ in range(2):
        returned = [(*env.reset(seed=0),), *map(env.step, actions)]
        assert [str(one) for one in returned[1:]] == expected
        for seen, *_, info in returned:
            seen.fill(7)
            info["action_mask"].fill(7)
            info.clear()


def test_each_thread_steps_its_own_environment():
    def played(seed: int) -> str:
        env = HexForageEnv(SMALL[seed % 2], delivery="continues", max_steps=3000)
        return str([env.reset(seed=seed), *map(env.step, [3, 1, 4, 1, 0, 2, 1] * 400)])

    expected = list(map(played, range(4)))
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(played, range(4))) == expected


def test_pictures_show_the_world_as_it_is():
    pictures = HexForageVectorEnv(2, render_mode="rgb_array")
    pictures.reset(seed=0)
    before = pictures.render()
    pictures.step(np.array([1, 2]))
    after = pictures.render()
    assert before is not None
    assert after is not None
    assert [one.shape for one in before] == [(720, 1280, 3)] * 2
    np.testing.assert_array_equal(before[0], before[1])
    assert (after[0] != after[1]).any()


def test_wrong_steps_raise_what_gymnasium_raises():
    for env, good in ((HexForageEnv(max_steps=2), 0), (HexForageVectorEnv(2), np.zeros(2, int))):
        with pytest.raises(ResetNeeded, match="reset"):
            env.step(good)
        env.reset(seed=0)
        for wrong in (5, -1, 2**63, 1.0, "left", None, [0, 5], [0] * 3, np.array([0.0, 1.0])):
            with pytest.raises(InvalidAction, match="must be"):
                env.step(wrong)
    env = HexForageEnv(max_steps=1)
    env.reset(seed=0)
    env.step(0)
    with pytest.raises(ResetNeeded):
        env.step(0)
    many = HexForageVectorEnv(2, max_steps=1, autoreset_mode="Disabled")
    with pytest.raises(ResetNeeded):
        many.reset(options={"reset_mask": np.array([True, False])})
    for seed in ([1], [1, -2], "ab"):
        with pytest.raises((ValueError, gymnasium.error.Error), match=r"[Ss]eed"):
            many.reset(seed=seed)
    many.reset(seed=0)
    many.step(np.zeros(2, int))
    with pytest.raises(ResetNeeded, match="environment 0 has ended"):
        many.step(np.zeros(2, int))
    many.reset(options={"reset_mask": np.array([True, False])})
    with pytest.raises(ResetNeeded, match="environment 1 has ended"):
        many.step(np.zeros(2, int))


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"world": "nowhere"}, "there is no world 'nowhere'"),
        ({"world": [SMALL[0], worlds.paper()], "num_envs": 2}, "give worlds of one size"),
        ({"world": SMALL, "num_envs": 2}, ", or a list of 1 to 2 of them."),
        ({"task": "maze"}, "task is 'maze'; it must be one of paper, fetching,"),
        ({"delivery": "never"}, "delivery is 'never'"),
        ({"max_steps": 0}, "max_steps is 0"),
        ({"num_envs": 0}, "num_envs is 0"),
    ],
)
def test_wrong_arguments_are_named(arguments, told):
    refused(told, HexForageVectorEnv, **arguments)
    if not {"num_envs", "autoreset_mode"} & arguments.keys():
        refused(told, HexForageEnv, **arguments)


MAZE = [1] * 16 + [3] + [1] * 16 + [4]  # delivers in the paper's world


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
@pytest.mark.parametrize("delivery", ["terminates", "continues"])
def test_deliveries_are_counted_by_step_and_by_rollout(mode: str, delivery: str) -> None:
    limit = 34 if mode == "Disabled" else 90
    how = {"autoreset_mode": mode, "delivery": delivery, "max_steps": limit}
    stepped, rolled = HexForageVectorEnv(2, **how), HexForageVectorEnv(2, **how)
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


def test_worlds_and_tasks_by_name_path_and_value(tmp_path) -> None:
    path = tmp_path / "map.txt"
    path.write_text(worlds.to_text(worlds.paper()), "utf-8")

    def played(**arguments: Any) -> str:
        env = gymnasium.make(ID, **arguments)
        env.reset(seed=3)
        return str([env.step(action) for action in MAZE])

    for same in ({"world": path}, {"world": str(path)}, {"task": "paper"}, {"task": task.paper()}):
        assert played(**same) == played()
    truncates = Task(delivery="truncates")
    assert played(task=truncates) == played(delivery="truncates") != played()
    assert played(task="fetching") == played(task=task.fetching()) != played()
