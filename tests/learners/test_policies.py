"""The hand-written policies, and policy files."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from plain_runs import rollout

from taichi_ants import Colony, Life, TrainingConfig
from taichi_ants.errors import AntsError
from taichi_ants.learners.policies import load_policy, random_policy, save_policy, trail_follower
from taichi_ants.task import Task, foraging, observations, queueing
from taichi_ants.task.constants import FORWARD, GIVE, LEFT, PICK_UP, RIGHT
from taichi_ants.worlds import paper
from taichi_ants.worlds.open_world import open_world


def best_actions(q_values: np.ndarray, name: str, observation: str = "paper") -> set[int]:
    sees = observations.get(observation)
    (row,) = (row for row in range(sees.n_states) if sees.name_of(row) == name)
    return set(np.flatnonzero(q_values[row] == q_values[row].max()).tolist())


def test_the_random_policy_makes_no_difference_between_actions() -> None:
    policy = random_policy()
    assert policy.shape == (128, 5)
    assert policy.dtype == np.float32
    assert (policy == policy[0, 0]).all()


@pytest.mark.parametrize(
    ("name", "actions"),
    [
        ("foraging E T F", {PICK_UP}),
        ("foraging F F O", {PICK_UP}),
        ("foraging T T T", {FORWARD}),
        ("foraging T E T", {LEFT, RIGHT}),
        ("foraging E O T", {RIGHT}),
        ("foraging E E E", {FORWARD}),
        ("foraging O E E", {FORWARD, RIGHT}),
        ("foraging E O E", {LEFT, RIGHT}),
        ("foraging O E O", {FORWARD}),
        ("foraging O O O", {LEFT}),
        ("carrying O Q E", {GIVE}),
        ("carrying S S O", {LEFT, FORWARD}),
        ("carrying E E S", {RIGHT}),
        ("carrying E E E", {LEFT, FORWARD, RIGHT}),
        ("carrying O E O", {FORWARD}),
        ("carrying O O O", {LEFT}),
    ],
)
def test_what_the_trail_follower_does(name: str, actions: set[int]) -> None:
    assert best_actions(trail_follower(), name) == actions


@pytest.mark.parametrize("observation", ["ants", "queues"])
@pytest.mark.parametrize(
    ("name", "actions"),
    [
        ("foraging F P T", {PICK_UP}),
        ("foraging A E O", {FORWARD}),
        ("foraging E A E", {LEFT, RIGHT}),
        ("foraging A A O", {LEFT}),
        ("carrying P Q A", {GIVE}),
        ("carrying P S O", {FORWARD}),
        ("carrying S P E", {FORWARD}),
        ("carrying S S O", {FORWARD}),
        ("carrying E P P", {FORWARD}),
        ("carrying P E S", {LEFT, RIGHT}),
        ("carrying E A E", {LEFT, FORWARD, RIGHT}),
        ("carrying A A O", {LEFT, FORWARD}),
        ("carrying O O O", {LEFT}),
    ],
)
def test_what_the_trail_follower_does_about_ants(
    observation: str, name: str, actions: set[int]
) -> None:
    assert best_actions(trail_follower(observation), name, observation) == actions


@pytest.mark.parametrize(
    ("observation", "name", "actions"),
    [
        # An ant without food waits to be pushed; giving fails, and does not turn it.
        ("ants", "foraging T P E", {GIVE}),
        ("ants", "foraging E E P", {GIVE}),
        ("queues", "foraging T P E", {FORWARD}),
        ("queues", "foraging T E P", {LEFT}),
        ("queues", "foraging p E P", {GIVE}),
        ("queues", "foraging E E P", {RIGHT}),
        ("queues", "foraging P E P", {LEFT, RIGHT}),
        ("queues", "foraging E p E", {GIVE}),
        ("queues", "foraging T p p", {LEFT}),
        # With food, picking up fails.
        ("queues", "carrying p E A", {PICK_UP}),
        ("queues", "carrying p P E", {FORWARD}),
        ("queues", "carrying p p S", {RIGHT}),
    ],
)
def test_where_the_trail_follower_waits_for_others(
    observation: str, name: str, actions: set[int]
) -> None:
    assert best_actions(trail_follower(observation), name, observation) == actions


@pytest.mark.parametrize("observation", ["paper", "ants", "queues"])
def test_the_trail_follower_never_walks_into_what_blocks_unless_nothing_else_is_left(
    observation: str,
) -> None:
    policy, sees = trail_follower(observation), observations.get(observation)
    assert policy.shape == (sees.n_states, 5)
    assert set(np.unique(policy)) == {0.0, 1.0}
    for row, values in enumerate(policy):
        actions = set(np.flatnonzero(values).tolist())
        load, *view = sees.name_of(row).split()
        fails = PICK_UP if load == "carrying" else GIVE
        if {"F", "Q"} & set(view):
            assert actions == {GIVE if load == "carrying" else PICK_UP}
        elif fails in actions:
            assert actions == {fails}
            assert {"P", "p"} & set(view)
        else:
            blocked = {"O", "A"} if load == "foraging" else {"O"}
            towards = {view[move] for move in actions}
            assert not towards & blocked or (set(view) <= blocked and actions == {LEFT})


# What 64 ants of the least seeds deliver, less a margin; learned tables give 565 and 906 there.
@pytest.mark.parametrize(
    ("task", "least"), [pytest.param(foraging(), 700, marks=pytest.mark.slow), (queueing(), 930)]
)
def test_a_colony_of_trail_followers_delivers_more_than_learned_tables(
    task: Task, least: int
) -> None:
    colony = Colony(
        paper(),
        replace(task, life=Life(regrowth=0)),
        TrainingConfig("sarsa", 0.1, 0.9, 0.01, 1.0),
        range(4),
        ants=64,
        sharing="frozen",
        q_values=trail_follower(task.observation),
    )
    assert colony.run(1, 1000).deliveries.min() > least


def test_the_trail_follower_of_another_observation_is_refused() -> None:
    with pytest.raises(AntsError, match=r"observation is 'five_cells'; .*paper, ants"):
        trail_follower("five_cells")


@pytest.mark.parametrize("evaporation", [False, True])
def test_the_trail_follower_takes_the_shortest_way_in_the_world_of_the_paper(
    evaporation: bool,
) -> None:
    task = Task(evaporation_in_evaluation=evaporation)
    run = rollout(paper(), trail_follower(), task=task)
    assert (run.returns, run.steps, run.deliveries) == ([45], [34], [1])


@pytest.mark.parametrize("seed", range(4))
def test_the_trail_follower_finds_its_way_in_open_worlds(seed: int) -> None:
    world = open_world(seed, (14, 12, 16))
    rollouts = [
        rollout(world, trail_follower(), seed=seed, number=number, max_steps=2000)
        for number in range(4)
    ]
    assert all(run.deliveries == [1] for run in rollouts)


# Files.


def test_a_policy_comes_back_from_its_file(tmp_path: Path) -> None:
    q_values = np.random.default_rng(1).normal(size=(128, 5)).astype(np.float32)
    metadata = {"learner": "sarsa", "seed": np.int64(3), "world": "world of é", "none": None}
    path = tmp_path / "policy"
    save_policy(path, q_values, metadata)
    loaded, observation, loaded_metadata = load_policy(path)
    np.testing.assert_array_equal(loaded, q_values)
    assert loaded.dtype == np.float32
    assert observation == "paper"
    assert loaded_metadata == {"learner": "sarsa", "seed": 3, "world": "world of é", "none": None}
    assert [entry.name for entry in tmp_path.iterdir()] == ["policy"]


def write(path: Path, q_values: Any = random_policy(), **changes: Any) -> None:  # noqa: B008
    """Write a policy file as other programs do, with some facts exchanged."""
    facts = {"kind": "policy", "version": 2, "observation": "paper", "metadata": {}, **changes}
    np.savez(path, q_values=q_values, facts=json.dumps(facts))


@pytest.mark.parametrize("observation", observations.names())
def test_a_policy_of_any_observation_comes_back_with_its_name(
    tmp_path: Path, observation: str
) -> None:
    n_states = observations.get(observation).n_states
    q_values = np.random.default_rng(2).normal(size=(n_states, 5)).astype(np.float32)
    save_policy(tmp_path / "policy.npz", q_values, {}, observation)
    policy = load_policy(tmp_path / "policy.npz")
    assert policy.observation == observation
    np.testing.assert_array_equal(policy.q_values, q_values)


def task_of(path, metadata, observation="ants"):
    save_policy(path, random_policy(observation), metadata, observation)
    return load_policy(path).task


def test_a_policy_knows_the_rules_for_which_it_was_made(tmp_path: Path) -> None:
    path = tmp_path / "policy.npz"
    assert task_of(path, {"task": foraging().as_dict()}) == foraging()
    assert task_of(path, {}) == Task("ants")
    # The rows of its table are those of its observation, whatever else its metadata say.
    assert task_of(path, {"task": Task().as_dict()}) == Task("ants")
    for wrong in ({"smell": 1}, 3):
        with pytest.raises(AntsError, match="in the policy's metadata"):
            task_of(path, {"task": wrong})


def test_a_policy_of_an_observation_that_nobody_registered_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "policy.npz"
    with pytest.raises(AntsError, match="there is no observation 'smell'"):
        save_policy(path, random_policy(), {}, "smell")
    assert list(tmp_path.iterdir()) == []
    write(path, observation="smell")
    with pytest.raises(AntsError, match=r"policy\.npz.*there is no observation 'smell'; .*plugin"):
        load_policy(path)


def test_a_policy_of_another_size_than_its_observation_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "policy.npz"
    write(path, observation="ants_seen")
    with pytest.raises(AntsError, match=r"\(128, 5\); .*'ants_seen' it must end in \(250, 5\)"):
        load_policy(path)


def test_other_number_types_are_converted(tmp_path: Path) -> None:
    path = tmp_path / "policy.npz"
    save_policy(path, np.ones((128, 5), np.int64).tolist(), {})
    assert load_policy(path)[0].dtype == np.float32
    big_endian = np.ones((128, 5), ">f8")
    write(path, q_values=big_endian)
    np.testing.assert_array_equal(load_policy(path)[0], np.ones((128, 5), np.float32))


@pytest.mark.parametrize(
    ("q_values", "message"),
    [
        (np.zeros((127, 5)), r"\(127, 5\)"),
        (np.zeros(640), r"\(640,\)"),
        (np.full((128, 5), np.nan), "nan for state 0 and action 0"),
        (np.full((128, 5), np.inf), "inf"),
        (np.full((128, 5), 1e300), "inf"),
        (np.full((128, 5), "a"), "real numbers"),
        (np.zeros((128, 5), complex), "real numbers"),
        (np.zeros((128, 5), bool), "real numbers"),
    ],
)
def test_values_that_are_no_policy_are_refused_both_ways(
    tmp_path: Path, q_values: np.ndarray, message: str
) -> None:
    path = tmp_path / "policy.npz"
    with pytest.raises(AntsError, match=message):
        save_policy(path, q_values, {})
    assert list(tmp_path.iterdir()) == []
    write(path, q_values=q_values)
    with pytest.raises(AntsError, match=message) as raised:
        load_policy(path)
    assert str(path) in str(raised.value)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_one_value_that_is_not_finite_is_named(tmp_path: Path, bad: float) -> None:
    q_values = random_policy()
    q_values[17, 4] = bad
    with pytest.raises(AntsError, match="state 17 and action 4"):
        save_policy(tmp_path / "policy.npz", q_values, {})


@pytest.mark.parametrize("metadata", [[], 3, "x", None])
def test_metadata_that_is_no_object_is_refused(tmp_path: Path, metadata: object) -> None:
    path = tmp_path / "policy.npz"
    write(path, metadata=metadata)
    with pytest.raises(AntsError, match=r"policy\.npz.* metadata is .*; it must be a dict"):
        load_policy(path)


@pytest.mark.parametrize(
    ("arrays", "said"),
    [
        ({"q_values": random_policy(), "observation": "paper", "metadata": "{}"}, "not contain"),
        ({"q_values": random_policy(), "facts": '{"a":' * 100_000}, "not contain a policy"),
        ({"facts": '{"kind": "policy", "version": 2}'}, "damaged"),
    ],
)
def test_other_archives_are_refused(tmp_path: Path, arrays: dict, said: str) -> None:
    path = tmp_path / "policy.npz"
    np.savez(path, **arrays)
    with pytest.raises(AntsError, match=f"{said}.*; name a file that save_policy wrote"):
        load_policy(path)


@pytest.mark.parametrize(
    ("path", "q_values", "metadata", "message"),
    [
        (1, random_policy(), {}, "path is 1; it must be text or a path"),
        (None, random_policy(), {}, "path is None"),
        (b"p.npz", random_policy(), {}, "path is b'p.npz'"),
        ("p.npz", [[1, 2], [3]], {}, "array of real numbers"),
        ("p.npz", None, {}, "q_values is None; .* real numbers"),
        ("p.npz", random_policy(), None, "metadata is None; it must be a mapping"),
    ],
)
def test_what_cannot_be_a_policy_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, path, q_values, metadata, message
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(AntsError, match=message):
        save_policy(path, q_values, metadata)
    assert list(tmp_path.iterdir()) == []


def test_a_number_is_no_file_and_nothing_is_closed(capfd: pytest.CaptureFixture) -> None:
    for number in (0, 1, 2):
        with pytest.raises(AntsError, match=f"path is {number}"):
            load_policy(number)
    print("still open", flush=True)
    assert capfd.readouterr().out == "still open\n"


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(AntsError, match=r"none\.npz.*no such file"):
        load_policy(tmp_path / "none.npz")
