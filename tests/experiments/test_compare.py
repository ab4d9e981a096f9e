"""The paper's comparison as a command: its files, held against the library."""

import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_lines import EXPERIMENTS, assert_one_sentence, call, contents, load, read_csv, run
from paper import process

from taichi_ants import Task, TrainingConfig, evaluate, train, worlds
from taichi_ants.files import archives
from taichi_ants.measures.finished import Run, values_of

NUMBERS = ("learning_rate", "discount", "epsilon", "epsilon_decay")
SEEDS, EPISODES, MAX_STEPS, ROLLOUTS = (7, 8, 9), 60, 45, 50
SMALL = [
    *("--seeds", len(SEEDS), "--seed", SEEDS[0], "--episodes", EPISODES),
    *("--max-steps", MAX_STEPS, "--learners", "dyna_q", "--planning-steps", 2),
    *("--learning-rates", 0.01, "--discounts", 0.9, 0.99),
    *("--epsilons", 0.3, "--epsilon-decays", 0.995),
]
TINY = [
    *("--seeds", 1, "--episodes", 2, "--max-steps", 30, "--learners", "q_learning"),
    *("--learning-rates", 0.1, "--discounts", 0.9, "--epsilons", 0.3, "--epsilon-decays", 0.9),
    *("--delivery", "terminates", "--no-figures"),
]
# Within 45 steps some deliver and some do not, in all of these.
SHOWN = [
    f"{delivery}_dyna_q_p2_{behaviour}"
    for delivery in ("truncates", "terminates")
    for behaviour in ("delivers", "circles_with_food")
]
FILES = {
    *("baselines.csv", "behaviours.csv", "claims.csv", "runs.npz"),
    *("manifest.json", "report.html", "report.txt", "study.json"),
    *("summary.csv", "table2.csv"),
    *(f"policies/{name}.npz" for name in SHOWN),
    *(f"tables/paper_{one}.json" for one in ("return", "steps", "late_steps")),
    *(f"tables/paper_{one}.json" for one in ("claims", "policies", "verdicts")),
    *("figures/learning_curves.png", "figures/return_against_deliveries.png"),
}


@pytest.fixture(scope="module")
def finished(tmp_path_factory, kernels):
    """The folder that one run of the command has left; not to be written to."""
    place = tmp_path_factory.mktemp("compare")
    done = run("compare", [*SMALL, "--out", "deep/out"], kernels, place)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""  # no progress bar where nobody looks
    folder = place / "deep" / "out"
    report = (folder / "report.txt").read_text("utf-8")
    assert done.stdout.startswith(report)
    assert re.fullmatch(
        r"\n\d+\.\d s; all results are in deep/out/\ndeep/out/report.html\n",
        done.stdout.removeprefix(report),
    )
    return folder


@pytest.fixture
def copy(finished, tmp_path):
    """A copy of it to try things on."""
    return Path(shutil.copytree(finished, tmp_path / "out"))


@pytest.fixture
def compare(capsys, monkeypatch):
    """Calls the script within this process, without a worker process, which `finished` has."""
    monkeypatch.setattr(process, "available_threads", lambda: 1)
    return lambda *arguments: call("compare", arguments, capsys)


def config_of(row):
    """The configuration that a row of summary.csv names."""
    numbers = [float(row[name]) for name in NUMBERS]
    own = (pair.split("=") for pair in row["hyperparameters"].split())
    return TrainingConfig(row["learner"], *numbers, **{name: int(value) for name, value in own})


def task_of(row, training=False, greedy=True):
    """The task that a row names, with these evaporations."""
    return Task(
        delivery=row["delivery"], evaporation_in_training=training, evaporation_in_evaluation=greedy
    )


def trained_as(rows, *more):
    """What the library makes of several rows: returns, steps, deliveries and tables, by name."""
    runs = [train(worlds.paper(), config_of(row), *more, task_of(row)) for row in rows]
    names = ("returns", "steps", "deliveries", "q_values")
    return {name: np.concatenate([getattr(run, name) for run in runs]) for name in names}


def test_files(finished):
    folders = {"blocks", "inputs", "sessions"}
    found = {name for name in contents(finished) if name.partition("/")[0] not in folders}
    assert found == FILES
    assert folders <= {path.name for path in finished.iterdir()}


def test_runs_are_what_the_library_gives_in_the_order_of_the_summary(finished):
    rows = read_csv(finished / "summary.csv")
    arrays = archives.read(finished / "runs.npz")
    trained = trained_as(rows, SEEDS, EPISODES, MAX_STEPS)
    greedy = evaluate(worlds.paper(), trained["q_values"], ROLLOUTS, SEEDS, MAX_STEPS)
    names = ("returns", "steps", "deliveries")
    outcome = trained | {f"greedy_{name}": getattr(greedy, name) for name in names}
    expected = values_of(Run.of_lone_ant(outcome))
    assert arrays["return_all"].shape == (len(rows), len(SEEDS))
    for name, values in expected.items():
        np.testing.assert_array_equal(arrays[name], values, err_msg=name)
    assert set(arrays) - set(expected) == {
        *("behaviours", "policy_returns"),
        *(f"curve_{name}" for name in names),
    }
    assert {arrays[f"curve_{name}"].shape[:2] for name in names} == {(2, 3)}
    assert arrays["deliveries_all"].any()
    assert arrays["greedy_deliveries"].any()


def test_evaporation_is_chosen_told_and_kept_apart(tmp_path, compare):
    flags = ["--task.evaporation-in-training", "true", "--task.evaporation-in-evaluation", "false"]
    out = tmp_path / "out"
    assert compare(*TINY, "--episodes", 30, *flags, "--out", out)[0] == 0
    (row,) = read_csv(out / "summary.csv")
    task = task_of(row, training=True, greedy=False)
    trained = train(worlds.paper(), config_of(row), 0, 30, 30, task)
    rollouts = evaluate(worlds.paper(), trained.q_values, ROLLOUTS, [0], 30, task)
    as_trained = replace(task, evaporation_in_evaluation=True)
    once = evaluate(worlds.paper(), trained.q_values, 1, [0], 30, as_trained)
    archive = archives.read(out / "runs.npz")
    assert np.array_equal(archive["return_all"], trained.returns.mean(axis=2))
    assert np.array_equal(archive["greedy_return"], rollouts.returns.mean(axis=2))
    assert np.array_equal(archive["policy_returns"], once.returns[..., 0])
    assert "Training with evaporation of trails, greedy" in (out / "report.txt").read_text("utf-8")
    assert read_csv(out / "baselines.csv")[0]["baseline"] == "exact bounds"
    status, _, err = compare(*TINY, "--episodes", 30, "--out", out)
    assert status == 2
    assert "task.evaporation_in_evaluation is " in err


def test_quick_takes_few_seeds_and_a_folder_of_its_own(tmp_path, compare, monkeypatch):
    monkeypatch.chdir(tmp_path)
    drawn = [one for one in TINY if one != "--no-figures"]
    assert compare(*drawn, "--quick", "--seeds", 50)[0] == 0
    folder = tmp_path / "results" / "compare-quick"
    assert list((folder / "figures").iterdir())
    assert list((folder / "policies").iterdir())
    assert {row["seeds"] for row in read_csv(folder / "summary.csv")} == {"10"}
    assert load("compare").parse_arguments([]).out == Path("results", "compare")
    assert load("compare").parse_arguments(["--quick", "--out", "here"]).out == Path("here")


def test_other_worlds(tmp_path, compare):
    chosen = ["--world", "open", "--world.seed", 5]
    status, _, err = compare(*TINY, *chosen, "--out", tmp_path / "out")
    assert (status, err) == (0, "")
    text = (tmp_path / "out" / "report.txt").read_text("utf-8")
    assert text.startswith("World: open, world seed 5.\n")
    assert "47.3" not in text
    verdicts = read_csv(tmp_path / "out" / "claims.csv")
    assert {row["verdict"] for row in verdicts} == {"not tested"}
    (row,) = read_csv(tmp_path / "out" / "summary.csv")
    expected = train(worlds.open_world(5), config_of(row), 0, 2, 30)
    archive = archives.read(tmp_path / "out" / "runs.npz")
    assert np.array_equal(archive["return_all"], expected.returns.mean(axis=2))
    assert np.array_equal(archive["steps_all"], expected.steps.mean(axis=2))


def test_a_learner_of_ones_own_and_a_discount_of_one_are_reported(tmp_path, compare):
    plugin = EXPERIMENTS / "plugins" / "hysteretic.py"
    changes = ["--plugin", plugin, "--learners", "hysteretic", "--discounts", 0, 1]
    status, out, _ = compare(*TINY, *changes, "--out", tmp_path / "out")
    assert status == 0
    assert out.startswith("World: the paper's.\n")
    archive = archives.read(tmp_path / "out" / "runs.npz")
    returns = archive["return_all"][:, 0]
    best = int(returns.argmax())
    greedy = archive["greedy_return"][best].mean()
    cells = [line.split() for line in out.splitlines() if line.startswith("hysteretic *")]
    assert cells[0][3] == f"{returns[best]:.1f}"
    assert " paper " not in out.split("Learner")[1]  # it does not have such a learner
    (line,) = read_csv(tmp_path / "out" / "table2.csv")
    assert float(line["greedy_return_mean"]) == pytest.approx(greedy)
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert f"hysteretic *, terminates: 0.1 / {best} / 0.3 / 0.9" in page
    assert "the discount is 1.0; it must be at least 0 and below 1" in page
    assert max(len(line) for line in out.splitlines()[:-2]) < 80


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["--learners", "td_zero"], ["td_zero", "q_learning", "sarsa", "dyna_q"]),
        (["--epsilons", "0.3", "nan"], ["epsilon", "nan"]),
        (["--training.n-steps", "2"], ["`training.n_steps` is not a hyperparameter of q_learning"]),
        (["--training.planning-steps", "2"], ["use --planning-steps"]),
        (["--task.delivery", "truncates"], ["--task.delivery"]),
        (["--seeds", "1000000"], ["--seeds", "1000000"]),
        (["--world", "mars"], ["'mars'", "open", "paper"]),
        (["--world", "no_way.txt"], ["no_way.txt", "cannot reach any food"]),
        (["--world.seed", "0"], ["--world.seed", "'paper'", "open"]),
        (["--out", "full"], ["'full'", "--force"]),
    ],
)
def test_refusals_are_one_sentence_and_leave_nothing_behind(
    arguments, named, tmp_path, monkeypatch, compare
):
    monkeypatch.chdir(tmp_path)
    Path("no_way.txt").write_text("Q\n\n#\n\nF\n")
    Path("full").mkdir()
    Path("full/diary.txt").write_text("not a result")
    before = contents(tmp_path)
    status, out, err = compare(*TINY, "--out", "a/new/folder", *arguments)
    assert (status, out) == (2, "")
    assert_one_sentence(err)
    for word in named:
        assert word in err
    assert contents(tmp_path) == before
    assert not Path("a").exists()
