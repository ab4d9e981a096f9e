"""Sessions: replayed to the bit, seen alike by all who look on, and nothing wrong changes them."""

import functools
import json
from dataclasses import replace
from typing import Annotated

import numpy as np
import pytest
from playback import played, unpack, unpacked
from random_edits import random_edit
from refusals import refused

from taichi_ants import (
    AntsError,
    Colony,
    Life,
    Pheromone,
    Task,
    TrainingConfig,
    World,
    load_policy,
    rules,
    worlds,
)
from taichi_ants import task as tasks
from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.engines.colony.layout import NestRow, Stage, WorldRow
from taichi_ants.features.rule import RULES
from taichi_ants.files import archives
from taichi_ants.interventions import Place
from taichi_ants.learners.policies import trail_follower
from taichi_ants.live import session as session_module
from taichi_ants.live.choices import sliders
from taichi_ants.live.exports import gif_bytes, recording
from taichi_ants.live.session import Log, Session, Setup
from taichi_ants.settings import Setting
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN
from taichi_ants.viewer import Recording
from taichi_ants.viewer.frames import CLOCK, POINT
from taichi_ants.worlds import text_map

LEARNS = TrainingConfig("sarsa", 0.2, 0.9, 0.3, 0.9, learning_rate_decay=0.8)
LIVELY = Task(
    pheromone=Pheromone("exponential", half_life=20, diffusion=0.2, deposit="add"),
    evaporation_in_training=True,
    life=Life(births=True, lifespan=60, regrowth=2, pile_move_interval=9),
)
SMALL = {"ranges": (9, 8, 7)}
HOMING = tasks.foraging().replace(
    fields={"home": {"deposited_when": "without_food", "evaporation": "exponential"}},
    homing_cue="home",
)


@rules.register("deposit")
def live_bump(
    level, most: Annotated[int, Setting("largest level", least=1, most=900)] = 400, share=0.5
):
    return min(level + most * share, most)


OWN = HOMING.replace(pheromone={"deposit": "live_bump"})
TWO_NESTS = text_map.to_text(
    World((7, 7, 7), [(0, 6, 0), (6, 0, 3)], [(0, 0, 5), (1, 0, 5), (5, 5, 0)], [(0, 3, 0)])
)
SETUPS = {
    "foraging": Setup("open", tasks.foraging(), LEARNS, 20, 40, 3, 25, world_settings=SMALL),
    "queueing": Setup(
        *("open", tasks.queueing(), trail_follower("queues"), 20, 30),
        world_settings=SMALL,
    ),
    "lively": Setup(
        *("open", LIVELY, TrainingConfig("dyna_q", 0.2, 0.9, 0.4, 0.9, planning_steps=2)),
        *(12, 30, 5, 40),
        world_settings=SMALL,
    ),
    "paper": Setup("paper", Task(), LEARNS, 5, ticks_per_episode=30, sharing="independent"),
    "nests": Setup(TWO_NESTS, tasks.foraging(), LEARNS, 20, 40, 3, 25),
    "rules": Setup("open", OWN, LEARNS, 20, world_settings=SMALL),
}
BUMP = RULES.yours.pop("live_bump")  # registered only while the tests of this file run
LATER = ("queueing", "lively", "foraging")  # two nests forage as well
MARKED = [pytest.param(one, marks=[pytest.mark.long] * (one in LATER)) for one in SETUPS]


@pytest.fixture(scope="module", autouse=True)
def _registered():
    RULES.add("live_bump", BUMP)
    yield
    RULES.yours.pop("live_bump")


def assert_sound(interventions: Interventions) -> None:
    """Check what must hold in every colony at the end of a tick."""
    colony = interventions.colony
    arrays, world = colony.arrays, colony.arrays["worlds"][:, 0]
    taken = arrays["stage"] != Stage.VACANT
    cells, numbers = arrays["cell"][taken], arrays["number"][taken]
    assert (arrays["stage"][taken] == Stage.LIVING).all()
    assert len(set(cells.tolist())) == len(set(numbers.tolist())) == world[WorldRow.LIVING]
    assert numbers.max(initial=-1) < world[WorldRow.NEXT_NUMBER]
    assert (np.flatnonzero(arrays["ground"] > 15) == np.sort(cells)).all()
    bare = colony.snapshot().ground
    assert (arrays["walls"] == (bare == OBSTACLE)).all()
    queens = colony.arrays["nests"][NestRow.QUEEN_CELL].tolist()
    assert np.flatnonzero(bare == QUEEN).tolist() == sorted(queens)
    assert colony.snapshot().trail[bare == OBSTACLE].sum() == 0
    later = interventions.world()
    closer = [later.closer(nest) for nest in range(colony.n_nests)]
    assert (np.concatenate(closer) == arrays["closer"]).all()
    assert np.count_nonzero(later.ground() == EMPTY) >= interventions.ants


def with_edits(setup: Setup, n: int, seed: int = 0) -> Session:
    """A session after n edits drawn at random, and some ticks between them."""
    session, rng = Session(setup), np.random.default_rng(seed)
    while len(session.edits) < n:
        try:
            session.apply(random_edit(rng, session.interventions), goes_on=rng.random() < 0.2)
        except AntsError:
            continue
        assert_sound(session.interventions)
        for _ in range(int(rng.integers(0, 3))):
            session.advance(int(rng.choice([1, 1, 9])))
    return session


def replayed(content: bytes) -> Session:
    """The session in a file that somebody has sent."""
    *_, session = Session.replay(Log.read("the file", content))
    return session


@pytest.fixture(scope="module")
def edited():
    """A function that returns the session of a setup after 60 edits."""
    return functools.cache(lambda name: with_edits(SETUPS[name], 60))


@pytest.mark.parametrize("name", MARKED)
def test_edits_are_replayed_to_the_bit(edited, name, tmp_path):
    session = edited(name)
    assert session.colony.episode > 2 or not session.setup.ticks_per_episode
    done = {name for _, edit in session.edits for name in edit}
    assert done >= {"place", "clear", "trail", "add_ants", "remove_ants", "episode", "ants"}
    session.save(tmp_path / "session.npz")
    again = Session.load(tmp_path / "session.npz")
    assert again.interventions.state() == session.interventions.state()
    assert (again.ticks, again.steps, again.edits) == (session.ticks, session.steps, session.edits)
    assert again.to_bytes() == session.to_bytes()
    assert replayed(again.to_bytes()).interventions.state() == session.interventions.state()


@pytest.mark.parametrize("name", MARKED)
def test_a_snapshot_gives_the_same_bits_as_a_replay_from_the_start(name, monkeypatch):
    """Undoing takes no tick, however long the session was, and leaves the session as it is."""
    monkeypatch.setattr(session_module, "_SNAPSHOT_INTERVAL", 0.0)
    session = with_edits(SETUPS[name], 25, seed=3)
    stands = session.interventions.state()
    with monkeypatch.context() as still:
        still.setattr(Colony, "tick", lambda *_: pytest.fail("a tick was replayed"))
        *_, undone = session.undone()[0]
    last = session.changes[-1]
    done, changes = tuple(session.edits[:last]), tuple(session.changes[:-1])
    log = Log(session.setup, done, undone.steps, None, None, changes=changes)
    *_, again = Session.replay(log)
    assert undone.steps == session.edits[last][0]
    assert undone.to_bytes() == again.to_bytes()
    assert undone.ticks == again.ticks
    for one in (undone, again):
        one.advance(10)
        (seen,) = played(Recording(one.recorder.header(), [one.recorder.whole()]))
        present = list(one.colony.snapshot().fields.values())
        assert len(seen.fields) == len(present)
        assert all(map(np.array_equal, seen.fields, present))
    assert undone.to_bytes() == again.to_bytes()
    assert session.interventions.state() == stands


def test_snapshots_are_bounded_by_time_and_memory(monkeypatch):
    session = Session(SETUPS["foraging"])
    monkeypatch.setattr(session_module, "_SNAPSHOT_INTERVAL", 60.0)
    for _ in range(20):
        session.apply({"episode": {}})
    assert len(session._snapshots) == 1
    monkeypatch.setattr(session_module, "_SNAPSHOT_INTERVAL", 0.0)
    monkeypatch.setattr(session_module, "_MOST_KEPT", 100_000)
    for _ in range(30):
        session.advance(5)
        session.apply({"epsilon": 0.5})
    numbers, contents = zip(*session._snapshots, strict=True)
    assert 2 < len(numbers) < 30
    assert sum(map(len, contents)) <= 100_000
    assert numbers == tuple(range(50 - len(numbers), 50))
    monkeypatch.setattr(session_module, "_LARGEST", 0)
    session.apply({"episode": {}})
    assert len(session._snapshots) == len(numbers)
    while session.edits:
        *_, session = session.undone()[0]
    with pytest.raises(AntsError, match="there is nothing to undo"):
        session.undone()


@pytest.mark.parametrize("name", MARKED)
def test_a_page_that_joins_late_sees_what_the_others_see(name):
    session, rng = Session(SETUPS[name]), np.random.default_rng(4)
    first, late, header = [session.recorder.whole()], [], session.recorder.header()
    for step in range(90):
        if step == 45:
            late = [session.recorder.whole()]
        frame = session.advance()
        if step % 3 == 0:
            first.append(frame)
            late += [frame] if late else []
            try:
                frame = session.apply(random_edit(rng, session.interventions))
            except AntsError:
                continue
        first.append(frame)
        late += [frame] if late else []
    early = list(played(Recording(header, first)))
    joined = list(played(Recording(session.recorder.header(), late)))
    for a, b in zip(early[-len(joined) :], joined, strict=True):
        assert a.clock == b.clock
        for field in ("numbers", "cells", "headings", "loaded", "states", "ground", "trail"):
            assert np.array_equal(getattr(a, field), getattr(b, field)), field
        assert b.values.keys() <= a.values.keys()
        assert all(a.values[entry] == value for entry, value in b.values.items())
        known = {entry // 5 for entry in b.values}
        n_states = session.colony.task.n_states
        owners = b.numbers if session.colony.one_a_slot else b.nests
        assert set((owners * n_states + b.states).tolist()) <= known
    snapshot = session.colony.snapshot()
    assert np.array_equal(joined[-1].ground, snapshot.ground)
    assert len(joined[-1].fields) == len(snapshot.fields)
    assert all(map(np.array_equal, joined[-1].fields, snapshot.fields.values()))


def test_a_recording_holds_what_happened(edited):
    session = edited("foraging")
    before = session.interventions.state()
    whole = recording(Session.snapshots(session.log(), 10_000))
    few = recording(Session.snapshots(session.log(), 50))
    for one in (whole, few):
        last = list(played(unpacked(one.to_bytes())))[-1]
        snapshot = session.colony.snapshot()
        assert np.array_equal(last.ground, snapshot.ground)
        assert np.array_equal(last.trail, snapshot.trail)
        assert np.array_equal(np.sort(last.cells), np.sort(snapshot.ant_cells))
    assert session.steps < len(whole) < session.steps + 200
    assert 20 < len(few) <= 52
    acting = [moment for moment in played(whole) if len(moment.actions)]
    assert len(acting) > 0.9 * session.ticks
    assert session.interventions.state() == before


def test_exports_are_files_of_the_project(edited, tmp_path):
    session = edited("foraging")
    (tmp_path / "x").write_bytes(session.policy_bytes())
    policy = load_policy(tmp_path / "x")
    assert np.array_equal(policy.q_values, session.colony.q_values[0])
    assert policy.task == session.colony.task
    with pytest.raises(AntsError, match="several tables"):
        edited("paper").policy_bytes()
    for name in ("foraging", "paper", "nests"):
        one = edited(name)
        (tmp_path / name).write_bytes(one.colony_bytes())
        colony = Colony.load(tmp_path / name)
        assert colony == one.colony
        again = replayed(one.to_bytes())
        again.colony_bytes()
        colony.tick(9)
        again.colony.tick(9)
        assert colony == again.colony, name
    assert gif_bytes(Session.snapshots(session.log(), 4)).startswith(b"GIF89a")


WRONG = [
    (None, "an intervention is None"),
    ({"remove_ants": [0]}, "the cell 0 is outside the world"),
    ({"place": {"what": "queen", "cells": [60, 61]}}, "a single cell for the queen"),
    ({"place": {"what": "rock", "cells": [60] * 400_001}}, "at most 400000 are allowed"),
    ({"task": {"pheromone.half_life": 9}}, "half_life` is 9.0; leave"),
    ({"ants": 41}, "because the capacity of this colony is 40"),
]


def test_parameters_of_own_rules_have_values_that_change_while_ants_run():
    session = Session(SETUPS["rules"])
    values = sliders(session.interventions)
    assert values["live_bump.most"]._asdict() | {"help": ""} == {
        **{"value": 400, "least": 1, "most": 900, "step": 1},
        **{"path": "task.rules.live_bump.most", "edits": None, "help": ""},
    }
    assert "largest level" in values["live_bump.most"].help
    share = values["live_bump.share"]
    assert share.least == 0 < share.value == 0.5 < share.most
    session.apply({"task": {"rules.live_bump.most": 7}})
    session.advance(30)
    assert sliders(session.interventions)["live_bump.most"].value == 7
    assert session.colony.snapshot().trail.max() <= 7
    assert session.colony.snapshot().fields["home"].max() > 7
    assert "901" in refused_edit(session, {"task": {"rules.live_bump.most": 901}})


def refused_edit(session: Session, edit: object) -> str:
    before, edits = session.interventions.state(), list(session.edits)
    text = refused("", session.apply, edit)
    assert session.interventions.state() == before
    assert session.edits == edits
    assert len(text) < 300
    return text


def test_wrong_edits_change_nothing():
    session = Session(SETUPS["foraging"])
    session.advance(7)
    for edit, said in WRONG:
        assert said in refused_edit(session, edit), edit
    follows = Session(SETUPS["queueing"])
    shown = ["ants", "deposit", "epsilon", "evaporation", "slope"]
    assert sorted(sliders(follows.interventions)) == shown
    assert "no learning rate" in refused_edit(follows, {"learning_rate": 0.5})


def test_rates_that_were_set_decay_no_more():
    session = Session(SETUPS["foraging"])
    for edit in ({"epsilon": 0.5}, {"learning_rate": 0.4}, {"episode": {}}):
        session.apply(edit)
    for _ in range(4):
        session.advance(10)
    assert session.colony.episode > 1
    assert (session.colony.epsilon, session.colony.learning_rate) == (0.5, 0.4)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"steps": 10}, "steps is"),
        ({"edits": [], "changes": []}, "does not end as it did"),
        ({"edits": [[0, {"explode": {}}]], "changes": [0]}, "explode"),
        ({"edits": [[5, {"episode": {}}], [4, {"episode": {}}]]}, "steps is 4"),
        ({"changes": [1]}, "damaged"),
        ({"changes": [0, 10**6]}, "changes is 1000000"),
        ({"setup": {"world": "/etc/passwd"}}, "TypeError"),
    ],
)
def test_files_that_were_altered_are_refused(edited, changes, said, tmp_path):
    path = tmp_path / "x.npz"
    edited("foraging").save(path)
    arrays = archives.read(path)
    facts = {**json.loads(arrays["facts"].item()), **changes}
    archives.write(path, {**arrays, "facts": np.array(json.dumps(facts))})
    with pytest.raises(
        AntsError, match=r"^the session in .* (is damaged|cannot be used).*\.$"
    ) as e:
        Session.load(path)
    assert said in str(e.value)


def test_a_file_that_unpacks_to_much_more_is_refused(edited, monkeypatch):
    monkeypatch.setattr(session_module, "KIND", replace(session_module.KIND, most=1000))
    with pytest.raises(AntsError, match=r"unpacks to .* bytes, and at most 1000 are allowed"):
        replayed(edited("foraging").to_bytes())


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"world": "nowhere"}, "the world is 'nowhere'"),
        ({"world": "Q ?\n"}, "'?'"),
        ({"world": "open", "world_settings": {"ranges": [9000, 9000, 1]}}, "81036004 cells"),
        ({"world": "open", "world_settings": {"size": 3}}, "`world.size` is not a setting"),
        ({"policy": {**LEARNS.as_dict(), "epsilon": 3}}, "`training.epsilon` is 3"),
        (
            {"capacity": 100_000, "sharing": "independent", "task": {"observation": "six_cells"}},
            "action values in independent tables",
        ),
    ],
)
def test_wrong_setups_say_why(changes, said):
    facts = {**SETUPS["paper"].to_json(), **changes}
    refused(said, lambda: Session(Setup.from_json(facts)))


def clock(session: Session, frame: bytes) -> dict[str, float]:
    types = session.recorder.header()["types"]
    return dict(zip(CLOCK, unpack(types, frame)["clock"].tolist(), strict=True))


def test_a_late_page_is_told_of_the_whole_progress():
    """Also of a session that was loaded, and of episodes that an intervention ended."""
    session, ends = Session(SETUPS["foraging"]), []
    for steps in (26, 26, 10):
        session.advance(steps - 1)
        outcome = session.colony.outcome()
        ends.append([session.colony.episode, session.ticks, outcome.returns[0, 0]])
        session.apply({"episode": {}})
    *_, again = Session.replay(session.log())
    for one in (session, again):
        points = unpack(one.recorder.header()["types"], one.recorder.whole())["progress"].reshape(
            -1, len(POINT)
        )
        ended = points[:, POINT.index("ended")] == 1
        named = [POINT.index(name) for name in ("episode", "ticks", "returns")]
        assert points[ended][:, named].tolist() == ends
        assert points[0, POINT.index("ticks")] == 0
        assert (points[~ended][:, POINT.index("episode")] == 0).all()


def test_a_recording_counts_what_was_delivered_between_its_frames(edited):
    """And a page that joins late is told the same."""
    session = edited("foraging")
    counted, again = 0, Session(session.setup)

    def delivered() -> int:
        return int(again.colony.outcome().deliveries[0, 0])

    for steps, edit in [*session.edits, (session.steps, {})]:
        while again.steps < steps:
            counted += delivered() * again.ended
            again.advance(1)
        counted += delivered() * ("episode" in edit or not edit)
        if edit:
            again.apply(edit)
    few = recording(Session.snapshots(session.log(), 20))
    types = few.header["types"]
    told = [
        unpack(types, frame)["clock"][CLOCK.index("delivered")]
        for frame in (few.frames[-1], session.recorder.whole())
    ]
    assert told == [counted, counted]
    assert counted > 0


@pytest.mark.parametrize(("what", "content"), [("rock", OBSTACLE), ("food", FOOD)])
def test_a_wall_across_a_road_of_ants_has_no_hole(what, content):
    """Ants in the way are moved aside, to the nearest empty cells; nothing else of them changes."""
    colony = Colony(worlds.paper(), tasks.foraging(), LEARNS, 2, ants=40)
    colony.begin_episode()
    colony.tick(200)
    interventions = Interventions(colony)
    before = {name: colony.arrays[name].copy() for name in colony._columns()}
    cells = np.sort(before["cell"])[::2]
    interventions.apply(Place(what, cells.tolist()))
    assert (colony.snapshot().ground[cells] == content).all()
    for name in before.keys() - {"cell", "state", "paper_state"}:
        assert np.array_equal(colony.arrays[name], before[name]), name
    moved = before["cell"] != colony.arrays["cell"]
    assert np.array_equal(moved, np.isin(before["cell"], cells))
    assert_sound(interventions)


def test_an_ant_without_room_stays_where_it_is():
    colony = Colony(worlds.from_text("Q   0   F\n"), tasks.foraging(), LEARNS, ants=1)
    colony.begin_episode()
    interventions, (cell,) = Interventions(colony), colony.snapshot().ant_cells
    interventions.apply(Place("rock", [cell]))
    assert colony.snapshot().ground[cell] == EMPTY
    assert colony.snapshot().ant_cells.tolist() == [cell]
