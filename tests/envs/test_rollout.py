"""Rollouts, compared with calls of `step`: in all modes, tasks and formats, from any state."""

from typing import Any

import numpy as np
import pytest
from gymnasium.error import InvalidAction, ResetNeeded
from gymnasium.vector import AutoresetMode
from hypothesis import given, settings
from hypothesis import strategies as st

from taichi_ants import AntsError, Pheromone, Task, TrainingConfig, task, train, worlds
from taichi_ants.envs.forage import HexForageVectorEnv, Rollout
from taichi_ants.envs.formats import ObservationFormat
from taichi_ants.learners.policies import action_probabilities, save_policy, trail_follower
from taichi_ants.task import Noise

SAME, NEXT, DISABLED = AutoresetMode.SAME_STEP, AutoresetMode.NEXT_STEP, AutoresetMode.DISABLED
MEADOWS = [worlds.open_world(seed, (8, 8, 8)) for seed in range(3)]
TASKS: dict[str, tuple[Task, ObservationFormat]] = {
    "paper": (Task(), "index"),
    "adding": (Task(pheromone=Pheromone(deposit="add"), delivery="truncates"), "cells"),
    "fading, slips": (task.foraging().replace(noise=Noise(slip=0.2)), "one_hot"),
    "misread": (Task(observation="trail_levels", noise=Noise(0.1, 0.2)), "index"),
}


def lone(n: int = 7, **options: Any) -> HexForageVectorEnv:
    given = {"world": MEADOWS, "max_steps": 15, "observation_format": "index"}
    return HexForageVectorEnv(n, **{**given, **options})


def assert_steps(env: Any, made: Rollout) -> None:
    """Take the actions of a rollout by `step`, and compare all results to the bit."""
    ended, finals = np.zeros(env.num_envs, bool), []
    for t, actions in enumerate(made.actions):
        if env.autoreset_mode is DISABLED and env._ants.over().any():
            assert not made.rewards[t:, ended].any()
            assert not (made.terminated | made.truncated | made.events > 0)[t:, ended].any()
            assert (made.observations[t + 1 :, ended] == made.observations[t, ended]).all()
            return
        seen, rewards, terminated, truncated, infos = env.step(actions)
        ended = terminated | truncated
        for ours, theirs in (
            (made.observations[t + 1], seen),
            (made.rewards[t], rewards),
            (made.terminated[t], terminated),
            (made.truncated[t], truncated),
        ):
            assert ours.dtype == theirs.dtype
            assert np.array_equal(ours, theirs)
        events, last = infos["event"], seen
        if "final_obs" in infos:
            events = np.where(ended, infos["final_info"]["event"], events)
            last = infos["final_obs"]
        assert np.array_equal(made.events[t], events)
        finals += [last[i] for i in np.flatnonzero(ended)]
    assert made.final_observations.shape[1:] == env.single_observation_space.shape
    assert np.array_equal(made.final_observations, np.array(finals).reshape(-1, *seen.shape[1:]))


def compare(make: Any, before: int, lengths: list[int], seed: int) -> None:
    """Mix steps and rollouts in one environment, and compare it with steps in another."""
    ours, theirs = make(), make()
    for env in (ours, theirs):
        env.reset(seed=seed)
    rng, n, dtype = np.random.default_rng(seed), ours.num_envs, rng_type(seed)
    for _ in range(before):
        actions = rng.integers(0, 5, n)
        ours.step(actions)
        theirs.step(actions)
    for length in lengths:
        actions = rng.choice([0, 1, 1, 2, 3, 4], (length, n)).astype(dtype)
        made = ours.rollout(actions)
        assert np.array_equal(made.actions, actions)
        assert_steps(theirs, made)
        if ours.autoreset_mode is DISABLED and ours._ants.over().any():
            with pytest.raises(ResetNeeded, match=r"has ended; call reset\(\) with .* before ro"):
                ours.rollout(actions)
            return
        actions = rng.integers(0, 5, n)
        one, other = ours.step(actions), theirs.step(actions)
        for k in range(4):
            assert np.array_equal(one[k], other[k])
        for name in ("state", "action_mask", "event"):
            assert np.array_equal(one[4][name], other[4][name])
        if ours.autoreset_mode is DISABLED and ours._ants.over().any():
            return


def rng_type(seed: int) -> str:
    return ("int64", "uint8")[seed % 2]


CASES = {
    "mode": st.sampled_from([SAME, NEXT, DISABLED]),
    "before": st.integers(0, 14),
    "lengths": st.lists(st.integers(1, 40), min_size=1, max_size=3),
    "seed": st.integers(0, 2**32),
}


@settings(max_examples=20, deadline=None)
@given(
    rules=st.sampled_from(list(TASKS)),
    delivery=st.sampled_from(["terminates", "truncates", "continues"]),
    evaporation=st.booleans(),
    **CASES,
)
def test_lone_ants_equal_steps(mode, before, lengths, seed, rules, delivery, evaporation):
    def make() -> HexForageVectorEnv:
        return lone(
            task=TASKS[rules][0].replace(evaporation_in_training=evaporation),
            delivery=delivery,
            autoreset_mode=mode,
            observation_format=TASKS[rules][1],
        )

    compare(make, before, lengths, seed)


def test_policies_choose_by_their_values():
    env = lone(task=task.foraging())
    q_values = np.random.default_rng(0).choice([0, 1], (env._ants.task.n_states, 5)).astype(float)
    env.reset(seed=3)
    made = env.rollout(q_values, 400, epsilon=0.25)
    states = made.observations[:-1]
    counts = np.zeros(q_values.shape)
    np.add.at(counts, (states, made.actions), 1)
    visits = counts.sum(axis=1)
    expected = action_probabilities(q_values, 0.25)
    seen = visits > 150
    assert seen.sum() >= 3
    error = np.abs(counts[seen] / visits[seen, None] - expected[seen])
    assert (error < 4.5 * np.sqrt(0.25 / visits[seen, None])).all()
    greedy = env.rollout(q_values, 100)
    best = q_values == q_values.max(axis=1, keepdims=True)
    assert best[greedy.observations[:-1], greedy.actions].all()


def test_forms_of_a_policy(tmp_path):
    learnt = train(worlds.paper(), TrainingConfig("q_learning", 0.1, 0.9, 0.1, 1.0), 0, 3)
    path = str(tmp_path / "policy.npz")
    save_policy(path, trail_follower(), {})
    made = {}
    for name, policy in {
        "name": "trail_follower",
        "file": path,
        "table": trail_follower(),
        "result": learnt,
    }.items():
        env = lone()
        env.reset(seed=2)
        made[name] = env.rollout(policy, 12)
    for name in ("file", "table"):
        assert np.array_equal(made[name].observations, made["name"].observations)
    assert not np.array_equal(made["result"].observations, made["name"].observations)


def test_refuses():
    env = lone()
    with pytest.raises(ResetNeeded, match=r"^no episode has begun; call reset\(\) before rollout"):
        env.rollout("random", 3)
    env.reset(seed=1)
    n, n_states = env.num_envs, env._ants.task.n_states
    env.rollout("random", 3)
    where = env._ants.batched.arrays["states"].copy()
    for error, message, policy, options in (
        (InvalidAction, rf"of shape \(1, {n}\)", np.zeros((0, n), int), {}),
        (InvalidAction, rf"\(3, 4\).*of shape \(3, {n}\)", np.zeros((3, 4), int), {}),
        (InvalidAction, rf"of shape \({n}, {n}\)", np.zeros(n, int), {}),
        (InvalidAction, r"^an action is 5; ", np.full((2, n), 5), {}),
        (InvalidAction, r"^an action is -1; ", np.full((2, n), -1), {}),
        (AntsError, r"^q_values has shape \(3, ", np.zeros((3, n)), {}),
        (AntsError, r"^q_values is \[\[1\], \[2, 3\]\]; ", [[1], [2, 3]], {}),
        (AntsError, r"^q_values is None; ", None, {"steps": 3}),
        (AntsError, r"^policy is 'x'; it must be one of ", "x", {"steps": 3}),
        (AntsError, r"^q_values is nan", np.full((n_states, 5), np.nan), {"steps": 3}),
        (InvalidAction, rf"of shape \(3, {n}\)", np.zeros((2, n), int), {"steps": 3}),
        (AntsError, r"^steps is None; it must", "random", {}),
        (AntsError, r"^steps is 0; ", "random", {"steps": 0}),
        (AntsError, r"^steps is 2.5; ", "random", {"steps": 2.5}),
        (AntsError, r"^epsilon is 2; ", "random", {"steps": 3, "epsilon": 2}),
        (AntsError, r"^seed is 'a'; ", "random", {"steps": 3, "seed": "a"}),
    ):
        with pytest.raises(error, match=message):
            env.rollout(policy, **options)
    assert np.array_equal(env._ants.batched.arrays["states"], where)


@pytest.mark.parametrize("mode", [SAME, NEXT])
def test_many_ants_and_steps(mode):
    """Several chunks of ants, several blocks of steps, episodes that end with a delivery."""
    ours = lone(1100, max_steps=12, autoreset_mode=mode)
    theirs = lone(1100, max_steps=12, autoreset_mode=mode)
    for env in (ours, theirs):
        env.reset(seed=4)
    made = ours.rollout("trail_follower", 150, epsilon=0.2)
    assert made.terminated.sum() > 100
    assert made.truncated.sum() > 100
    assert_steps(theirs, made)
