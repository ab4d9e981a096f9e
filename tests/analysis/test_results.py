"""Results as tidy rows, with summaries, figures and paired comparisons."""

import csv
from dataclasses import replace

import numpy as np
import pytest

from taichi_ants import (
    AntsError,
    Colony,
    TrainingConfig,
    compare,
    evaluate,
    plot,
    summary,
    train,
    worlds,
)
from taichi_ants.analysis.results import curves, of_seeds
from taichi_ants.analysis.statistics import bootstrap_interval
from taichi_ants.learners.policies import trail_follower
from taichi_ants.measures.tidy import Measured, Tidy

SEEDS = range(5)
TRAINING = TrainingConfig("q_learning", 0.1, 0.9, 0.1, 1.0)
ASKED = ["deliveries", "entropy", "path_length"]


class Made(Tidy):
    """A result of given rows."""

    def __init__(self, table: Measured) -> None:
        self.table = table

    def measured(self) -> Measured:
        return self.table


def run(ants=6, seeds=SEEDS, **asked):
    follows = {"sharing": "frozen", "q_values": trail_follower()}
    return Colony(worlds.paper(), None, TRAINING, seeds, ants, **follows).run(2, 60, **asked)


@pytest.fixture(scope="module")
def series():
    return run(measures=ASKED, every=25)


@pytest.fixture(scope="module")
def trained():
    configs = [TrainingConfig("q_learning", 0.1, 0.9, epsilon, 1.0) for epsilon in (0.1, 0.5)]
    return train(worlds.paper(), configs, SEEDS, 8, 100)


def test_rows_are_tidy(series):
    rows = list(series.rows())
    assert len(rows) == 3 * 5 * 2 * 3  # ticks 25, 50, 60; worlds, episodes, measures
    assert list(rows[0]) == ["world", "seed", "episode", "tick", "measure", "value"]
    assert {row["tick"] for row in rows} == {25, 50, 60}
    assert {row["measure"] for row in rows} == {"deliveries", "entropy.trail", "path_length"}
    last = [row for row in rows if row["measure"] == "deliveries" and row["tick"] == 60]
    for row in last:
        assert row["value"] == series.deliveries[row["episode"], row["world"]]
        assert row["seed"] == SEEDS[row["world"]]


def test_without_measures_the_rows_are_the_counts():
    result = run()
    rows = {(row["measure"], row["episode"], row["seed"]): row["value"] for row in result.rows()}
    assert rows["moves", 1, 3] == result.moves[1, 3]
    assert len(rows) == 12 * 2 * 5


def test_rows_of_lone_ants(trained):
    rows = [row for row in trained.rows() if row["measure"] == "steps"]
    assert list(rows[0]) == ["configuration", "seed", "episode", "tick", "measure", "value"]
    assert [row["value"] for row in rows] == trained.steps.ravel().tolist()
    greedy = evaluate(worlds.paper(), trained.q_values, 3, SEEDS, 50)
    assert greedy.seeds == tuple(SEEDS)
    values = greedy.measured().values
    assert values["first_delivery"].tolist() == greedy.steps.ravel().tolist()
    assert values["efficiency"].tolist() == (greedy.deliveries / greedy.steps).ravel().tolist()
    alone = evaluate(worlds.paper(), trained.q_values[0, 0], 3, 7, 50)
    assert {row["seed"] for row in alone.rows()} == {7}


def test_files_have_the_rows(series, tmp_path):
    series.to_csv(tmp_path / "rows.csv")
    with open(tmp_path / "rows.csv", newline="") as file:
        found = list(csv.DictReader(file))
    assert len(found) == len(list(series.rows()))
    for text, row in zip(found, series.rows(), strict=True):
        assert text["measure"] == row["measure"]
        assert text["value"] == ("" if np.isnan(row["value"]) else repr(row["value"]))


def test_pandas_has_the_rows(series):
    pandas = pytest.importorskip("pandas")
    frame = series.to_pandas()
    plain = pandas.DataFrame(list(series.rows()))
    pandas.testing.assert_frame_equal(
        frame.astype({"measure": plain["measure"].dtype}), plain, check_dtype=False
    )
    wide = frame.pivot_table(index="tick", columns="measure", values="value", observed=True)
    assert wide.index.tolist() == [25, 50, 60]


def test_summaries_are_means_over_seeds(series, trained):
    rows = {row["measure"]: row for row in summary(series).rows}
    means = series.deliveries.mean(axis=0)
    assert rows["deliveries"]["mean"] == means.mean()
    low, high = bootstrap_interval(means[None])
    assert (rows["deliveries"]["low"], rows["deliveries"]["high"]) == (low[0], high[0])
    assert rows["deliveries"]["unit"] == "food items"
    assert "path_length (ticks)" in repr(summary(series))
    steps = [row for row in summary(trained, last=3).rows if row["measure"] == "steps"]
    assert [row["configuration"] for row in steps] == ["epsilon 0.1", "epsilon 0.5"]
    means = trained.steps[:, :, -3:].mean(axis=(1, 2))
    assert [row["mean"] for row in steps] == pytest.approx(means.tolist(), rel=1e-12)


def test_seeds_without_a_value_do_not_count():
    """Two seeds of one episode; the second seed has a value in the second row only."""
    table = Measured(
        index={"seed": np.array([3, 8, 3, 8]), "episode": np.zeros(4, int),
               "tick": np.array([10, 10, 20, 15])},
        values={"length": np.array([1.0, np.nan, 2.0, 6.0]), "none": np.full(4, np.nan)},
        of_seed=np.array([0, 1, 0, 1]), of_group=np.zeros(4, int), seeds=(3, 8),
    )  # fmt: skip
    assert of_seeds(table, "length").tolist() == [[2, 6]]
    assert np.isnan(of_seeds(table, "none")).all()
    full = replace(table, values={"length": np.array([1.0, 1.0, 3.5, 1.0])})
    for pair, difference in (((table, full), -1.5), ((full, table), 1.5)):
        for missing in (np.nan, 6.0):
            table.values["length"][3] = missing
            found = compare(*map(Made, pair), "length")
            assert (found.seeds, found.differences[0]) == (1 + (missing == 6.0), difference)
    ((x, values),) = curves(table, "length", "tick")
    assert x.tolist() == [10, 15, 20]
    np.testing.assert_array_equal(values, [[1, np.nan], [1, 6], [2, 6]])


def test_curves_by_episode(trained):
    for number, (x, values) in enumerate(curves(trained.measured(), "returns", "episode")):
        assert x.tolist() == list(range(8))
        np.testing.assert_array_equal(values, trained.returns[number].T)


def test_comparisons_are_paired(series, trained):
    other = run(ants=12, measures="deliveries")
    found = compare(series, other)
    differences = (series.deliveries.mean(axis=0) - other.deliveries.mean(axis=0)).tolist()
    assert found.differences == tuple(differences)
    low, high = bootstrap_interval(np.array([differences]))
    assert (found.low, found.high, found.seeds) == (low[0], high[0], 5)
    assert found.difference == pytest.approx(found.first - found.second)
    two = compare(trained, trained, "steps", configurations=(0, 1), last=4)
    means = trained.steps[:, :, -4:].mean(axis=2)
    assert two.differences == tuple((means[0] - means[1]).tolist())
    assert "over 5 paired seeds" in repr(two)


def test_figures_are_drawn(series, trained):
    figure = plot(series, "deliveries", "entropy.trail")
    assert [axes.get_ylabel() for axes in figure.axes] == [
        "Deliveries,\nfood items", "Entropy (trail)"
    ]  # fmt: skip
    assert figure.axes[-1].get_xlabel() == "Tick"
    assert [len(axes.lines) for axes in plot(trained).axes] == [2, 2, 2]


def test_several_results_are_drawn_together(series, trained):
    other = run(ants=12, measures=["deliveries", "activity"], every=20)
    figure = plot({"few": series, "many": other})
    assert [axes.get_ylabel() for axes in figure.axes] == ["Deliveries,\nfood items"]
    (axes,) = figure.axes
    assert [line.get_label() for line in axes.lines] == ["few", "many"]
    alone = [plot(one, "deliveries").axes[0].lines[0] for one in (series, other)]
    for line, single in zip(axes.lines, alone, strict=True):
        assert np.array_equal(line.get_xydata(), single.get_xydata())
    both = plot({"first": trained, "again": trained}, "steps").axes[0]
    assert [line.get_label() for line in both.lines] == [
        f"{name} {group}" for name in ("first", "again") for group in trained.measured().groups
    ]


def test_names_of_measures_are_those_of_run(series):
    """A measure with parts stands for all of them in figures, and for its only one elsewhere."""
    whole, part = plot(series, "entropy"), plot(series, "entropy.trail")
    assert [axes.get_ylabel() for axes in whole.axes] == [axes.get_ylabel() for axes in part.axes]
    assert "too few for these: use 10" in " ".join(text.get_text() for text in whole.texts)
    found = compare(series, run(ants=3, measures=ASKED), "entropy")
    assert (
        found.differences
        == compare(series, run(ants=3, measures=ASKED), "entropy.trail").differences
    )


@pytest.mark.parametrize(
    ("attempt", "message"),
    [
        (
            lambda one: compare(one, 3),
            "b is 3; it must be a result of Colony.run, train or evaluate",
        ),
        (lambda one: compare(one, one, "nothing"), "no measure 'nothing'"),
        (lambda one: compare(one, run(seeds=range(1, 6)), "deliveries"), "same seeds"),
        (lambda one: compare(one, one, configurations=(0, 1)), "configuration is 1"),
        (lambda one: compare(one, one, last=3), "last is 3"),
        (lambda one: plot(one, "nothing"), "choose one of deliveries, entropy.trail"),
        (lambda one: summary(one, last=0), "last is 0"),
        (lambda one: plot({"a": one, "b": 3}), "b is 3; it must be a result of Colony.run"),
        (lambda one: plot({"a": one, "b": run(seeds=range(1, 6))}), "the seeds of 'b' are"),
        (lambda one: plot({"a": one, "b": one}, "nothing"), "no measure 'nothing'"),
    ],
)
def test_wrong_requests_are_refused(series, attempt, message):
    with pytest.raises(AntsError, match=message):
        attempt(series)
