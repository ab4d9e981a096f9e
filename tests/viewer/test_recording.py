"""Recordings hold what the engine and the reference have, at every tick."""

import html
import re
from itertools import pairwise

import numpy as np
import pytest
from playback import played, unpack, unpacked
from random_choices import NO_NOISE, NOISE
from random_colonies import random_colony

from taichi_ants import (
    AntsError,
    Colony,
    Task,
    TrainingConfig,
    World,
    rollout,
    trace_training,
    worlds,
)
from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.interventions import Place
from taichi_ants.learners.policies import trail_follower
from taichi_ants.reference import ReferenceColony
from taichi_ants.task import Caste, Food, Labour, Threshold, foraging
from taichi_ants.viewer import Recorder, Recording, page, record_colony, record_trace
from taichi_ants.viewer.frames import types_of

# Each entry needs its own kernels: learner, sharing, observation, dense, traffic.
KERNELS = [
    ("q_learning", "shared", "paper", False, "blocking"),
    pytest.param("sarsa", "shared", "ants_seen", True, "blocking", marks=pytest.mark.long),
    ("sarsa", "independent", "paper", False, "blocking"),
    pytest.param("q_learning", "frozen", "queues", True, "following", marks=pytest.mark.slow),
]
TICKS = 40
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


@pytest.mark.parametrize(("learner", "sharing", "sees", "dense", "traffic"), KERNELS)
def test_a_recording_is_what_engine_and_reference_do(learner, sharing, sees, dense, traffic):
    """While ants are born and die, food comes and goes, and trails fall and spread."""
    for seed in range(4):
        drawn = random_colony(
            seed,
            sharing=sharing,
            learner=learner,
            observation=sees,
            dense=dense,
            traffic=traffic,
            changes=True,
            noise=NOISE if sharing == "independent" else NO_NOISE,
        )
        colony = Colony(*drawn.model, **drawn.options)
        plain = ReferenceColony(*drawn.model, **drawn.options)
        snapshots, tables, ants = [], [], []
        colony.begin_episode(TICKS)
        plain.begin_episode()
        recorder = Recorder(colony)
        frames = [recorder.snapshot()]
        transitions = [[]]
        for tick in range(TICKS + 1):
            snapshots.append(colony.snapshot())
            tables.append(colony.q_values[0])
            views = (colony.numbers, colony.cells, colony.headings, colony.carrying, colony.states)
            ants.append((np.nonzero(colony.living[0])[0], [view[0].copy() for view in views]))
            if tick < TICKS and not plain.over:
                frames.append(recorder.tick())
                plain.tick(last=tick == TICKS - 1)
                transitions.append(sorted(plain.transitions, key=lambda one: one.number))
        recording = unpacked(Recording(recorder.header(), frames).to_bytes())
        moments = list(played(recording))
        rewards = [unpack(recorder.types, frame)["rewards"].tolist() for frame in frames]
        before, met = None, set()
        assert len(moments) == len(transitions)
        for moment, reward, snapshot, table, (slots, views), did in zip(
            moments, rewards, snapshots, tables, ants, transitions, strict=False
        ):
            assert np.array_equal(moment.ground, snapshot.ground)
            assert moment.trail.dtype == snapshot.trail.dtype
            assert np.array_equal(moment.trail, snapshot.trail)
            slots = slots[np.argsort(views[0][slots])]
            names = ("numbers", "cells", "headings", "loaded", "states")
            for name, view in zip(names, views, strict=True):
                assert getattr(moment, name).tolist() == view[slots].tolist(), name
            assert moment.clock[6] == len(slots)
            for place, slot in enumerate(slots.tolist()):
                own = table[slot] if colony.one_a_slot else table
                owner = int(moment.numbers[place]) if colony.one_a_slot else 0
                state = int(moment.states[place])
                held = moment.row(state, drawn.task.n_states, owner)
                assert np.array_equal(held, own[state])
                met.add(owner * drawn.task.n_states + state)
            assert met == {entry // 5 for entry in moment.values}
            if before is not None:
                assert before.numbers.tolist() == [one.number for one in did]
                assert moment.actions.tolist() == [one.executed for one in did]
                assert reward == [one.reward for one in did]
                assert len(moment.td_errors) == (len(did) if sharing != "frozen" else 0)
            before = moment


def test_frames_have_nests_castes_kinds_of_food_and_rewards():
    colony = Colony(WORLD, MANY, CONFIG, 4, ants=30, start="spread")
    colony.begin_episode()
    recorder, kinds = Recorder(colony), np.zeros(colony.grid.size, np.uint8)
    frames, seen = [recorder.snapshot()], set()
    frame = unpack(recorder.types, frames[0])
    queens = frame["queens"].tolist()
    assert queens == colony.snapshot().queens.tolist()
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
        frames.append(recorder.tick())
        frame = unpack(recorder.types, frames[-1])
        assert not len(frame["queens"])
        idle = colony.actions[0, order] < 0
        assert (frame["acts"] & 15 == np.where(idle, 15, colony.actions[0, order])).all()
        assert (frame["rewards"] == colony.rewards[0, order]).all()
        seen |= {("reward", value) for value in frame["rewards"].tolist()}
        seen |= {("idle", one) for one in idle.tolist()}
        if tick == 70:
            (cell,) = colony.grid.cells(np.array([snapshot.ant_cells[0]])).tolist()
            Interventions(colony).apply(Place("food", [cell], kind="egg"))
            Interventions(colony).apply(Place("queen", [[0, 6, 0]], nest=1))
            frames.append(recorder.snapshot())
            frame = unpack(recorder.types, frames[-1])
            assert frame["queens"].tolist() == colony.snapshot().queens.tolist() != queens
    assert {("carried", kind) for kind in (-1, 0, 1, 2)} <= seen
    assert {("reward", 90.0), ("reward", 40.0), ("idle", True), ("idle", False)} <= seen
    whole = unpack(recorder.types, recorder.whole())
    found = np.zeros(colony.grid.size, np.uint8)
    found[whole["kinds_at"]] = whole["kinds"]
    assert np.array_equal(found, colony.snapshot().food_kinds)
    header = recorder.header()
    assert whole["queens"].tolist() == colony.snapshot().queens.tolist()
    *_, last = played(Recording(header, frames))
    order = np.argsort(colony.numbers[0])
    assert np.array_equal(last.nests, colony.nests[0, order])
    tables = colony.q_values[0].reshape(-1, MANY.n_states, 5)
    for state, table in zip(last.states.tolist(), colony.tables_of_ants[0, order], strict=True):
        assert np.array_equal(last.row(state, MANY.n_states, int(table)), tables[table, state])
    assert ["nests", "2"] in list(map(list, header["about"]))
    assert (header["castes"], header["foods"]) == ([*CASTES], [*FOODS])
    assert header["marks"] == [{"words": "idle", "most": None}]


@pytest.mark.parametrize("learner", ["sarsa", "double_q"])
def test_a_trace_of_training_holds_tables_and_td_errors(learner):
    config = TrainingConfig(learner, 0.1, 0.9, 0.3, 0.99)
    trace = trace_training(worlds.paper(), config, seed=7, episodes=3, max_steps=80)
    recording = record_trace(trace, title="learns")
    moments = list(played(recording))
    assert len(moments) == len(trace) + 3  # each episode begins with a moment of its own
    acting = [moment for moment in moments if len(moment.actions)]
    for step, moment in enumerate(acting):
        assert moment.actions == trace.actions[step]
        assert moment.events == trace.events[step]
        assert moment.td_errors == trace.td_errors[step]
        assert moment.clock[:2] == [trace.episodes[step], trace.steps[step] + 1]
        state = int(trace.states[step])
        assert np.array_equal(moment.row(state, 128), trace.tables[step, state])
    assert record_trace(rollout(worlds.paper(), trail_follower())).header["learns"] is False


def test_td_errors_of_a_shared_table_are_the_mean_of_its_ants():
    """Two ants in one state that do the same: the value moves by 1 - (1 - alpha)^2 of the mean."""
    task = Task(evaporation_in_training=True)
    world, config = worlds.open_world(2, (9, 9, 9)), TrainingConfig("q_learning", 0.5, 0, 0, 1)
    colony = Colony(world, task, config, 1, 12)
    colony.begin_episode()
    moments = list(played(record_colony(colony, 60)))
    shared = 0
    for before, after in pairwise(moments):
        pairs = list(zip(before.states.tolist(), after.actions.tolist(), strict=True))
        rewards = np.array(task.rewards.by_event())[after.events]
        for place, pair in enumerate(pairs):
            same = [k for k, other in enumerate(pairs) if other == pair]
            value = before.row(pair[0], 128)[pair[1]]
            # Without a discount the target is the reward.
            assert after.td_errors[place] == pytest.approx(rewards[same].mean() - value, abs=1e-4)
            shared += len(same) > 1
    assert shared > 50


def test_what_is_skipped_and_what_is_changed_by_hand():
    """Several ticks a frame leave out what ants did; an edit is told without a tick."""
    colony = Colony(
        worlds.paper(),
        None,
        TrainingConfig("sarsa", 1.0, 0.0, 0.0, 1.0, min_epsilon=0),
        sharing="frozen",
        q_values=trail_follower(),
    )
    colony.begin_episode()
    recorder = Recorder(colony)
    frames = [recorder.snapshot(), recorder.tick(5)]
    colony.arrays["ground"][colony.grid.index((3, 0, 1))] = 5
    frames += [recorder.snapshot(), recorder.tick()]
    moments = list(played(Recording(recorder.header(), frames)))
    assert [moment.clock[1] for moment in moments] == [0, 5, 5, 6]
    assert [len(moment.actions) for moment in moments] == [0, 0, 0, 1]
    assert np.array_equal(moments[-1].ground, colony.snapshot().ground)
    assert np.array_equal(moments[-1].trail, colony.snapshot().trail)
    every = record_colony(colony, 7, frame_interval=3)
    assert [unpack(every.header["types"], one)["clock"][1] for one in every.frames[:4]] == [
        6,
        9,
        12,
        13,
    ]


def test_cells_and_states_take_as_many_bytes_as_they_need():
    assert types_of(2**16 - 1, 2**16 - 1, True)["cells"] == "u2"
    assert types_of(2**16, 2**16 - 1, True)["cells"] == "u4"
    assert types_of(2**16 - 1, 2**16, True)["states"] == "u4"


def test_what_cannot_be_recorded_says_why():
    colony = Colony(worlds.paper(), None, TrainingConfig("sarsa", 0.1, 0.9, 0.3, 1.0))
    with pytest.raises(AntsError, match="no episode has begun"):
        record_colony(colony, 3)
    colony.begin_episode()
    with pytest.raises(AntsError, match="ticks is -1"):
        record_colony(colony, -1)
    with pytest.raises(AntsError, match="follow is 3; it must lie between 0 and 0"):
        record_colony(colony, 1, follow=3)
    trace = rollout(worlds.paper(), trail_follower())
    object.__setattr__(trace, "arguments", None)
    with pytest.raises(AntsError, match="does not contain its world and settings"):
        record_trace(trace)


def test_notebooks_show_recordings():
    title = 'An <ant> & its "trail"'
    trace = rollout(worlds.paper(), trail_follower())
    recording = record_trace(trace, title)
    shown = recording._repr_html_()
    assert shown.startswith("<iframe ")
    assert html.unescape(re.search(r'title="([^"]*)"', shown)[1]) == title
    assert html.unescape(re.search(r'srcdoc="([^"]*)"', shown)[1]) == page(recording)
