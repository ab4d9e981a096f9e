"""Policies that are functions, as tables; tables that act in environments."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command_lines import run

from taichi_ants import AntsError, evaluate, load_policy, rollout, save_policy, tabulate, worlds
from taichi_ants.envs.forage import HexForageEnv, HexForageVectorEnv
from taichi_ants.envs.formats import FORMATS, Shown
from taichi_ants.learners.policies import Policy, trail_follower
from taichi_ants.task import observations

# Two that take the same greedy walk: without ties, so without chance.
FOLLOWER = trail_follower() + 0.1 * np.linspace(1, 0, 5, dtype=np.float32)


def network(seen: np.ndarray) -> np.ndarray:
    """The follower as a function of one-hot vectors, as a network would be."""
    states = Shown(observations.get("paper"), "one_hot").states(seen)
    return FOLLOWER[states].astype(np.float64)


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("observation", ["paper", "ants"])
def test_a_function_gets_each_state_as_environments_show_it(observation: str, form: str) -> None:
    shown = Shown(observations.get(observation), form)
    values = np.random.default_rng(0).normal(size=(shown.observation.n_states, 5))

    def function(seen: np.ndarray) -> np.ndarray:
        assert seen.dtype == shown.space.dtype
        assert all(one in shown.space for one in seen)
        return values[shown.states(seen)]

    table = tabulate(function, observation, form)
    assert table.dtype == np.float32
    assert (table == values.astype(np.float32)).all()


def test_actions_become_the_best_of_their_state() -> None:
    actions = np.arange(128) % 5
    table = tabulate(lambda seen: actions)
    assert (table.argmax(axis=1) == actions).all()
    assert (table.sum(axis=1) == 1).all()


@pytest.mark.parametrize(
    ("returned", "said"),
    [
        (lambda seen: np.zeros((5, 128)), r"shape \(5, 128\) and type float64; .*\(128, 5\)"),
        (lambda seen: np.zeros(128), r"type float64; .* whole numbers and of shape \(128,\)"),
        (lambda seen: np.zeros((128, 5), complex), "type complex128"),
        (lambda seen: np.full(128, 5), "returned contains 5; all must lie between 0 and 4"),
        (lambda seen: np.full(128, -1), "returned contains -1"),
        (lambda seen: np.where(np.eye(128, 5), np.nan, 0), "nan for state 0 and action 0"),
        (lambda seen: np.full((128, 5), -1e300), "-inf for state 0 and action 0"),
    ],
)
def test_what_a_function_may_not_return(returned, said) -> None:
    with pytest.raises(AntsError, match=said):
        tabulate(returned)


def test_faults_of_the_function_are_its_own() -> None:
    with pytest.raises(ZeroDivisionError):
        tabulate(lambda seen: 1 // 0)


def test_observations_and_formats_are_checked() -> None:
    with pytest.raises(AntsError, match="nothing"):
        tabulate(network, "nothing")
    with pytest.raises(AntsError, match="observation_format is 'image'"):
        tabulate(network, observation_format="image")  # type: ignore[arg-type]


@pytest.mark.slow
def test_a_network_is_rendered_put_into_a_colony_and_compared(
    kernels: Path, tmp_path: Path
) -> None:
    """All that takes policy files takes it."""
    path = tmp_path / "network.npz"
    save_policy(path, tabulate(network), {"made by": "a test"})
    sheet = run("policy_sheet", ["--policy", path, "--out", "sheet.png"], kernels, tmp_path)
    assert sheet.returncode == 0, sheet.stderr
    assert (tmp_path / "sheet.png").stat().st_size > 10_000
    shared = ["--sharing", "frozen", "--ants", 4, "--ticks", 50]
    live = run("colony", ["live", "--policy", path, *shared], kernels, tmp_path)
    assert live.returncode == 0, live.stderr
    ours = evaluate(worlds.paper(), load_policy(path).q_values, rollouts=3)
    theirs = evaluate(worlds.paper(), FOLLOWER, rollouts=3)
    assert (ours.returns == theirs.returns).all()
    assert (ours.steps == theirs.steps).all()


def test_a_policy_acts_in_one_environment_as_in_a_rollout() -> None:
    policy, rng = Policy(FOLLOWER, "paper", {}), np.random.default_rng(0)
    trace = rollout(worlds.paper(), FOLLOWER, max_steps=40)
    env = HexForageEnv(max_steps=40, evaporation=True)
    _, info = env.reset(seed=0)
    for action in trace.actions:
        assert policy.actions(info["state"], rng) == action
        *_, info = env.step(policy.actions(info["state"], rng))


def test_a_policy_acts_in_many_environments() -> None:
    policy, rng = Policy(trail_follower(), "paper", {}), np.random.default_rng(0)
    envs = HexForageVectorEnv(3, world=worlds.open_world(1, (8, 8, 8)))
    _, infos = envs.reset(seed=0)
    for _ in range(5):
        actions = policy.actions(infos["state"], rng)
        assert actions.shape == (3,)
        assert (policy.q_values[infos["state"], actions] == 1).all()
        *_, infos = envs.step(actions)


def test_ties_are_broken_evenly_and_only_ties() -> None:
    table = np.zeros((128, 5), np.float32)
    table[7] = [1, 0, 1, 1, 0]
    policy, rng = Policy(table, "paper", {}), np.random.default_rng(0)
    taken = np.bincount(policy.actions(np.full((100, 60), 7), rng).ravel(), minlength=5)
    assert (taken[[1, 4]] == 0).all()
    assert (abs(taken[[0, 2, 3]] - 2000) < 150).all()


@pytest.mark.parametrize("states", [-1, 128, [0, 200], 0.5])
def test_states_that_are_none(states) -> None:
    with pytest.raises(AntsError, match="states (contains|is)"):
        Policy(FOLLOWER, "paper", {}).actions(states, np.random.default_rng(0))


def test_one_table_is_evaluated_with_many_seeds() -> None:
    world = worlds.open_world(3, (8, 8, 8))
    many = evaluate(world, FOLLOWER, rollouts=4, seeds=range(5))
    assert many.steps.shape == (5, 4)
    np.testing.assert_array_equal(
        many.steps, evaluate(world, np.stack([FOLLOWER] * 5), rollouts=4, seeds=range(5)).steps
    )


def test_a_table_that_was_learned_outside_is_evaluated() -> None:
    """As Gymnasium's learners keep it: float64, or a dictionary of states that were seen."""
    outside = FOLLOWER.astype(np.float64)
    assert (evaluate(worlds.paper(), outside, rollouts=3).deliveries == 1).all()
    sparse = {state: row for state, row in enumerate(outside) if row.any()}
    with pytest.raises(AntsError, match="must be an array of real numbers"):
        evaluate(worlds.paper(), sparse)  # type: ignore[arg-type]
    with pytest.raises(AntsError, match=r"shape \(5, 128\); .* must end in \(128, 5\)"):
        evaluate(worlds.paper(), outside.T)
    with pytest.raises(AntsError, match=r"shape \(2, 4, 4, 4, 5\)"):
        evaluate(worlds.paper(), outside.reshape(2, 4, 4, 4, 5))
