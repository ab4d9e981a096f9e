"""The study of colonies as a script: files held against the library."""

from __future__ import annotations

import contextlib
import io
from dataclasses import replace

import colony
import numpy as np
import pytest
from command_lines import contents, read_csv

from taichi_ants import Colony, Life, Pheromone, Task, TrainingConfig, worlds
from taichi_ants.task import foraging, queueing

SEEDS, EPISODES, TICKS, ROLLOUTS = (3, 4), 4, 80, 2
SMALL = [
    *("study", "--world-kinds", "paper", "small", "--sizes", 1, 3),
    *("--seeds", len(SEEDS), "--seed", SEEDS[0]),
    *("--episodes", EPISODES, "--ticks", TICKS, "--rollouts", ROLLOUTS),
]
FILES = {
    *("conditions.csv", "differences.csv", "seeds.csv", "manifest.json"),
    *("report.html", "report.txt", "study.json"),
    *("tables/colony_elsewhere.json", "tables/colony_glance.json"),
    *(f"figures/{name}.png" for name in ("elsewhere", "rules", "scaling", "training")),
    *(
        f"policies/paper_{rules}_{ants}.npz"
        for rules in ("paper", "foraging", "queueing")
        for ants in (1, 3)
    ),
}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Return the output of one run of the script, and its folder, which is not to be changed."""
    place, out = tmp_path_factory.mktemp("finished"), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(out):
        patch.chdir(place)
        with pytest.raises(SystemExit) as ended:
            colony.main([*map(str, SMALL), "--out", "out"])
    assert ended.value.code == 0
    return out.getvalue(), place / "out"


@pytest.mark.slow
def test_all_files_are_there(finished):
    out, folder = finished
    folders = ("blocks", "inputs", "sessions")
    assert {name for name in contents(folder) if not name.startswith(folders)} == FILES
    report = (folder / "report.txt").read_text("utf-8")
    assert out.startswith(report)
    assert len(out.splitlines()) <= 42
    assert out.splitlines()[-1] == "out/report.html"
    assert "Deliveries per 1000 ticks of 3 ants" in report
    assert "2 seeds, too few for a verdict, exploration rate 0.01; in brackets: without" in report
    assert "What does each rule add?" in report
    page = (folder / "report.html").read_text("utf-8")
    assert (
        "The paper&#39;s world, 2 seeds, too few for a verdict, exploration rate 0.01: deliveries"
        in page
    )
    assert "Trained in open worlds, 3 ants, 2 seeds, too few for a verdict" in page
    assert page.count('class="player"') == 3
    rows = read_csv(folder / "conditions.csv")
    # In the paper's world seven rules for one and three ants, and of three rules those that were
    # trained alone, or in open worlds; the latter in small worlds, too.
    assert len(rows) == 7 * 2 + 3 + 3 + 3


DECAYS = {"epsilon_decay": (0.01 / 0.3) ** (1 / 3), "learning_rate_decay": 0.1 ** (1 / 3)}
LEAST = {"min_epsilon": 0.01, "min_learning_rate": 0.01, "initial_q": 10}
TRAINING = TrainingConfig("sarsa", 0.1, 0.9, 0.3, **DECAYS, **LEAST)
CALM = TrainingConfig("sarsa", 0.1, 0.9, 0.01, 1.0)
OTHERS = [seed + 2**32 for seed in SEEDS]


def task(pheromone=Pheromone(), life=Life(regrowth=0)):  # noqa: B008 - both are frozen
    """That of a colony that lives for a while."""
    return Task(pheromone=pheromone, life=life)


@pytest.mark.slow
def test_the_numbers_are_those_of_the_library(finished):
    """Three ants that forage: copies of one in the paper's world, trained there."""
    _, folder = finished
    rules = replace(foraging(), life=Life(regrowth=0))
    alone = Colony(worlds.paper(), rules, TRAINING, SEEDS)
    alone.run(EPISODES, TICKS)
    table = {"sharing": "frozen", "q_values": alone.q_values}
    lives = Colony(worlds.paper(), rules, CALM, OTHERS, 3, **table)
    condition = ("paper", "foraging", "alone", "3")
    assert_measured(folder, condition, lives.run(ROLLOUTS, TICKS))


@pytest.mark.slow
def test_ants_are_evaluated_in_worlds_that_they_have_not_seen(finished):
    """Three ants that queue, each episode in another open world of a pool, then in small ones."""
    _, folder = finished
    rules = replace(queueing(), life=Life(regrowth=0))
    draws = [np.random.default_rng(seed).integers(64, size=EPISODES) for seed in SEEDS]
    pool = [[worlds.open_world(2**20 + n, (30, 30, 30)) for n in each] for each in draws]
    places = [list(of_episode) for of_episode in zip(*pool, strict=True)]
    together = Colony(places[0], rules, TRAINING, SEEDS, 3)
    together.run(EPISODES, TICKS, worlds=places)
    small = [worlds.open_world(seed, (15, 15, 15)) for seed in SEEDS]
    table = {"sharing": "frozen", "q_values": together.q_values}
    lives = Colony(small, rules, CALM, OTHERS, 3, **table)
    assert_measured(folder, ("small", "queueing", "open", "3"), lives.run(ROLLOUTS, TICKS))


def assert_measured(folder, condition, outcome):
    """The measures of each seed are those of episodes (episodes, seeds) of three ants."""
    rows = [r for r in read_csv(folder / "seeds.csv") if tuple(r.values())[:4] == condition]
    assert [int(row["seed"]) for row in rows] == list(SEEDS)
    blocked = outcome.blocked.sum(axis=0) / outcome.moves.sum(axis=0)
    first = np.where(outcome.first_delivery < 0, TICKS, outcome.first_delivery).mean(axis=0)
    expected = {
        "deliveries": outcome.deliveries.mean(axis=0) * 1000 / TICKS,
        "first_delivery": first,
        "blocked": blocked,
        "reward": outcome.returns.mean(axis=0) * 1000 / TICKS / 3,
    }
    for name, values in expected.items():
        assert [float(row[name]) for row in rows] == pytest.approx(values.tolist())
