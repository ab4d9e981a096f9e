"""Recordings of colonies with several nests, castes, kinds of food and your own rewards."""

from __future__ import annotations

import numpy as np
import pytest
from playback import unpack

from taichi_ants import Colony, Task, TrainingConfig, World, rules, worlds
from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.interventions import Place
from taichi_ants.learners.config import update_weights
from taichi_ants.learners.policies import trail_follower
from taichi_ants.task import Caste, Food, Labour, Threshold, foraging
from taichi_ants.task.constants import N_ACTIONS
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


def begun(**options) -> Colony:
    colony = Colony(WORLD, MANY, CONFIG, 4, ants=30, start="spread", **options)
    colony.begin_episode()
    return colony


@pytest.mark.parametrize("sharing", ["shared", "frozen"])
def test_frames_have_castes_kinds_of_food_and_rewards(sharing):
    follow = {"q_values": trail_follower("ants")} if sharing == "frozen" else {}
    colony = begun(sharing=sharing, **follow)
    recorder, kinds = Recorder(colony), np.zeros(colony.grid.size, np.uint8)
    frame, seen = unpack(recorder.types, recorder.snapshot()), set()
    for tick in range(150):
        order = np.argsort(colony.numbers[0])
        snapshot, numbers = colony.snapshot(), np.argsort(colony.snapshot().ant_numbers)
        kinds[frame["kinds_at"]] = frame["kinds"]
        assert np.array_equal(kinds, snapshot.food_kinds)
        groups = frame["groups"]
        assert (groups & 15 == colony.castes[0, order]).all()
        assert (groups > 127).tolist() == colony.idle[0, order].tolist()
        carried = snapshot.ant_foods[numbers]
        assert ((groups >> 4) & 7 == np.maximum(carried, 0)).all()
        seen |= {("carried", kind) for kind in carried.tolist()}
        frame = unpack(recorder.types, recorder.tick())
        idle = colony.actions[0, order] < 0
        assert (frame["acts"] & 15 == np.where(idle, 15, colony.actions[0, order])).all()
        assert (frame["rewards"] == colony.rewards[0, order]).all()
        seen |= {("reward", value) for value in frame["rewards"].tolist()}
        seen |= {("idle", one) for one in idle.tolist()}
        if tick == 70:
            (cell,) = colony.grid.cells(np.array([snapshot.ant_cells[0]])).tolist()
            Place("food", [cell], kind="egg").apply(Interventions(colony))
            frame = unpack(recorder.types, recorder.snapshot())
    assert {("carried", kind) for kind in (-1, 0, 1, 2)} <= seen
    assert {("reward", 90.0), ("reward", 40.0), ("idle", True), ("idle", False)} <= seen
    whole = unpack(recorder.types, recorder.whole())
    found = np.zeros(colony.grid.size, np.uint8)
    found[whole["kinds_at"]] = whole["kinds"]
    assert np.array_equal(found, colony.snapshot().food_kinds)
    header = recorder.header()
    assert (header["castes"], header["foods"]) == ([*CASTES], [*FOODS])
    assert header["idles"]


def test_td_errors_are_those_of_the_caste():
    """Changes of values are the errors times the learning rate; guides and idle ants have none."""
    colony = begun()
    recorder, met = Recorder(colony), set()
    recorder.snapshot()
    for _ in range(60):
        order = np.argsort(colony.numbers[0])
        before, states = colony.q_values[0], colony.states[0, order]
        castes, nests = colony.castes[0, order], colony.nests[0, order]
        frame = unpack(recorder.types, recorder.tick())
        actions = (frame["acts"] & 15).tolist()
        at = list(zip(nests, castes, states, actions, strict=True))
        for place, (error, where) in enumerate(zip(frame["td_errors"], at, strict=True)):
            caste = castes[place]
            if actions[place] == 15 or caste == 2:
                assert np.isnan(error)
                met.add("none")
                continue
            n = at.count(where)
            weight = update_weights(0.5 if caste == 1 else 0.1, 30)[n]
            moved = float(colony.q_values[0][where]) - float(before[where])
            assert error * weight == pytest.approx(moved, abs=1e-5)
            met.add((int(caste), n > 1, bool(moved)))
    assert {"none", (0, False, True), (1, False, True), (1, True, True)} <= met


def test_the_table_of_a_caste_and_a_nest_is_that_of_their_ants():
    colony = begun()
    recorder = Recorder(colony)
    values = {}
    for frame in (recorder.snapshot(), *(recorder.tick() for _ in range(40))):
        one = unpack(recorder.types, frame)
        values |= dict(zip(one["table_at"].tolist(), one["table"].tolist(), strict=True))
    n_states = colony.task.n_states
    for slot, state in enumerate(colony.states[0].tolist()):
        nest, caste = colony.nests[0, slot], colony.castes[0, slot]
        first = ((nest * len(CASTES) + caste) * n_states + state) * N_ACTIONS
        held = [values[first + action] for action in range(N_ACTIONS)]
        assert held == colony.q_values[0, nest, caste, state].tolist()
    assert dict(recorder.header()["about"])["table"] == "one per nest and caste"


def lively(reward, tick):
    """Return a reward that depends on more than the event."""
    return min(reward + tick % 3, 1000)


@pytest.mark.slow
def test_frames_have_your_own_rewards():
    rules.register("reward")(lively)
    task = foraging().replace(reward="lively", life={"regrowth": 0})
    colony = Colony(worlds.open_world(3, (9, 9, 9)), task, CONFIG, 1, ants=20)
    colony.begin_episode()
    recorder = Recorder(colony)
    recorder.snapshot()
    usual, differ = colony.task.rewards.by_event(), 0
    for _ in range(60):
        frame = unpack(recorder.types, recorder.tick())
        order = np.argsort(colony.numbers[0])
        assert frame["rewards"].tolist() == colony.rewards[0, order].tolist()
        differ += (frame["rewards"] != usual[colony.events[0, order]]).any()
    assert differ


def test_colonies_without_groups_have_no_sections_for_them():
    colony = Colony(worlds.paper(), Task(), CONFIG, 1, ants=5)
    colony.begin_episode()
    recorder = Recorder(colony)
    frames = [recorder.snapshot(), recorder.tick(), recorder.whole()]
    for frame in frames:
        sections = unpack(recorder.types, frame)
        assert not any(len(sections[name]) for name in ("groups", "kinds_at", "kinds"))
