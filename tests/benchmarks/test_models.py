"""The benchmark of models: its colonies have the features that its rows name."""

from __future__ import annotations

import models

from taichi_ants.task import foraging


def test_the_features_are_those_of_the_task():
    task = models.task_with(models.FEATURES)
    assert len(task.castes) == 2
    assert list(task.fields) == [task.homing_cue] == ["from_nest"]
    assert task.choice.rule == "softmax"
    assert (task.noise.slip, task.noise.misread) == (0.05, 0.05)
    assert models.task_with(()) == foraging()
    assert [models.world_of(100, n).n_nests for n in (1, 2)] == [1, 2]


def test_its_table():
    found = {"foraging": [2e6, 4e6, 3e6], "softmax": [1e6, 1e6, 1e6]}
    assert models.table(found, 1000).rows == [
        ["foraging", "3", "1", "[1.00, 1.00]"],
        ["softmax", "1", "0.33", "[0.25, 0.50]"],
    ]
