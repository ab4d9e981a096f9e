"""Kernels are compiled by one of several workers of a machine."""

from __future__ import annotations

import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import pytest

from taichi_ants import Task, TrainingConfig
from taichi_ants.studies import compilation
from taichi_ants.studies.executors import Work
from taichi_ants.studies.points import ColonyPoint, RunPoint
from taichi_ants.task import Noise
from taichi_ants.worlds import open_world, paper

SARSA = TrainingConfig("sarsa", 0.1, 0.9, 0.3, 0.99)
RUN = RunPoint(paper(), Task(), SARSA, 6, 80, 3)
WORLDS = tuple(open_world(seed, (12, 12, 12)) for seed in (1, 2))
COLONY = ColonyPoint(WORLDS, Task(), SARSA, ants=4, episodes=2, ticks=60, rollouts=2)


def work(point, seeds=(0, 1)):
    return Work((point,), seeds, None, None, {"threads": 1, "arch": "cpu"})


def kind(point, *others):
    return compilation._kind(work(point), others)


def test_numbers_do_not_change_kernels_but_zero_and_names_do():
    assert kind(RUN) == kind(replace(RUN, training=replace(SARSA, epsilon=0.2), episodes=9))
    assert kind(RUN) != kind(replace(RUN, training=replace(SARSA, learner="q_learning")))
    noisy = [replace(RUN, task=Task(noise=Noise(slip=slip))) for slip in (0.1, 0.2)]
    assert kind(noisy[0]) == kind(noisy[1]) != kind(RUN)
    assert kind(RUN) != kind(RUN, ("plugin.py", "text"))
    assert kind(COLONY) != kind(RUN)


@pytest.mark.parametrize("point", [RUN, COLONY])
def test_the_shortest_work_is_one_seed_of_one_step(point):
    short = compilation._shortest(work(point))
    (first,) = short.points
    assert (short.seeds, first.episodes, first.rollouts) == ((0,), 1, 1)
    assert short.do()["returns"].shape == (1, 1, 1)
    assert point.episodes > 1


def compiled(point):
    return compilation.compile_once(work(point)), compilation.compile_once(work(point))


@pytest.mark.slow
def test_one_of_three_workers_compiles(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    spawn = multiprocessing.get_context("spawn")
    for expected in (1, 0):  # then the cache has the kernels
        with ProcessPoolExecutor(3, spawn, max_tasks_per_child=1) as pool:
            first, second = zip(*pool.map(compiled, [RUN] * 3), strict=True)
        assert sum(first) == expected
        assert not any(second)
    assert os.listdir(tmp_path / "taichi_ants" / "kernels")
