"""The benchmark, and its yardstick in C: a third writing of the rules, equal to the bit."""

from __future__ import annotations

import re

import numpy as np
import pytest
import throughput
from random_worlds import random_world

from taichi_ants import Task, TrainingConfig, train
from taichi_ants.worlds import paper


@pytest.fixture(scope="module")
def yardstick(tmp_path_factory):
    if throughput.compiler() is None:
        pytest.skip("there is no C compiler")
    return throughput.load_yardstick(throughput.compiler(), tmp_path_factory.mktemp("c"))


@pytest.mark.parametrize("delivery", ["continuing", "absorbing"])
def test_c_gives_the_same_runs(delivery, yardstick):
    configs = throughput.grid("q_learning", 0)[::5]
    configs.append(TrainingConfig("q_learning", 1.0, 0.9, 0.7, 0.5, 0.2))
    deliveries = 0
    for world in (paper(), *(random_world(seed + 60, 6) for seed in range(12))):
        seeds = (0, 7, 2**63 + 5)
        result = train(world, configs, seeds, 25, 150, Task(delivery=delivery))
        deliveries += result.deliveries.sum()
        for c, config in enumerate(configs):
            for s, seed in enumerate(seeds):
                given = (config, delivery == "continuing", seed, 25, 150)
                run = throughput.train_in_c(yardstick, world, *given)
                assert np.array_equal(run[0], result.returns[c, s])
                assert np.array_equal(run[1], result.steps[c, s])
                assert np.array_equal(run[2], result.q_values[c, s])
    assert deliveries > 100


def printed_by(arguments, capsys):
    with pytest.raises(SystemExit) as end:
        throughput.main(arguments)
    assert end.value.code == 0
    return capsys.readouterr().out


SMALL = ["--seeds", "1"]


def test_its_table(capsys):
    lines = printed_by(SMALL, capsys).splitlines()
    assert lines[0].split() == ["runs", "steps", "wall", "s", "CPU", "s", "M", "steps/s", "ns/step"]
    labels = [line[:16].strip() for line in lines[1:5]]
    assert labels == ["q_learning", "sarsa", "dyna_q (p3)", "dyna_q (p5)"]
    assert [int(line[16:22]) for line in lines[1:5]] == [16, 16, 16, 16]
    steps = [int(line[22:35].replace(",", "")) for line in lines[1:5]]
    expected = train(paper(), throughput.grid("sarsa", 0), 0, task=Task(delivery="continuing"))
    assert steps[1] == expected.steps.sum()
    if throughput.compiler() is not None:
        assert re.fullmatch(
            r"Q-learning in plain C takes [\d.]+ ns a step: [\d.]+ times ours\.", lines[5]
        )


def test_without_a_compiler(capsys, monkeypatch):
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    lines = printed_by(SMALL, capsys).splitlines()
    assert lines[-1].startswith("There is no C compiler")
