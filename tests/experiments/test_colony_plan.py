"""The plan of the study of colonies, and its files; golden hashes hold its numbers."""

import numpy as np
import pytest
from colony import COMPARED, LEARNING, TASKS, conditions_of, greedy, plan, scheduled, with_bounds
from colony_findings import ELSEWHERES, WORLD_KINDS, Condition
from colony_limits import limits_of
from command_lines import call, contents, read_csv

from taichi_ants import worlds

SEEDS = (3, 4)
LENGTHS = {"episodes": 60, "ticks": 1000, "rollouts": 4}


@pytest.fixture(scope="module")
def planned():
    training = scheduled(LEARNING, 60)
    return conditions_of([*WORLD_KINDS, *ELSEWHERES], (1, 4, 16, 64), training, **LENGTHS)


def test_every_design_has_its_conditions(planned) -> None:
    jointly = [one for one in planned if one.regime == "joint"]
    assert len(jointly) == len(WORLD_KINDS) * len(TASKS) * 4
    for regime, sizes in (("alone", {4, 16, 64}), ("with_4", {16, 64}), ("with_16", {64})):
        found = {
            one.ants
            for one in planned
            if (one.world_kind, one.rules, one.regime) == ("open", "paper", regime)
        }
        assert found == sizes
    abroad = {one.world_kind: one.ants for one in planned if one.regime == "open"}
    assert abroad.keys() == {"paper", "piles", *ELSEWHERES}
    assert {world_kind for world_kind, ants in abroad.items() if ants != 64} == {"large"}
    assert len(planned) == len(jointly) + len(WORLD_KINDS) * len(COMPARED) * 6 + len(abroad) * 3


def test_nobody_is_evaluated_where_it_was_trained(planned) -> None:
    for (world_kind, *_), point in planned.items():
        teacher = point.after or point
        if world_kind == "paper" and point.after is None:
            assert point.pool is None
            assert point.world == worlds.paper()
        elif teacher.pool is not None:
            assert len(set(teacher.pool)) == 64
            seen = point.worlds(SEEDS)
            assert not set(seen if isinstance(seen, list) else [seen]) & set(teacher.pool)


def test_epsilon_and_learning_rate_fall_in_the_first_70_percent(planned) -> None:
    training = planned[Condition("paper", "foraging", "joint", 64)].training
    epsilon, rate = training.epsilon, training.learning_rate
    for _ in range(42):
        epsilon, rate = training.next_epsilon(epsilon), training.next_learning_rate(rate)
    assert (epsilon, rate) == pytest.approx((0.01, 0.01))
    assert training.next_epsilon(epsilon) == pytest.approx(0.01)


def test_every_condition_is_evaluated_without_exploration_too() -> None:
    options = {**LENGTHS, "world_kinds": ["paper", "moving"], "sizes": [1, 4], "seed": 3}
    asked = plan({**options, "seeds": 2})
    for point in asked.conditions.values():
        calm = greedy(point)
        assert {point, calm} <= {*asked.study.points}
        assert (calm.evaluation_epsilon, calm.episodes) == (0, 0)
        assert calm.after == (point.after or point)
        assert (calm.world, calm.task, calm.ants) == (point.world, point.task, point.ants)
    assert asked.study.seeds == SEEDS


def test_a_colony_is_held_against_the_bound_of_its_own_world(planned) -> None:
    one = Condition("piles", "queueing", "joint", 64)
    elsewhere = Condition("moving", "queueing", "open", 64)
    conditions = {condition: planned[condition] for condition in (one, elsewhere)}
    point = planned[one]
    expected = [limits_of(world, point.task).deliveries(64) for world in point.worlds(SEEDS)]
    assert expected[0] != expected[1]
    values = {point: {"deliveries": np.array([700.0, 700.0])} for point in conditions.values()}
    values |= {greedy(p): {"deliveries": np.array([800.0, 800.0])} for p in conditions.values()}
    found = with_bounds(conditions, values, SEEDS)
    assert found[one]["bound"].tolist() == expected
    assert np.isnan(found[elsewhere]["bound"]).all()  # the limits do not hold where food moves
    assert found[one]["greedy"].tolist() == [800, 800]
    assert found[one]["bound_share"] == pytest.approx(700 / np.array(expected))


SMALL = [
    *("study", "--world-kinds", "paper", "small", "--sizes", 1, 3, "--seeds", 2, "--seed", 3),
    *("--episodes", 4, "--ticks", 80, "--rollouts", 2),
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


@pytest.mark.slow
def test_all_files_are_there(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, out, err = call("colony", [*SMALL, "--out", "out"], capsys)
    assert (status, err) == (0, "")
    folder = tmp_path / "out"
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
