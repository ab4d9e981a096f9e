"""Sessions: replayed to the bit, seen alike by all who look on, and nothing wrong changes them."""

from __future__ import annotations

import contextlib
import functools
import json
import math
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from command_lines import ROOT, environment
from interrupts import interrupted_after_launch
from playback import played, unpack, unpacked
from random_edits import random_edit

from taichi_ants import (
    AntsError,
    Colony,
    Life,
    Pheromone,
    Task,
    TrainingConfig,
    World,
    interventions,
    load_policy,
)
from taichi_ants import task as tasks
from taichi_ants.files import archives
from taichi_ants.learners.policies import Policy, trail_follower
from taichi_ants.live import session as session_module
from taichi_ants.live.choices import Choices
from taichi_ants.live.exports import gif_bytes, recording
from taichi_ants.live.session import Log, Session, Setup
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE
from taichi_ants.viewer import Recording, recorder
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
TWO_NESTS = text_map.to_text(
    World((7, 7, 7), [(0, 6, 0), (6, 0, 3)], [(0, 0, 5), (1, 0, 5), (5, 5, 0)], [(0, 3, 0)])
)
GATE = [(3, 0, 0), (3, 1, 0)]  # a rock and an empty cell
FOODS = [(2, 0, 0), (0, 3, 0)]
GATED = Setup(
    text_map.to_text(World((5, 5, 5), (0, 0, 0), FOODS, GATE[:1], regions={"gate": GATE})),
    *(tasks.foraging(), LEARNS),
    ants=2,
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
    "fields": Setup("open", HOMING, LEARNS, 20, world_settings=SMALL, pheromone="home"),
}
LATER = ("queueing", "lively")
MARKED = [pytest.param(one, marks=[pytest.mark.slow] * (one in LATER)) for one in SETUPS]


def with_edits(setup: Setup, n: int, seed: int = 0) -> Session:
    """A session after n edits drawn at random, and some ticks between them."""
    session, rng = Session(setup), np.random.default_rng(seed)
    while len(session.edits) < n:
        try:
            session.apply(random_edit(rng, session.interventions))
        except AntsError:
            continue
        for _ in range(int(rng.integers(0, 3))):
            session.advance(int(rng.choice([1, 1, 9])))
    return session


def replayed(content: bytes) -> Session:
    """The session in a file that somebody has sent."""
    *_, session = Session.replay(Log.from_bytes(content))
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
def test_changes_are_undone_one_by_one(name):
    """Each time the session is as it was before the change, whatever happened since."""
    session, rng, before = Session(SETUPS[name]), np.random.default_rng(7), []
    for _ in range(6):
        session.advance(int(rng.integers(1, 9)))
        stands = session.interventions.state(), session.ticks, session.steps, list(session.edits)
        for part in range(int(rng.integers(1, 4))):
            with contextlib.suppress(AntsError):
                session.apply(random_edit(rng, session.interventions), goes_on=part > 0)
        if len(session.edits) > len(stands[-1]):
            before.append(stands)
    session.advance(20)
    assert len(before) > 3
    for stands in reversed(before):
        *_, session = session.undone()
        assert (
            session.interventions.state(),
            session.ticks,
            session.steps,
            session.edits,
        ) == stands
    with pytest.raises(AntsError, match="there is nothing to undo"):
        session.undone()


@pytest.mark.parametrize("name", MARKED)
def test_a_snapshot_gives_the_same_bits_as_a_replay_from_the_start(name, monkeypatch):
    """Undoing takes no tick, however long the session was, and leaves the session as it is."""
    monkeypatch.setattr(session_module, "_BETWEEN", 0.0)
    session = with_edits(SETUPS[name], 25, seed=3)
    stands = session.interventions.state()
    with monkeypatch.context() as still:
        still.setattr(Colony, "tick", lambda *_: pytest.fail("a tick was replayed"))
        *_, undone = session.undone()
    last = session.changes[-1]
    done, changes = tuple(session.edits[:last]), tuple(session.changes[:-1])
    log = Log(session.setup, done, undone.steps, None, None, changes=changes)
    *_, again = Session.replay(log)
    assert undone.steps == session.edits[last][0]
    assert undone.same(again)
    assert undone.to_bytes() == again.to_bytes()
    assert undone.ticks == again.ticks
    for one in (undone, again):
        one.advance(10)
        (seen,) = played(Recording(one.header(), [one.snapshot()]))
        assert np.array_equal(seen.trail, one.colony.snapshot().fields[session.setup.pheromone])
    assert undone.same(again)
    assert session.interventions.state() == stands


def test_snapshots_are_bounded_by_time_and_memory(monkeypatch):
    session = Session(SETUPS["foraging"])
    for _ in range(20):
        session.apply({"episode": {}})
    few = len(session._snapshots)
    assert few < 1 + session._spent / session_module._BETWEEN
    monkeypatch.setattr(session_module, "_BETWEEN", 0.0)
    monkeypatch.setattr(session_module, "_MOST_KEPT", 200_000)
    for _ in range(60):
        session.advance(5)
        session.apply({"epsilon": 0.5})
    kept = session._snapshots
    assert 2 < len(kept) < 60
    assert sum(len(one.content) for one in kept) <= 200_000
    assert kept[-1].edits == len(session.edits) - 1
    monkeypatch.setattr(session_module, "_LARGEST", 0)
    session.apply({"episode": {}})
    assert len(session._snapshots) == len(kept)
    for _ in range(10):
        *_, session = session.undone()
    assert len(session.edits) == 71


def test_a_file_knows_what_was_one_change(tmp_path):
    session = Session(SETUPS["paper"])
    (cells,) = np.nonzero(session.colony.snapshot().ground == EMPTY)
    for part, cell in enumerate(cells[:5].tolist()):
        session.apply({"trail": {"level": 9, "cells": [cell]}}, goes_on=part not in (0, 2))
    session.save(tmp_path / "session.npz")
    again = Session.load(tmp_path / "session.npz")
    assert again.changes == session.changes == [0, 2]
    *_, again = again.undone()
    assert len(again.edits) == 2


@pytest.mark.long
def test_threads_and_processes_do_not_matter(edited, tmp_path, kernels):
    script = (
        "import sys; from taichi_ants import runtime; from taichi_ants.live.session import Session;"
        "runtime.start(int(sys.argv[1]));"
        "print(*(Session.load(path).interventions.state() for path in sys.argv[2:]))"
    )
    names = ("foraging", "lively")
    paths = [str(tmp_path / f"{name}.npz") for name in names]
    for name, path in zip(names, paths, strict=True):
        edited(name).save(path)
    for threads in ("1", "2"):
        done = subprocess.run(
            [sys.executable, "-c", script, threads, *paths],
            # Nor does it matter how kernels are compiled.
            env=environment(kernels, TI_ADVANCED_OPTIMIZATION="1"),
            cwd=ROOT,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        assert done.stdout.split() == [edited(name).interventions.state() for name in names]


def test_pieces_of_time_do_not_matter():
    one, other = Session(SETUPS["foraging"]), Session(SETUPS["foraging"])
    while one.steps < 60:
        one.advance(100)  # not beyond the end of an episode
    while other.steps < one.steps:
        other.advance()
    assert one.ticks == other.ticks == 3 * 25
    assert one.colony.episode == 2
    assert one.interventions.state() == other.interventions.state()


@pytest.mark.parametrize("name", MARKED)
def test_a_page_that_joins_late_sees_what_the_others_see(name):
    session, rng = Session(SETUPS[name]), np.random.default_rng(4)
    first, late, header = [session.snapshot()], [], session.header()
    for step in range(90):
        if step == 45:
            late = [session.snapshot()]
            header["names"] |= session.news()
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
    joined = list(played(Recording(session.header(), late)))
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
    assert np.array_equal(joined[-1].trail, snapshot.fields[session.setup.pheromone])


def test_states_have_names_before_they_are_seen_on_pages():
    setup = replace(SETUPS["foraging"], task=Task(observation="six_cells"))
    session = Session(setup)
    names = dict(session.header()["names"])
    assert 0 < len(names) < session.colony.task.n_states
    session.news()
    for _ in range(20):
        session.advance()
        names |= session.news()
        assert set(session.colony.states[session.colony.living].tolist()) <= names.keys()
    assert session.news() == {}
    assert session.header()["names"] == names


def test_a_recording_holds_what_happened(edited):
    session = edited("foraging")
    before = session.interventions.state()
    whole = recording(session.log(), most_frames=10_000)
    few = recording(session.log(), most_frames=50)
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
    assert gif_bytes(session.log(), most_frames=4).startswith(b"GIF89a")


def test_what_a_hand_has_put_stays_and_what_is_of_an_episode_goes():
    session = Session(replace(SETUPS["foraging"], ticks_per_episode=0))
    ground = session.colony.arrays["ground"]
    a, b, c, d, e = np.flatnonzero(ground == EMPTY)[:5].tolist()
    session.apply({"place": {"what": "rock", "cells": [a]}})
    session.apply({"place": {"what": "food", "cells": [b]}})
    session.apply({"place": {"what": "queen", "cells": [c]}})
    session.apply({"trail": {"level": 77, "cells": [d]}})
    session.apply({"add_ants": {"cells": [e], "heading": 2}})
    session.apply({"ants": 25})
    snapshot = session.colony.snapshot()
    assert (snapshot.trail[d], len(snapshot.ant_cells)) == (77, 25)
    session.apply({"episode": {}})
    snapshot = session.colony.snapshot()
    assert snapshot.ground[[a, b]].tolist() == [OBSTACLE, FOOD]
    assert session.colony.worlds[0].grid.index(session.colony.worlds[0].queen) == c
    assert (snapshot.trail[d], len(snapshot.ant_cells)) == (0, 25)


WRONG = [
    (None, "an intervention is None"),
    ([], "an intervention is []"),
    ({}, "with the name of one intervention"),
    ({"explode": {}}, "name of an intervention is 'explode'"),
    ({"policy": "random"}, "cannot change the policy"),
    ({"place": {}}, "`place.what` is missing"),
    ({"episode": {"now": 1}}, "`episode.now` is not a setting"),
    ({"episode": {}, "ants": 1}, "with the name of one intervention"),
    ({"remove_ants": [0]}, "the cell 0 is outside the world"),
    ({"clear": {"cells": [[1, 2]]}}, "has the cell [1, 2]"),
    ({"clear": [[10**9, 0, 0]]}, "the cell (1000000000, 0, 0) is outside the world"),
    ({"clear": "gate"}, "there is no region 'gate'"),
    ({"place": {"what": "queen", "cells": [60, 61]}}, "a single cell for the queen"),
    ({"task": {"observation": "paper"}}, "the task cannot change observation from"),
    ({"place": {"what": "lava", "cells": [60]}}, "what` is 'lava'"),
    ({"place": {"what": 5, "cells": [60]}}, "what` is 5"),
    ({"place": {"what": "rock", "cells": []}}, "cells` is empty"),
    ({"place": {"what": "rock", "cells": "60"}}, "no region '60'"),
    ({"place": {"what": "rock", "cells": {"60": 1}}}, "cells` is"),
    ({"place": {"what": "rock", "cells": [60] * 10**6}}, "at most 10000 edits of"),
    ({"place": {"what": "rock", "cells": [60, True]}}, "cells` is True"),
    ({"place": {"what": "rock", "cells": [60.0]}}, "cells` is 60.0"),
    ({"place": {"what": "rock", "cells": [math.nan]}}, "cells` is nan"),
    ({"place": {"what": "rock", "cells": [-1]}}, "the cell -1 is"),
    ({"place": {"what": "rock", "cells": [0]}}, "the cell 0 is"),  # of the border
    ({"place": {"what": "rock", "cells": [10**30]}}, "the cell 10000"),
    ({"place": {"what": "rock", "cells": "all"}}, "no region 'all'"),
    ({"trail": {"level": -1, "cells": [60]}}, "level` is -1"),
    ({"trail": {"level": True, "cells": [60]}}, "level` is True"),
    ({"trail": {"level": 1.5, "cells": [60]}}, "level` is 1.5"),
    ({"trail": {"level": 10**7, "cells": [60]}}, "level` is 10000000"),
    ({"add_ants": {"cells": [60], "heading": 6}}, "heading` is 6"),
    ({"add_ants": {"cells": [60], "heading": "up"}}, "heading` is 'up'"),
    ({"place": {"what": "queen", "cells": [None]}}, "cells` is None"),
    ({"place": {"what": "queen", "cells": [[60]]}}, "has the cell [60]"),
    ({"gravity": 1}, "'gravity'"),
    ({"task": {"pheromone.half_life": 9}}, "half_life` is 9.0; leave"),  # trails fall by 1
    ({"epsilon": [1]}, "`epsilon.value` is [1]"),
    ({"epsilon": math.nan}, "`epsilon.value` is nan"),
    ({"epsilon": math.inf}, "`epsilon.value` is inf"),
    ({"epsilon": 1.01}, "`epsilon.value` is 1.01"),
    ({"epsilon": True}, "`epsilon.value` is True"),
    ({"epsilon": "0.1"}, "`epsilon.value` is '0.1'"),
    ({"epsilon": 10**400}, "`epsilon.value` is 1000"),
    ({"ants": 0}, "`ants.number` is 0"),
    ({"ants": 2.0}, "`ants` is 2.0"),
    ({"ants": 41}, "ants is 41"),
    ({"evaporation": 2}, "'evaporation'"),
    ({"task": {"pheromone.slope": 0}}, "slope` is 0"),
]


def refused(session: Session, edit: object) -> str:
    before, edits = session.interventions.state(), list(session.edits)
    with pytest.raises(AntsError) as caught:
        session.apply(edit)
    assert session.interventions.state() == before
    assert session.edits == edits
    text = str(caught.value)
    assert text.endswith(".")
    assert "\n" not in text
    assert len(text) < 300
    return text


@pytest.mark.parametrize("edit", [
    *({"clear": "gate"}, {"clear": {"cells": "gate"}}, {"move": [[2, 0, 0], [1, 0, 0]]}),
    {"trail": 5},
    *({"trail": {"level": 7, "cells": "gate"}}, {"place": {"what": "food", "cells": "gate"}}),
    *({"add_ants": "gate"}, {"add_ants": [[3, 1, 2], [1, 0, 0]]}, {"remove_ants": 0.5}),
    *({"add_ants": 2}, {"clear": [[2, 0, 0], [2, 0, 0]]}, {"ants": np.int64(3)}),
    *({"place": {"what": "queen", "cells": [[1, 0, 0]]}}, {"task": {"pheromone": {"level": 3}}}),
])  # fmt: skip
def test_sessions_replay_each_form_of_an_intervention(edit, tmp_path):
    """Docs/protocol.md describes them; the colony is that to which the intervention applies."""
    session = Session(GATED)
    session.advance(5)
    twin = Session(GATED)
    twin.advance(5)
    before = twin.interventions.state()
    interventions.from_dict(edit).apply(twin.interventions)
    session.apply(edit)
    assert session.interventions.state() == twin.interventions.state() != before
    session.save(tmp_path / "session.npz")
    assert Session.load(tmp_path / "session.npz").same(session)


def test_files_with_the_names_of_regions_are_replayed():
    """Earlier versions saved them, and refused to load them."""
    session = Session(GATED)
    session.apply({"clear": "gate"})
    named = replace(session.log(), edits=((0, {"clear": {"cells": "gate"}}),))
    *_, again = Session.replay(named)
    assert again.same(session)


def test_wrong_edits_change_nothing():
    session = Session(SETUPS["foraging"])
    session.advance(7)
    for edit, said in WRONG:
        assert said in refused(session, edit), edit
    follows = Session(SETUPS["queueing"])
    assert follows.values().keys() == {"ants", "epsilon", "deposit", "slope", "evaporation"}
    assert "no learning rate" in refused(follows, {"learning_rate": 0.5})


def test_what_was_interrupted_is_counted(monkeypatch):
    session = Session(SETUPS["foraging"])

    def interrupted(n, tick=session.colony.tick):
        tick(n)
        raise KeyboardInterrupt

    monkeypatch.setattr(session.colony, "tick", interrupted)
    with pytest.raises(KeyboardInterrupt):
        session.advance(7)
    assert (session.ticks, session.colony.ticks) == (7, 7)
    assert replayed(session.to_bytes()).interventions.state() == session.interventions.state()


def test_edits_without_room_change_nothing():
    session = Session(SETUPS["foraging"])
    session.advance(7)
    snapshot = session.colony.snapshot()
    free = np.flatnonzero(session.colony.arrays["ground"] == EMPTY).tolist()
    foods = np.flatnonzero(snapshot.ground == FOOD).tolist()
    cells = np.flatnonzero(session.colony.grid.exists).tolist()
    said = refused(session, {"add_ants": {"cells": free, "heading": None}})
    assert "the capacity of this colony is 40" in said
    queen = int(np.flatnonzero(snapshot.ground == 13)[0])
    for cell in (queen, foods[0], int(snapshot.ant_cells[0])):
        assert "the queen cannot move to cell" in refused(
            session, {"place": {"what": "queen", "cells": [cell]}}
        )
    # What has been eaten is at the start of the next episode, so that only this takes all.
    assert "the last food" in refused(session, {"clear": {"cells": cells}})
    session = Session(SETUPS["queueing"])  # nobody learns
    session.apply({"remove_ants": {"cells": cells}})
    assert "would leave" in refused(session, {"place": {"what": "rock", "cells": cells}})


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"steps": 10}, "steps is"),
        ({"steps": 10**12}, "steps is"),
        ({"steps": None}, "steps is None"),
        ({"edits": [], "changes": []}, "does not end as it did"),
        ({"edits": [[0, {"explode": {}}]], "changes": [0]}, "explode"),
        ({"edits": [[5, {"episode": {}}], [4, {"episode": {}}]]}, "steps is 4"),
        ({"edits": 7}, "damaged"),
        ({"edits": []}, "changes is "),
        ({"changes": 7}, "damaged"),
        ({"changes": [1]}, "damaged"),
        ({"changes": [0, 0]}, "damaged"),
        ({"changes": [0, 1.0]}, "changes is 1.0"),
        ({"changes": [0, 10**6]}, "changes is 1000000"),
        ({"setup": {"world": "/etc/passwd"}}, "policy is None"),
        ({"state": "0"}, "does not end as it did"),
        ({"state": None}, "state is None"),
        ({"setup": None}, "setup is None"),
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


@pytest.mark.parametrize("content", [b"", b"nothing", b"PK\3\4" + bytes(100)])
def test_no_session_at_all(content):
    with pytest.raises(AntsError, match=r"'the loaded file' .*\.$"):
        replayed(content)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"world": "nowhere"}, "the world is 'nowhere'"),
        ({"world": "pyproject.toml"}, "the world is 'pyproject.toml'"),
        ({"world": 3}, "world is 3"),
        ({"world": "Q ?\n"}, "'?'"),
        ({"world": "Q" + " " * 4999 + "F\n"}, "a world of ranges ("),
        ({"world": "open", "world_settings": {"ranges": [9000, 9000, 1]}}, "81036004 cells"),
        ({"world": "open", "world_settings": {"size": 3}}, "`world.size` is not a setting"),
        ({"world": "open", "world_settings": {"ranges": "abc"}}, "ranges are 'abc'"),
        ({"task": {"observation": "none"}}, "none"),
        ({"task": {"gravity": 1}}, "gravity"),
        ({"task": 4}, "`task` is 4"),
        ({"policy": "table"}, "policy is 'table'"),
        ({"policy": {"learner": "sarsa"}}, "policy is"),
        ({"policy": {**LEARNS.as_dict(), "epsilon": 3}}, "`training.epsilon` is 3"),
        ({"policy": {**LEARNS.as_dict(), "learner": "mine"}}, "no learner 'mine'"),
        ({"policy": "file.npz"}, "policy is 'file.npz'"),
        ({"ants": 0}, "ants is 0"),
        ({"ants": True}, "ants is True"),
        ({"ants": 10**9}, "ants is"),
        ({"ants": 9, "capacity": 8}, "capacity is 8"),
        ({"ants": 9999}, "9999 ants"),
        (
            {"capacity": 100_000, "sharing": "independent", "task": {"observation": "six_cells"}},
            "memory",
        ),
        ({"seed": 2**70}, "a seed"),
        ({"seed": 1.5}, "a seed"),
        ({"ticks_per_episode": -1}, "ticks_per_episode is -1"),
        ({"sharing": "frozen"}, "sharing is 'frozen'"),
        ({"colour": "red"}, "'colour' is not a field of a setup"),
        ({"epsilon": math.nan}, "epsilon is nan"),
    ],
)
def test_wrong_setups_say_why(changes, said):
    facts = {**SETUPS["paper"].to_json(), **changes}
    with pytest.raises(AntsError) as caught:
        Session(Setup.from_json(facts))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", MARKED)
def test_setups_are_json(name):
    setup = SETUPS[name]
    facts = json.loads(json.dumps(setup.to_json()))
    again = Setup.from_json(facts, None if setup.learns else setup.policy)
    assert again.to_json() == setup.to_json()
    assert Session(again).interventions.state() == Session(setup).interventions.state()


@pytest.mark.parametrize("table", [np.zeros((3, 5)), np.zeros((2, 128, 5)), "paper", None, [[1j]]])
def test_a_policy_is_a_training_or_one_table(table):
    with pytest.raises(AntsError, match=r"^(policy|q_values) .*\.$"):
        Setup("paper", Task(), table)


def test_a_policy_of_several_nests_is_exported_if_they_share_it(tmp_path):
    two = SETUPS["nests"]
    with pytest.raises(AntsError, match=r"^ants have several tables, but .* export the colony"):
        Session(two).policy_bytes()
    table = trail_follower("ants")
    follows = Session(replace(two, policy=table))
    (tmp_path / "policy.npz").write_bytes(follows.policy_bytes())
    assert np.array_equal(load_policy(tmp_path / "policy.npz").q_values, table)


GROUPS = tasks.foraging().replace(
    castes={"nurse": {"threshold": 5.0}, "scout": {"share": 0.3, "epsilon": 0.4}, "guide": {}},
    foods={"seed": {"deliver": 90, "regrowth": 5}, "sap": {"loads": 3}},
    labour=tasks.Labour("thresholds", demand=0.05, relief=1, stop_probability=0.5),
)
OF_GROUPS = Setup(
    text_map.to_text(World((7, 7, 7), (0, 6, 0), [(0, 0, 5), (1, 0, 5), (5, 5, 0)])).replace(
        "F", "G", 1
    ),
    *(GROUPS.replace(castes={"guide": {"policy": "trail_follower"}}), LEARNS),
    ants=20,
)


def test_what_the_task_or_the_page_lacks_is_refused_with_what_to_do():
    with pytest.raises(AntsError, match=r"2 kinds of food, but the task 1; add the others to"):
        Session(replace(SETUPS["nests"], world="Q   G   F\n"))
    with pytest.raises(AntsError, match=r"castes.guide.policy` is '/etc/passwd', but the live pag"):
        replace(OF_GROUPS, task=GROUPS.replace(castes={"guide": {"policy": "/etc/passwd"}}))
    policy = Policy(np.zeros((GROUPS.n_states, 5), np.float32), "ants", {"task": GROUPS.as_dict()})
    with pytest.raises(AntsError, match=r"`task.foods` has seed, sap, which the form of the live"):
        Choices({"mine": policy})


@pytest.mark.slow
def test_a_session_with_castes_and_kinds_of_food_is_replayed(tmp_path):
    session = Session(OF_GROUPS)
    session.advance(40)
    snapshot = session.colony.snapshot()
    assert set(snapshot.ant_castes.tolist()) == {0, 1, 2}
    assert snapshot.ant_idle.any()
    free = np.flatnonzero(snapshot.ground == EMPTY).tolist()[:3]
    session.apply({"place": {"what": "food", "cells": free, "kind": "sap"}})
    assert set(session.colony.snapshot().food_kinds[free].tolist()) == {1}
    session.apply({"task": {"castes.scout.epsilon": 0.1, "foods.seed.deliver": 50}})
    session.advance(60)
    session.apply({"episode": {}})
    session.advance(20)
    again = replayed(session.to_bytes())
    assert again.interventions.state() == session.interventions.state()
    assert gif_bytes(session.log(), most_frames=3).startswith(b"GIF")
    frames = recording(session.log(), 9)
    assert frames.header["castes"] == ["nurse", "scout", "guide"]
    *_, before = session.undone()
    assert before.colony.episode == 0


def test_the_queen_of_any_nest_moves():
    session = Session(SETUPS["nests"])
    session.advance(10)
    before = session.colony.snapshot().queens
    empty = np.flatnonzero(session.colony.snapshot().ground == EMPTY)
    cell = int(next(one for one in empty if session.interventions.is_empty(int(one))))
    session.apply({"place": {"what": "queen", "nest": 1, "cells": [cell]}})
    assert session.colony.snapshot().queens.tolist() == [before[0], cell]
    session.apply({"episode": {}})
    assert session.colony.snapshot().queens.tolist() == [before[0], cell]


def test_what_a_hand_has_set_stays_in_later_episodes():
    session = Session(SETUPS["foraging"])
    session.apply({"epsilon": 0.25})
    for _ in range(3):
        session.apply({"episode": {}})
    assert session.colony.epsilon == 0.25  # though it decays if nobody sets it
    assert session.colony.learning_rate < LEARNS.learning_rate  # which nobody has set
    session.apply({"learning_rate": 0.0})
    tables = session.colony.q_values
    session.advance(25)
    session.advance(25)
    session.advance(25)
    assert session.colony.episode == 4
    assert np.array_equal(session.colony.q_values, tables)


def test_a_recording_counts_what_was_delivered_between_its_frames(edited):
    """And a page that joins late is told the same."""
    session = edited("foraging")
    counted, again = 0, Session(session.setup)
    for steps, edit in session.edits:
        while again.steps < steps:
            counted += int(again.colony.outcome().deliveries[0, 0]) * again.ended
            again.leap(1)
        counted += int(again.colony.outcome().deliveries[0, 0]) * ("episode" in edit)
        again.apply(edit)
    while again.steps < session.steps:
        counted += int(again.colony.outcome().deliveries[0, 0]) * again.ended
        again.leap(1)
    counted += int(again.colony.outcome().deliveries[0, 0])
    few = recording(session.log(), most_frames=20)
    types = few.header["types"]
    told = [
        unpack(types, frame)["clock"][CLOCK.index("delivered")]
        for frame in (few.frames[-1], session.snapshot())
    ]
    assert told == [counted, counted]
    assert counted > 0


def clock(session: Session, frame: bytes) -> dict[str, float]:
    types = session.header()["types"]
    return dict(zip(CLOCK, unpack(types, frame)["clock"].tolist(), strict=True))


def test_a_leap_is_as_many_steps_through_episodes():
    slow, quick = Session(SETUPS["foraging"]), Session(SETUPS["foraging"])
    while slow.steps < 57:  # two episodes of 25 ticks, and some
        slow.advance()
    told = clock(quick, quick.leap(57))
    assert quick.interventions.state() == slow.interventions.state()
    assert (told["episode"], told["tick"]) == (2, 5)
    assert told["ticks"] == quick.ticks == slow.ticks == 55
    assert clock(quick, quick.snapshot())["ticks"] == 55


def test_a_late_page_is_told_of_the_whole_progress():
    """Also of a session that was loaded, and of episodes that an intervention ended."""
    session, ends = Session(SETUPS["foraging"]), []
    for steps in (26, 26, 10):
        session.leap(steps - 1)
        outcome = session.colony.outcome()
        ends.append([session.colony.episode, session.ticks, outcome.returns[0, 0]])
        session.apply({"episode": {}})
    *_, again = Session.replay(session.log())
    for one in (session, again):
        points = unpack(one.header()["types"], one.snapshot())["progress"].reshape(-1, len(POINT))
        ended = points[:, POINT.index("ended")] == 1
        named = [POINT.index(name) for name in ("episode", "ticks", "returns")]
        assert points[ended][:, named].tolist() == ends
        assert points[0, POINT.index("ticks")] == 0
        assert (points[~ended][:, POINT.index("episode")] == 0).all()


def test_a_long_progress_is_thinned(monkeypatch):
    monkeypatch.setattr(recorder, "_MOST", 8)
    session = Session(SETUPS["foraging"])
    for _ in range(60):
        session.apply({"episode": {}})
    ends = [point for point in session._recorder.progress.points() if point[-1]]
    assert 4 <= len(ends) <= 8
    assert len({b[0] - a[0] for a, b in pairwise(ends)}) == 1


def test_a_session_that_was_interrupted_after_a_launch_replays():
    """While it ticks, between two episodes, and in an edit, which it refuses to go on from."""
    session = Session(replace(GATED, ticks_per_episode=20))
    session.leap(3)
    with interrupted_after_launch():
        session.leap(5)
    assert session.ticks == session.colony.ticks > 3
    session.leap(20 - session.ticks)
    assert session.ended
    with interrupted_after_launch():
        session.advance()
    session.apply({"episode": {}})
    session.apply({"epsilon": 0.5})
    session.leap(4)
    *_, same = Session.replay(session.log())
    assert same.steps == session.steps
    with interrupted_after_launch():
        session.apply({"place": {"what": "food", "cells": [(1, 1, 0)]}})
    with pytest.raises(AntsError, match="an intervention was interrupted"):
        session.leap(1)


@pytest.mark.parametrize("policy", [TrainingConfig("sarsa", 0.1, 0.9, 0.3, 0.9), trail_follower()])
def test_ants_that_choose_without_action_values_need_no_policy(tmp_path, policy):
    task = Task(choice=tasks.Choice("deneubourg"), life=tasks.Life(regrowth=0))
    one = Session(Setup("paper", task, policy, ants=12))
    one.advance(40)
    assert {"ants", "deposit"} <= one.values().keys()
    assert not {"epsilon", "learning_rate"} & one.values().keys()
    assert one.header()["rule"] == "deneubourg"
    with pytest.raises(AntsError, match="ants have no table"):
        one.policy_bytes()
    one.save(tmp_path / "one.npz")
    assert Session.load(tmp_path / "one.npz").same(one)
    alone = Colony(one.setup.build_world(), task, None, 0, ants=12, sharing="frozen")
    alone.begin_episode()
    alone.tick(40)
    assert np.array_equal(alone.snapshot().ant_cells, one.colony.snapshot().ant_cells)
