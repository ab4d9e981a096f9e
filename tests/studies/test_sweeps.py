"""Sweeps in blocks: the same results in any order, from any state of the folder."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from taichi_ants.studies.sweeps import Sweep, run_sweep

from taichi_ants import AntsError, TrainingConfig, evaluate, files, train
from taichi_ants.studies import sweeps
from taichi_ants.studies.provenance import commit, provenance, sweep_settings, world_facts
from taichi_ants.worlds import World, paper

CONFIGS = (
    TrainingConfig("sarsa", 0.1, 0.9, 0.3, 0.99),
    TrainingConfig("dyna_q", 0.1, 0.9, 0.3, 0.99, planning_steps=2, delivery="continuing"),
    TrainingConfig("sarsa", 0.2, 0.9, 0.3, 0.99),
    TrainingConfig("sarsa", 0.3, 0.9, 0.3, 0.99, delivery="continuing"),
    TrainingConfig("sarsa", 0.4, 0.9, 0.3, 0.99),
)
NAMES = ("returns", "steps", "deliveries")


@pytest.fixture(params=[2, 11], ids=["blocks of some seeds", "blocks of some configurations"])
def sweep(request, monkeypatch):
    """Five configurations and five seeds, in blocks of so many runs at most."""
    monkeypatch.setattr(sweeps, "_STEPS_OF_A_BLOCK", request.param * 6 * 80)
    return Sweep(paper(), CONFIGS, (4, 0, 9, 7, -2), episodes=6, max_steps=80, rollouts=3)


def same(one, other):
    return all(
        np.array_equal(getattr(one, name), getattr(other, name))
        for name in (*NAMES, *(f"greedy_{name}" for name in NAMES), "q_values")
    )


def test_blocks_cover_all_runs_once_with_one_learner_each(sweep):
    done = np.zeros((5, 5), int)
    limit = sweeps._STEPS_OF_A_BLOCK // (6 * 80)
    for configs, seeds in sweep.blocks():
        assert done[configs, seeds].size <= limit
        assert len({sweep.cost_of(c) for c in range(5)[configs]}) == 1
        done[configs, seeds] += 1
    assert (done == 1).all()
    assert len(list(sweep.blocks())) == {2: 5 * 3, 11: 1 + 1 + 2}[limit]


def test_blocks_are_limited_in_runs_too():
    sweep = Sweep(paper(), CONFIGS, tuple(range(9000)), episodes=1, max_steps=1, rollouts=1)
    assert max(seeds.stop - seeds.start for _, seeds in sweep.blocks()) <= 5000
    long = Sweep(paper(), CONFIGS, (0, 1), episodes=10**6, max_steps=10**7, rollouts=1)
    assert {seeds.stop - seeds.start for _, seeds in long.blocks()} == {1}


def test_a_sweep_is_training_and_evaluation(sweep, tmp_path):
    shares = []
    result = run_sweep(sweep, tmp_path, progress=shares.append)
    trained = train(sweep.world, CONFIGS, sweep.seeds, 6, 80)
    greedy = evaluate(sweep.world, trained.q_values, 3, sweep.seeds, 80)
    for name in NAMES:
        assert np.array_equal(getattr(result, name), getattr(trained, name))
        assert np.array_equal(getattr(result, f"greedy_{name}"), getattr(greedy, name))
    assert np.array_equal(result.q_values, trained.q_values)
    costs = {(cost.learner, cost.planning_steps): cost.steps for cost in result.costs}
    assert costs == {
        ("sarsa", 0): result.steps[[0, 2, 3, 4]].sum(),
        ("dyna_q", 2): result.steps[1].sum(),
    }
    assert shares[0] == 0
    assert shares[-1] == pytest.approx(1)
    assert all(earlier < later for earlier, later in itertools.pairwise(shares))
    assert len(shares) == 1 + len(list(sweep.blocks())) == 1 + len(list(tmp_path.iterdir()))


@pytest.mark.parametrize(("training", "greedy"), [(True, True), (True, False), (False, False)])
def test_evaporation_is_a_setting_of_each(training, greedy, tmp_path):
    sweep = Sweep(paper(), CONFIGS[:2], (0, 1), 20, 80, 2, training, greedy)
    result = run_sweep(sweep, tmp_path)
    trained = train(paper(), CONFIGS[:2], (0, 1), 20, 80, evaporation=training)
    rollouts = evaluate(paper(), trained.q_values, 2, (0, 1), 80, evaporation=greedy)
    for name in NAMES:
        assert np.array_equal(getattr(result, name), getattr(trained, name))
        assert np.array_equal(getattr(result, f"greedy_{name}"), getattr(rollouts, name))


def test_a_sweep_goes_on_from_any_blocks(sweep, tmp_path, monkeypatch):
    first = run_sweep(sweep, tmp_path)
    files = sorted(tmp_path.iterdir())
    stamps = {file: file.stat().st_mtime_ns for file in files}
    calls = []
    real = sweeps._do_block
    monkeypatch.setattr(
        sweeps, "_do_block", lambda *arguments: calls.append(arguments) or real(*arguments)
    )
    assert same(run_sweep(sweep, tmp_path), first)
    assert calls == []
    for file in files[::2]:
        file.unlink()
    again = run_sweep(sweep, tmp_path)
    assert same(again, first)
    assert len(calls) == len(files[::2])
    for file in files[1::2]:
        assert file.stat().st_mtime_ns == stamps[file]


DAMAGES = {
    "empty": lambda path: path.write_bytes(b""),
    "cut off": lambda path: path.write_bytes(path.read_bytes()[:-40]),
    "no archive": lambda path: path.write_text("block"),
    "without a table": lambda path: rewrite(path, "q_values", None),
    "fewer seeds": lambda path: rewrite(path, "returns", np.zeros((1, 0, 6), int)),
    "fewer rollouts": lambda path: rewrite(path, "greedy_steps", np.zeros((1, 2, 2), int)),
    "smaller tables": lambda path: rewrite(path, "q_values", np.zeros((1, 2, 64, 5))),
    "other actions": lambda path: rewrite(path, "q_values", 1 + files.read_npz(path)["q_values"]),
    "of other seeds": lambda path: path.write_bytes(sorted(path.parent.iterdir())[1].read_bytes()),
    "no cost": lambda path: rewrite(path, "cost", np.zeros(3)),
}


def rewrite(path, name, array):
    arrays = {**files.read_npz(path), name: array}
    files.write_npz(path, {key: value for key, value in arrays.items() if value is not None})


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_blocks_are_done_again(damage, sweep, tmp_path):
    first = run_sweep(sweep, tmp_path)
    path = sorted(tmp_path.iterdir())[2]
    size, said = path.stat().st_size, []
    DAMAGES[damage](path)
    assert same(run_sweep(sweep, tmp_path, notice=said.append), first)
    assert path.stat().st_size == size
    assert said == [f"{str(path)!r} is damaged, so this part is done again."]


def test_an_interruption_loses_one_block_at_most(sweep, tmp_path):
    def stop(share):
        if share > 0.4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_sweep(sweep, tmp_path, progress=stop)
    total = len(list(sweep.blocks()))
    assert 1 <= len(list(tmp_path.iterdir())) < total
    other = tmp_path / "other"
    other.mkdir()
    assert same(run_sweep(sweep, tmp_path), run_sweep(sweep, other))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"world": None}, "world is None"),
        ({"world": World((2, 1, 1), (0, 0, 0), foods=[(1, 0, 0)])}, "this world has room for 0"),
        ({"configs": ()}, "configs is empty"),
        ({"configs": (TrainingConfig("td_zero", 0.1, 0.9, 0.3, 0.99),)}, "'td_zero'"),
        ({"seeds": ()}, "seeds is empty"),
        ({"seeds": (1, 1)}, "seeds holds 1 more than once"),
        ({"episodes": 0}, "episodes is 0"),
        ({"max_steps": 10**8}, "max_steps is 100000000"),
        ({"rollouts": 0}, "rollouts is 0"),
        ({"train_evaporation": "off"}, "train_evaporation is 'off'"),
        ({"greedy_evaporation": 1}, "greedy_evaporation is 1"),
        ({"episodes": 2 * 10**9, "seeds": tuple(range(1000))}, "5000 runs of 2000000000 episodes"),
    ],
)
def test_bad_sweeps(change, says):
    arguments = {"world": paper(), "configs": CONFIGS, "seeds": (0,), **change}
    with pytest.raises(AntsError) as caught:
        Sweep(**arguments)
    assert says in str(caught.value)


def test_memory_bounds_a_sweep(monkeypatch):
    monkeypatch.setattr(sweeps, "available_memory", lambda: 1e6)
    Sweep(paper(), CONFIGS, (0,), 500)
    with pytest.raises(AntsError, match=r"100 runs of 500 episodes need about 0 GB .* has 0 GB"):
        Sweep(paper(), CONFIGS, tuple(range(20)), 500)


def test_settings_tell_all_that_determines_results(sweep):
    settings = sweep_settings(sweep)
    others = {
        "world": World((3, 3, 3), (0, 0, 0), foods=[(2, 0, 0)]),
        **{"configs": CONFIGS[:2], "seeds": (1,), "episodes": 7, "max_steps": 81, "rollouts": 4},
        **{"train_evaporation": True, "greedy_evaporation": False},
    }
    for name, value in others.items():
        assert sweep_settings(replace(sweep, **{name: value})) != settings, name
    assert sweep_settings(replace(sweep)) == settings


def test_any_difference_of_worlds_is_told():
    base = {
        **{"ranges": (5, 5, 5), "queen": (0, 0, 0), "foods": [(2, 0, 0)], "obstacles": [(0, 2, 0)]},
        **{"trails": [((1, 0, 0), 5)], "ants": [((0, 0, 1), 2)]},
    }
    changes = {
        **{"ranges": (5, 5, 6), "queen": (0, 0, 2), "foods": [(3, 0, 0)], "obstacles": [(0, 3, 0)]},
        **{"trails": [((1, 0, 0), 6)], "ants": [((0, 0, 1), 3)]},
    }
    facts = [world_facts(World(**{**base, name: value})) for name, value in changes.items()]
    facts.append(world_facts(World(**base)))
    for one, other in itertools.combinations(facts, 2):
        assert one != other
    # A food here and an obstacle there is not the same as the other way round.
    swapped = {**base, "foods": base["obstacles"], "obstacles": base["foods"]}
    assert world_facts(World(**swapped)) != facts[-1]


def test_provenance(tmp_path):
    facts = provenance(["compare.py", "--out", "a b"])
    assert facts["command"] == "compare.py --out 'a b'"
    assert facts["packages"]["taichi"] == "1.7.4"
    assert facts["commit"] == commit()
    (tmp_path / "x").write_bytes(b"abc")
    assert files.file_hash(tmp_path / "x").startswith("ba7816bf8f01cfea414140de5dae2223")
