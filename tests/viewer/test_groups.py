"""Recordings of colonies with several nests, castes, kinds of food and your own rewards."""

from __future__ import annotations

import numpy as np
from playback import unpack

from taichi_ants import Colony, TrainingConfig, World
from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.interventions import Place
from taichi_ants.task import Caste, Food, Labour, Threshold, foraging
from taichi_ants.viewer import Recorder

CASTES = {
    "nurse": Caste(share=0.4, threshold=Threshold("fixed", value=5)),
    "scout": Caste(share=0.3, learning_rate=0.5),
    "guide": Caste(policy="trail_follower"),
}
FOODS = {"seed": Food(deliver=90, regrowth=5), "sap": Food(deliver=40, loads=3), "egg": Food()}
MANY = foraging().replace(
    castes=CASTES,
    foods=FOODS,
    labour=Labour("thresholds", demand=1.0, relief=1, stop_probability=0.1),
    life={"regrowth": None},
)
WORLD = World(
    (9, 9, 9),
    (2, 2, 0),
    foods=[(5, 2, 0), (2, 5, 0), (3, 0, 0), (6, 6, 0), (0, 3, 0)],
    food_kinds=[0, 1, 2, 0, 1],
    other_queens=[(6, 3, 0)],
)
CONFIG = TrainingConfig("q_learning", 0.1, 0.9, 0.3, 1.0)


def test_frames_have_castes_kinds_of_food_and_rewards():
    colony = Colony(WORLD, MANY, CONFIG, 4, ants=30, start="spread")
    colony.begin_episode()
    recorder, kinds = Recorder(colony), np.zeros(colony.grid.size, np.uint8)
    frame, seen = unpack(recorder.types, recorder.snapshot()), set()
    for tick in range(150):
        order = np.argsort(colony.numbers[0])
        snapshot, numbers = colony.snapshot(), np.argsort(colony.snapshot().ant_numbers)
        kinds[frame["kinds_at"]] = frame["kinds"]
        assert np.array_equal(kinds, snapshot.food_kinds)
        groups = frame["groups"]
        assert (groups & 15 == colony.castes[0, order]).all()
        assert (frame["marks"] == 255 * colony.idle[0, order]).all()
        carried = snapshot.ant_foods[numbers]
        assert (groups >> 4 == np.maximum(carried, 0)).all()
        seen |= {("carried", kind) for kind in carried.tolist()}
        frame = unpack(recorder.types, recorder.tick())
        idle = colony.actions[0, order] < 0
        assert (frame["acts"] & 15 == np.where(idle, 15, colony.actions[0, order])).all()
        assert (frame["rewards"] == colony.rewards[0, order]).all()
        seen |= {("reward", value) for value in frame["rewards"].tolist()}
        seen |= {("idle", one) for one in idle.tolist()}
        if tick == 70:
            (cell,) = colony.grid.cells(np.array([snapshot.ant_cells[0]])).tolist()
            Interventions(colony).apply(Place("food", [cell], kind="egg"))
            frame = unpack(recorder.types, recorder.snapshot())
    assert {("carried", kind) for kind in (-1, 0, 1, 2)} <= seen
    assert {("reward", 90.0), ("reward", 40.0), ("idle", True), ("idle", False)} <= seen
    whole = unpack(recorder.types, recorder.whole())
    found = np.zeros(colony.grid.size, np.uint8)
    found[whole["kinds_at"]] = whole["kinds"]
    assert np.array_equal(found, colony.snapshot().food_kinds)
    header = recorder.header()
    assert (header["castes"], header["foods"]) == ([*CASTES], [*FOODS])
    assert header["marks"] == [{"words": "idle", "most": None}]
