"""One colony that lives for a while: its files, what stops it, what it says."""

from __future__ import annotations

import os
from itertools import islice

import numpy as np
import pytest

from taichi_ants import AntsError, Colony, Task, TrainingConfig, worlds
from taichi_ants.commands.colony import live, summary
from taichi_ants.engines.colony.layout import WorldRow
from taichi_ants.rendering import writers

TASK = Task(delivery="truncates", evaporation_in_training=True)
TRAINING = TrainingConfig("sarsa", 0.1, 0.9, 0.1, 1.0, 0.1)


def begun(ants: int = 3) -> Colony:
    colony = Colony(worlds.paper(), TASK, TRAINING, 4, ants)
    colony.begin_episode()
    return colony


def never() -> bool:
    return False


@pytest.mark.parametrize(
    ("render", "encode", "ticks"), [("a.gif", "_with_palette", 6), ("a.png", "png", 20)]
)
def test_a_colony_is_saved_although_its_picture_cannot_be(
    tmp_path, monkeypatch, render, encode, ticks
) -> None:
    def full(frames, *more, **named) -> None:
        list(islice(frames, 4))  # of a GIF: at the start and after 2, 4, 6 ticks
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(writers, encode, full)
    colony = begun()
    save = str(tmp_path / "keep.npz")
    with pytest.raises((AntsError, OSError), match="o space left on device"):
        live(colony, 20, lambda share: None, never, save, str(tmp_path / render), frame_interval=2)
    assert os.listdir(tmp_path) == ["keep.npz"]
    other = begun()
    other.tick(ticks)
    saved = Colony.load(save)
    assert saved.ticks == ticks
    np.testing.assert_array_equal(saved.cells, other.cells)
    np.testing.assert_array_equal(saved.q_values, other.q_values)


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
        return summary(colony, 1, 2.34)

    one, two = summed(deliveries=1, births=1), summed(deliveries=2, births=2, deaths=1)
    assert one.startswith("1 ant, 1 tick in 2.3 s.")
    assert "\n1 delivery by tick 1, " in one
    assert one.endswith(" % of the moves blocked, 1 birth.")
    assert "\n2 deliveries by tick 1, " in two
    assert two.endswith(" % of the moves blocked, 2 births, 1 death.")
