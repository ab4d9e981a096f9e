"""What training returns: kept in files, compared, printed, and not mixed up."""

import copy
import json
import pickle

import numpy as np
import pytest
from refusals import refused

from taichi_ants import (
    Task,
    TrainingConfig,
    TrainingResult,
    continue_training,
    evaluate,
    rollout,
    trace_training,
    train,
    worlds,
)
from taichi_ants.files import archives

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


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("state_integers", np.zeros((2, 2, 6488), np.int32), "integers of a result is an array"),
        ("state_q", np.zeros((2, 3, 1, 432, 5), np.float32), "q of a result is an array"),
        ("returns", None, "damaged (KeyError: 'returns'); name a file that"),
    ],
)
def test_damaged_arrays(stored, tmp_path, name, value, said):
    arrays = {key: array for key, array in stored.items() if key != name}
    assert stored["state_integers"].shape == (2, 3, 6488)
    arrays |= {} if value is None else {name: value}
    assert refused(said, of_file, arrays, tmp_path).startswith("the training result in '")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"configs": []}, ""),
        ({"configs": [{"learner": "sarsa"}]}, ""),
        ({"seeds": [1, 1, 2]}, "more than once"),
        ({"task": {"delivery": "never"}}, "`task.delivery` is 'never'"),
        ({"task": {"observation": "paper"}}, "of shape (2, 3, n, 128, 8)"),
        ({"world": {**WORLD, "ranges": [0, 1, 2]}}, "ranges contains 0; all must lie"),
    ],
)
def test_damaged_facts(stored, tmp_path, changes, said):
    facts = {**json.loads(stored["facts"].item()), **changes}
    arrays = {**stored, "facts": np.array(json.dumps(facts))}
    assert refused(said, of_file, arrays, tmp_path).startswith("the training result in '")


def of_file(arrays: dict[str, np.ndarray], folder) -> TrainingResult:
    archives.write(folder / "x.npz", arrays)
    return TrainingResult.load(folder / "x.npz")


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
