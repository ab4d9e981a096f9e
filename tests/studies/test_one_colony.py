"""One colony that lives for a while: its files, what stops it, what it says."""

from __future__ import annotations

import os
import signal
from itertools import islice

import numpy as np
import pytest

from taichi_ants import AntsError, Colony, Life, Task, TrainingConfig, worlds
from taichi_ants.engines.colony.layout import WorldRow
from taichi_ants.learners.policies import trail_follower
from taichi_ants.rendering import writers
from taichi_ants.studies.interruption import held, stoppable
from taichi_ants.studies.one_colony import Outputs, Pace, let_time_pass, live, summary

TASK = Task(delivery="continuing", evaporation_in_training=True)
TRAINING = TrainingConfig("sarsa", 0.1, 0.9, 0.1, 1.0, 0.1)


def begun(ants: int = 3) -> Colony:
    colony = Colony(worlds.paper(), TASK, TRAINING, 4, ants)
    colony.begin_episode()
    return colony


def never() -> bool:
    return False


@pytest.mark.parametrize(
    ("render", "writer", "ticks"),
    [("a.gif", "_gif", 6), ("frames", "_png", 6), ("a.png", "_png", 20)],
)
@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), RuntimeError("odd")])
def test_a_colony_is_saved_although_its_picture_cannot_be(
    tmp_path, monkeypatch, render, writer, ticks, error
) -> None:
    pictures = []

    def fourth(frames, *settings, **options) -> bytes:  # at the start and after 2, 4, 6 ticks
        pictures.extend(islice(frames, 4) if writer == "_gif" else [frames])
        if len(pictures) == 4 or render == "a.png":
            raise error
        return b""

    monkeypatch.setattr(writers, writer, fourth)
    colony = begun()
    outputs = Outputs(str(tmp_path / "keep.npz"), str(tmp_path / render), every=2)
    expected = AntsError if isinstance(error, OSError) else RuntimeError
    with pytest.raises(expected) as caught:
        live(colony, 20, outputs, lambda share: None, never)
    if expected is AntsError:
        text = str(caught.value)
        assert "o space left on device" in text
        assert text.endswith(f"; the colony is saved in {outputs.save!r}, at tick {ticks}.")
    assert os.listdir(tmp_path) == ["keep.npz"]
    other = begun()
    other.tick(ticks)
    saved = Colony.load(outputs.save)
    assert saved.ticks == ticks
    np.testing.assert_array_equal(saved.arrays["ants"], other.arrays["ants"])
    np.testing.assert_array_equal(saved.q_values, other.q_values)


def test_the_colony_and_its_picture_need_two_places(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    for render in ("x.gif", str(tmp_path / "x.gif"), "sub/../x.gif"):
        with pytest.raises(AntsError, match=r"'x.gif' and .* are one place"):
            Outputs("x.gif", render).check()
    Outputs("x.npz", "x.gif").check()


def test_a_stopped_colony_ends_at_a_whole_tick_with_all_its_files(tmp_path, capsys) -> None:
    def progress(share: float) -> None:
        os.kill(os.getpid(), signal.SIGTERM)

    colony = begun()
    outputs = Outputs(str(tmp_path / "keep.npz"), str(tmp_path / "a.gif"), every=2)
    paces = []

    def work() -> None:
        with stoppable(), held() as stopped:
            paces.append(live(colony, 10, outputs, progress, stopped))

    with pytest.raises(SystemExit) as end:
        work()
    assert (end.value.code, paces[0].ticks) == (143, 2)
    assert Colony.load(outputs.save).ticks == 2
    assert (tmp_path / "a.gif").exists()


def test_the_summary_counts_in_words() -> None:
    def summed(**counts: int) -> str:
        colony = begun(ants=1)
        colony.tick(1)
        rows = {
            "deliveries": WorldRow.DELIVERIES,
            "births": WorldRow.BIRTHS,
            "deaths": WorldRow.DEATHS,
        }
        for name, count in counts.items():
            colony.arrays["worlds"][rows[name]] = count
        return summary(colony, Pace(ticks=1))

    one, two = summed(deliveries=1, births=1), summed(deliveries=2, births=2, deaths=1)
    assert one.startswith("1 ant, 1 tick: ")
    assert "\n1 delivery by tick 1, " in one
    assert one.endswith(" % of the moves blocked, 1 birth.")
    assert "\n2 deliveries by tick 1, " in two
    assert two.endswith(" % of the moves blocked, 2 births, 1 death.")


def test_the_summary_says_when_all_places_are_taken() -> None:
    def lived(births: bool, capacity: int | None) -> tuple[str, Colony]:
        task = Task(life=Life(births=births, regrowth=0))
        training = TrainingConfig("sarsa", 0.1, 0.9, 0.0, 1.0, 0.0)
        options = {"sharing": "fixed", "q_values": trail_follower()}
        colony = Colony(worlds.paper(), task, training, 4, 8, capacity, **options)
        colony.begin_episode()
        pace = Pace()
        for _ in let_time_pass(colony, 400, pace, never):
            pass
        return summary(colony, pace), colony

    text, colony = lived(True, 9)
    waiting = colony.outcome().deliveries.sum() - 1
    assert colony.waiting_foods == waiting > 1
    assert text.endswith(
        f"\n9 of 9 places are taken, {waiting} foods wait at the queen; --capacity gives more."
    )
    assert "places" not in lived(True, 5000)[0]
    assert "places" not in lived(False, None)[0]
