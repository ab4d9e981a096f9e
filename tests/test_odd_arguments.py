"""Arguments of a wrong kind are told where they are given; no message fills a screen."""

import sys
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from taichi_ants import (
    Colony,
    Rewards,
    Task,
    TrainingConfig,
    arguments,
    evaluate,
    learners,
    measures,
    offline,
    plot,
    record,
    rendering,
    rollout,
    states,
    train,
)
from taichi_ants import worlds as places
from taichi_ants.analysis.bounds import EpisodeBounds
from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.errors import AntsError
from taichi_ants.learners.policies import Policy
from taichi_ants.studies.command_line import Parser, notice
from taichi_ants.viewer import page, record_colony
from taichi_ants.viewer.page import check_page

WORLD = places.paper()
CONFIG = TrainingConfig("q_learning", 0.1, 0.9, 0.3, 0.9)
TABLE = np.zeros((128, 5))
SCALAR, RAGGED, LONG, HUGE = np.array(5), [[1], [1, 2]], "x" * 10**6, 10**5000


@cache
def data() -> offline.Dataset:
    return record(WORLD, episodes=1, max_steps=3)


@pytest.fixture(scope="module")
def colony() -> Colony:
    return Colony(WORLD, None, None, 0, 2, sharing="frozen")


ODD = {
    "configs": lambda _: train(WORLD, SCALAR, 0, 1),
    "world": lambda _: Colony(SCALAR, None, CONFIG),
    "world of an episode": lambda colony: colony.begin_episode(world=SCALAR),
    "which": lambda colony: colony.reset_worlds(RAGGED),
    "seeds": lambda colony: colony.reset_worlds(np.array([True]), seeds=object()),
    "actions": lambda colony: (colony.begin_episode(), colony.act(RAGGED)),
    "a reward": lambda _: Rewards(deliver=HUGE),
    "cells": lambda _: WORLD.grid.index(RAGGED),
    "a far cell": lambda _: WORLD.grid.index([(2**63, 0, 0)]),
    "index": lambda _: WORLD.grid.cells(RAGGED),
    "a learner": lambda _: learners.get(LONG),
    "no learner": lambda _: learners.get(["sarsa"]),
    "no configuration": lambda _: learners.registry.with_hyperparameters(None),
    "a long name": lambda _: learners.Learner(LONG, 3),
    "who is followed": lambda colony: record_colony(colony, follow=np.zeros(0)),
    "a state": lambda _: states.state_name(2**31),
    "a first value": lambda _: offline.fitted_q_iteration(data(), initial_q=None),
    "no first value": lambda _: offline.batch_q_learning(data(), initial_q=HUGE),
    "an offline model's": lambda _: offline.model_based(data(), TABLE, initial_q="x"),
    "by run": lambda _: offline.fitted_q_iteration(data(), by_run=np.zeros(0)),
    "a penalty": lambda _: offline.pessimistic_q_iteration(data(), penalty=HUGE),
    "a label": lambda _: learners.registry.label(["sarsa"]),
    "a picture's world": lambda _: rendering.picture(SCALAR),
    "a snapshot's world": lambda _: rendering.at_start(SCALAR),
    "a bound's world": lambda _: EpisodeBounds(SCALAR, Task()),
    "a page's path": lambda _: check_page(None),
    "a page": lambda _: page(SCALAR),
    "numbers of worlds": lambda _: Interventions(
        Colony(WORLD, None, None, range(3), 2, sharing="frozen"), RAGGED
    ),
    "two runs": lambda _: rollout(WORLD, train(WORLD, CONFIG, range(2), 1)),
    "measures": lambda colony: colony.run(1, 1, measures=5),
    "a measure's snapshot": lambda colony: measures.get("deliveries")(colony),
    "who is changed": lambda _: Interventions(None),
    "what changes": lambda colony: Interventions(colony).apply("trail"),
    "a model's data": lambda _: offline.EmpiricalModel.of(None, np.ones((1, 1))),
    "where walks start": lambda _: WORLD.walkable([10**12]),
    "no results": lambda _: plot({}),
    "two policies": lambda _: rollout(WORLD, np.zeros((2, 128, 5))),
    "a world's name": lambda _: places.registry.check_seed_counts(LONG),
}


@pytest.mark.parametrize("name", ODD)
def test_what_is_odd_is_named(name: str, colony: Colony) -> None:
    with pytest.raises(AntsError) as caught:
        ODD[name](colony)
    assert len(str(caught.value)) < 400


BOUNDS, STRIPES = EpisodeBounds(WORLD, Task()), np.zeros((3, 128, 5))
REFUSED = {
    "behaviour_probability of the data contains nan": lambda: offline.importance_sampling(
        replace(data(), behaviour_probability=np.full(len(data()), np.nan)), TABLE
    ),
    "q_values has shape": lambda: offline.model_based(data(), STRIPES[0, :3]),
    "`discount` is 1": lambda: offline.model_based(data(), TABLE, 1.0),
    "`resamples` is -1": lambda: offline.importance_sampling(data(), TABLE, resamples=-1),
    "`discount` is 1.5": lambda: offline.fitted_q_iteration(data(), 1.5),
    "data is 3": lambda: offline.batch_q_learning(3),
    "behaviour has shape": lambda: record(WORLD, STRIPES, seeds=(1, 2)),
    r"q_values has shape \(128, 4\)": lambda: record(WORLD, TABLE[:, :4]),
    "episodes is 0": lambda: record(WORLD, episodes=0),
    "epsilon is 2": lambda: record(WORLD, epsilon=2),
    "discount.* -0.1": lambda: BOUNDS.optimal(-0.1, 600),
    "discount.* 1.0": lambda: BOUNDS.optimal(1.0, 600),
    "discount.* nan": lambda: BOUNDS.optimal(float("nan"), 600),
    "constant trails": lambda: EpisodeBounds(WORLD, Task(evaporation_in_training=True)),
    r"use a smaller world or fewer food items\.$": lambda: EpisodeBounds(
        places.World((1000, 1000, 1), (0, 0, 0)), Task()
    ),
}


@pytest.mark.parametrize("message", REFUSED)
def test_what_cannot_be_computed_is_refused(message: str) -> None:
    with pytest.raises(AntsError, match=message):
        REFUSED[message]()


def test_results_and_policies_are_taken_for_their_tables() -> None:
    result = train(WORLD, CONFIG, 5, 2)
    table = result.q_values[0, 0]
    policy = Policy(table, "paper", {})
    for given in (result, policy):
        assert rollout(WORLD, given) == rollout(WORLD, table)
    assert evaluate(WORLD, result, 3).steps.tolist() == [[evaluate(WORLD, table, 3).steps.tolist()]]


def test_several_tables_are_counted_where_one_is_wanted() -> None:
    with pytest.raises(AntsError, match=r"which is 2 tables; .* its q_values\[0, 0\]"):
        rollout(WORLD, train(WORLD, CONFIG, range(2), 1))


def test_whole_numbers_of_numpy_are_whole_numbers() -> None:
    assert len(rollout(WORLD, TABLE, max_steps=SCALAR)) == 5


def test_too_little_memory_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*given: object) -> None:
        raise MemoryError("Unable to allocate 64.0 GiB for an array")

    monkeypatch.setattr(arguments, "checked_seeds", fails)
    calls = (train, CONFIG, 0), (evaluate, TABLE), (record,), (Colony, None, CONFIG)
    for call, *given in calls:
        with pytest.raises(AntsError, match=r"memory for so many .*; choose smaller numbers\.$"):
            call(WORLD, *given)
    monkeypatch.setattr(sys.modules["taichi_ants.worlds.open_world"], "scatter_rocks", fails)
    with pytest.raises(AntsError, match="too little memory for a world of these ranges; choose"):
        places.build("far_piles")


def test_no_message_fills_a_screen(capsys: pytest.CaptureFixture[str]) -> None:
    error = AntsError(f"the beginning {LONG} the end.")
    assert str(error).startswith("the beginning xxx")
    assert str(error).endswith("xxx the end.")
    assert len(str(error)) <= 1000
    assert str(AntsError(error)) == str(error)  # as libraries raise it anew
    notice(LONG)
    parser = Parser()
    parser.add_argument("--kind", choices=("a", "b"))
    with pytest.raises(SystemExit):
        parser.parse_args(["--kind", LONG])
    said = capsys.readouterr().err
    assert "invalid choice: 'xxx" in said
    assert len(said) < 4000
