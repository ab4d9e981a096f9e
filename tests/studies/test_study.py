"""Studies: wanted minus present, in blocks of any size, by stages, in shards."""

import itertools
from dataclasses import fields, make_dataclass, replace

import numpy as np
import pytest

from taichi_ants import AntsError, TrainingConfig, evaluate, train
from taichi_ants.protocol import At, Every
from taichi_ants.studies import points as kinds_of_points
from taichi_ants.studies.folder import provenance, source
from taichi_ants.studies.points import (
    ColonyPoint,
    Drawn,
    FixedPolicy,
    RunPoint,
    key_of,
    settings_of,
    world_facts,
)
from taichi_ants.studies.store import Store
from taichi_ants.studies.study import Study, run, share_of
from taichi_ants.task import Life, Rewards, Task
from taichi_ants.worlds import World, open_world, paper

TERMINATES, TRUNCATES = Task(), Task(delivery="truncates")
SARSA = TrainingConfig("sarsa", 0.1, 0.9, 0.3, 0.99)
LAMBDA = replace(SARSA, learner="sarsa_lambda")
DYNA = TrainingConfig("dyna_q", 0.1, 0.9, 0.3, 0.99, planning_steps=2)
KINDS = (
    (TERMINATES, SARSA),
    (TRUNCATES, DYNA),
    (TERMINATES, replace(SARSA, learning_rate=0.2)),
    (TERMINATES, replace(SARSA, learning_rate=0.3)),
    (TRUNCATES, replace(SARSA, learning_rate=0.4)),
)
POINTS = tuple(RunPoint(paper(), task, config, 6, 80, 3) for task, config in KINDS)
SEEDS = (4, 0, 9, 7, -2)
NAMES = ("returns", "steps", "deliveries")
OF_RUNS = (*NAMES, *(f"greedy_{name}" for name in NAMES), "q_values")
OF_COLONIES = ("deliveries", "first_delivery", "moves", "blocked", "returns")


def runs(points, seeds=SEEDS):
    return Study(points, seeds, OF_RUNS)


def colonies(points, seeds=(3, 5)):
    return Study(points, seeds, OF_COLONIES)


def outcomes_of(study, folder, **how):
    """The arrays of each point, after the study has run."""
    run(study, Store(folder), **how)
    return found_in(study, folder)


def found_in(study, folder, part=False):
    arrays = Store(folder).read(study.keys, study.seeds, study.arrays, part)
    return {p: {n: a[row] for n, a in arrays.items()} for row, p in enumerate(study.points)}


def same(one, other):
    """Whether two studies gave the same."""
    return one.keys() == other.keys() and all(
        set(one[point]) == set(other[point])
        and all(np.array_equal(one[point][name], other[point][name]) for name in one[point])
        for point in one
    )


def files_in(folder):
    return sorted((folder / "blocks").glob("*.npz"))


@pytest.fixture(params=[2, 11], ids=["blocks of some seeds", "blocks of some points"])
def study(request, monkeypatch):
    """Five points and five seeds, in blocks of so many runs at most."""
    monkeypatch.setattr(RunPoint, "runs_of_a_block", request.param)
    return runs(POINTS)


def test_blocks_cover_all_runs_once_with_one_task_and_learner_each(study):
    done, limit = [], RunPoint.runs_of_a_block
    for some, at in study.blocks(np.ones((5, 5), bool)):
        points, seeds = [POINTS[p] for p in some], [SEEDS[s] for s in at]
        assert len(points) * len(seeds) <= limit
        assert len({(p.task, p.training.learner) for p in points}) == 1
        done += itertools.product(points, seeds)
    assert sorted(done, key=str) == sorted(itertools.product(POINTS, SEEDS), key=str)


def test_blocks_are_cut_evenly_and_limited_in_runs():
    short = replace(POINTS[0], episodes=1, max_steps=1, rollouts=1)
    sizes = [len(at) for _, at in runs((short,), range(9000)).blocks(np.ones((1, 9000), bool))]
    assert sizes == [4500, 4500]
    long = replace(POINTS[0], episodes=10**6, max_steps=10**7)
    blocks = runs((long,), (0, 1)).blocks(np.ones((1, 2), bool))
    assert [len(at) for _, at in blocks] == [1, 1]
    usual = RunPoint(paper(), Task(), SARSA)
    assert usual.runs_of_a_block == pytest.approx(833)


def test_a_study_of_runs_is_training_and_evaluation(study, tmp_path):
    shares = []
    outcomes = outcomes_of(study, tmp_path, progress=shares.append)
    for point in POINTS:
        trained = train(paper(), point.training, SEEDS, 6, 80, point.task)
        greedy = evaluate(paper(), trained.q_values, 3, SEEDS, 80, point.task)
        for name in NAMES:
            assert np.array_equal(outcomes[point][name], getattr(trained, name)[0])
            assert np.array_equal(outcomes[point][f"greedy_{name}"], getattr(greedy, name)[0])
        assert np.array_equal(outcomes[point]["q_values"], trained.q_values[0])
    assert shares[0] == 0
    assert shares[-1] == pytest.approx(1)
    assert all(earlier <= later + 1e-9 for earlier, later in itertools.pairwise(shares))
    assert len(list(study.blocks(np.ones((5, 5), bool)))) == len(files_in(tmp_path))


def test_the_key_of_a_point_holds_the_physics_number(monkeypatch):
    """Results of other physics must not mix; a version alone does not change results."""
    key = key_of(POINTS[0])
    monkeypatch.setattr("taichi_ants.__version__", "9.9")
    assert key_of(POINTS[0]) == key
    assert key_of(POINTS[0], "plugin") != key
    monkeypatch.setattr(kinds_of_points, "PHYSICS", kinds_of_points.PHYSICS + 1)
    assert key_of(POINTS[0]) != key


LIVELY = Task(delivery="truncates", evaporation_in_training=True, life=Life(regrowth=0))
WORLDS = tuple(open_world(seed, (12, 12, 12)) for seed in (3, 5))
DRAWN = Drawn.by("open", ranges=(12, 12, 12))
ALONE = ColonyPoint(DRAWN, LIVELY, SARSA, episodes=2, ticks=60, rollouts=2)


@pytest.mark.parametrize("shards", [1, 2, 3, 7, 30])
def test_shards_have_equal_work_and_keep_points_with_their_tables(shards):
    one = replace(ALONE, world=WORLDS[0])
    large = replace(one, ants=9)
    study = colonies((large, replace(one, ants=4, episodes=0, after=one), one), (3, 5, 8, 1, 0))
    shares = [share_of(study.seconds, study.families, n + 1, shards) for n in range(shards)]
    assert (sum(share.astype(int) for share in shares) == 1).all()
    for share in shares:
        assert (share[1] == share[2]).all()
    works = [study.seconds[share].sum() for share in shares]
    assert max(works) - min(works) <= 2 * study.seconds[0, 0]
    if shards == 30:
        assert sum(share.any() for share in shares) == 2 * 5


COPIES = replace(ALONE, ants=4, episodes=0, after=ALONE)


def only_deliveries(points, seeds, outcome):
    return {"total": outcome["deliveries"].sum(axis=2)}


def test_tables_that_were_not_kept_are_learned_again_for_the_points_that_need_them(tmp_path):
    few = Study((ALONE,), (3, 5), ("total",), only_deliveries)
    assert outcomes_of(few, tmp_path)[ALONE].keys() == {"total"}
    grown = Study((COPIES, ALONE), (3, 5), ("total",), only_deliveries)
    expected = outcomes_of(grown, tmp_path / "other")
    assert same(outcomes_of(grown, tmp_path), expected)
    with np.load(files_in(tmp_path)[0]) as file:
        assert {"total", "about"} <= set(file.files) <= {"total", "q_values", "about"}


def test_a_block_of_colonies_is_limited_in_memory(monkeypatch):
    """To a quarter of a gigabyte, but it has one seed at least."""
    monkeypatch.setattr(kinds_of_points, "_SECONDS_OF_A_BLOCK", 1e12)
    many = replace(ALONE, world=WORLDS[0], ants=10_000, start="spread")
    assert 100 < many.runs_of_a_block < 1000
    tables = replace(many, sharing="independent")
    assert 1 <= tables.runs_of_a_block < many.runs_of_a_block / 10
    assert replace(many, ants=16_000_000, capacity=16_000_000).runs_of_a_block == 1


@pytest.mark.parametrize("kind", ["runs", "colonies"])
def test_a_study_resumes_from_any_blocks(kind, study, tmp_path, monkeypatch):
    if kind == "colonies":
        study = colonies(
            (replace(ALONE, ants=3, after=ALONE), replace(ALONE, ants=2), ALONE, ALONE)
        )
        assert len(study.points) == 3  # each once
    first, calls = outcomes_of(study, tmp_path), []
    blocks = files_in(tmp_path)
    stamps = {file: file.stat().st_mtime_ns for file in blocks}
    owner = type(study.points[0])
    real = owner.compute
    do = staticmethod(lambda *given: calls.append(given) or real(*given))
    monkeypatch.setattr(owner, "compute", do)
    assert same(outcomes_of(study, tmp_path), first)
    assert calls == []
    for file in blocks[::2]:
        file.unlink()
    assert same(outcomes_of(study, tmp_path), first)
    assert len(calls) >= len(blocks[::2])
    for file in blocks[1::2]:
        assert file.stat().st_mtime_ns == stamps[file]


def flip_a_bit(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def shift_an_array(path):
    """One bit of the length of a header, so that its array begins elsewhere."""
    content = bytearray(path.read_bytes())
    content[content.index(b"NUMPY") + 7] ^= 16
    path.write_bytes(content)


def test_an_array_that_runs_do_not_have_is_named(tmp_path):
    with pytest.raises(
        AntsError, match=r"seeds 4 to -2 \(runs have no 'return'; choose others of r"
    ):
        run(Study(POINTS[:1], SEEDS, ("return",)), Store(tmp_path))


DAMAGES = {
    "another header": shift_an_array,
    "empty": lambda path: path.write_bytes(b""),
    "one bit": flip_a_bit,
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_blocks_are_set_aside_and_done_again(damage, study, tmp_path):
    """When they are listed or, if an array is damaged, when they are read."""
    first = outcomes_of(study, tmp_path)
    path = files_in(tmp_path)[2]
    DAMAGES[damage](path)
    run(study, store := Store(tmp_path))
    if not store.damaged:
        with pytest.raises(AntsError, match=f"^'{path}' is damaged, so its runs are missing"):
            store.read(study.keys, study.seeds, study.arrays)
        run(study, store)
    assert store.damaged == [path]
    assert same(found_in(study, tmp_path), first)
    assert path.with_suffix(".damaged").exists()


def test_a_block_that_lacks_an_array_is_done_again_at_once(study, tmp_path):
    first, path = outcomes_of(study, tmp_path), files_in(tmp_path)[2]
    with np.load(path) as file:
        arrays = dict(file)
    arrays.popitem()
    np.savez(path, **arrays)
    run(study, store := Store(tmp_path))
    assert store.damaged == [path]
    assert same(found_in(study, tmp_path), first)


def test_runs_that_are_missing_are_read_as_nan_or_0(tmp_path):
    store = Store(tmp_path)
    store.add(["a"], [1], {"share": np.ones((1, 1)), "number": np.ones((1, 1), int)})
    found = store.read(["a"], [1, 2], ["share", "number"], part=True)
    assert np.array_equal(found["share"], [[1, np.nan]], equal_nan=True)
    assert found["number"].tolist() == [[1, 0]]


@pytest.mark.parametrize(
    ("point", "change", "says"),
    [
        (POINTS[0], {"training": TrainingConfig("td_zero", 0.1, 0.9, 0.3, 0.99)}, "'td_zero'"),
        (POINTS[0], {"rollouts": 0}, "rollouts is 0"),
        (ALONE, {"sharing": "frozen"}, "sharing is 'frozen'"),
        (ALONE, {"episodes": 0}, "episodes is 0"),
        (ALONE, {"after": replace(ALONE, sharing="independent")}, "no shared table"),
        (ALONE, {"training": LAMBDA}, "'sarsa_lambda' has no TD error that can be summed"),
    ],
)
def test_bad_points_are_named(point, change, says):
    with pytest.raises(AntsError) as caught:
        replace(point, **change)
    assert says in str(caught.value)


@pytest.mark.parametrize(
    ("points", "seeds", "says"),
    [
        ((), (0,), "`points` is empty"),
        (POINTS, (), "seeds is empty"),
        (POINTS, (1, 1), "seeds contains 1 more than once"),
        ((replace(POINTS[0], world=None),), (0,), "world is None"),
        ((replace(POINTS[0], world=World((2, 1, 1), (0, 0, 0), [(1, 0, 0)])),), (0,), "room for 0"),
        ((replace(POINTS[0], world=World((3, 3, 3), (0, 0, 0))),), (0,), "the world has no food"),
        ((replace(ALONE, ants=4000),), (3, 5), "the number of ants is 4000"),
    ],
)
def test_bad_studies_are_refused_before_any_work(points, seeds, says):
    with pytest.raises(AntsError) as caught:
        Study(tuple(points), tuple(seeds), ("returns",))
    assert says in str(caught.value)


def test_all_that_determines_results_changes_the_key():
    changes = {
        "world": World((3, 3, 3), (0, 0, 0), foods=[(2, 0, 0)]),
        "task": Task(rewards=Rewards(deliver=11)),
        "training": replace(SARSA, min_epsilon=0.02),
        **{"episodes": 7, "max_steps": 81, "rollouts": 4},
    }
    several = [POINTS[0], *(replace(POINTS[0], **{n: one}) for n, one in changes.items())]
    joint = replace(ALONE, ants=4, after=ALONE)
    changes = {"after": None, "start": "spread", "ticks": 61, "sharing": "independent"}
    changes |= {"world": Drawn.by("open", 1, ranges=(12, 12, 12)), "pool": WORLDS}
    several += [joint, *(replace(joint, **{name: one}) for name, one in changes.items())]
    assert len({*map(key_of, several)}) == len(several)
    assert key_of(replace(POINTS[0])) == key_of(POINTS[0])


MODEL = Task(life=Life(births=True)).replace(
    traffic="following", noise={"slip": 0.1}, fields={"home": {"level": 9}}
)
GOLDEN = {
    "runs": POINTS[0],
    "planning": POINTS[1],
    "shaped": replace(POINTS[0], task=Task(rewards=Rewards(shaping=0))),
    "long": RunPoint(paper(), TRUNCATES, SARSA, 500, 600),
    "followed": RunPoint(
        *(paper(), Task(), TrainingConfig.frozen(), 0),
        policy=FixedPolicy.named("trail_follower", Task()),
    ),
    "drawn": ALONE,
    "copies": COPIES,
    "pool": replace(ALONE, pool=WORLDS, sharing="independent"),
    "model": ColonyPoint(WORLDS[0], MODEL, SARSA, ants=9, capacity=40),
    "protocol": replace(
        ALONE,
        protocol=[At(20, trail=0), Every(15, add_ants=1)],
        measures=("entropy",),
        measure_every=20,
        capacity=12,
    ),
}
KEYS = {
    "runs": "f315cfc3ba7dbdaed71ef3dfd98375ad",
    "planning": "dbec7bcf00150ca36b0062f712f5c625",
    "shaped": "7db33c8a94ebdb58222af8eeed93c317",
    "long": "e2ab7a3ee979b55992e96fe628b696c0",
    "followed": "2f0fbce38ede204d81c7387acc7dfe42",
    "drawn": "c01e1a3a2d6e90b12d4a29f9a27b8b2c",
    "copies": "7294b20c6e665c15c86b96b266a30b29",
    "pool": "60b1fc0f3c9846ff46d786de74631b50",
    "model": "28ad4587b098e26341d6fff7a71a2551",
    "protocol": "a0ab1efc8cf6f7c041192fab1b4deea4",
}


@pytest.mark.parametrize("name", GOLDEN)
def test_keys_are_what_they_were(name):
    """They change with the physics number only, not if a setting with a neutral default is new."""
    point = GOLDEN[name]
    assert key_of(point) == KEYS[name]
    grown = make_dataclass("Grown", [("later", int, 0)], bases=(type(point),), frozen=True)
    own = {one.name: getattr(point, one.name) for one in fields(point)}
    assert key_of(grown(**own)) == KEYS[name]
    assert key_of(grown(**own, later=1)) != KEYS[name]


def test_equal_numbers_of_other_types_have_equal_keys():
    """As in extended sweeps, whose files write 50 or 50.0, or digits that a float lacks."""
    for one, other in ((5, 5.0), (0.1, 0.1000000000000000055)):
        keys = {
            key_of(replace(POINTS[0], task=Task(rewards=Rewards(deliver=5)), training=training))
            for training in (replace(SARSA, initial_q=one), replace(SARSA, initial_q=other))
        }
        assert len(keys) == 1
    recipes = (Drawn.by("open", ranges=(12, 12, 12), rock_share=share) for share in (0, 0.0))
    assert len({*recipes}) == 1


def test_settings_say_once_what_all_points_have_in_common():
    settings = settings_of(POINTS, SEEDS)
    assert settings["task.delivery"] == [task.delivery for task, _ in KINDS]
    assert settings["task.rewards.deliver"] == 10
    assert settings["training.hyperparameters.planning_steps"] == [None, 2, None, None, None]
    assert settings["worlds"] == [world_facts(paper())]
    assert settings["world"] == 0


def test_provenance():
    facts = provenance(["experiments/compare.py", "--out", "a b"])
    assert facts["command"] == "experiments/compare.py --out 'a b'"
    for program in ("/home/me/bin/taichi-ants", "/home/me/taichi_ants/__main__.py"):
        assert provenance([program, "sweep"])["command"] == "taichi-ants sweep"
    assert facts["packages"]["taichi"] == "1.7.4"
    assert {"kiwisolver", "mdurl"} <= facts["packages"].keys()  # which Matplotlib and Rich need
    assert "pip" not in facts["packages"]
    assert {name: facts[name] for name in ("commit", "clean")} == source()
