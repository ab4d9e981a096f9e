"""What training and evaluation refuse, each with the value named, and what they accept."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_ants import (
    AntsError,
    Colony,
    Task,
    TrainingConfig,
    continue_training,
    evaluate,
    rollout,
    trace_training,
    train,
    worlds,
)
from taichi_ants.arguments import checked_seeds, checked_seeds_for
from taichi_ants.engines.runs.engine import pieces, size_of_launch
from taichi_ants.errors import checked_whole, shown
from taichi_ants.rendering import Scene
from taichi_ants.worlds import World, paper

CONFIG = TrainingConfig("q_learning", 0.1, 0.9, 0.3, 0.99)
PLANS = TrainingConfig("dyna_q", 0.1, 0.9, 0.3, 0.99, planning_steps=2)
TABLE = np.zeros((128, 5))
NO_ROOM = World((2, 1, 1), queen=(0, 0, 0), foods=[(1, 0, 0)])


def says(text, function, *arguments, **options):
    with pytest.raises(AntsError) as caught:
        function(*arguments, **options)
    assert text in str(caught.value)
    assert str(caught.value).endswith(".")
    assert "\n" not in str(caught.value)


def with_more(learner, **more):
    return TrainingConfig(learner, 0.1, 0.9, 0.3, 0.99, **more)


@pytest.mark.parametrize(
    ("configs", "text"),
    [
        ([], "configs is []"),
        (None, "configs is None"),
        (3, "configs is 3"),
        ("q_learning", "configs is 'q_learning'"),
        ([CONFIG, None], "the configuration is None"),
        (TrainingConfig("td_zero", 0.1, 0.9, 0.3, 0.99), "there is no learner 'td_zero'"),
        (
            with_more("dyna_q", planning_steps=0),
            "`training.planning_steps` is 0; it must be between 1 and",
        ),
        (
            [CONFIG, with_more("sarsa", n=7)],
            "`training.n` is not a setting of sarsa",
        ),
        (
            with_more("sarsa_lambda", trace_decay=1.5),
            "`training.trace_decay` is 1.5; it must be between 0 and 1",
        ),
    ],
)
def test_configurations(configs, text):
    says(text, train, paper(), configs, 0, 1, 1)


BAD_SEEDS = [
    ([], "seeds is empty"),
    (np.zeros(0, int), "seeds is empty"),
    (0.5, "a seed is 0.5"),
    ([0, 1.0], "a seed is 1.0"),
    (np.array([0.0]), "a seed is 0.0"),
    (True, "a seed is True"),
    (None, "a seed is None"),
    ("12", "a seed is '12'"),
    ([[0, 1]], "a seed is [0, 1]"),
    (2**64, f"seeds contains {2**64}; a seed must fit into 64 bits"),
    ([-(2**63) - 1], f"seeds contains {-(2**63) - 1}"),
    ([4, 5, 4], "seeds contains 4 more than once"),
    ([-1, 2**64 - 1], f"seeds contains {2**64 - 1} more than once; give seeds that differ"),
]


@pytest.mark.parametrize(("seeds", "text"), BAD_SEEDS)
def test_seeds(seeds, text):
    says(text, train, paper(), CONFIG, seeds, 1, 1)
    says(text, evaluate, paper(), np.zeros((3, 128, 5)), 1, seeds)


@pytest.mark.parametrize(
    ("seeds", "expected"),
    [
        (5, (5,)),
        (range(3), (0, 1, 2)),
        ((seed for seed in (2, 1)), (2, 1)),
        (np.array([3, 2], np.uint8), (3, 2)),
        (np.array(7), (7,)),
        ([-(2**63), 2**64 - 1], (-(2**63), 2**64 - 1)),
    ],
)
def test_seeds_that_are_fine(seeds, expected):
    checked = checked_seeds(seeds)
    assert checked == expected
    assert all(type(seed) is int for seed in checked)


def test_seeds_of_tables():
    assert checked_seeds_for(4, ()).tolist() == [4]
    assert checked_seeds_for(4, (2, 3)).tolist() == [4] * 6
    assert checked_seeds_for([1, 2, 3], (2, 3)).tolist() == [1, 2, 3, 1, 2, 3]
    for shape, words in {
        (): "one table; give 1 seed.",
        (2,): "2 tables; give 1 seed or 2 seeds.",
        (3, 2): "3 x 2 tables; give 1 seed or 2 seeds.",
    }.items():
        says(f"there are 3 seeds for {words}", checked_seeds_for, [1, 2, 3], shape)


NO_COUNTS = [(0, "0"), (-1, "-1"), (1.0, "1.0"), ("1", "'1'"), (None, "None"), (True, "True")]


@pytest.mark.parametrize(("value", "shown"), [*NO_COUNTS, (2**31, str(2**31))])
def test_counts(value, shown):
    text = f"episodes is {shown}; it must"
    says(text, train, paper(), CONFIG, 0, value, 1)
    says(text, continue_training, train(paper(), CONFIG, 0, 1, 1), value)
    says(text, trace_training, paper(), CONFIG, 0, value, 1)
    says(f"rollouts is {shown}; it must", evaluate, paper(), TABLE, value)


@pytest.mark.parametrize(("value", "shown"), [*NO_COUNTS, (10_000_001, "10000001")])
def test_step_limits(value, shown):
    text = f"max_steps is {shown}; it must"
    says(text, train, paper(), CONFIG, 0, 1, value)
    says(text, evaluate, paper(), TABLE, 1, 0, value)
    says(text, rollout, paper(), TABLE, 0, 0, value)
    says(text, trace_training, paper(), CONFIG, 0, 1, value)


@pytest.mark.parametrize(("value", "shown"), [*NO_COUNTS[1:], (2**31, str(2**31))])
def test_numbers_of_rollouts(value, shown):
    says(f"number is {shown}; it must", rollout, paper(), TABLE, 0, value)


def test_counts_of_any_kind_of_integer():
    assert checked_whole("n", np.int64(3)) == 3
    assert type(checked_whole("n", np.uint8(3))) is int
    assert checked_whole("n", 0, least=0) == 0


@pytest.mark.parametrize("value", ["none", "off", 0, 1, None, 0.5, [True]])
def test_flags(value):
    """Text such as "none" would count as True."""
    text = f"is {value!r}; it must be True or False"
    says(f"ends_at_delivery {text}", Colony, paper(), None, CONFIG, ends_at_delivery=value)
    says(f"overlay is {value!r}", Scene, paper().grid, overlay=value)


@pytest.mark.parametrize("task", ["paper", 3, Task])
def test_tasks(task):
    for function in (train, trace_training):
        says(f"task is {shown(task)}; it must be a Task", function, paper(), CONFIG, 0, 1, 1, task)


def test_tables_must_fit_the_observation():
    task = Task("five_cells")
    text = "q_values has shape (128, 5); for the observation 'five_cells' it must end in (2048, 5)"
    says(text, evaluate, paper(), TABLE, task=task)
    says(text, rollout, paper(), TABLE, task=task)


@pytest.mark.parametrize("value", [-0.1, 1.1, float("nan"), "0.5", None, True, [0.5], 10**400])
def test_epsilon(value):
    for function in (evaluate, rollout):
        says(f"epsilon is {shown(value)}", function, paper(), TABLE, epsilon=value)


@pytest.mark.parametrize(
    ("table", "text"),
    [
        (np.zeros((128, 4)), "q_values has shape (128, 4)"),
        (np.zeros((5, 128)), "q_values has shape (5, 128)"),
        (np.zeros(640), "q_values has shape (640,)"),
        (np.zeros((0, 128, 5)), "q_values has shape (0, 128, 5)"),
        (3.0, "q_values has shape ()"),
        (np.full((128, 5), np.nan), "q_values is nan for state 0"),
        (np.full((128, 5), np.inf), "q_values is inf for state 0"),
        (np.full((128, 5), 1e39), "q_values is inf for state 0"),
        (None, "q_values"),
        ("policy", "q_values is 'policy'; it must be an array of real numbers"),
        (np.zeros((128, 5), complex), "q_values is an array of shape (128, 5) and type complex"),
        ([[1, 2], [3]], "q_values is [[1, 2], [3]]; it must be an array of real"),
    ],
)
@pytest.mark.filterwarnings("ignore:overflow encountered in cast")
def test_tables(table, text):
    says(text, evaluate, paper(), table)
    says(text, rollout, paper(), table)


def test_one_table_for_a_rollout():
    several = np.stack([TABLE, TABLE])
    says("q_values has shape (2, 128, 5), which is 2 tables; give one", rollout, paper(), several)


@pytest.mark.parametrize("world", [None, "paper", ((2, 2, 2), (0, 0, 0))])
def test_worlds(world):
    text = f"world is {world!r}; it must be a World"
    says(text, train, world, CONFIG, 0, 1, 1)
    says(text, evaluate, world, TABLE)
    says(text, rollout, world, TABLE)
    says(text, trace_training, world, CONFIG)


def test_worlds_without_room():
    says("this world has room for 0", train, NO_ROOM, CONFIG, 0)
    says("this world has room for 0", evaluate, NO_ROOM, TABLE)
    says("this world has room for 0", rollout, NO_ROOM, TABLE)
    says("this world has room for 0", trace_training, NO_ROOM, CONFIG)


@pytest.mark.parametrize(
    ("threads", "text"),
    [
        *((0, "threads is 0"), (1025, "threads is 1025"), (1.5, "threads is 1.5")),
        *((True, "threads is True"), ("2", "threads is '2'")),
    ],
)
def test_threads(threads, text):
    says(text, train, paper(), CONFIG, 0, 1, 1, threads=threads)
    says(text, evaluate, paper(), TABLE, threads=threads)


@pytest.mark.parametrize("arch", ["gpu", "CPU", "", 3])
def test_architectures(arch):
    says(
        f"arch is {arch!r}; it must be one of cpu, cuda", train, paper(), CONFIG, 0, 1, 1, arch=arch
    )


def test_traces_have_a_limit():
    says("episodes * max_steps is 100200", trace_training, paper(), CONFIG, 0, 167, 600)
    says("episodes * max_steps is 1000001", rollout, paper(), TABLE, max_steps=1_000_001)


def test_arguments_are_left_as_they_are():
    tables = np.random.default_rng(0).normal(size=(2, 128, 5)).astype(np.float32)
    tables.setflags(write=False)
    before = tables.copy()
    evaluate(paper(), tables[:, :, ::-1], 2, [0, 1], 50)  # strided and read-only
    assert np.array_equal(tables, before)

    result = train(paper(), [CONFIG, PLANS], [0, 1], 3, 50)
    kept = {name: array.copy() for name, array in vars(result.state).items()}
    says("result is None; it must be a TrainingResult", continue_training, None, 2)
    longer = continue_training(result, 2)
    for name, array in kept.items():
        assert np.array_equal(getattr(result.state, name), array)
    assert result.episodes == 3
    assert longer.episodes == 5


def test_results_have_the_documented_forms():
    result = train(paper(), [CONFIG, PLANS], (3, 1, 2), 4, 20)
    for array in (result.returns, result.steps, result.deliveries):
        assert (array.shape, array.dtype) == ((2, 3, 4), np.int32)
    assert (result.q_values.shape, result.q_values.dtype) == ((2, 3, 128, 5), np.float32)
    assert (result.configs, result.seeds) == ((CONFIG, PLANS), (3, 1, 2))
    result.q_values[:] = 1  # a copy
    assert not (result.q_values == 1).all()
    assert result.seconds > 0

    for shape in ((), (3,), (2, 3)):
        outcome = evaluate(paper(), np.zeros((*shape, 128, 5)), 6, max_steps=20)
        for array in (outcome.returns, outcome.steps, outcome.deliveries):
            assert (array.shape, array.dtype) == ((*shape, 6), np.int32)


def test_progress_rises_to_one():
    shares = []
    train(paper(), [CONFIG, PLANS, CONFIG], range(4), 3, 20, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1)
    assert len(shares) >= 2
    shares.clear()
    evaluate(paper(), TABLE, 3, progress=shares.append)
    assert shares[-1] == pytest.approx(1)


def test_a_world_to_learn_in_has_food():
    bare = World((4, 4, 4), (0, 0, 0))
    text = "the world has no food, so ants cannot learn in it"
    says(text, train, bare, CONFIG, 0, 1, 1)
    says(text, trace_training, bare, CONFIG)
    assert evaluate(bare, TABLE, 2, max_steps=3).deliveries.sum() == 0
    assert len(rollout(bare, TABLE, max_steps=3)) == 3


@pytest.mark.parametrize(
    "value",
    [[0] * 10**6, "x" * 10**7, np.zeros(10**6), 10**5000],
    ids=["list", "text", "array", "number"],
)
def test_messages_stay_short_whatever_they_name(value):
    for function, arguments in (
        *((train, (value, CONFIG, 0, 1, 1)), (train, (paper(), [value], 0, 1, 1))),
        *((train, (paper(), CONFIG, [value], 1, 1)), (train, (paper(), CONFIG, 0, value, 1))),
        *((evaluate, (paper(), TABLE, value)), (World, ((3, 3, 3), value))),
        *((worlds.build, (value,)), (worlds.register, (value, None)), (Task, (value,))),
        *((continue_training, (value, 1)), (Colony, (paper(), value, CONFIG))),
    ):
        with pytest.raises(AntsError) as caught:
            function(*arguments)
        assert len(str(caught.value)) < 300


@pytest.mark.parametrize("workers", [1, 2, 64, 4096])
@pytest.mark.parametrize("episodes", [1, 500, 10**6, 2**31 - 1])
@pytest.mark.parametrize("max_steps", [1, 600, 10**7])
@pytest.mark.parametrize("cells", [11, 500, 10**8])
def test_launches_are_short_and_can_be_indexed(workers, episodes, max_steps, cells):
    for cost, widest in ((1, 1024), (250, 10**7)):
        runs, each = size_of_launch(workers, episodes, max_steps, cost, cells, widest)
        assert runs >= 1
        assert 1 <= each <= episodes
        assert runs == 1 or runs * cells * 4 <= 2**28
        assert runs * widest < 2**31
        assert runs * each < 2**31
        # A second of a thread, if every episode has its greatest length, or one episode.
        steps = -(-runs // workers) * each * max_steps
        assert each == 1 or steps * 25 * cost <= 1.1e9


@pytest.mark.parametrize(("n_runs", "n_episodes"), [(1, 1), (7, 500), (8, 3), (20, 10)])
def test_launches_cover_all_work_once_and_episodes_in_order(n_runs, n_episodes):
    done = np.zeros((n_runs, n_episodes), int)
    for runs, episodes in pieces(n_runs, n_episodes, 3, 4):
        assert (done[runs, : episodes.start] == 1).all()
        done[runs, episodes] += 1
    assert (done == 1).all()
