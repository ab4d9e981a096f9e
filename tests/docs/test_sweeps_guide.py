"""The Python of docs/how-to/sweeps.md repeats rows of sweeps exactly."""

import pytest
from command_lines import ROOT

from taichi_ants import files
from taichi_ants.studies.store import Store
from taichi_ants.studies.study import run
from taichi_ants.studies.sweep import sweep_of

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
