"""The benchmark, and its yardsticks in C: two more writings of the rules, equal to the bit."""

from __future__ import annotations

import numpy as np
import pytest
import throughput
from random_worlds import random_world

from taichi_ants import AntsError, Task, TrainingConfig, train
from taichi_ants.worlds import paper

needs_c = pytest.mark.skipif(throughput.compiler(1) is None, reason="there is no C compiler")


@pytest.fixture(scope="module")
def yardsticks(tmp_path_factory):
    if throughput.compiler(1) is None:
        pytest.skip("there is no C compiler")
    try:
        return throughput.load_yardsticks(throughput.compiler(2), tmp_path_factory.mktemp("c"), 2)
    except AntsError:  # no compiler has OpenMP
        return throughput.load_yardsticks(throughput.compiler(1), tmp_path_factory.mktemp("c"), 1)


def yardstick_of(yardsticks, name):
    if name not in yardsticks:
        pytest.skip("this processor or its compiler has no AVX-512")
    return yardsticks[name]


@pytest.mark.parametrize("name", throughput.YARDSTICKS.values())
@pytest.mark.parametrize("delivery", ["truncates", "terminates"])
@pytest.mark.parametrize("learner", throughput.LEARNERS)
def test_c_gives_the_same_runs(learner, delivery, name, yardsticks):
    yardstick = yardstick_of(yardsticks, name)
    configs = throughput.grid(*throughput.LEARNERS[learner])[::5]
    more = configs[0].hyperparameters
    for numbers in ((1.0, 0.9, 0.7, 0.5, 0.2), (0.5, 0.9, 1.0, 0.2, 0.0)):
        configs.append(TrainingConfig(configs[0].learner, *numbers, hyperparameters=more))
    deliveries = 0
    for world in (paper(), *(random_world(seed + 60, 6) for seed in range(12))):
        seeds = (0, 7, 2**63 + 5)
        result = train(world, configs, seeds, 25, 150, Task(delivery=delivery))
        deliveries += result.deliveries.sum()
        for threads in (1, 2):
            given = (delivery == "truncates", 25, 150, threads)
            trained = throughput.train_in_c(yardstick, world, configs, seeds, *given)
            throughput.check_same(trained, result)
    assert deliveries > 100


@pytest.mark.parametrize("name", throughput.YARDSTICKS.values())
def test_fewer_runs_than_lanes(name, yardsticks):
    yardstick, configs = yardstick_of(yardsticks, name), throughput.grid("dyna_q", 3)[:1]
    result = train(paper(), configs, 3, 4, 600)
    trained = throughput.train_in_c(yardstick, paper(), configs, [3], False, 4)
    throughput.check_same(trained, result)
    with pytest.raises(AntsError, match="other steps than the package"):
        throughput.check_same(trained._replace(steps=trained.steps + 1), result)


def said_by(arguments, capsys):
    with pytest.raises(SystemExit) as end:
        throughput.main(arguments)
    return end.value.code, capsys.readouterr()


SMALL = ["--seeds", "1", "--rounds", "1"]


def rows_of(said):
    """The cells behind the label of each row, spaces within numbers removed."""
    labels = [*throughput.LEARNERS, "the grid"]
    lines = {line[:12].strip(): line[12:].split() for line in said.splitlines()}
    return [["".join(lines[label][:-5]), *lines[label][-5:]] for label in labels]


@pytest.mark.long
@needs_c
def test_its_table_and_its_guard(capsys):
    code, said = said_by(SMALL, capsys)
    assert code == 0
    rows = rows_of(said.out)
    expected = train(paper(), throughput.grid("sarsa", 0), 0, task=Task(delivery="truncates"))
    assert int(rows[1][0]) == expected.steps.sum()
    assert int(rows[-1][0]) == sum(int(row[0]) for row in rows[:-1])
    for row in rows:
        ours, in_c, ratio = float(row[1]), float(row[2]), float(row[4])
        assert ratio == pytest.approx(ours / in_c, rel=0.05)
    code, said = said_by([*SMALL, "--least", "1000"], capsys)
    assert code != 0
    assert "at least 1000 is expected" in said.err


@needs_c
def test_without_vectors(tmp_path, monkeypatch):
    monkeypatch.setattr(throughput, "FLAGS", (*throughput.FLAGS, "-U__AVX512F__"))
    loaded = throughput.load_yardsticks(throughput.compiler(1), tmp_path, 1)
    assert list(loaded) == ["C"]
    seconds = {label: np.ones((1, 2)) for label in throughput.LEARNERS}
    made = throughput.table(["C"], dict.fromkeys(seconds, 10**6), seconds, 1, 1)
    assert [row[4] for row in made.rows] == ["-"] * 5
    assert made.notes[-1].startswith("No vector C")


@pytest.mark.parametrize(
    ("least", "why"),
    [
        *((one, f"{one} is not allowed") for one in ("nan", "-1", "inf")),
        ("much", "is not a number"),
    ],
)
def test_a_least_ratio_is_a_number_from_0_on(least, why, capsys):
    code, said = said_by([*SMALL, "--least", least], capsys)
    assert (code, said.out) == (2, "")
    assert said.err.startswith("error: --least: ")
    assert why in said.err


def test_the_first_compiler_that_has_openmp(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    for name, code in (("clang", 1), ("gcc", 0), ("cc", 0)):
        (tmp_path / name).write_text(f"#!/bin/sh\nexit {code}\n")
        (tmp_path / name).chmod(0o755)
    assert throughput.compiler(1) == str(tmp_path / "clang")
    assert throughput.compiler(2) == str(tmp_path / "gcc")
    monkeypatch.setenv("CC", "clang")
    assert throughput.compiler(2) == str(tmp_path / "clang")
    monkeypatch.delenv("CC")
    for name in ("gcc", "cc"):
        (tmp_path / name).unlink()
    assert throughput.compiler(2) == str(tmp_path / "clang")  # its error says what to install


def test_without_a_compiler(capsys, monkeypatch):
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    code, said = said_by(SMALL, capsys)
    assert code == 0
    assert [row[2] for row in rows_of(said.out)] == ["-"] * 5
    assert said.out.splitlines()[-1].startswith("There is no C compiler")
