"""Ctrl-C in a colony: its counts are those of its worlds, and what is incomplete is refused."""

import signal
from typing import Any

import pytest
from interrupts import interrupted_after_launch

from taichi_ants import AntsError, Colony, TrainingConfig, task, worlds
from taichi_ants.engines.colony import stepping
from taichi_ants.engines.colony.stepping import ThreadChoice

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
