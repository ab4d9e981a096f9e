"""The study of what ants gain from seeing more: its measure, its pairs, its tables."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from command_lines import call, contents

from taichi_ants import Life, Task, TrainingConfig, train, worlds
from taichi_ants.commands import observations as command
from taichi_ants.studies.runner import RunPoint
from taichi_ants.task import observations


def test_only_episodes_that_end_in_the_last_quarter_of_the_budget_count():
    point = RunPoint(worlds.paper(), Task(), TrainingConfig("sarsa", 0.1, 0.9, 0.3, 1.0))
    # They end at 40, 74, 75, 76, 90, 100 and 110 of 100 steps, and at 80 and 101.
    steps = np.array([[40, 34, 1, 1, 14, 10, 10], [80, 21, 1, 1, 1, 1, 1]])
    deliveries = np.array([[1, 1, 1, 1, 0, 1, 1], [0, 1, 1, 1, 1, 1, 1]])
    outcome = {"steps": steps, "deliveries": deliveries}
    found = command.alone_values(point, outcome, 100)
    assert found.tolist() == [1000 * 2 / (1 + 14 + 10), 0.0]


@pytest.fixture
def small(monkeypatch, tmp_path):
    """Two learners, of which one can share a table, and hardly any steps."""
    monkeypatch.chdir(tmp_path)
    both = [TrainingConfig(name, *command.RATES) for name in ("sarsa", "double_q")]
    monkeypatch.setattr(command, "configs", lambda shared: both[:1] if shared else both)
    for name, value in {"BUDGET": 900, "LONGEST": 60, "SHORTEST": 34}.items():
        monkeypatch.setattr(command, name, {"paper": value, "open": value})
    monkeypatch.setattr(command, "RANGES", (10, 10, 10))
    for name, value in {"ANTS": 3, "EPISODES": 2, "TICKS": 40}.items():
        monkeypatch.setattr(command, name, value)


def read(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_its_rows_are_what_the_library_gives(small, capsys):
    status, _, err = call("observations", ["--quick"], capsys)
    assert (status, err) == (0, "")
    folder = Path("results/observations-quick")
    assert set(contents(folder)) == {
        *("seeds.csv", "summary.csv", "findings.csv", "report.txt", "manifest.json"),
        "figures/observations.png",
    }
    rows = read(folder / "seeds.csv")
    assert len(rows) == (2 * 2 + 2 * 1) * len(observations.names()) * 4
    found = {
        (row["place"], row["learner"], row["observation"], int(row["seed"])): row["deliveries"]
        for row in rows
    }
    point = (command.BUDGET["paper"] // command.SHORTEST["paper"] + 1, command.LONGEST["paper"])
    alone = worlds.paper(), worlds.open_world(2, command.RANGES)
    for name in observations.names():
        config = TrainingConfig("double_q", *command.RATES)
        for where, world, seed, replicate in (
            ("paper", alone[0], 3, 3),
            ("open", alone[1], 0, 2),  # the world is the replicate, its run has seed 0
        ):
            trained = train(world, config, seed, *point, Task(name))
            outcome = {"steps": trained.steps[0], "deliveries": trained.deliveries[0]}
            (value,) = command.alone_values(None, outcome, command.BUDGET[where])
            assert float(found[f"alone, {where}", "double_q", name, replicate]) == value

    findings = read(folder / "findings.csv")
    assert len(findings) == (2 * 2 + 2 * 1) * (len(observations.names()) - 1)
    by_label = {row["contrast"]: float(row["difference"]) for row in findings}
    means = {
        name: np.mean([float(found["together, open", "sarsa", name, seed]) for seed in range(4)])
        for name in observations.names()
    }
    label = "together, open: sarsa, ants_seen minus paper"
    assert by_label[label] == pytest.approx(means["ants_seen"] - means["paper"])


def test_all_ants_live_by_the_same_rules_but_for_what_they_see(small):
    for where, study in command.studies(2).items():
        tasks = [point.task for point in study.points]
        assert {task.observation for task in tasks} == set(observations.names())
        life = Life(regrowth=0) if where.startswith("together") else Life()
        assert {task.life for task in tasks} == {life}
        assert len({(task.delivery, task.evaporation_in_training) for task in tasks}) == 1
