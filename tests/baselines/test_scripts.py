"""The scripts of the baselines, as a user runs them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from command_lines import assert_one_sentence, call_script, run

from taichi_ants import Colony, Life, TrainingConfig
from taichi_ants.baselines.utility import forage
from taichi_ants.learners.policies import trail_follower
from taichi_ants.task import queueing
from taichi_ants.worlds import paper


def test_goss_prints_ours_beside_the_published(kernels: Path, tmp_path: Path) -> None:
    done = run("goss", ["--colonies", 500], kernels, tmp_path)
    assert done.returncode == 0, done.stderr
    rows = [line.split() for line in done.stdout.splitlines() if "published" in line]
    assert rows[2] == ["2.0", "published", "15.0", "6.0", "6.0", "7.0", "66.0"]
    assert rows[3][-6:] == ["published", "100.0", "0.0", "0.0", "0.0", "0.0"]
    ours = [line.split() for line in done.stdout.splitlines() if " ours " in line]
    assert ours[3][:3] == ["2.0,", "opens", "late"]
    for row, said in zip(ours, rows, strict=True):
        assert abs(float(row[-1]) - float(said[-1])) < 10
    assert all(abs(sum(map(float, row[-5:])) - 100) < 0.3 for row in ours)
    assert (
        "of 500 colonies for each r, with a standard error of at most 2.2 percentage points"
        in done.stdout
    )


def test_goss_compares_with_what_was_published_only_where_as_many_choose(
    kernels: Path, tmp_path: Path
) -> None:
    done = run("goss", ["--colonies", 50, "--choices", 20], kernels, tmp_path)
    assert "published" not in done.stdout
    assert "of ants 11 to 20 on" in done.stdout
    assert "ants 31 to 40" in done.stdout


def test_ant_system_prints_a_row_for_each_world_and_method(kernels: Path, tmp_path: Path) -> None:
    arguments = ["--worlds", "paper", "--iterations", 3, "--colonies", 2, "--ants", 4]
    done = run("ant_system", arguments, kernels, tmp_path)
    assert done.returncode == 0, done.stderr
    rows = [line.split() for line in done.stdout.splitlines()[1:]]
    assert [row[:3] for row in rows] == [["paper", "ant_system", "18"], ["paper", "max_min", "18"]]


def test_utility_prints_a_row_for_each_world_and_room(kernels: Path, tmp_path: Path) -> None:
    arguments = ["--seeds", 2, "--ants", 5, "--ticks", 300, "--room", 1, 3]
    done = run("utility", arguments, kernels, tmp_path)
    assert done.returncode == 0, done.stderr
    rows = [line.split() for line in done.stdout.splitlines()[1:]]
    expected = [[kind, room] for kind in ("paper", "open", "piles", "bridge") for room in "13"]
    assert [row[:2] for row in rows] == expected
    each = [forage(paper(), ticks=300, ants=5, colonies=4, capacity=3, seed=n) for n in (0, 1)]
    mean = sum(outcome.deliveries.mean() for outcome in each) / 2
    assert rows[1][2] == f"{1000 * mean:.0f}"
    assert rows[1][7] == f"{sum((outcome.found > 0).sum() for outcome in each)}/8"


@pytest.mark.parametrize(
    ("name", "arguments", "said"),
    [
        ("ant_system", ["--worlds", "paper", "mars"], "double_bridge"),
        ("ant_system", ["--evaporation", 2], "`evaporation` is 2.0"),
        ("fixed_rules", ["--epsilon", 2], "epsilon` is 2.0"),
        ("fixed_rules", ["--ants", 10**6], "the number of ants is 1000000"),
        ("fixed_rules", ["--worlds", "moon"], "invalid choice: 'moon'"),
        ("fixed_rules", ["--study", "nowhere"], "cannot read 'nowhere/seeds.csv'"),
        ("utility", ["--discount", 1], "`discount` is 1.0"),
        ("goss", ["--colonies", 0], "0 is not allowed"),
        ("goss", ["--choices", 401], "--choices is 401; it must be even"),
        ("goss", ["--choices", 10**7], "2000 GB"),
    ],
)
def test_mistakes_end_in_a_sentence_and_nothing_else(
    name: str, arguments: list, said: str, capsys: pytest.CaptureFixture
) -> None:
    status, out, err = call_script(name, arguments, capsys)
    assert (status, out) == (2, "")
    assert_one_sentence(err)
    assert said in err


@pytest.mark.long
def test_fixed_rules_prints_a_row_for_each_world_and_task(kernels: Path, tmp_path: Path) -> None:
    study = [
        *("world_kind,rules,regime,ants,seed,deliveries,greedy", "paper,queueing,joint,3,0,50,60"),
        *("paper,queueing,joint,3,1,70,80", "paper,queueing,alone,3,1,9,9"),
    ]
    (tmp_path / "seeds.csv").write_text("\n".join(study), "utf-8")
    arguments = ["--seeds", 2, "--ants", 3, "--epsilon", 0.01, "--study", tmp_path]
    done = run("fixed_rules", arguments, kernels, tmp_path)
    assert done.returncode == 0, done.stderr
    lines = [line.split() for line in done.stdout.splitlines()]
    assert [line[0] for line in lines[:3]] == ["paper:", "ants:", "queues:"]
    header, *rows = lines[3:]
    tasks = ["paper", "foraging", "queueing", "netlogo", "netlogo,"]
    expected = [[world, task] for world in ("paper", "open", "piles") for task in tasks]
    assert [row[:2] for row in rows] == expected
    assert header[:3] == ["world", "rules", "epsilon"]
    place = paper()
    follow = {"sharing": "frozen", "q_values": trail_follower("queues")}
    rules = replace(queueing(), life=Life(regrowth=0))
    training = TrainingConfig("sarsa", 0.1, 0.9, 0.01, 1.0)
    outcome = Colony(place, rules, training, (2**32, 2**32 + 1), 3, **follow).run(4, 1000)
    row = rows[tasks.index("queueing")]
    assert row[2:4] == ["0.01", f"{outcome.deliveries.mean():.0f}"]
    assert row[7] == f"{outcome.deliveries.mean(axis=0).min():.0f}"
    assert row[9] == f"{100 * outcome.blocked.sum() / outcome.moves.sum():.0f}"
    assert row[11:13] == ["60", f"{60 - outcome.deliveries.mean():+.0f}"]
    assert all(len(other) == 11 + (other[1] == "netlogo,") * 2 for other in rows if other != row)
