"""The scripts of the baselines, as a user runs them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from command_lines import assert_one_sentence, run

from taichi_ants import Colony, Life, TrainingConfig
from taichi_ants.learners.policies import trail_follower
from taichi_ants.task import queueing
from taichi_ants.worlds import paper


def test_goss_prints_ours_beside_the_published(kernels: Path, tmp_path: Path) -> None:
    done = run("goss", ["--colonies", 500], kernels, tmp_path)
    assert done.returncode == 0, done.stderr
    rows = [line.split() for line in done.stdout.splitlines() if "published" in line]
    assert rows[2] == ["2.0", "published", "15.0", "6.0", "6.0", "7.0", "66.0"]
    ours = [line.split() for line in done.stdout.splitlines() if " ours " in line]
    for row, said in zip(ours, rows, strict=True):
        assert abs(float(row[-1]) - float(said[-1])) < 10
    assert all(abs(sum(map(float, row[2:])) - 100) < 0.3 for row in ours)


def test_ant_system_prints_a_row_for_each_world_and_method(kernels: Path, tmp_path: Path) -> None:
    arguments = ["--worlds", "paper", "--iterations", 3, "--colonies", 2, "--ants", 4]
    done = run("ant_system", arguments, kernels, tmp_path)
    assert done.returncode == 0, done.stderr
    rows = [line.split() for line in done.stdout.splitlines()[1:]]
    assert [row[:3] for row in rows] == [["paper", "ant_system", "18"], ["paper", "max_min", "18"]]


def test_mistakes_end_in_a_sentence(kernels: Path, tmp_path: Path) -> None:
    done = run("ant_system", ["--worlds", "mars"], kernels, tmp_path)
    assert done.returncode == 2
    assert_one_sentence(done.stderr)
    assert "double_bridge" in done.stderr


@pytest.mark.slow
def test_fixed_rules_prints_a_row_for_each_world_and_task(kernels: Path, tmp_path: Path) -> None:
    arguments = ["--seeds", 2, "--ants", 3, "--epsilon", 0.05]
    done = run("fixed_rules", arguments, kernels, tmp_path)
    assert done.returncode == 0, done.stderr
    header, *rows = [line.split() for line in done.stdout.splitlines()]
    tasks = ["paper", "foraging", "queueing", "netlogo", "netlogo,"]
    expected = [[world, task] for world in ("paper", "open", "piles") for task in tasks]
    assert [row[:2] for row in rows] == expected
    assert header[:3] == ["world", "rules", "epsilon"]
    place = paper()
    follow = {"sharing": "fixed", "q_values": trail_follower("queues")}
    rules = replace(queueing(), life=Life(regrowth=0))
    training = TrainingConfig("sarsa", 0.1, 0.9, 0.05, 1.0)
    outcome = Colony(place, rules, training, (0, 1), 3, **follow).run(4, 1000)
    row = rows[tasks.index("queueing")]
    assert row[2] == "0.05"
    assert row[3] == f"{outcome.deliveries.mean():.0f}"
    assert row[-2] == f"{100 * outcome.blocked.sum() / outcome.moves.sum():.0f}"
