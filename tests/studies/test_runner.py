"""Studies in blocks: the same results in any order, from any state of the folder."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from taichi_ants import AntsError, Colony, TrainingConfig, evaluate, train
from taichi_ants.files import archives
from taichi_ants.studies import points as kinds_of_points
from taichi_ants.studies import runner
from taichi_ants.studies.points import EVALUATION_SEEDS, ColonyPoint, RunPoint, world_facts
from taichi_ants.studies.provenance import provenance, source
from taichi_ants.studies.runner import Study
from taichi_ants.task import Life, Pheromone, Rewards, Task
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


@pytest.fixture(params=[2, 11], ids=["blocks of some seeds", "blocks of some points"])
def study(request, monkeypatch):
    """Five points and five seeds, in blocks of so many runs at most."""
    monkeypatch.setattr(kinds_of_points, "_STEPS_OF_A_BLOCK", request.param * 6 * 80)
    return Study(POINTS, SEEDS)


def same(one, other):
    """Whether two studies gave the same, but for the time that it took."""
    return one.keys() == other.keys() and all(
        set(one[point]) == set(other[point])
        and all(
            np.array_equal(one[point][name], other[point][name])
            for name in one[point]
            if name != "seconds"
        )
        for point in one
    )


def test_blocks_cover_all_runs_once_with_one_task_and_learner_each(study):
    done = []
    limit = kinds_of_points._STEPS_OF_A_BLOCK // (6 * 80)
    for some, at in study.blocks():
        points, seeds = [POINTS[p] for p in some], [SEEDS[s] for s in at]
        assert len(points) * len(seeds) <= limit
        assert len({(p.task, p.training.learner) for p in points}) == 1
        done += itertools.product(points, seeds)
    assert sorted(done, key=str) == sorted(itertools.product(POINTS, SEEDS), key=str)
    assert len(list(study.blocks())) == {2: 5 * 3, 11: 4}[limit]


def test_blocks_are_limited_in_runs_too():
    short = replace(POINTS[0], episodes=1, max_steps=1, rollouts=1)
    study = Study((short,), tuple(range(9000)))
    assert max(len(at) for _, at in study.blocks()) <= 5000
    long = replace(POINTS[0], episodes=10**6, max_steps=10**7)
    assert {len(at) for _, at in Study((long,), (0, 1)).blocks()} == {1}


def test_a_study_of_runs_is_training_and_evaluation(study, tmp_path):
    shares = []
    outcomes = study.run(tmp_path, progress=shares.append)
    for point in POINTS:
        trained = train(paper(), point.training, SEEDS, 6, 80, point.task)
        greedy = evaluate(paper(), trained.q_values, 3, SEEDS, 80, point.task)
        for name in NAMES:
            assert np.array_equal(outcomes[point][name], getattr(trained, name)[0])
            assert np.array_equal(outcomes[point][f"greedy_{name}"], getattr(greedy, name)[0])
        assert np.array_equal(outcomes[point]["q_values"], trained.q_values[0])
        assert (outcomes[point]["seconds"] > 0).all()
    assert shares[0] == 0
    assert shares[-1] == pytest.approx(1)
    assert all(earlier <= later + 1e-9 for earlier, later in itertools.pairwise(shares))
    assert len(list(study.blocks())) == len(list(tmp_path.iterdir()))


@pytest.mark.parametrize(("training", "greedy"), [(True, True), (True, False), (False, False)])
def test_evaporation_is_a_setting_of_each(training, greedy, tmp_path):
    task = Task(evaporation_in_training=training, evaporation_in_evaluation=greedy)
    point = RunPoint(paper(), task, SARSA, 20, 80, 2)
    outcome = Study((point,), (0, 1)).run(tmp_path)[point]
    trained = train(paper(), SARSA, (0, 1), 20, 80, Task(evaporation_in_training=training))
    other = Task(evaporation_in_evaluation=greedy)
    rollouts = evaluate(paper(), trained.q_values, 2, (0, 1), 80, other)
    for name in NAMES:
        assert np.array_equal(outcome[name], getattr(trained, name)[0])
        assert np.array_equal(outcome[f"greedy_{name}"], getattr(rollouts, name)[0])


def test_the_key_of_a_point_holds_the_physics_number(monkeypatch):
    """Results of other physics must not mix; a version alone does not change results."""
    point = RunPoint(paper(), Task(), SARSA, 20, 80, 2)
    keys = Study((point,), (0,)).keys
    monkeypatch.setattr("taichi_ants.__version__", "9.9")
    assert Study((point,), (0,)).keys == keys
    monkeypatch.setattr(runner, "PHYSICS", runner.PHYSICS + 1)
    assert Study((point,), (0,)).keys != keys


LIVELY = Task(delivery="truncates", evaporation_in_training=True, life=Life(regrowth=0))
WORLDS = tuple(open_world(seed, (12, 12, 12)) for seed in (3, 5))
ALONE = ColonyPoint(WORLDS, LIVELY, SARSA, episodes=2, ticks=60, rollouts=2)


@pytest.mark.slow
def test_a_study_of_colonies_is_learning_and_evaluation(tmp_path):
    joint = replace(ALONE, ants=4, after=ALONE)
    own = replace(ALONE, ants=4, sharing="independent", start="spread")
    outcomes = Study((joint, own), (3, 5)).run(tmp_path)
    assert set(outcomes) == {ALONE, joint, own}
    first = Colony(WORLDS, LIVELY, SARSA, (3, 5))
    first.run(2, 60)
    assert np.array_equal(outcomes[ALONE]["q_values"], first.q_values)
    calm = replace(SARSA, epsilon=SARSA.min_epsilon, epsilon_decay=1.0)
    others = [seed + EVALUATION_SEEDS for seed in (3, 5)]
    for point, more in ((joint, {"q_values": first.q_values}), (own, {})):
        options = {"ants": 4, "start": point.start}
        learning = Colony(WORLDS, LIVELY, SARSA, (3, 5), **options, sharing=point.sharing, **more)
        learning.run(2, 60)
        table = learning.q_values
        colony = Colony(WORLDS, LIVELY, calm, others, **options, sharing="frozen", q_values=table)
        episodes = colony.run(2, 60)
        for name in ("deliveries", "first_delivery", "moves", "blocked", "returns"):
            assert np.array_equal(outcomes[point][name], getattr(episodes, name).T)
    assert "q_values" not in outcomes[own]  # a table for each ant is not kept


@pytest.mark.parametrize("shards", [1, 2, 3, 7, 30])
def test_shards_have_equal_work_and_keep_points_with_their_tables(shards):
    seeds = (3, 5, 8, 1, 0)
    one = replace(ALONE, world=WORLDS[0])
    large = replace(one, ants=9)
    study = Study((large, replace(one, ants=4, episodes=0, after=one)), seeds)
    shares = [study.share(number, shards) for number in range(1, shards + 1)]
    assert (sum(share.astype(int) for share in shares) == 1).all()
    place, after = (study.in_order.index(study.points[1]), study.in_order.index(one))
    for share in shares:
        assert (share[place] == share[after]).all()
    works = [study.weights[share].sum() for share in shares]
    heaviest = study.weights[study.in_order.index(large), 0]
    assert max(works) - min(works) <= 2 * heaviest
    if shards == 30:
        assert sum(share.any() for share in shares) == 2 * len(seeds)


def test_shards_fill_one_folder(tmp_path):
    study = Study((replace(ALONE, ants=4, episodes=0, after=ALONE), ALONE), (3, 5))
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    for number in (2, 1):
        assert study.run(tmp_path / "a", shard=(number, 2)) == {}
    blocks = set((tmp_path / "a").iterdir())
    assert same(study.run(tmp_path / "a"), study.run(tmp_path / "b"))
    assert set((tmp_path / "a").iterdir()) == blocks


def only_deliveries(points, seeds, outcome):
    return {"value_deliveries": outcome["deliveries"].sum(axis=2)}


def test_tables_that_were_not_saved_are_learned_again_for_the_points_that_need_them(tmp_path):
    copies = replace(ALONE, ants=4, episodes=0, after=ALONE)
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    few = Study((ALONE,), (3, 5)).reduced(tmp_path / "a", only_deliveries)
    grown = Study((copies, ALONE), (3, 5))
    ((_, saved),) = Study((ALONE,), (3, 5)).read(tmp_path / "a", (0,))
    assert saved.keys() == {"value_deliveries"}
    of_copies = np.array([[False, False], [True, True]])
    grown.complete(tmp_path / "a", of_copies, "deliveries")
    plain = grown.run(tmp_path / "b")
    ((_, found),) = grown.read(tmp_path / "a", [1], "deliveries")
    for name, array in plain[copies].items():
        assert np.array_equal(found[name], array)
    assert np.array_equal(few["deliveries"][0], plain[ALONE]["deliveries"].sum(axis=1))


def test_colonies_in_blocks_of_some_seeds_give_the_same(tmp_path, monkeypatch):
    """With worlds of their own, with one for all, from a pool, and going on from others."""
    seeds = (3, 5, 8, 1, 0)
    each = replace(ALONE, world=tuple(open_world(seed, (12, 12, 12)) for seed in seeds))
    one = replace(ALONE, world=WORLDS[0])
    points = (each, replace(each, ants=4, after=each), replace(one, ants=3, sharing="independent"))
    points += (replace(one, ants=4, episodes=0, after=one), replace(each, pool=WORLDS))
    study, found = Study(points, seeds), []
    for size in (kinds_of_points._NUMBERS_OF_A_BLOCK, 8_000):
        monkeypatch.setattr(kinds_of_points, "_NUMBERS_OF_A_BLOCK", size)
        blocks = [[at for some, at in study.blocks() if some[0] == p] for p in range(6)]
        folder = tmp_path / str(size)
        folder.mkdir()
        found.append(study.run(folder))
        assert len(list(folder.iterdir())) == sum(map(len, blocks))
    assert same(*found)
    assert [len(of_point) for of_point in blocks] == [3, 3, 5, 3, 3, 3]


def test_a_block_of_colonies_is_limited_in_memory(monkeypatch):
    """To a quarter of a gigabyte, but it has one seed at least."""
    monkeypatch.setattr(kinds_of_points, "_WORK_OF_A_BLOCK", 1e12)
    many = replace(ALONE, world=WORLDS[0], ants=10_000, start="spread")
    assert 100 < many.runs_of_a_block < 1000
    tables = replace(many, sharing="independent")
    assert 1 <= tables.runs_of_a_block < many.runs_of_a_block / 10
    assert replace(many, ants=16_000_000, capacity=16_000_000).runs_of_a_block == 1


@pytest.mark.parametrize("ants", [1, 16, 500, 10**6])
def test_a_block_of_colonies_is_limited_in_work(ants):
    """To that of 10^8 ticks of an ant, or to one seed."""
    diffuses = replace(LIVELY, pheromone=Pheromone("exponential", half_life=9, diffusion=0.1))
    for task in (LIVELY, diffuses):
        point = replace(ALONE, world=WORLDS[0], task=task, start="spread", episodes=50, ticks=1000)
        point = replace(point, ants=ants, capacity=10**6 + 1)
        assert point.weight >= ants * 52_000
        assert point.runs_of_a_block * point.weight <= 1e8 or point.runs_of_a_block == 1
    assert point.weight > 52_000 * (ants + 0.07 * WORLDS[0].grid.size)


def test_copies_follow_what_another_point_has_learned_and_train_nothing(tmp_path):
    copies = replace(ALONE, ants=4, episodes=0, after=ALONE)
    outcomes = Study((copies,), (3, 5)).run(tmp_path)
    calm = replace(SARSA, epsilon=SARSA.min_epsilon, epsilon_decay=1.0)
    others = [seed + EVALUATION_SEEDS for seed in (3, 5)]
    table = outcomes[ALONE]["q_values"]
    colony = Colony(WORLDS, LIVELY, calm, others, ants=4, sharing="frozen", q_values=table)
    assert np.array_equal(outcomes[copies]["moves"], colony.run(2, 60).moves.T)


def test_points_in_common_are_done_once(tmp_path):
    copies = replace(ALONE, ants=4, episodes=0, after=ALONE)
    study = Study((copies, ALONE, replace(ALONE, ants=1)), (3, 5))
    assert study.in_order == (ALONE, copies)
    study.run(tmp_path)
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize("kind", ["runs", "colonies"])
def test_a_study_goes_on_from_any_blocks(kind, study, tmp_path, monkeypatch):
    if kind == "colonies":
        points = (replace(ALONE, ants=3, after=ALONE), replace(ALONE, ants=2))
        study = Study(points, (3, 5))
    first = study.run(tmp_path)
    blocks = sorted(tmp_path.iterdir())
    stamps = {file: file.stat().st_mtime_ns for file in blocks}
    calls = []
    owner = type(study.points[0])
    real = owner.do
    do = staticmethod(lambda *given: calls.append(given) or real(*given))
    monkeypatch.setattr(owner, "do", do)
    assert same(study.run(tmp_path), first)
    assert calls == []
    for file in blocks[::2]:
        file.unlink()
    assert same(study.run(tmp_path), first)
    assert len(calls) == len(blocks[::2])
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


DAMAGES = {
    "another header": shift_an_array,
    "of other points": lambda path: path.write_bytes(min(path.parent.iterdir()).read_bytes()),
    "empty": lambda path: path.write_bytes(b""),
    "cut off": lambda path: path.write_bytes(path.read_bytes()[:-40]),
    "no archive": lambda path: path.write_text("block"),
    "one bit": flip_a_bit,
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_blocks_are_done_again(damage, study, tmp_path, capsys):
    first = study.run(tmp_path)
    path = sorted(tmp_path.iterdir())[2]
    DAMAGES[damage](path)
    assert same(study.run(tmp_path), first)
    (said,) = capsys.readouterr().err.splitlines()
    assert said.startswith(f"{str(path)!r} is damaged or has other settings")
    assert archives.read(path)["returns"].size


def test_an_interruption_loses_one_block_at_most(study, tmp_path):
    def stop(share):
        if share > 0.4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        study.run(tmp_path, progress=stop)
    assert 1 <= len(list(tmp_path.iterdir())) < len(list(study.blocks()))
    other = tmp_path / "other"
    other.mkdir()
    assert same(study.run(tmp_path), study.run(other))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"training": TrainingConfig("td_zero", 0.1, 0.9, 0.3, 0.99)}, "'td_zero'"),
        ({"training": None}, "configs is None"),
        ({"task": "paper"}, "task is 'paper'"),
        ({"episodes": 0}, "episodes is 0"),
        ({"max_steps": 10**8}, "max_steps is 100000000"),
        ({"rollouts": 0}, "rollouts is 0"),
    ],
)
def test_bad_points_of_runs_are_named(change, says):
    with pytest.raises(AntsError) as caught:
        replace(POINTS[0], **change)
    assert says in str(caught.value)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"ants": 0}, "ants is 0"),
        (
            {"capacity": 3, "ants": 9},
            "because 9 ants start",
        ),
        ({"start": "there"}, "start is 'there'"),
        ({"sharing": "frozen"}, "sharing is 'frozen'"),
        ({"episodes": 0}, "episodes is 0"),
        ({"ticks": 0}, "ticks is 0"),
        ({"rollouts": 0}, "rollouts is 0"),
        ({"after": replace(ALONE, sharing="independent")}, "no shared table"),
        ({"training": LAMBDA}, "'sarsa_lambda' has no TD error that can be summed"),
    ],
)
def test_bad_points_of_colonies_are_named(change, says):
    with pytest.raises(AntsError) as caught:
        replace(ALONE, **change)
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
        ((ALONE,), (1, 2, 3), "2 worlds for 3 seeds"),
        ((replace(ALONE, ants=4000),), (3, 5), "the number of ants is 4000"),
    ],
)
def test_bad_studies_are_refused_before_any_work(points, seeds, says):
    with pytest.raises(AntsError) as caught:
        Study(tuple(points), tuple(seeds))
    assert says in str(caught.value)


def test_settings_tell_all_that_determines_results():
    first = POINTS[0]
    settings = Study(POINTS, SEEDS).settings()
    others = {
        "world": World((3, 3, 3), (0, 0, 0), foods=[(2, 0, 0)]),
        "task": Task(rewards=Rewards(deliver=11)),
        "training": replace(SARSA, min_epsilon=0.02),
        **{"episodes": 7, "max_steps": 81, "rollouts": 4},
    }
    for name, value in others.items():
        changed = Study((replace(first, **{name: value}), *POINTS[1:]), SEEDS)
        assert changed.settings() != settings, name
    assert Study(POINTS, SEEDS[:-1]).settings() != settings
    assert Study(POINTS[:-1], SEEDS).settings() != settings
    assert Study(tuple(map(replace, POINTS)), SEEDS).settings() == settings
    joint = replace(ALONE, ants=4, after=ALONE)
    for name, value in {
        "after": None,
        "start": "spread",
        "ticks": 61,
        "sharing": "independent",
    }.items():
        changed = Study((ALONE, replace(joint, **{name: value})), (3, 5))
        assert changed.settings() != Study((ALONE, joint), (3, 5)).settings(), name


def test_settings_say_once_what_all_points_have_in_common():
    settings = Study(POINTS, SEEDS).settings()
    assert settings["task.delivery"] == [task.delivery for task, _ in KINDS]
    assert settings["task.rewards.deliver"] == 10
    assert settings["training.hyperparameters.planning_steps"] == [None, 2, None, None, None]
    assert settings["worlds"] == [world_facts(paper())]
    assert settings["world"] == 0


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


def test_provenance():
    facts = provenance(["experiments/compare.py", "--out", "a b"])
    assert facts["command"] == "experiments/compare.py --out 'a b'"
    for program in ("/home/me/bin/taichi-ants", "/home/me/taichi_ants/__main__.py"):
        assert provenance([program, "sweep"])["command"] == "taichi-ants sweep"
    assert facts["packages"]["taichi"] == "1.7.4"
    assert {"kiwisolver", "mdurl"} <= facts["packages"].keys()  # which Matplotlib and Rich need
    assert not {"pytest", "mypy", "pip"} & facts["packages"].keys()
    assert {name: facts[name] for name in ("commit", "clean")} == source()
