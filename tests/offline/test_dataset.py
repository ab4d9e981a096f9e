"""Data sets: files, parts, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_ants import AntsError, Dataset, Task, record, worlds
from taichi_ants.files import archives


@pytest.fixture(scope="module")
def data() -> Dataset:
    return record(worlds.paper(), None, 4, (5, 6, 7), 20, Task(delivery="truncates"))


def test_files_hold_everything(data, tmp_path):
    data.save(tmp_path / "ants.npz")
    loaded = Dataset.load(tmp_path / "ants.npz")
    assert loaded == data
    assert loaded.task == Task(delivery="truncates")
    assert loaded.behaviour == {"policy": "random", "epsilon": 0.0}


def test_other_files_are_refused_in_one_sentence(data, tmp_path):
    path = tmp_path / "ants.npz"
    data.save(path)
    arrays = archives.read(path)
    archives.write(path, {**arrays, "action": arrays["action"] + np.int8(9)})
    with pytest.raises(AntsError, match="action of a data set contains"):
        Dataset.load(path)
    archives.write(path, {"facts": "{}"})
    with pytest.raises(AntsError, match="does not contain a data set"):
        Dataset.load(path)


def test_returns_discount_from_the_first_step_of_each_episode(data):
    returns = data.returns(0.5)
    for k, (first, end) in enumerate(zip(data.begins, data.begins[1:], strict=False)):
        plain = sum(0.5**t * int(reward) for t, reward in enumerate(data.reward[first:end]))
        assert returns[k] == pytest.approx(plain, abs=1e-12)


def test_parts_of_a_data_set(data):
    """An episode that is cut is truncated there."""
    some = data.first(transitions=30)
    assert np.bincount(some.run).tolist() == [30, 30, 30]
    assert some.begins.tolist() == [0, 20, 30, 50, 60, 80, 90]
    assert some.truncated[29]
    assert not data.truncated[29]
    one = data.of_run(1)
    assert set(one.run) == {1}
    assert one.episode.tolist() == sorted([0, 1, 2, 3] * 20)
    assert np.array_equal(one.state, data.state[data.run == 1])


def changed(data, name, row, value):
    array = getattr(data, name).copy()
    array[row] = value
    return {name: array}


@pytest.mark.parametrize(
    ("name", "row", "value", "says"),
    [
        ("state", 3, 128, "state of a data set contains 128; all must lie between 0 and 127"),
        ("action", 3, -1, "action of a data set contains -1"),
        ("run", -1, 3, "run of a data set contains 3"),
        ("next_state", 3, 90, "are not in order"),
        ("truncated", -1, False, "are not in order"),
        ("agent", 3, 1, "are not in order"),
        ("episode", 3, 1, "are not in order"),
    ],
)
def test_arrays_that_do_not_belong_together_are_refused(data, name, row, value, says):
    with pytest.raises(AntsError, match=says):
        replace(data, **changed(data, name, row, value))
