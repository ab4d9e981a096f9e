"""Lone ants of the page train as `train` does; a compiler builds the same programs again."""

import hashlib
import json
import runpy
import shutil

import numpy as np
import pytest
from lab_engines import ENGINE, Node

from taichi_ants import TrainingConfig, rollout, trace_training, train, worlds
from taichi_ants.task import Task

SEEDS = [1, 7, 2**40 + 3]


def check(ask, setting, **more):
    """Assert that a run of the page has the returns, steps and deliveries of `train`."""
    found = ask("train", **setting, **more, seeds=SEEDS)
    names = ("learner", "rate", "discount", "epsilon", "decay")
    more_steps = {"planning_steps": setting["planningSteps"]} if setting["planningSteps"] else {}
    config = TrainingConfig(*(setting[name] for name in names), **more_steps)
    task = Task(delivery="truncates" if setting["truncates"] else "terminates")
    lengths = {"episodes": more["episodes"], "max_steps": more["maxSteps"]} if more else {}
    wanted = train(worlds.paper(), config, SEEDS, task=task, **lengths)
    for name in ("returns", "steps", "deliveries"):
        assert found[name] == np.ravel(getattr(wanted, name)).tolist()
    return sum(found["deliveries"])


def test_runs_are_those_of_train(ask):
    grid = ask("grid")
    assert len(grid) == 128
    delivered = [check(ask, setting, episodes=60, maxSteps=200) for setting in grid[5::32]]
    assert all(delivered)


@pytest.mark.parametrize("learner", ["q_learning", "sarsa"])
def test_notes_of_steps_are_those_of_the_package(learner, ask):
    config = TrainingConfig(learner, 0.1, 0.9, 0.3, epsilon_decay=0.99)
    setting = {"learner": learner, "rate": 0.1, "discount": 0.9, "epsilon": 0.3, "decay": 0.99}
    found = ask("notes", setting={**setting, "seeds": [1], "episodes": 4}, rollout=2)
    task = Task(evaporation_in_evaluation=False)
    trace = trace_training(worlds.paper(), config, seed=1, episodes=4, task=task)
    table = trace.tables[-1]
    assert found["table"] == table.ravel().tolist()
    followed = rollout(worlds.paper(), table, seed=1, number=2, task=task)
    names = {"state": "states", "action": "actions", "reward": "rewards", "next": "next_states"}
    for notes, wanted in ((found["steps"], trace), (found["followed"], followed)):
        assert len(notes) == len(wanted) > 30
        for name, column in names.items():
            assert [note[name] for note in notes] == getattr(wanted, column).tolist()
    entries = trace.tables[np.arange(len(trace)), trace.states, trace.actions]
    assert [note["value"] for note in found["steps"]] == entries.tolist()
    assert [bool(note["terminated"]) for note in found["steps"]] == trace.terminated.tolist()


@pytest.mark.parametrize(
    "step", [pytest.param(5, marks=pytest.mark.slow), pytest.param(1, marks=pytest.mark.long)]
)
def test_whole_runs_of_the_grid_are_those_of_train(step, ask):
    """Each fifth setting, in which all values occur, or all."""
    assert sum(check(ask, setting) for setting in ask("grid")[::step]) > 1000 / step


def test_the_committed_programs_are_those_of_the_record():
    built = json.loads((ENGINE / "built.json").read_text("utf-8"))
    for name in ("colony.wasm", "ant.wasm"):
        assert hashlib.sha256((ENGINE / name).read_bytes()).hexdigest() == built[name]


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("wasm-ld") is None, reason="there is no clang with lld")
def test_a_new_build_has_the_same_results(ask, tmp_path):
    runpy.run_path(str(ENGINE / "build.py"))["build"](tmp_path)
    again = Node(tmp_path)
    try:
        for rules in (0, 5, 7, 15):
            stroke = {"tick": 50, "do": "rock", "reach": 2, "path": [2112]}
            visit = {"scene": {"rules": rules, "learner": 1}, "changes": [stroke], "ticks": 300}
            assert again("visit", visit) == ask("visit", visit)
        for setting in ask("grid")[::40]:
            one = {**setting, "seeds": SEEDS, "episodes": 50}
            assert again("train", one) == ask("train", one)
    finally:
        again.close()
