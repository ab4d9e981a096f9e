"""Ctrl-C in a colony: its counts are those of its worlds, and what is incomplete is refused."""

from __future__ import annotations

import signal
from typing import Any

import pytest
from interrupts import interrupted_after_launch

from taichi_ants import AntsError, Colony, Interventions, TrainingConfig, task, worlds
from taichi_ants.engines.colony import stepping
from taichi_ants.engines.colony.stepping import ThreadChoice
from taichi_ants.interventions import AddAnts, Place
from taichi_ants.task.constants import FOOD

LEARNER = TrainingConfig("sarsa", 0.1, 0.9, 0.3, 0.97)


def colony(**options: Any) -> Colony:
    made = Colony(worlds.paper(), task.foraging(), LEARNER, seeds=range(2), ants=8, **options)
    made.begin_episode(100)
    return made


@pytest.mark.parametrize("schedule", ["by_world", "by_chunk"])
def test_ticks_are_those_of_the_worlds(schedule: str) -> None:
    made, twin = colony(schedule=schedule), colony(schedule=schedule)
    made.tick(5)
    with interrupted_after_launch():
        made.tick(20)
    assert made.ticks > 5
    assert made.episode_ticks.tolist() == [made.ticks] * 2
    made.tick(25 - made.ticks)
    twin.tick(25)
    assert made == twin


def test_an_alarm_at_any_moment_leaves_the_right_ticks() -> None:
    made = colony()
    made.tick(200)  # takes no time to compile later
    usual = signal.signal(signal.SIGALRM, signal.default_int_handler)
    try:
        for _ in range(5):
            signal.setitimer(signal.ITIMER_REAL, 0.05)
            with pytest.raises(KeyboardInterrupt):
                made.tick(10**6)
            assert made.episode_ticks.tolist() == [made.ticks] * 2
    finally:
        signal.signal(signal.SIGALRM, usual)


def test_a_launch_that_gave_up_at_a_barrier_is_completed(monkeypatch: pytest.MonkeyPatch) -> None:
    made, twin = (colony(schedule="by_chunk", threads=2) for _ in range(2))
    twin.tick(9)
    monkeypatch.setattr(ThreadChoice, "plan", lambda choice, ticks, most: (ticks, 2))
    monkeypatch.setattr(stepping, "_SPINS", 0)
    with interrupted_after_launch():
        made.tick(9)
    made.tick(9 - made.ticks)
    assert made == twin


def test_an_episode_that_did_not_begin_completely_is_refused(tmp_path: Any) -> None:
    made = colony()
    made.tick(100)
    delivered = made.deliveries + made.delivered
    for number in range(2):
        with interrupted_after_launch():
            made.begin_episode(100)
        assert made.delivered.tolist() == delivered.tolist(), number
    for use in (made.tick, made.snapshot, lambda: made.save(tmp_path / "a.npz")):
        with pytest.raises(AntsError, match=r"interrupted; call begin_episode first\.$"):
            use()
    made.begin_episode(100)
    made.tick()
    assert made.ticks == 1


def test_what_one_world_refuses_changes_none() -> None:
    """Cells, queens, ants and the start of later episodes."""
    made = colony()
    Interventions(made, worlds=[1]).put(made.grid.index([(2, 2, 0)]), FOOD)
    some, (food,) = Interventions(made), made.worlds[0].foods.tolist()
    Place("rock", [food]).apply(Interventions(made, worlds=[0], lasting=False))
    full = Interventions(made, worlds=[1])
    full.add_some(made.capacity - full.living, None)
    before = some.state()
    for refused in (
        Place("queen", [(2, 2, 0)]),  # free in world 0
        AddAnts(number=1),  # world 1 is full
        Place("rock", [food, (2, 2, 0)]),  # both worlds would start without food
    ):
        with pytest.raises(AntsError):
            refused.apply(some)
        assert some.state() == before, refused
    made.tick()
