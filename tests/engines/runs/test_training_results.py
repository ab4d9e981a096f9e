"""What training returns: kept in files, compared, printed, and not mixed up."""

from __future__ import annotations

import copy
import json
import pickle
from dataclasses import replace

import numpy as np
import pytest

from taichi_ants import (
    AntsError,
    Colony,
    Task,
    TrainingConfig,
    TrainingResult,
    World,
    continue_training,
    evaluate,
    rollout,
    trace_training,
    train,
    worlds,
)
from taichi_ants.engines.runs.results import RunState
from taichi_ants.files import archives
from taichi_ants.records import same

CONFIGS = (
    TrainingConfig("sarsa", 0.1, 0.9, 0.5, 0.99),
    TrainingConfig("dyna_q", 0.1, 0.95, 0.3, 0.995, planning_steps=3),
)
SEEDS = (4, -1, 2**63)
WORLD = worlds.paper().as_dict()
TASK = Task("trail_levels", delivery="truncates", evaporation_in_training=True)


@pytest.fixture(scope="module")
def result() -> TrainingResult:
    return train(worlds.paper(), CONFIGS, SEEDS, episodes=6, max_steps=80, task=TASK)


@pytest.fixture(scope="module")
def stored(result, tmp_path_factory) -> dict[str, np.ndarray]:
    path = tmp_path_factory.mktemp("stored") / "result.npz"
    result.save(path)
    return archives.read(path)


def test_what_was_loaded_goes_on_bit_for_bit(result, tmp_path):
    result.save(tmp_path / "half.npz")
    loaded = TrainingResult.load(tmp_path / "half.npz")
    assert loaded == result
    assert loaded.seconds == result.seconds
    assert continue_training(loaded, 5) == continue_training(result, 5)
    whole = train(worlds.paper(), CONFIGS, SEEDS, 11, 80, TASK)
    assert continue_training(loaded, 5) == whole


@pytest.mark.parametrize("configs", CONFIGS)
def test_worlds_of_any_kind_are_kept(configs, tmp_path):
    world = worlds.open_world(3, (12, 11, 10))
    once = train(world, configs, 7, 2, 50)
    once.save(tmp_path / "one.npz")
    assert TrainingResult.load(tmp_path / "one.npz").world == world
    assert TrainingResult.load(tmp_path / "one.npz") == once


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("state_integers", np.zeros((2, 3, 6487), np.int32), "integers of a result is an array"),
        ("state_q", np.zeros((2, 3, 1, 432, 5), np.float32), "q of a result is an array"),
        (
            "returns",
            None,
            "damaged (KeyError: 'returns'); name a file that",
        ),
    ],
)
def test_damaged_arrays(stored, tmp_path, name, value, said):
    arrays = {key: array for key, array in stored.items() if key != name}
    assert stored["state_integers"].shape == (2, 3, 6488)
    assert said in refused(arrays if value is None else {**arrays, name: value}, tmp_path)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"configs": []}, ""),
        ({"configs": [{"learner": "sarsa"}]}, ""),
        ({"seeds": [1]}, ""),
        ({"seeds": [1, 1, 2]}, "more than once"),
        ({"max_steps": 0}, "max_steps is 0"),
        ({"task": {"delivery": "never"}}, "`task.delivery` is 'never'"),
        ({"task": {"observation": "paper"}}, "of shape (2, 3, 1, 128, 8)"),
        ({"task": {"observation": "own"}}, "`task.observation` is 'own'; "),
        ({"world": {**WORLD, "ranges": [0, 1, 2]}}, "ranges are"),
        ({"world": None}, ""),
        ({"seconds": "long"}, ""),
    ],
)
def test_damaged_facts(stored, tmp_path, changes, said):
    facts = {**json.loads(stored["facts"].item()), **changes}
    assert said in refused({**stored, "facts": np.array(json.dumps(facts))}, tmp_path)


def refused(arrays: dict[str, np.ndarray], folder) -> str:
    archives.write(folder / "x.npz", arrays)
    with pytest.raises(AntsError, match=r"^the training result in '.*x.npz' .*[.]$") as caught:
        TrainingResult.load(folder / "x.npz")
    return str(caught.value)


def test_foreign_files(tmp_path):
    colony = Colony(worlds.paper(), None, CONFIGS[0])
    colony.save(tmp_path / "colony.npz")
    deep = {"facts": np.array("[" * 100_000 + "]" * 100_000)}
    archives.write(tmp_path / "deep.npz", deep)
    for name in ("colony.npz", "deep.npz"):
        with pytest.raises(
            AntsError, match=f"{name}' does not contain a training result of this version"
        ):
            TrainingResult.load(tmp_path / name)
    (tmp_path / "text.npz").write_text("text")
    with pytest.raises(AntsError, match=r"text\.npz' is damaged, or not an \.npz file"):
        TrainingResult.load(tmp_path / "text.npz")
    with pytest.raises(AntsError, match="path is 1; it must be text or a path"):
        TrainingResult.load(1)


def test_arrays_that_do_not_belong_to_a_result_are_refused(result):
    with pytest.raises(AntsError, match=r"returns of a result is \[\]"):
        replace(result, returns=[])
    with pytest.raises(AntsError, match="state of a result is None"):
        replace(result, state=None)
    for name, array in vars(result.state).items():
        other = replace(result.state, **{name: array[:, :2]})
        with pytest.raises(AntsError, match=f"{name} of a result is"):
            replace(result, state=other)
    assert replace(result, seconds=0.0) == result


def test_results_compare_by_content(result):
    assert result == copy.deepcopy(result) == pickle.loads(pickle.dumps(result))
    again = train(worlds.paper(), CONFIGS, SEEDS, 6, 80, TASK)
    assert (result == again, result != again) == (True, False)
    assert result.seconds != again.seconds  # they are no outcome
    assert (result == continue_training(result, 1)) is False
    assert (result.state == again.state, result == 3) == (True, False)

    tables = result.q_values[0]
    greedy = evaluate(worlds.paper(), tables, 2, task=TASK)
    assert (greedy == evaluate(worlds.paper(), tables, 2, task=TASK)) is True
    assert (greedy == evaluate(worlds.paper(), tables, 3, task=TASK)) is False
    followed = rollout(worlds.paper(), tables[0], task=TASK)
    assert (followed == rollout(worlds.paper(), tables[0], task=TASK)) is True
    assert followed != trace_training(worlds.paper(), CONFIGS[0], max_steps=5)
    for record in (result, result.state, greedy, followed):
        with pytest.raises(TypeError, match="unhashable"):
            hash(record)


def test_nan_equals_nan_and_types_count():
    values = np.array([1.0, np.nan])
    assert same(values, values.copy())
    assert not same(values, values.astype(np.float32))
    assert not same(values, [1.0, np.nan])
    assert not same(None, values)
    assert not same(True, 1)


def test_colonies_compare_by_content(tmp_path):
    def begun(seed: int = 3) -> Colony:
        colony = Colony(worlds.paper(), None, CONFIGS[1], (seed, 9), ants=4)
        colony.begin_episode()
        colony.tick(20)
        return colony

    one = begun()
    assert (one == begun(), one == begun(4), one == 3) == (True, False, False)
    one.save(tmp_path / "x.npz")
    assert Colony.load(tmp_path / "x.npz") == one
    assert one.outcome() == begun().outcome()
    assert one.snapshot() == begun().snapshot()
    one.tick()
    assert one != begun()
    with pytest.raises(TypeError, match="unhashable"):
        hash(one)


def test_everything_prints_on_one_screen(result):
    many = [replace(CONFIGS[0], learning_rate=0.01 + 0.01 * k) for k in range(20)]
    colony = Colony([worlds.open_world(s, (9, 9, 9)) for s in range(3)], None, CONFIGS[0],
                    range(3))  # fmt: skip
    colony.begin_episode()
    shown = [
        *(result, result.state, train(worlds.paper(), many, range(40), 2, 20)),
        *(
            evaluate(worlds.paper(), result.q_values, task=TASK),
            rollout(worlds.paper(), result.q_values[0, 0], task=TASK),
        ),
        *(trace_training(worlds.paper(), CONFIGS[0], max_steps=5), colony, colony.outcome()),
        *(colony.snapshot(), World((3, 3, 3), (0, 0, 0))),
    ]
    for value in shown:
        lines = repr(value).splitlines()
        assert len(lines) <= 24
        assert max(map(len, lines)) <= 400
        assert lines[0].startswith(type(value).__name__ + "(")
    assert f"return {result.returns[0].mean():.4g}, steps" in repr(result)
    assert "and 14 more configurations" in repr(shown[2])
    assert "returns: int32 (2, 3, 50), mean" in repr(shown[3])
    assert "World(ranges=(9, 9, 9)" in repr(colony)
    assert "and 2 more" in repr(colony)


def test_configurations_that_follow_one_another_are_not_copied_to_be_trained():
    configs = [TrainingConfig("q_learning", rate, 0.9, 0.1, 1.0) for rate in (0.1, 0.2, 0.3)]
    state = RunState.fresh(configs, (1, 2), 128)
    part = state.part(slice(1, 3))
    assert part.q.shape == (4, *state.q.shape[2:])
    part.q[:], part.epsilon[:] = 7, 0.5
    assert (state.q[1:] == 7).all()
    assert (state.q[0] == 0).all()
    others = state.part([0, 2])
    others.q[:] = 9
    assert (state.q[[0, 2]] != 9).all()
    state.put([0, 2], others)
    assert (state.q[[0, 2]] == 9).all()
    assert (state.q[1] == 7).all()
