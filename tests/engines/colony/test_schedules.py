"""What must not matter to a colony: schedule, threads, neighbours in a batch, order, a pause."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from taichi_ants import Colony, TrainingConfig, runtime, train, worlds
from taichi_ants.engines.colony import kernels, layout, stepping
from taichi_ants.engines.colony.layout import Order
from taichi_ants.engines.colony.stepping import ThreadChoice
from taichi_ants.task import Field, Life, Pheromone, Task

LIVELY = Task(
    pheromone=Pheromone("exponential", half_life=20, diffusion=0.2, deposit="add"),
    fields={
        "home": Field(deposited_when="without_food", deposit="fading"),
        "wide": Field(deposited_when="always", diffusion=0.3),
    },
    homing_cue="home",
    evaporation_in_training=True,
    life=Life(births=True, lifespan=60, regrowth=2, pile_move_interval=9),
)
TRAINING = TrainingConfig("dyna_q", 0.2, 0.9, 0.4, 0.9, planning_steps=2)
CALM = TrainingConfig("q_learning", 0.2, 0.9, 0.4, 0.9)


def all_threads(choice: ThreadChoice, ticks: int, most: int) -> tuple[int, int]:
    """A plan in which as many threads as there may be share all ticks."""
    return ticks, most


def meadow(seed: int = 5):
    return worlds.open_world(seed=seed, ranges=(9, 8, 7))


def history(seeds=(3, 4, 5), threads=2, schedule="by_world", world=None, **options):
    """All arrays after two episodes."""
    where = {"threads": threads, "schedule": schedule}
    ants = Colony(world or meadow(), LIVELY, TRAINING, seeds, ants=30, **where, **options)
    outcome = ants.run(2, 50)
    assert outcome.deliveries.sum() > 0
    assert outcome.blocked.sum() > 0
    return {name: ants.arrays[name] for name in ants.stored}


def assert_same(first: dict, second: dict) -> None:
    for name in first:
        assert np.array_equal(first[name], second[name]), name


def test_threads_and_schedules_give_the_same(monkeypatch):
    """Sixteen chunks of a world for two threads, so that their sums are joined."""
    monkeypatch.setattr(layout, "_CHUNKS_PER_THREAD", 8)
    monkeypatch.setattr(ThreadChoice, "plan", all_threads)
    expected = history(threads=1)
    # Another number of threads starts Taichi anew.
    for schedule in ("by_world", "by_chunk"):
        assert_same(expected, history(threads=2, schedule=schedule))


@pytest.mark.parametrize(("n_worlds", "threads"), [(1, 2), (2, 2), (7, 2), (20, 3), (256, 16)])
def test_threads_take_distant_worlds(n_worlds, threads, monkeypatch):
    """The counts of neighbours share cache lines, which slows threads down that write to them."""
    monkeypatch.setattr(runtime, "start", lambda: runtime.Runtime("cpu", threads))
    orders = []
    monkeypatch.setattr(stepping.Stepper, "launch", lambda *given: orders.append(given[1].orders()))
    state = SimpleNamespace(schedule="by_world", seeds=range(n_worlds), capacity=8, ticks=0)
    state.arrays = {"orders": np.zeros(len(Order), int), "barrier": np.zeros(24, int)}
    state.orders = lambda: state.arrays["orders"].tolist()
    stepping.Stepper().advance(state, 5)
    ((_, parts, lanes, *_),) = orders
    found = [kernels.world_of.__wrapped__(part, parts, lanes) for part in range(parts)]
    assert sorted(one for one in found if one < n_worlds) == list(range(n_worlds))
    assert lanes == min(threads, n_worlds)
    for first in range(0, parts, lanes):
        together = sorted(found[first : first + lanes])  # worlds that threads take at a time
        assert all(np.diff(together) == parts // lanes)
    assert parts - n_worlds < lanes


def test_threads_that_do_not_come_are_not_waited_for_without_end(monkeypatch):
    """Seven parts for two threads: the first two leave the barrier, the rest is done by one."""
    monkeypatch.setattr(layout, "_CHUNKS_PER_THREAD", 8)
    monkeypatch.setattr(stepping, "_SPINS", 1000)
    monkeypatch.setattr(ThreadChoice, "plan", lambda choice, ticks, most: (ticks, 7))
    given_up, options = 0, {"ants": 30, "threads": 2}
    expected = Colony(meadow(), LIVELY, TRAINING, 3, **options, schedule="by_world")
    colony = Colony(meadow(), LIVELY, TRAINING, 3, **options, schedule="by_chunk")
    for one in (expected, colony):
        one.begin_episode()
    for n in (1, 3, 20, 20):
        expected.tick(n)
        colony.tick(n)
        given_up += colony.arrays["orders"][Order.FIRST] > 0
        for name in expected.stored:
            assert np.array_equal(colony.arrays[name], expected.arrays[name]), name
    assert given_up == 4


@pytest.mark.parametrize("spins", [0, 20, 4000, 100_000])
def test_giving_up_at_any_barrier_gives_the_same(spins, monkeypatch):
    """With so little patience, threads give up here and there, and the rest follows on one."""
    monkeypatch.setattr(stepping, "_SPINS", spins)
    monkeypatch.setattr(ThreadChoice, "plan", all_threads)
    assert_same(history(threads=2), history(threads=2, schedule="by_chunk"))


def test_no_more_threads_wait_for_each_other_than_there_are(monkeypatch):
    monkeypatch.setattr(ThreadChoice, "plan", all_threads)
    ants = Colony(meadow(), None, CALM, 3, ants=30, threads=2, schedule="by_chunk")
    ants.begin_episode()
    for threads in (2, 8):  # somebody starts Taichi anew; eight are more than processors
        runtime.start(threads)
        ants.tick(3)
        assert ants.arrays["orders"][Order.PARTS] == min(threads, runtime.available_threads(), 4)
    monkeypatch.setattr(runtime, "available_threads", lambda: 1)
    ants.tick(3)
    assert ants.arrays["orders"][Order.PARTS] == 1


def test_who_is_faster_goes_on():
    """Other programs that use the processors delay threads that wait more than a single one."""
    choice, alone = ThreadChoice(), []
    paces = {4: 1.0, 1: 3.0}
    for launch in range(90):
        if launch == 40:  # the processors are busy from now on
            paces[4] = 7.0
        n, threads = choice.plan(80, 4)
        assert (n, threads) in ((80, 1), (10, 1), (80, 4), (10, 4))
        choice.took(threads, paces[threads])
        alone.append(n if threads == 1 else 0)
    assert 0 < sum(alone[:40]) < 0.02 * 80 * 40
    assert sum(alone[50:]) > 0.9 * 80 * 35
    assert ThreadChoice().plan(80, 1) == (80, 1)


def test_threads_share_a_single_world_from_fewer_ants_on():
    world = worlds.open_world(1, (35, 35, 35))
    for n, seeds, schedule in (
        (2047, 1, "by_world"),
        (2048, 1, "by_chunk"),
        (2048, (1, 2), "by_world"),
    ):
        assert Colony(world, None, TRAINING, seeds, ants=n).schedule == schedule


def test_a_colony_does_not_feel_its_neighbours():
    """A world of a batch is what it is alone, and worlds may differ."""
    batch = history(seeds=(3, 8), world=[meadow(5), meadow(6)])
    alone = history(seeds=(8,), world=meadow(6))
    for name in ("ground", "level", "q", "streams", "integers", "totals"):
        half = batch[name].shape[-1] // 2
        assert np.array_equal(batch[name][..., half:], alone[name]), name


def test_the_internal_order_of_the_ants_does_not_matter():
    """Ants that are stored in another order do the same, and the shared table is the same."""
    plain, shuffled = (Colony(meadow(), LIVELY, TRAINING, 1, ants=60, capacity=60) for _ in "ab")
    plain.begin_episode()
    shuffled.begin_episode()
    rng = np.random.default_rng(0)
    for _ in range(60):
        order = rng.permutation(60)
        for name in shuffled.columns():
            shuffled.arrays[name][:] = shuffled.arrays[name][order]
        plain.tick()
        shuffled.tick()
    back = np.argsort(shuffled.numbers[0])
    for name in plain.columns():
        assert np.array_equal(shuffled.arrays[name][back], plain.arrays[name]), name
    assert np.array_equal(shuffled.arrays["q"], plain.arrays["q"])
    assert np.array_equal(shuffled.arrays["ground"], plain.arrays["ground"])
    assert plain.outcome().blocked[0, 0] > 0


@pytest.mark.parametrize(
    ("learner", "sharing"),
    [
        ("dyna_q", "shared"),
        pytest.param("sarsa", "independent", marks=pytest.mark.slow),
        pytest.param("double_q", "independent", marks=pytest.mark.slow),
    ],
)
def test_one_ant_equals_the_engine_of_independent_runs(learner, sharing):
    more = {"planning_steps": 2} if learner == "dyna_q" else {}
    training = TrainingConfig(learner, 0.1, 0.9, 0.3, 0.95, hyperparameters=more)
    for delivery in ("terminates", "truncates"):
        assert_equal_runs(training, Task(delivery=delivery), sharing)


def assert_equal_runs(training: TrainingConfig, task: Task, sharing: str) -> None:
    seeds = (0, 7, -5)
    expected = train(worlds.paper(), training, seeds, episodes=12, max_steps=150, task=task)
    ants = Colony(worlds.paper(), task, training, seeds, ends_at_delivery=True, sharing=sharing)
    outcome = ants.run(12, 150)
    assert np.array_equal(outcome.returns.T, expected.returns[0])
    assert np.array_equal(outcome.ticks.T, expected.steps[0])
    assert np.array_equal(outcome.deliveries.T, expected.deliveries[0])
    assert outcome.deliveries.sum() > 10
    assert np.array_equal(ants.q_values.reshape(3, 128, 5), expected.q_values[0])
    assert np.array_equal(ants.arrays["first_streams"], expected.state.random_states[0])
