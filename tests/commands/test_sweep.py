"""Sweeps as a command: its tables held against the library, and files that are wrong."""

import json
from pathlib import Path

import numpy as np
import pytest
from command_lines import EXPERIMENTS, assert_one_sentence, contents, numbers_in, read_csv

from taichi_ants import (
    AntsError,
    Rewards,
    Task,
    TrainingConfig,
    train,
    worlds,
)
from taichi_ants.analysis.statistics import bootstrap_interval
from taichi_ants.studies.points import RunPoint
from taichi_ants.studies.sweep import plan, sweep_of
from taichi_ants.task import foraging, paper

RUNS = """
kind = "runs"
measures = ["return_last50", "greedy_deliveries"]
seeds = [7, 2, 5]
episodes = 50
max_steps = 60
rollouts = 3

[task]
delivery = "truncates"

[training]
learner = "sarsa"
discount = 0.9
epsilon_decay = 0.99

[vary]
training.learning_rate = [0.01, 0.1]
training.epsilon = [0.1, 0.5, 1.0]
task.rewards.shaping = [1, 0]
"""
# Deliveries are reported beside returns.
MEASURES = ["return_last50", "greedy_deliveries", "deliveries_last50"]


def test_a_row_is_a_point_and_a_seed_as_the_library_has_it(sweep):
    status, out, err = sweep(RUNS)
    assert (status, err) == (0, "")
    folder = Path("results/sweep-my")
    names = {name for name in contents(folder) if not name.startswith(("blocks/", "sessions/"))}
    assert names == {
        *("runs.csv", "summary.csv", "report.txt", "manifest.json", "figures/return_last50.png"),
        *("study.json", "inputs/my.toml"),
    }
    rows = read_csv(folder / "runs.csv")
    names = ["training.learning_rate", "training.epsilon", "task.rewards.shaping"]
    assert list(rows[0]) == [*names, "seed", *MEASURES]
    assert len(rows) == 2 * 3 * 2 * 3
    for row in rows[::5]:
        rate, epsilon = (float(row[name]) for name in names[:2])
        config = TrainingConfig("sarsa", rate, 0.9, epsilon, 0.99)
        task = Task(delivery="truncates", rewards=Rewards(shaping=int(row[names[2]])))
        trained = train(worlds.paper(), config, int(row["seed"]), 50, 60, task)
        assert float(row["return_last50"]) == trained.returns.mean()
        assert float(row["deliveries_last50"]) == trained.deliveries.mean()
    summary = read_csv(folder / "summary.csv")
    assert len(summary) == 12
    for number, line in enumerate(summary):
        alike = rows[3 * number : 3 * number + 3]
        assert all(line[name] == row[name] for row in alike for name in names)
        values = np.array([[float(row["return_last50"]) for row in alike]])
        assert float(line["return_last50_mean"]) == pytest.approx(values.mean())
        low, high = bootstrap_interval(values)
        assert float(line["return_last50_ci_low"]) == pytest.approx(low[0])
        assert float(line["return_last50_ci_high"]) == pytest.approx(high[0])
    report = (folder / "report.txt").read_text("utf-8")
    assert out.startswith(report)
    assert "learning_rate epsilon shaping" in report
    facts = json.loads((folder / "study.json").read_text("utf-8"))["settings"]
    assert (facts["task.delivery"], facts["seeds"]) == ("truncates", [7, 2, 5])


def test_figures_are_added_to_finished_results_without_new_runs(sweep, monkeypatch):
    assert sweep(RUNS, "--no-figures")[0] == 0
    folder = Path("results/sweep-my")
    before = contents(folder)
    monkeypatch.setattr(RunPoint, "compute", None)
    assert sweep(RUNS)[0] == 0
    after = contents(folder)
    assert {*after} - {*before} == {"figures/return_last50.png"}
    assert after.items() >= {n: one for n, one in before.items() if n != "manifest.json"}.items()
    assert "already has these results" in sweep(RUNS)[1]


WRONG = [
    ('kind = "runs"', "", ["kind is missing", "runs, colony"]),
    (RUNS[RUNS.index("measures") : RUNS.index("seeds")], "", ["measures is missing"]),
    ("shaping =", "shapings =", ["rewards.shapings` is not a setting; choose shaping"]),
    ("seeds =", "seds =", ["'seds' is not a setting", "choose seeds"]),
    ("rollouts", "ants", ["'ants' is not a setting of a sweep of kind 'runs'"]),
    ("discount = 0.9", "", ["training.discount` is missing"]),
    ("discount =", "discont =", ["`training.discont` is not a setting of", "choose discount"]),
    ("discount = 0.9", "discount = 1.9", ["discount` is 1.9"]),
    ("discount", "epsilon = 0.1\ndiscount", ["training.epsilon is in [vary]"]),
    ("[1, 0]", "[]", ["task.rewards.shaping cannot vary, or has no values"]),
    ("seeds = [7, 2, 5]", "seeds = 0", ["seeds is 0", "or a list of seeds"]),
    (
        "[task]",
        "[world]\nper_seed = true\n[task]",
        ["per_seed is True", "for kind 'colony'"],
    ),
    (
        "[task]",
        "[against]\ntask.rewards.shaping = 7\n[task]",
        ["against is task.rewards.shaping = 7; ", "[vary]"],
    ),
    ("seeds =", "margin = 1\nseeds =", ["which margin requires"]),
    ("[1, 0]", "[1, 1]", ["task.rewards.shaping has 1 more than once"]),
    ("episodes = 50", "episodes = 49", ["return_last50 needs 50 episodes"]),
    ("[task]", "[world]\nseed = 1\n[task]", ["world.seed has no effect on"]),
    ("[task]", "[task]\nrewards = 3", ["in [vary], and task.rewards is fixed"]),
    ("[vary]", "[vary]\nseeds = [3, 4]", ["seeds cannot vary"]),
    ("[vary]", "[vary", ["is not valid TOML", "correct it"]),
    ("[task]", '[task]\npreset = "foragin"', ["task.preset is 'foragin'", "foraging"]),
    ("seeds =", 'policy = "random"\nseeds =', ["episodes is 50", "set episodes = 0"]),
    ("episodes = 50", "episodes = 0", ["episodes is 0", "0 requires a policy"]),
    (RUNS[RUNS.index("[vary]") :], "", ["[vary] is missing"]),
]


def test_several_grids_are_joined(tmp_path):
    """Learners with hyperparameters of their own, and what belongs together."""
    grids = """
[[vary]]
training.learner = "q_learning"
training.learning_rate = [0.1, 0.2]
[[vary]]
training.learner = "dyna_q"
training.learning_rate = 0.1
training.planning_steps = [2, 4, 6]
"""
    head = RUNS[: RUNS.index("[vary]")].replace('learner = "sarsa"', "epsilon = 0.3")
    (tmp_path / "a.toml").write_text(head + grids)
    settings = plan({"file": tmp_path / "a.toml"}).settings
    names = ("training.learner", "training.learning_rate", "training.planning_steps")
    assert [tuple(one.get(name) for name in names) for one in settings] == [
        *(("q_learning", 0.1, None), ("q_learning", 0.2, None)),
        *(("dyna_q", 0.1, 2), ("dyna_q", 0.1, 4), ("dyna_q", 0.1, 6)),
    ]


def test_what_is_asked_for_twice_is_done_once_and_shown_twice(sweep):
    grids = "[[vary]]\ntask.rewards.shaping = [1, 0]\n[[vary]]\ntask.rewards.shaping = [2, 1]\n"
    text = RUNS[: RUNS.index("[vary]")] + "learning_rate = 0.1\nepsilon = 0.3\n" + grids
    assert sweep(text, "--no-figures")[0] == 0
    rows = read_csv("results/sweep-my/runs.csv")
    assert [row["task.rewards.shaping"] for row in rows] == [*"111000222111"]
    assert rows[:3] == rows[9:]
    assert rows[0]["return_last50"] != rows[3]["return_last50"]


def test_a_sweep_begins_with_a_preset_of_the_task():
    file = {"kind": "runs", "measures": ["greedy_return"], "episodes": 0, "policy": "random"}
    changes = {"rewards": {"deliver": 70}}
    file |= {"task": changes, "vary": {"task.preset": ["paper", "foraging"]}}
    found = [point.task for point in sweep_of(file).study.points]
    assert found == [paper().replace(**changes), foraging().replace(**changes)]


@pytest.mark.parametrize("name", ["crowds", "learning_rates", "observations", "trails"])
def test_the_examples_can_be_read(name):
    assert len(plan({"file": EXPERIMENTS / "sweeps" / f"{name}.toml"}).settings) > 4


PROTOCOL = """
kind = "colony"
measures = "deliveries"
seeds = 2
ants = 4
capacity = 12
during = "both"
episodes = 2
ticks = 60
rollouts = 2
world = {preset = "open", ranges = [12, 12, 12], per_seed = true, seed = 5}

[task]
evaporation_in_training = true
life.regrowth = 0

[training]
learner = "sarsa"
learning_rate = 0.1
discount = 0.9
epsilon = 0.3
epsilon_decay = 0.9

[[at]]
tick = 20
trail = 0

[[every]]
ticks = 15
add_ants = 1

[[when]]
measure = "living"
below = 4
epsilon = 0.5

[vary]
at.1.remove_ants = [0.0, 0.5]
"""


def test_a_protocol_is_part_of_the_points_of_a_sweep(sweep):
    status, _, err = sweep(PROTOCOL, "--no-figures")
    assert (status, err) == (0, "")
    rows = read_csv("results/sweep-my/runs.csv")
    assert [row["at.1.remove_ants"] for row in rows] == ["0.0", "0.0", "0.5", "0.5"]
    point = plan({"file": Path("my.toml")}).study.points[1]
    assert point.during == "both"
    assert point.runs_of_a_block == 1  # because epsilon belongs to all worlds of a colony
    for seed in (0, 1):
        world = point.world.of(seed)
        learning = point.colony(world, [seed], None, True)
        learning.run(2, 60, protocol=point.protocol)
        colony = point.colony(world, [seed], learning.q_values, False)
        found = colony.run(2, 60, protocol=point.protocol).deliveries.mean() * 1000 / 60
        assert float(rows[2 + seed]["deliveries"]) == pytest.approx(found)
    facts = json.loads(Path("results/sweep-my/study.json").read_text("utf-8"))["settings"]
    assert facts["protocol"][1][0]["at"]["remove_ants"] == {"share": 0.5}


WRONG_EVENTS = [
    ("tick = 20", "tick = 60", ["`at.tick` is 60, but episodes have 60 ticks"]),
    ("trail = 0", "trial = 0", ["in [[at]] number 1, `at.trial` is not a setting"]),
    ('"living"', '"height"', ["in [[when]] number 1", "'height'"]),
    (
        "trail",
        "learning_rate",
        ["in [[at]] number 1, in the evaluation, the ants"],
    ),
    ("[task]", "[task]\ncastes.a.nest = 3", ["`task.castes.a.nest` is 3", "has 1 nest"]),
    ("[[every]]", "[every]", ["[every] must be [[every]]"]),
    ("at.1.remove", "at.2.remove", ["the file has no at.2; add it"]),
    (
        'kind = "colony"\nmeasures = "deliveries"',
        'kind = "runs"\nmeasures = "greedy_deliveries"',
        ["in a file of kind 'colony'"],
    ),
]


def test_ranges_of_events_are_checked_and_whole(tmp_path):
    ranges = "at.1.tick = { from = 5, to = 50 }\nat.1.task.pheromone.level = { from = 3, to = 9 }"
    text = PROTOCOL.replace("tick = 20\n", "").replace("at.1.remove_ants = [0.0, 0.5]", ranges)
    text = 'design = "sobol"\nsamples = 4\n' + text
    (tmp_path / "my.toml").write_text(text)
    events = [one.protocol[0] for one in plan({"file": tmp_path / "my.toml"}).study.points]
    assert len({event.tick for event in events}) == 4
    assert all(type(level) is int for event in events for _, level in event.task.values)
    for end, said in (("from = -50", "`at.tick` is -"), ("from = 5.5", "whole")):
        (tmp_path / "my.toml").write_text(text.replace("from = 5", end, 1))
        with pytest.raises(AntsError, match=said):
            plan({"file": tmp_path / "my.toml"})


@pytest.mark.parametrize(
    ("text", "old", "new", "words"),
    [(text, *row) for text, rows in ((RUNS, WRONG), (PROTOCOL, WRONG_EVENTS)) for row in rows],
)
def test_mistakes_in_a_file_end_in_one_sentence_that_names_the_key(text, old, new, words, sweep):
    assert old in text
    status, out, err = sweep(text.replace(old, new, 1))
    assert (status, out) == (2, "")
    assert_one_sentence(err)
    for word in ("my.toml", *words):
        assert word in err
    assert not Path("results").exists()


def test_settings_of_a_training_that_does_not_happen_are_refused():
    file = {"episodes": 0, "policy": "trail_follower"}
    colony = {**file, "kind": "colony", "measures": ["deliveries"], "vary": {"ants": [2, 3]}}
    runs = {**file, "kind": "runs", "measures": ["greedy_return"], "vary": {"max_steps": [9, 20]}}
    more = r", or set evaluation_epsilon to let them explore\.$"
    for one, training, end in (
        (colony, {"training": {"epsilon": 0.3}}, more),
        (colony, {"vary": {"training.epsilon": [0.0, 0.1]}}, more),
        (runs, {"training": {"epsilon": 0.3}}, r"\.$"),
    ):
        with pytest.raises(AntsError, match=f"^training.epsilon .* is 0; leave it out{end}"):
            sweep_of({**one, **training})


def test_the_exploration_of_an_evaluation_is_checked():
    file = {"kind": "colony", "measures": ["deliveries"], "episodes": 0, "vary": {"rollouts": [1]}}
    with pytest.raises(AntsError, match="a number between 0 and 1"):
        sweep_of({**file, "policy": "random", "evaluation_epsilon": 1.5})
    with pytest.raises(AntsError, match="evaluation_epsilon has no effect"):
        sweep_of({**file, "task": {"choice": "deneubourg"}, "evaluation_epsilon": 0.1})


DESIGN = """
kind = "colony"
measures = ["blocked", "deliveries"]
seeds = 2
ants = 4
episodes = 0
ticks = 20
rollouts = 1
policy = "trail_follower"
design = "sobol"
samples = 4
sensitivity = true

[task]
pheromone.evaporation = "exponential"

[vary]
task.pheromone.half_life = { from = 10, to = 1000, scale = "log" }
task.pheromone.view = ["half", "strongest"]
task.noise.slip = { from = 0, to = 0.5 }
task.noise.misread = 0.01
"""


def test_a_design_has_rows_of_drawn_values_indices_and_figures(sweep):
    status, out, err = sweep(DESIGN)
    assert (status, err) == (0, "")
    folder = Path("results/sweep-my")
    names = {name for name in contents(folder) if not name.startswith(("blocks/", "sessions/"))}
    assert names == {
        *("runs.csv", "summary.csv", "sensitivity.csv", "report.txt", "manifest.json"),
        *("figures/blocked.png", "inputs/my.toml", "study.json"),
    }
    rows = numbers_in(folder / "runs.csv")
    assert len(rows) == 4 * (3 + 2) * 2
    assert len({row["task.noise.slip"] for row in rows}) == 8
    assert all(10 <= row["task.pheromone.half_life"] <= 1000 for row in rows)
    assert {row["task.noise.misread"] for row in rows} == {0.01}
    indices = numbers_in(folder / "sensitivity.csv")
    assert [(row["measure"], row["setting"].rpartition(".")[2]) for row in indices][:3] == [
        *(("blocked", "half_life"), ("blocked", "view"), ("blocked", "slip"))
    ]
    assert "The 10 of 20 points with the highest blocked:" in out
    assert "first_order" in out
    again = sweep(DESIGN)
    assert "already has these results" in again[1]
