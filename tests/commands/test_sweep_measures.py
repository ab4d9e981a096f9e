"""Sweeps with registered measures, series over time, and policies without learning."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from command_lines import assert_one_sentence, numbers_in, read_csv

from taichi_ants import (
    AntsError,
    Colony,
    TrainingConfig,
    evaluate,
    rules,
    save_policy,
    train,
    worlds,
)
from taichi_ants.features.rule import RULES
from taichi_ants.learners.policies import random_policy, trail_follower
from taichi_ants.studies.points import EVALUATION_SEEDS
from taichi_ants.studies.sweep import plan, sweep_of, tables
from taichi_ants.task import Pheromone, Task

FILE = """
kind = "colony"
measures = ["entropy", "deliveries", "path_length"]
measure_every = 25
seeds = 3
ants = 6
episodes = 0
ticks = 60
rollouts = 2
policy = "trail_follower"

[vary]
task.pheromone.level = [20, 250]
"""
FROZEN = TrainingConfig("q_learning", 1.0, 1.0, 0.0, 1.0)


def rows_of(name):
    return read_csv(f"results/sweep-my/{name}")


def run(level=250, table=None, **asked):
    seeds = [EVALUATION_SEEDS + seed for seed in range(3)]
    table = trail_follower() if table is None else table
    rules = {"sharing": "frozen", "q_values": table}
    task = Task(pheromone=Pheromone(level=level))
    return Colony(worlds.paper(), task, FROZEN, seeds, 6, **rules).run(2, 60, **asked)


def test_the_series_is_that_of_the_library(sweep):
    status, out, err = sweep(FILE, "--no-figures")
    assert (status, err) == (0, "")
    assert "entropy.trail" in out
    rows = rows_of("series.csv")
    names = ["task.pheromone.level", "seed", "episode", "tick", "measure", "value"]
    assert list(rows[0]) == names
    found = {tuple(row[name] for name in names[:-1]): row["value"] for row in rows}
    assert len(found) == len(rows) == 2 * 3 * 2 * 3 * 3
    for level in (20, 250):
        for one in run(level, measures=["entropy", "deliveries", "path_length"], every=25).rows():
            seed = one["seed"] - EVALUATION_SEEDS
            where = (level, seed, one["episode"], one["tick"], one["measure"])
            value = found[tuple(map(str, where))]
            assert value == ("" if np.isnan(one["value"]) else repr(one["value"]))


def test_the_tables_have_means_over_rollouts_at_their_ends(sweep):
    assert sweep(FILE)[0] == 0
    rows = [row for row in rows_of("runs.csv") if row["task.pheromone.level"] == "250"]
    assert list(rows[0])[2:] == ["entropy.trail", "deliveries", "path_length"]
    result = run(measures=["entropy", "path_length"])
    for name in ("entropy.trail", "path_length"):
        values = result.series.values[name].reshape(2, 3)
        assert [float(row[name]) for row in rows] == pytest.approx(np.nanmean(values, axis=0))
    per_1000 = result.deliveries.mean(axis=0) * 1000 / 60
    assert [float(row["deliveries"]) for row in rows] == pytest.approx(per_1000.tolist())
    assert "entropy.trail_mean" in rows_of("summary.csv")[0]
    assert Path("results/sweep-my/figures/entropy.trail.png").exists()


def test_policies_can_vary(sweep):
    save_policy("mine.npz", trail_follower(), {})
    text = FILE.replace('policy = "trail_follower"\n', "").replace("measure_every = 25\n", "")
    vary = 'policy = ["mine.npz", "trail_follower", "random"]'
    text = text.replace("task.pheromone.level = [20, 250]", vary)
    assert sweep(text, "--no-figures")[0] == 0
    found = {}
    for row in rows_of("runs.csv"):
        found.setdefault(row["policy"], []).append(float(row["deliveries"]))
    assert found["mine.npz"] == found["trail_follower"]
    expected = run(table=random_policy()).deliveries.mean(axis=0) * 1000 / 60
    assert found["random"] == pytest.approx(expected.tolist())
    save_policy("mine.npz", random_policy(), {})  # another table in the same file
    assert sweep(text, "--no-figures")[0] == 0
    rows = [float(row["deliveries"]) for row in rows_of("runs.csv") if row["policy"] == "mine.npz"]
    assert rows == found["random"]


def test_parameters_of_a_rule_vary_without_a_table(sweep, monkeypatch):
    monkeypatch.setattr(RULES, "yours", {})
    rules.register("evaporation")(weaker)
    text = FILE.replace("[vary]", '[task]\npheromone.evaporation = "weaker"\n\n[vary]')
    text += "task.rules.weaker.rate = [0.1, 0.5]\n"
    Path("my.toml").write_text(text)
    rates = [one.task.rules["weaker"].rate for one in plan({"file": Path("my.toml")}).study.points]
    assert set(rates) == {0.1, 0.5}
    Path("my.toml").write_text(text.replace("rules.weaker", "rules.weakr"))
    with pytest.raises(AntsError, match="there is no rule 'weakr'"):
        plan({"file": Path("my.toml")})


def weaker(level, rate=0.2):
    return level * (1 - rate)


def test_measures_of_a_plugin_work_for_lone_ants_and_for_colonies(sweep):
    """A measure of counts for the windows of lone ants, and one of finished runs of both kinds."""
    Path("yours.py").write_text(
        "from taichi_ants import measures\n"
        "measures.register('pace', lambda c: c['deliveries'] / c['ticks'], of='counts')\n"
        "measures.register('worst', lambda r: r.evaluation['returns'].min(-1), of='run')\n"
    )
    text = FILE.replace('"entropy", "deliveries", "path_length"', '"pace", "worst"')
    assert sweep(text, "--plugin", "yours.py", "--no-figures")[0] == 0
    rows = [row for row in rows_of("runs.csv") if row["task.pheromone.level"] == "250"]
    result = run()
    pace = (result.deliveries / 60).mean(axis=0)
    assert [float(row["pace"]) for row in rows] == pytest.approx(pace)
    assert [float(row["worst"]) for row in rows] == result.returns.min(axis=0).tolist()
    assert {row["measure"] for row in rows_of("series.csv")} == {"pace"}
    lone = """
kind = "runs"
measures = ["pace_all", "greedy_pace", "worst"]
seeds = 2
episodes = 5
rollouts = 3
max_steps = 80
training = {learner = "sarsa", discount = 0.9, epsilon = 0.3, epsilon_decay = 1.0}
vary.training.learning_rate = [0.1, 0.2]
"""
    assert sweep(lone, "--plugin", "yours.py", "--no-figures", "--force")[0] == 0
    config = TrainingConfig("sarsa", 0.2, 0.9, 0.3, 1.0)
    trained = train(worlds.paper(), config, (0, 1), 5, 80)
    greedy = evaluate(worlds.paper(), trained.q_values, 3, (0, 1), 80)
    rows = rows_of("runs.csv")[2:]
    for row, steps, delivered in zip(rows, trained.steps[0], trained.deliveries[0], strict=True):
        assert float(row["pace_all"]) == pytest.approx((delivered / steps).mean())
    assert [float(row["worst"]) for row in rows] == greedy.returns[0].min(axis=1).tolist()
    paces = (greedy.deliveries / greedy.steps)[0].mean(axis=1)
    assert [float(row["greedy_pace"]) for row in rows] == pytest.approx(paces)
    status, _, err = sweep(lone.replace("pace_all", "blocked_share_all"), "--plugin", "yours.py")
    assert status == 2
    assert "failed with KeyError" in err


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"entropy"', '"entropi"', ["measures is 'entropi'", "entropy", "no_delivery_rate"]),
        ("measure_every = 25", "measure_every = 0", ["measure_every is 0"]),
        ('"trail_follower"', '"none.npz"', ["cannot read 'none.npz'"]),
        ('"entropy", "deliveries", "path_length"', '"per_ant"', ["a measure that has a series"]),
        ("[vary]", "[task.fields.a]\n[vary]\ntask.fields.b.level = [1]", ["no task.fields.b; add"]),
    ],
)
def test_mistakes_end_in_one_sentence(old, new, words, sweep):
    assert old in FILE
    status, out, err = sweep(FILE.replace(old, new, 1))
    assert (status, out) == (2, "")
    assert_one_sentence(err)
    for word in words:
        assert word in err


def test_regions_of_a_sweep_file(sweep):
    """An intervention and a measure read them; the second event opens the gate, or does not."""
    gate = """
[world.regions]
gate = [[0, 5, 5], [0, 5, 6]]
all = {centre = [0, 0, 0], radius = 99}

[[at]]
tick = 0
add_ants = "gate"

[[at]]
remove_ants = "all"

[vary]
at.2.tick = [1, 59]
"""
    text = FILE.replace('["entropy", "deliveries", "path_length"]', '["regions.all", "living"]')
    text = text.replace("[vary]\ntask.pheromone.level = [20, 250]\n", gate)
    text = text.replace("ants = 6", "ants = 6\ncapacity = 8")
    status, _, _ = sweep(text, "--no-figures")
    assert status == 0
    rows = [row for row in rows_of("series.csv") if row["measure"] == "living"]
    living = {(row["at.2.tick"], row["tick"]): row["value"] for row in rows}
    assert living["59", "25"] == "8.0"
    assert living["1", "25"] == living["59", "60"] == "0.0"
    assert {row["regions.all"] for row in rows_of("runs.csv")} == {""}  # no ants are left
    status, _, error = sweep(text.replace('"gate"', '"gte"'), "--no-figures", "--force")
    assert status != 0
    assert_one_sentence(error)
    assert "there is no region 'gte' in the world, whose regions are: all, gate; choose" in error


def test_runs_without_a_value_are_left_out_and_counted(tmp_path):
    file = {"kind": "colony", "measures": ["entropy"], "episodes": 0, "policy": "trail_follower"}
    file |= {"seeds": 12, "against": {"ants": 2}, "vary": {"ants": [2, 3, 4]}}
    sweep = sweep_of(file)
    values = np.random.default_rng(0).uniform(size=(3, 12))
    values[0, 3] = values[1, [4, 5]] = values[2] = np.nan

    def write(values, figures):
        found, present = {"entropy.trail": values}, np.ones((3, 12), bool)
        how = {"figures": figures, "parquet": False, "part": False, "folder": tmp_path}
        return tables(
            sweep,
            SimpleNamespace(
                **how, study=sweep.study, present=present, read=lambda *_, arrays: found
            ),
        )

    report = write(values, figures=True)
    rows = numbers_in(tmp_path / "summary.csv")
    assert [row["entropy.trail_left_out"] for row in rows] == [1, 2, 12]
    assert [row["seeds"] for row in rows] == [12] * 3
    assert float(rows[1]["entropy.trail_mean"]) == pytest.approx(np.nanmean(values[1]))
    assert rows[2]["entropy.trail_mean"] is None
    found = numbers_in(tmp_path / "findings.csv")
    assert [row["left_out"] for row in found] == [3, 12]
    both = ~np.isnan(values[:2]).any(axis=0)
    wanted = (values[1] - values[0])[both].mean()
    assert float(found[0]["difference"]) == pytest.approx(wanted)
    assert found[1]["finding"] == "undecided"
    assert "runs without a value are left out" in " ".join(report.split())
    assert "entropy.trail against ants 2" in report
    assert "] (2 left out)" in report
    assert "- (12 left out)" in report
    assert "left out" not in write(np.nan_to_num(values), figures=False)
    assert "left_out" not in (tmp_path / "summary.csv").read_text()
