"""The scripts in experiments/models: each writes a figure and a table, and shows what it says."""

import runpy
import sys
from typing import Any

import numpy as np
import pytest
from command_lines import ROOT, numbers_in
from model_script import table

from taichi_ants.analysis.statistics import bootstrap_interval
from taichi_ants.features.rule import RULES

MODELS = ROOT / "experiments" / "models"


def rows_of(name: str, seeds: int, folder, monkeypatch) -> list[dict[str, Any]]:
    """Run a script, and return the rows of its numbers."""
    arguments = [f"{name}.py", "--seeds", str(seeds), "--out", str(folder)]
    monkeypatch.setattr(sys, "argv", arguments)
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(MODELS / f"{name}.py"), run_name="__main__")
    assert ended.value.code == 0
    assert (folder / f"{name}.png").stat().st_size > 10_000
    return numbers_in(folder / f"{name}.csv")


@pytest.mark.slow
def test_home_trail(tmp_path, monkeypatch):
    """A second trail replaces most of a compass; without either, hardly any food is delivered."""
    delivered = dict.fromkeys(("compass", "home trail", "no cue"), 0)
    for row in rows_of("home_trail", 4, tmp_path, monkeypatch):
        delivered[row["model"]] += row["deliveries"] if row["episode"] >= 25 else 0
    assert delivered["compass"] > delivered["home trail"] > 0.6 * delivered["compass"]
    assert delivered["no cue"] < 0.1 * delivered["compass"]


@pytest.mark.slow
def test_two_nests(tmp_path, monkeypatch):
    """Equal nests share a pile equally; a nearer one gets more of it."""
    last = [row for row in rows_of("two_nests", 20, tmp_path, monkeypatch) if row["tick"] == 500]
    assert len(last) == 60
    share = {}
    for near in (10, 8, 6):
        rows = [row for row in last if row["near"] == near]
        share[near] = np.mean([row["first"] / (row["first"] + row["second"]) for row in rows])
    assert abs(share[10] - 0.5) < 0.03
    assert 0.53 < share[8] + 0.02 < share[6] < 0.65


@pytest.mark.slow
def test_thresholds_divide_labour(tmp_path, monkeypatch, capsys):
    """More ants forage at a higher demand, and those with low thresholds forage more."""
    late = {demand: [] for demand in (0.25, 0.5, 1, 2)}
    for row in rows_of("division_of_labour", 3, tmp_path, monkeypatch):
        if row["tick"] > 2000:
            late[row["demand"]].append(row["foragers"])
    means = [np.mean(shares) for shares in late.values()]
    assert means == sorted(means)
    assert means[-1] > 3 * means[0] > 0.3
    for line in capsys.readouterr().out.splitlines()[2:6]:
        _, _, _, _, low, _, _, high, *_ = line.split()
        assert float(low) > 1.3 * float(high)


@pytest.mark.slow
def test_a_colony_recovers_after_a_removal(tmp_path, monkeypatch):
    ants = {}
    for row in rows_of("recovery", 2, tmp_path, monkeypatch):
        ants[row["removed"], row["seed"], row["tick"]] = row["ants"]
    assert len(ants) == 4 * 2 * 80
    for seed in (0, 1):
        before, half = (ants[share, seed, 2000] for share in (0.0, 0.5))
        assert half == before - int(0.5 * before + 0.5)


@pytest.mark.slow
def test_a_no_entry_pheromone(tmp_path, monkeypatch, rules_of_scripts):
    rows = rows_of("no_entry", 2, tmp_path, monkeypatch)
    assert len(rows) == 2 * 4 * 2 * 30
    last = [row["delivered"] for row in rows if row["tick"] == 3000]
    assert min(last) > 0
    assert len(set(last)) > 1


def test_a_table_has_a_line_for_each_condition():
    rows = [{"kind": kind, "x": n} for kind in "ab" for n in (1, 2, 4)]
    low, high = bootstrap_interval(np.array([[1.0, 2.0, 4.0]]))
    made = table(rows)
    assert made.columns == ["kind", "x"]
    assert made.rows == [[kind, f"2.33 [{low[0]:.3g}, {high[0]:.3g}]"] for kind in "ab"]
    assert table([{**rows[0], "x": 1234.5}]).rows == [["a", "1234"]]


@pytest.fixture
def rules_of_scripts(monkeypatch):
    """Forget the rules that a script registers."""
    monkeypatch.setattr(RULES, "yours", dict(RULES.yours))


def test_rules_of_the_no_entry_model(rules_of_scripts):
    runpy.run_path(str(MODELS / "no_entry.py"))
    mark = RULES.get("no_entry").function
    for level, carried, expected in ((0, 60, 0), (0, 61, 100), (50, 1000, 100), (200, 61, 200)):
        assert mark(level, carried) == expected
    wary = RULES.get("wary").function
    empty, food, free, none = (0, 0, 0), (0, 3, 0), (1, 1, 1), (0, 0, 0)
    last = 1 - 2**-32
    cases = (  # codes, levels, repellent, open, nearer, carries, random; action
        ((empty, none, none, free, none, 0, 0.3), 0),  # three equal cells
        ((empty, none, none, free, none, 0, 0.34), 1),
        ((empty, none, none, free, none, 0, last), 2),
        ((empty, (20, 0, 0), none, free, none, 0, 0.66), 0),  # weights 1600, 400, 400
        ((empty, (20, 0, 0), none, free, none, 0, 0.67), 1),
        ((empty, none, (100, 0, 0), (1, 1, 0), none, 0, 0.01), 1),  # weights 400 / 201, 400
        ((empty, none, (100, 0, 0), (1, 1, 0), none, 1, 0.49), 0),  # carriers ignore it
        ((empty, (0, 400, 0), none, (1, 0, 1), none, 0, 0.5), 2),  # the closed cell is not chosen
        ((empty, none, none, (1, 1, 0), none, 0, last), 1),
        ((empty, none, none, free, (0, 0, 1), 1, 0.0), 2),  # the compass of an ant with food
        ((empty, none, none, (1, 1, 0), (0, 0, 1), 1, 0.0), 0),  # the nearer cell is closed
        ((empty, none, none, none, none, 0, 0.49), 0),
        ((empty, none, none, none, none, 0, 0.5), 2),
        ((food, none, none, free, none, 0, 0.0), 3),
        ((food, none, none, free, none, 1, 0.0), 4),
    )
    for given, action in cases:
        assert wary(*given) == action, given
