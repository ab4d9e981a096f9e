"""What training and evaluation refuse, each with the value named, and what they accept."""

import numpy as np
import pytest
from refusals import refused

from taichi_ants import TrainingConfig, continue_training, evaluate, rollout, trace_training, train
from taichi_ants.engines.runs.engine import pieces, size_of_launch
from taichi_ants.worlds import paper

CONFIG = TrainingConfig("q_learning", 0.1, 0.9, 0.3, 0.99)
PLANS = TrainingConfig("dyna_q", 0.1, 0.9, 0.3, 0.99, planning_steps=2)
UNKNOWN = TrainingConfig("td_zero", 0.1, 0.9, 0.3, 0.99)
TABLES = np.zeros((3, 128, 5))


def of_seeds(seeds):
    return [
        lambda: train(paper(), CONFIG, seeds, 1, 1),
        lambda: evaluate(paper(), TABLES, 1, seeds),
    ]


def of_table(table):
    return [lambda: evaluate(paper(), table), lambda: rollout(paper(), table)]


def of_world(world):
    return [
        *(lambda: train(world, CONFIG, 0, 1, 1), lambda: trace_training(world, CONFIG)),
        *(lambda: evaluate(world, TABLES[0]), lambda: rollout(world, TABLES[0])),
    ]


@pytest.mark.parametrize(
    ("calls", "text"),
    [
        ([lambda: train(paper(), [], 0)], "configs is []"),
        ([lambda: train(paper(), [CONFIG, None], 0)], "the configuration is None"),
        ([lambda: train(paper(), UNKNOWN, 0)], "there is no learner 'td_zero'"),
        ([lambda: continue_training(None, 2)], "result is None; it must be a TrainingResult"),
        (of_seeds([]), "seeds is empty"),
        (of_seeds(0.5), "a seed is 0.5"),
        (of_seeds([[0, 1]]), "a seed is [0, 1]"),
        (of_seeds(2**64), f"a seed is {2**64}; it must lie between"),
        (of_seeds([4, 5, 4]), "seeds contains 4 more than once"),
        (of_table(np.zeros((128, 4))), "q_values has shape (128, 4)"),
        (of_table(np.zeros((0, 128, 5))), "q_values has shape (0, 128, 5)"),
        (of_table(np.full((128, 5), np.nan)), "q_values is nan for state 0"),
        (of_table("policy"), "q_values is 'policy'; it must be an array of real numbers"),
        (of_table([[1, 2], [3]]), "q_values is [[1, 2], [3]]; it must be an array of real"),
        (of_world(None), "world is None; it must be a World"),
        (of_world("paper"), "world is 'paper'; it must be a World"),
    ],
)
def test_what_is_refused(calls, text):
    for call in calls:
        refused(text, call)


def test_arguments_are_left_as_they_are():
    tables = np.random.default_rng(0).normal(size=(2, 128, 5)).astype(np.float32)
    tables.setflags(write=False)
    before = tables.copy()
    evaluate(paper(), tables[:, :, ::-1], 2, [0, 1], 50)  # strided and read-only
    assert np.array_equal(tables, before)

    result = train(paper(), [CONFIG, PLANS], [0, 1], 3, 50)
    kept = {name: array.copy() for name, array in vars(result.state).items()}
    longer = continue_training(result, 2)
    for name, array in kept.items():
        assert np.array_equal(getattr(result.state, name), array)
    assert result.episodes == 3
    assert longer.episodes == 5


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
