"""Registered measures: names, parts, arguments, and messages for wrong ones."""

import math

import numpy as np
import pytest

from taichi_ants import AntsError, Colony, TrainingConfig, When, measures, summary, train, worlds
from taichi_ants.learners.policies import trail_follower
from taichi_ants.measures.measure import MEASURES
from taichi_ants.measures.series import SeriesRecorder
from taichi_ants.task import Task

FROZEN = {"sharing": "frozen", "q_values": trail_follower()}
TRAINING = TrainingConfig("q_learning", 0.1, 0.9, 0.1, 1.0)


@pytest.fixture(autouse=True)
def forget_others(monkeypatch):
    monkeypatch.setattr(MEASURES, "yours", {})


def colony(world=None, ants=5, seeds=(0, 1, 2)) -> Colony:
    return Colony(world or worlds.paper(), None, TRAINING, seeds, ants, **FROZEN)


def test_a_measure_of_a_snapshot_is_one_number():
    ours = colony()
    ours.begin_episode()
    ours.tick(60)
    for w, delivered in enumerate(ours.deliveries.tolist()):
        assert measures.get("deliveries")(ours.snapshot(w)) == delivered
    snapshot = ours.snapshot()
    assert measures.get("entropy")(snapshot) == measures.get("entropy.trail")(snapshot) > 0
    for name, message in {
        "entropy.home": "it has trail",
        "deliveries_by": r"is not a number, but \{'deliveries_by.caste_0'",
        "deliveries.trail": "it has no parts",
    }.items():
        with pytest.raises(AntsError, match=message):
            measures.get(name)(snapshot)


def test_deliveries_have_the_names_of_castes_and_kinds_of_food():
    task = Task(castes={"scout": {}, "guard": {}}, foods={"seed": {}, "leaf": {}})
    series = Colony(worlds.paper(), task, TRAINING).run(1, 9, measures="deliveries_by").series
    parts = [name.partition(".")[2] for name in series.values]
    assert parts == ["nest_0", "food_seed", "food_leaf", "caste_scout", "caste_guard"]


def test_your_own_measure_is_read_as_the_others():
    measures.register("north", lambda s: np.count_nonzero(s.ant_headings == 0), "ants")
    measures.register("loads", lambda s: {"with": s.ant_carries.sum(), "without": None})
    result = colony().run(1, 30, measures=["north", "loads", "loads.with"], every=10)
    values = result.series.values
    assert list(values) == ["north", "loads.with", "loads.without"]
    assert np.isnan(values["loads.without"]).all()
    assert result.series.units["north"] == "ants"


def test_a_world_has_one_row_for_a_tick():
    ours, recorder = colony(), SeriesRecorder("deliveries")
    ours.begin_episode()
    for _ in range(2):
        recorder.read(ours)
    assert recorder.series().worlds.tolist() == [0, 1, 2]


def test_a_measure_of_counts_works_for_colonies_and_lone_ants():
    """In series, in conditions, and in summaries of lone ants, whose episodes are arrays."""
    measures.register("fruitless", lambda c: c["ticks"] - c["deliveries"], "ticks", of="counts")
    result = colony().run(1, 30, measures="fruitless", every=10)
    last = result.series.values["fruitless"][-3:]
    assert last.tolist() == (30 - result.deliveries[0]).tolist()
    protocol = [When("fruitless", above=14, interval=5, remove_ants=1.0)]
    assert not colony().run(1, 30, protocol=protocol).living.any()
    trained = train(worlds.paper(), [TRAINING], (0, 1), 4, 50)
    (row,) = (row for row in summary(trained).rows if row["measure"] == "fruitless")
    assert row["mean"] == (trained.steps - trained.deliveries).mean()
    measures.register("stuck", lambda c: c["blocked"], of="counts")  # lone ants do not count it
    assert "stuck" not in {row["measure"] for row in summary(trained).rows}


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda s: "much", "returned 'much'; it must return a finite number"),
        (lambda s: {"a": "much"}, "returned 'much'"),
        (lambda s: s.ant_cells, r"returned .*; it must return a finite number"),
        (lambda s: -math.inf, "returned -inf; it must return a finite number, nan"),
        (lambda s: s.nothing, "failed with AttributeError"),
        (lambda s: s.ground.fill(0), "failed with ValueError: .* read-only"),
        (lambda s: s.fields["trail"].sort(), "failed with ValueError: .* read-only"),
        (lambda: 1, "failed with TypeError"),
    ],
)
def test_wrong_values_are_refused(function, message):
    measures.register("mine", function)
    with pytest.raises(AntsError, match=message):
        colony().run(1, 10, measures="mine", every=5)


def test_what_a_measure_reads_is_counts_or_runs():
    with pytest.raises(AntsError, match="of is 'activity'; it must be one of counts, run"):
        measures.register("mine", len, of="activity")
