"""The Python of docs/how-to/sweeps.md repeats rows of sweeps exactly."""

from __future__ import annotations

import numpy as np
import pytest
from command_lines import ROOT

from taichi_ants import Colony, TrainingConfig, files, worlds
from taichi_ants.learners.policies import frozen_policy
from taichi_ants.studies.store import Store
from taichi_ants.studies.study import run
from taichi_ants.studies.sweep import sweep_of
from taichi_ants.task import foraging

GUIDE = (ROOT / "docs/how-to/sweeps.md").read_text("utf-8")
COLONY, RUNS = (part.split("```")[0] for part in GUIDE.split("```python\n")[1:])


def row_of(file, tmp_path):
    """The measures of the only row of a sweep, by name."""
    study, store = sweep_of(file).study, Store(tmp_path)
    run(study, store)
    values = store.read(study.keys, study.seeds, study.arrays)
    return {name: array.item() for name, array in values.items()}


def of_file(name, seed, **row):
    file = files.tomllib.loads((ROOT / "experiments/sweeps" / name).read_text())
    return {**file, "seeds": [seed], "vary": {name: [value] for name, value in row.items()}}


@pytest.mark.slow
def test_the_row_of_a_colony_is_the_one_of_the_guide(tmp_path, capsys):
    row = {"task.pheromone.half_life": 20, "task.pheromone.deposit": "add"}
    wanted = row_of(of_file("trails.toml", 3, **row), tmp_path)
    exec(compile(COLONY, "how-to/sweeps.md", "exec"), {})
    assert float(capsys.readouterr().out) == wanted["deliveries"] > 0


def test_the_row_of_a_lone_ant_is_the_one_of_the_guide(tmp_path, capsys):
    file = of_file(
        "learning_rates.toml", 3, **{"training.learning_rate": 0.1, "training.epsilon": 0.5}
    )
    file["measures"] = ["return_last50", "greedy_return", "greedy_deliveries"]
    wanted = row_of(file, tmp_path)
    found: dict = {}
    exec(compile(RUNS, "how-to/sweeps.md", "exec"), found)
    printed = [float(one) for one in capsys.readouterr().out.split()]
    assert printed == [wanted[name] for name in file["measures"]]
    assert found["trace"].rewards.sum() == found["greedy"].returns.ravel()[0]


@pytest.mark.parametrize("epsilon", [None, 0.05])
def test_the_row_of_a_frozen_policy_is_played_as_the_guide_says(epsilon, tmp_path):
    more = {} if epsilon is None else {"evaluation_epsilon": epsilon}
    names = {"kind": "colony", "measures": ["deliveries", "entropy"], "task.preset": "foraging"}
    of_colony = {"ants": 9, "episodes": 0, "ticks": 200, "rollouts": 2, "seeds": [5]}
    vary = {"policy": ["trail_follower"]}
    wanted = row_of({**names, **of_colony, **more, "vary": vary}, tmp_path)
    policy = {"sharing": "frozen", "q_values": frozen_policy("trail_follower", "ants")}
    who = TrainingConfig.frozen(epsilon or 0), 5 + 2**32
    colony = Colony(worlds.paper(), foraging(), *who, ants=9, **policy)
    rollouts = colony.run(2, 200, measures="entropy")
    assert rollouts.deliveries.mean() * 1000 / 200 == wanted["deliveries"] > 0
    assert np.mean(rollouts.series.values["entropy.trail"]) == wanted["entropy.trail"]
