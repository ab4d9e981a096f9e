"""Measures of colonies equal those of the reference, which computes them in plain Python."""

import numpy as np
import pytest
from plain_measures import MEASURES, measured
from random_colonies import mortal, random_colony

from taichi_ants import Colony, TrainingConfig, measures, worlds
from taichi_ants.learners.policies import trail_follower
from taichi_ants.reference import ReferenceColony
from taichi_ants.task import foraging

EVERY, EPISODES, TICKS = 3, 2, 20
PARTS = ("regions.a", "regions.b", "deliveries_by.nest_0", "deliveries_by.food_0")
READ = (*MEASURES, *PARTS, "deliveries_by.caste_0")


def same(one: float, other: float) -> bool:
    return one == other or (one != one and other != other)


def expected(plain: ReferenceColony) -> list[dict]:
    """The rows of one world."""
    rows = []
    for episode in range(EPISODES):
        plain.begin_episode()
        while plain.record.ticks < TICKS and not plain.over:
            plain.tick(last=plain.record.ticks == TICKS - 1)
            tick = plain.record.ticks
            if tick % EVERY and tick < TICKS and not plain.over:
                continue
            row = {name: measured(plain, name) for name in READ}
            rows.append({**row, "episode": episode, "tick": tick})
        plain.end_episode()
    return rows


@pytest.mark.parametrize(
    ("schedule", "threads", "changes"),
    [
        ("by_chunk", 2, True),
        pytest.param("by_world", 1, False, marks=pytest.mark.long),
        pytest.param("by_chunk", 2, False, marks=pytest.mark.long),
        pytest.param("by_world", 2, True, marks=pytest.mark.long),
    ],
)
def test_measures_equal_the_reference(schedule, threads, changes):
    """Drawn models, two worlds at once; births and deaths where ants and food change."""
    happened = dict.fromkeys(READ, 0)
    for seed in range(8):
        drawn = random_colony(
            seed, sharing="frozen", learner="q_learning", dense=changes, changes=changes
        )
        drawn = mortal(drawn) if changes else drawn
        rules = {**drawn.population, "sharing": drawn.sharing, "q_values": drawn.q_values}
        seeds = (drawn.seed, 7)
        given = drawn.world, drawn.task, drawn.training
        colony = Colony(*given, seeds, **rules, schedule=schedule, threads=threads)
        series = colony.run(EPISODES, TICKS, measures=[*measures.BUILT_IN], every=EVERY).series
        assert set(series.values) == {*READ}
        for w, one in enumerate(seeds):
            places = np.flatnonzero(series.worlds == w)
            theirs = expected(ReferenceColony(*given, one, **rules))
            assert series.ticks[places].tolist() == [row["tick"] for row in theirs]
            assert series.episodes[places].tolist() == [row["episode"] for row in theirs]
            for place, row in zip(places, theirs, strict=True):
                for measure, values in series.values.items():
                    assert same(float(values[place]), row[measure]), (seed, measure)
                for measure in READ:
                    happened[measure] += 0 < row[measure] < np.inf
    del happened["waiting_births"]  # see the next test
    assert min(happened.values()) > 10, happened


def test_births_that_wait_equal_the_reference():
    task = foraging().replace(life={"births": True, "regrowth": 0})
    given = worlds.paper(), task, TrainingConfig.frozen(0.05)
    rules = {"ants": 6, "capacity": 12, "sharing": "frozen", "q_values": trail_follower("ants")}
    colony, plain = Colony(*given, 3, **rules), ReferenceColony(*given, 3, **rules)
    series = colony.run(1, 300, measures=["waiting_births", "living"], every=10).series
    plain.begin_episode()
    for tick, waiting in zip(series.ticks, series.values["waiting_births"], strict=True):
        while plain.record.ticks < tick:
            plain.tick()
        assert waiting == measured(plain, "waiting_births")
    living = series.values["living"]
    assert waiting > 10
    assert living[-1] == 12


@pytest.mark.parametrize("schedule", ["by_chunk", pytest.param("by_world", marks=pytest.mark.long)])
def test_reading_changes_nothing(schedule):
    for seed in range(3):
        drawn = random_colony(seed, learner="q_learning", dense=False, changes=True)
        colonies, results = [], []
        for asked in ({}, {"measures": measures.names(), "every": 1}):
            given = drawn.world, drawn.task, drawn.training, (1, 2)
            colony = Colony(*given, **drawn.population, schedule=schedule, threads=2)
            results.append(colony.run(2, 15, **asked))
            colonies.append(colony)
        assert colonies[0] == colonies[1]
        for name, array in results[0].counts().items():
            np.testing.assert_array_equal(array, results[1].counts()[name])
