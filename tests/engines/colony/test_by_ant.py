"""The schedule of a GPU, in which each ant has a thread, on the CPU: equal results."""

import copy
import pickle
from ctypes.util import find_library

import drawing
import numpy as np
import pytest
import record
from interrupts import interrupted_after_launch

from taichi_ants import AntsError, Colony, TrainingConfig, runtime, task, worlds
from taichi_ants.engines import device_memory
from taichi_ants.engines.colony import layout, stepping
from taichi_ants.engines.colony.layout import BY_ANT, schedule_of

QUICK = "nests", "castes_fields"
LATER = "labour_fields", "n_step"  # the others take a minute
MARKED = [
    pytest.param(one, marks=[] if one in QUICK else getattr(pytest.mark, later))
    for one in drawing.GROUPS
    for later in ["slow" if one in LATER else "long"]
]
DYNA_Q = TrainingConfig("dyna_q", 0.2, 0.9, 0.3, 0.97, planning_steps=2)
SARSA = TrainingConfig("sarsa", 0.5, 0.9, 0.3, 0.97)
MOST_ARGUMENTS = 64  # of a launch on a GPU


@pytest.fixture(autouse=True)
def with_guards(monkeypatch):
    """Kernels have the guards of a GPU."""
    monkeypatch.setattr(runtime, "gpu_kernels_on_cpu", True)


def made(schedule: str = BY_ANT, ants: int = 8, learner: TrainingConfig = DYNA_Q) -> Colony:
    """Two worlds within an episode."""
    place = worlds.open_world(2, ranges=(8,) * 3 if ants < 100 else (30,) * 3)
    colony = Colony(place, task.foraging(), learner, range(2), ants, schedule=schedule)
    colony.begin_episode(100)
    return colony


def assert_same(one: Colony, other: Colony) -> None:
    """Assert that all numbers are equal, by numbers of ants."""
    assert np.array_equal(one.q_values, other.q_values)
    (places, their_places) = (colony.numbers.argsort(axis=1) for colony in (one, other))
    for name in ("cells", "headings", "streams", "events", "actions", "carried"):
        ours = np.take_along_axis(getattr(one, name), places, 1)
        assert np.array_equal(ours, np.take_along_axis(getattr(other, name), their_places, 1)), name
    for world in range(2):
        assert np.array_equal(one.snapshot(world).trail, other.snapshot(world).trail)
    assert one.outcome() == other.outcome()


@pytest.mark.parametrize("most", [0, 10**9], ids=["loops", "one_loop"])
@pytest.mark.parametrize("group", MARKED)
def test_drawn_colonies_have_the_recorded_hashes(group, most, monkeypatch):
    monkeypatch.setattr(stepping, "_MOST_IN_ONE_LOOP", most)
    for name, drawn in drawing.colonies_of(group, 1):  # their rules are registered meanwhile
        assert record.of_colony(drawn, BY_ANT) == record.recorded()[1][name]


@pytest.mark.parametrize(("ants", "ants_of_place"), [(8, 3), (1000, 1000), (1000, 16)])
def test_threads_add_to_the_same_sums_in_any_order(ants, ants_of_place, monkeypatch):
    """Also many ants, all into one place."""
    monkeypatch.setattr(stepping, "_MOST_IN_ONE_LOOP", 0)
    monkeypatch.setattr(layout, "ANTS_OF_PLACE", ants_of_place)
    colony, expected = made(ants=ants), made("by_world", ants)
    for one in (colony, expected):
        one.tick(40)
    assert_same(colony, expected)


@pytest.mark.parametrize("learner", [DYNA_Q, SARSA])
def test_blocks_of_threads_wait_for_each_other(learner, monkeypatch):
    """Two threads of a CPU are two blocks, of one thread each."""
    import taichi as ti

    from taichi_ants.engines.colony import kernels

    runtime.start(2)
    monkeypatch.setattr(device_memory, "multiprocessors", lambda: 2)
    monkeypatch.setattr(kernels, "THREADS_OF_BLOCK", 1)
    monkeypatch.setattr(ti.simt.block, "sync", lambda: None)  # for a GPU only
    colony, expected = made(ants=60, learner=learner), made("by_world", 60, learner)
    for one in (colony, expected):
        one.tick(300)
    assert colony.arrays["barrier"][layout.Barrier.ARRIVED] > 2
    assert_same(colony, expected)


def test_a_launch_has_few_arguments(monkeypatch):
    """Those of the other schedules have more than a GPU allows."""
    colony, other = made(), made("by_world")
    colony.tick(30)
    assert {name for name, _ in colony._launches} == {"begin", "ticks"}
    monkeypatch.setattr(stepping, "_MOST_IN_ONE_LOOP", 0)
    for one in (colony, other):
        one.tick()
    loops = {"first", "planning", "last"}
    assert {name for name, _ in colony._launches} == {"begin", "ticks", *loops}
    assert max(len(launch._known) for launch in colony._launches.values()) <= MOST_ARGUMENTS
    assert len(other._launches["ticks"]._known) > MOST_ARGUMENTS


def test_what_is_written_between_ticks_counts():
    """Also an array with another shape: weights of a lower learning rate."""
    colony, expected = (made(one, 200, SARSA) for one in (BY_ANT, "by_world"))
    room = len(colony.arrays["weights"])
    for one in (colony, expected):
        one.tick(5)
        one.epsilon = 0.9
        one.next_actions[:, 0] = 1
        one.tick(5)
        one.end_episode()
        one.begin_episode(50, worlds.open_world(7, ranges=(30,) * 3))
        one.tick(5)
        one._set_learning_rate(0.01)
        one.tick(5)
    assert_same(colony, expected)
    weights = colony.arrays["weights"]
    assert len(weights) > room
    assert np.array_equal(weights, expected.arrays["weights"])


def test_copies_and_files_have_what_is_on_the_device(tmp_path):
    colony, expected = made(), made("by_world")
    for one in (colony, expected):
        one.tick(7)
    colony.save(tmp_path / "colony.npz")
    copies = copy.deepcopy(colony), pickle.loads(pickle.dumps(colony))
    loaded = Colony.load(tmp_path / "colony.npz")
    assert loaded.schedule == "by_world"  # a CPU chooses its own
    colony.tick(3)
    expected.tick(20)
    for one in (*copies, loaded):
        assert one.ticks == 7
        one.tick(20)
        assert_same(one, expected)
    colony.tick(17)
    assert_same(colony, expected)


def test_a_tick_that_was_interrupted_ends_the_episode():
    colony = made()
    colony.tick(2)
    with interrupted_after_launch(2):
        colony.tick(40)
    for use in (colony.tick, colony.snapshot, colony.outcome):
        with pytest.raises(AntsError, match=r"interrupted; call begin_episode first\.$"):
            use()
    colony.begin_episode()
    colony.tick()
    assert colony.ticks == 1


def test_a_reset_of_taichi_loses_only_what_is_on_the_device():
    import taichi as ti

    colony, kept = made(), made()
    for one in (colony, kept):
        one.tick()
    expected = copy.deepcopy(kept)  # which reads all of it
    ti.reset()
    with pytest.raises(AntsError, match=r"reset .* destroys the state .* load it afterwards\.$"):
        colony.tick()
    for one in (kept, expected):
        one.tick()
    assert_same(kept, expected)


def test_a_gpu_has_no_other_schedule():
    assert [schedule_of(None, 1, n, "cuda") for n in (1, 10**6)] == [BY_ANT] * 2
    with pytest.raises(AntsError, match=r"^schedule is 'by_chunk'; .*by_ant\.$"):
        schedule_of("by_chunk", 1, 10**6, "cuda")


@pytest.mark.skipif(find_library("cuda") is not None, reason="this machine may have a GPU")
def test_a_machine_without_a_gpu_says_so_in_one_sentence():
    with pytest.raises(AntsError, match=r"^arch is 'cuda', but no CUDA device is usable here; .*"):
        Colony(worlds.paper(), task.foraging(), DYNA_Q, arch="cuda")
    made("by_world").tick()  # Taichi starts anew
