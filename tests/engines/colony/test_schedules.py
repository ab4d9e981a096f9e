"""What must not matter to a colony: schedule, threads, neighbours in a batch, order, a pause."""

import threading
import time
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from types import FunctionType, SimpleNamespace

import numpy as np
import pytest

from taichi_ants import Colony, TrainingConfig, worlds
from taichi_ants.engines.colony import barrier, layout, stepping
from taichi_ants.engines.colony.layout import Order
from taichi_ants.engines.colony.stepping import ThreadChoice
from taichi_ants.task import Field, Life, Pheromone, Task

LIVELY = Task(
    pheromone=Pheromone("exponential", half_life=20, diffusion=0.2, deposit="add"),
    fields={"home": Field(deposited_when="without_food", deposit="fading", diffusion=0.3)},
    homing_cue="home",
    evaporation_in_training=True,
    life=Life(births=True, lifespan=60, regrowth=2, pile_move_interval=9),
)
PLAIN = Task(), Task()
TRAINING = TrainingConfig("dyna_q", 0.2, 0.9, 0.4, 0.9, planning_steps=2)


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


def use_chunks(monkeypatch, n: int) -> None:
    """Let worlds have n chunks, for any number of threads."""
    monkeypatch.setattr(layout, "most_chunks", lambda *sizes: n)
    monkeypatch.setattr(stepping, "chunks_for", lambda *sizes: n)


def test_threads_and_schedules_give_the_same(monkeypatch):
    """Sixteen chunks of a world for two threads, so that their sums are joined."""
    use_chunks(monkeypatch, 16)
    monkeypatch.setattr(ThreadChoice, "plan", all_threads)
    expected = history(threads=1)
    # Another number of threads starts Taichi anew.
    for schedule in ("by_world", "by_chunk"):
        assert_same(expected, history(threads=2, schedule=schedule))


@pytest.mark.parametrize("seeds", [(3,), (3, 4, 5)])
def test_any_number_of_chunks_gives_the_same(seeds, monkeypatch):
    """Also odd ones: some ticks and a sort with each, by one thread and by two."""
    use_chunks(monkeypatch, 16)
    expected, colony, in_kernel, by_numpy = (
        Colony(meadow(), task, TRAINING, seeds, ants=30, schedule=schedule, threads=2)
        for task, schedule in ((LIVELY, "by_world"), *[(t, "by_chunk") for t in (LIVELY, *PLAIN)])
    )
    for one in (expected, colony, in_kernel, by_numpy):
        one.begin_episode()
    monkeypatch.setattr(stepping, "_SORT_SECONDS", np.inf)
    for chunks, parts in zip((1, 2, 3, 5, 8, 16), (2, 1) * 3, strict=True):
        use_chunks(monkeypatch, chunks)
        monkeypatch.setattr(ThreadChoice, "plan", lambda _, ticks, most, n=parts: (ticks, n))
        for one in (expected, colony, in_kernel, by_numpy):
            one.tick(9)
        assert_same({name: colony.arrays[name] for name in colony.stored}, expected.arrays)
        in_kernel._launch_parts("sort", 0, parts)
        by_numpy._sort_ants()
        assert in_kernel == by_numpy
    assert (in_kernel.numbers != np.arange(30)).any(axis=1).all()


class Cell:
    """A number of `barrier` in the test below."""

    value = 0


def run_barriers(parts: int, started: int, rounds: int, spins: int) -> list[list[int]]:
    """The barriers that each part has passed, of parts in Python threads, of which some start."""
    cells = defaultdict(Cell)
    c = SimpleNamespace(barrier=cells, orders={Order.SPINS: spins})
    begun, passed, lock = [0] * rounds, [[] for _ in range(started)], threading.Lock()

    def add(cell, n):
        time.sleep(0)  # lets another thread run
        with lock:
            cell.value += n
            return cell.value - n

    cast = SimpleNamespace(cast=lambda value, kind: int(value), i32=int, i64=int, min=min)
    cast.select, cast.atomic_add = lambda condition, a, b: a if condition else b, add

    def live(part):
        for number in range(rounds):
            with lock:
                begun[number] += 1
            if wait(c, part, parts, number) == 0:
                break
            assert begun[number] == parts
            passed[part].append(number)

    wait = FunctionType(barrier.wait_for_all.__wrapped__.__code__, {**vars(barrier), "ti": cast})
    with ThreadPoolExecutor(started) as pool:
        list(pool.map(live, range(started)))
    return passed


@pytest.mark.parametrize("parts", [2, 3, 5, 8, 9, 10, 17, 26])
def test_barriers_hold_any_number_of_parts(parts):
    """In Python threads, because few processors cannot run many kernels at once."""
    assert run_barriers(parts, parts, 6, 10**9) == [list(range(6))] * parts
    assert run_barriers(parts, parts - 1, 6, 50) == [[]] * (parts - 1)  # one does not come


@pytest.mark.parametrize("best", [1, 2, 8, 12])
def test_threads_are_chosen_by_short_trials(best):
    """Noise of up to 20 %, and a pace that is half a fifth lower at each neighbour."""
    choice, rng, passed, in_trials = ThreadChoice(), np.random.default_rng(best), 0.0, 0.0
    numbers = [1, 2, 4, 8, 12]
    while passed < 20:
        ticks, threads = choice.plan(100, 12)
        steps = abs(numbers.index(threads) - numbers.index(best))
        seconds = ticks * 2e-4 * 1.2**steps * rng.uniform(1, 1.2)
        in_trials += seconds * (threads != choice.numbers[choice.at])
        passed += seconds
        choice.note(ticks, seconds)
    assert in_trials <= 0.03 * passed + 0.02 * len(numbers)  # the first launches are extra
    assert choice.numbers[choice.at] == best


def test_pauses_of_threads_do_not_change_their_number():
    """One thread is slower than two, of which one launch in ten takes three times as long."""
    choice, rng, passed, ticks = ThreadChoice(), np.random.default_rng(1), {1: 0.0, 2: 0.0}, 0
    while sum(passed.values()) < 60:
        ticks, threads = choice.plan(16, 2)
        seconds = ticks * 0.03 / (threads + 1) * (3 if rng.random() < 0.1 else 1)
        passed[threads] += seconds
        choice.note(ticks, seconds)
    assert passed[1] < 0.1 * passed[2]


def test_fewer_threads_are_tried_early():
    """If other programs use the processors, threads wait for each other most of the time."""
    choice, passed, ticks = ThreadChoice(), 0.0, 0
    while choice.numbers[choice.at] > 1:
        ticks, threads = choice.plan(16, 2)
        passed += (seconds := ticks * (0.1, 0.4)[threads - 1])
        choice.note(ticks, seconds)
    assert passed < 10


@pytest.mark.parametrize("spins", [0, 20, 4000, 100_000])
def test_giving_up_at_any_barrier_gives_the_same(spins, monkeypatch):
    """With so little patience, threads give up here and there, and the rest follows on one."""
    monkeypatch.setattr(stepping, "_SPINS", spins)
    monkeypatch.setattr(ThreadChoice, "plan", all_threads)
    assert_same(history(threads=2), history(threads=2, schedule="by_chunk"))


def test_the_internal_order_of_the_ants_does_not_matter():
    """Ants that are stored in another order do the same, and the shared table is the same."""
    plain, shuffled = (Colony(meadow(), LIVELY, TRAINING, 1, ants=60, capacity=60) for _ in "ab")
    plain.begin_episode()
    shuffled.begin_episode()
    rng = np.random.default_rng(0)
    for _ in range(60):
        order = rng.permutation(60)
        for name in shuffled._columns():
            shuffled.arrays[name][:] = shuffled.arrays[name][order]
        plain.tick()
        shuffled.tick()
    back = np.argsort(shuffled.numbers[0])
    for name in plain._columns():
        assert np.array_equal(shuffled.arrays[name][back], plain.arrays[name]), name
    assert np.array_equal(shuffled.arrays["q"], plain.arrays["q"])
    assert np.array_equal(shuffled.arrays["ground"], plain.arrays["ground"])
    assert plain.outcome().blocked[0, 0] > 0
