"""The room: who gets in, what pages are told, and that nobody can do harm."""

from __future__ import annotations

import http.client
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from attacks import ATTACKS, attack
from command_lines import crowding
from playback import played
from rooms import CHOSEN, Guest, running
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from taichi_ants import AntsError
from taichi_ants.learners.policies import Policy, trail_follower
from taichi_ants.live import server
from taichi_ants.live.choices import Choices
from taichi_ants.live.session import Log, Session
from taichi_ants.task.constants import EMPTY
from taichi_ants.viewer import Recording


@pytest.fixture(scope="module")
def shared():
    with running(Choices({"mine": Policy(trail_follower("ants"), "ants", {})})) as one:
        yield one


@pytest.fixture
def room(shared):
    """The room, whose session stands as it stood when the test ends."""
    with Guest(shared) as guest:
        guest.ask("begin", chosen=CHOSEN)
        guest.until("whole")
    while shared._pages:
        time.sleep(0.01)
    return shared


def state_of(room) -> object:
    session = room.session
    return session.interventions.state(), session.ticks, list(session.edits)


def get(
    room, path: str, method: str = "GET", body: str | None = None, **headers: str
) -> tuple[int, dict[str, str], str]:
    with closing(http.client.HTTPConnection("127.0.0.1", room.port, timeout=30)) as line:
        line.request(method, path, body, headers)
        answer = line.getresponse()
        return answer.status, dict(answer.headers), answer.read().decode()


def test_the_page_is_given_to_no_other_page_and_holds_no_secret(room):
    here = f"127.0.0.1:{room.port}"
    good = f"/?token={room.token}"
    status, headers, text = get(room, good)
    assert status == 200
    assert f"connect-src ws://{here}" in text
    assert headers["Content-Type"] == "text/html; charset=utf-8"
    assert headers["Referrer-Policy"] == "no-referrer"
    assert "Set-Cookie" not in headers
    assert room.token not in text
    assert get(room, "/")[::2] == (200, text)  # as where it is reloaded
    first, more = room.token[:-1], f"{room.token}x"
    for query in (f"token={first}", f"token={more}", f"token=x&token={room.token}"):
        assert get(room, f"/?{query}")[0] == 403, query
    for path in ("/socket", "/socket?token=%ff%00", f"/socket?Token={room.token}"):
        assert get(room, path, Origin=f"http://{here}")[0] == 403, path
    assert get(room, good, Host=f"localhost:{room.port}")[0] == 200
    for host in ("evil.example", f"evil.example:{room.port}", "127.0.0.1", "", f"{here}, {here}"):
        assert get(room, good, Host=host)[0] == 403, host
    for path in (good, "/"):
        assert get(room, path, Origin="http://evil.example")[0] == 403
    for path in ("/etc/passwd", "/../../etc/passwd", "//", "/viewer.js", "/Socket"):
        assert get(room, f"{path}?token={room.token}")[0] in (403, 404), path


@pytest.mark.parametrize("method", ["POST", "OPTIONS"])
def test_nothing_can_be_sent_but_over_the_socket(room, method):
    before = state_of(room)
    for body in (None, "x" * 1000, "x" * 1_000_000):
        try:
            status, headers, _ = get(room, f"/?token={room.token}", method, body)
        except ConnectionError:
            continue  # the library closes what announces a body
        assert (status, headers["Allow"]) == (405, "GET, HEAD")
    assert state_of(room) == before


def test_sockets_are_for_pages_of_its_own(room):
    before = state_of(room)
    good = f"http://127.0.0.1:{room.port}"
    address = f"ws://127.0.0.1:{room.port}/socket?token="
    for token, origin in [
        *((room.token, one) for one in (None, "null", "http://evil.example", good + "0")),
        *((room.token, one) for one in (good.replace("http", "https"), "http://127.0.0.1")),
        *((one, good) for one in ("", room.token[1:], "x" * 5000)),
    ]:
        with pytest.raises(InvalidStatus) as refused:
            connect(address + token, origin=origin, proxy=None).__enter__()
        assert refused.value.response.status_code == 403
    assert state_of(room) == before


def shown(guest: Guest, session):
    """The world that a page has after all that it was sent."""
    recording = Recording(guest.header, guest.frames)
    return list(played(recording))[-1]


def assert_same(guest: Guest, session) -> None:
    one, snapshot = shown(guest, session), session.colony.snapshot()
    assert one.clock[1] == session.colony.ticks
    assert np.array_equal(one.ground, snapshot.ground)
    assert np.array_equal(one.trail, snapshot.trail)
    assert sorted(one.cells.tolist()) == sorted(snapshot.ant_cells.tolist())


def both(one: Guest, other: Guest, kind: str = "frame") -> None:
    one.until(kind)
    other.until(kind)


def test_all_pages_see_the_world_of_the_engine(room):
    free = int(room.session.colony.grid.index((5, 5, 0)))
    with Guest(room) as first, Guest(room) as second:
        for ticks in (1, 7):
            first.ask("step", ticks=ticks)
            for _ in range(ticks):
                both(first, second)
        first.edit({"place": {"what": "food", "cells": [free]}})
        both(first, second)
        with Guest(room) as late:
            for guest in (first, second, late):
                assert_same(guest, room.session)
            second.ask("step", ticks=1)
            for guest in (first, second, late):
                guest.until("frame")
                assert_same(guest, room.session)
        assert room.session.colony.snapshot().ground[free] == 7
        assert room.session.edits[0][1]["place"]["what"] == "food"


def test_a_page_that_is_slow_is_told_less_and_then_all(room):
    with Guest(room) as slow, Guest(room) as quick:
        for _ in range(3 * server._MOST_IN_FLIGHT):
            quick.seen(1)
            quick.ask("step", ticks=1)
            quick.until("frame")
        assert_same(quick, room.session)
        slow.ask("step", ticks=1)  # so that it hears of a state after all frames
        quick.until("frame")
        slow.until("state")
        while slow.state["ticks"] < room.session.ticks:
            slow.until("state")
        assert len(slow.frames) == server._MOST_IN_FLIGHT
        slow.seen(server._MOST_IN_FLIGHT)
        slow.until("whole")
        assert_same(slow, room.session)
        slow.ask("step", ticks=1)
        slow.until("frame")
        assert_same(slow, room.session)


def test_time_passes_while_somebody_looks_on(room):
    with Guest(room) as guest:
        guest.ask("speed", value=1000)
        guest.ask("play")
        for _ in range(3):
            guest.until("frame")
            guest.seen(1)
        while not guest.state["playing"]:
            guest.hear()
        guest.ask("pause")
        while guest.state["playing"]:
            guest.hear()
        stands = room.session.ticks
        time.sleep(0.3)
        assert room.session.ticks == stands > 1
        guest.ask("speed", value=1)
        guest.ask("play")
        guest.until("frame")
        began = time.monotonic()
        guest.until("frame")
        assert time.monotonic() - began > 0.5
    while room._pages:
        time.sleep(0.01)
    time.sleep(0.1)
    stands = room.session.ticks
    time.sleep(1.3)
    assert room.session.ticks == stands


def deep(n: int) -> str:
    return '{"do":"edit","edit":' + "[" * n + "]" * n + "}"


CLOSED = [
    *("", "null", "[]", "7", "{}", "nonsense", '"play"', '{"do":7}', '{"do":null}'),
    *('{"do":"explode"}', '{"do":"__init__"}', '{"do":["play"]}', '{"do":{}}'),
    *('{"do":"speed"}', '{"do":"speed","value":"12"}'),
    *('{"do":"speed","value":NaN}', '{"do":"speed","value":1e999}', '{"do":"speed","value":-1}'),
    *('{"do":"speed","value":' + "9" * 5000 + "}", '{"do":"step","ticks":1000000}'),
    *('{"do":"seen","frames":-5}', '{"do":"seen","frames":1e400}', '{"do":"seen"}'),
    *('{"do":"edit"}', '{"do":"edit","edit":7}', deep(3), deep(100_000)),
    *('{"do":"edit","edit":{"episode":{}}}', '{"do":"edit","edit":{},"stroke":"1"}'),
    *('{"do":"export"}', '{"do":"export","kind":"/etc/passwd"}', '{"do":"export","kind":[]}'),
    *("\0", "\ufeff{}", "x" * (server._MOST_TEXT + 1), '{"do":"play"' + " " * 2**18 + "}"),
]


def test_who_sends_what_no_page_sends_is_cut_off(room):
    before = state_of(room)
    for message in CLOSED:
        with Guest(room) as guest:
            guest.socket.send(message)
            guest.until_cut_off()
            assert guest.socket.close_code == 1008, message[:30]
            assert len(guest.socket.close_reason) > 10
    with Guest(room):  # it goes on for others
        assert state_of(room) == before
        assert not room.playing


REFUSED = [
    *({}, {"explode": 1}, {"place": None}, {"place": ["ground"]}, {"policy": "random"}),
    {"place": {"what": "rock", "cells": [10**9]}},
    {"place": {"what": "rock", "cells": [[1]]}},
    {"__class__": 1},
    {"epsilon": 7},
    {"ants": 10**7},
]


def test_an_edit_that_is_not_allowed_is_refused_in_one_sentence(room):
    before = state_of(room)
    with Guest(room) as guest:
        for edit in REFUSED:
            guest.edit(edit)
            words = guest.until("error")["words"]
            assert words.endswith("."), edit
            assert "\n" not in words
        guest.ask("step", ticks=1)  # the page stays
        guest.until("frame")
        assert before != state_of(room)
    assert room.session.edits == before[2]


NO_SESSIONS = [
    {"world": "/etc/passwd"},
    {"world": "map", "map": "paper"},
    {"policy": "file ../../policy"},
    {"policy": 7},
    {"size": [30, 30, 30]},
    {"ants": 0},
    {"ants": "12"},
    {"ticks": 1e9},
]


def test_a_session_that_cannot_be_is_refused(room):
    before = state_of(room)
    incomplete = {name: CHOSEN[name] for name in list(CHOSEN)[1:]}
    with Guest(room) as guest:
        for chosen in [None, incomplete, *({**CHOSEN, **wrong} for wrong in NO_SESSIONS)]:
            guest.ask("begin", chosen=chosen)
            assert guest.until("error")["words"].endswith("."), chosen
    assert state_of(room) == before


def test_fifty_pages_are_too_many_but_harm_nobody(room):
    before, guests = state_of(room), [Guest(room) for _ in range(server._MOST_PAGES)]
    for _ in range(50 - server._MOST_PAGES):
        with pytest.raises(InvalidStatus) as refused:
            Guest(room)
        assert refused.value.response.status_code == 503
    assert state_of(room) == before
    guests[0].until("whole")
    guests[0].ask("step", ticks=1)
    for guest in guests:
        guest.until("frame")
    assert_same(guests[0], room.session)
    for guest in guests:
        guest.close()
    while room._joined:
        time.sleep(0.01)
    with Guest(room):
        pass


def test_a_session_is_saved_and_loaded(room):
    with Guest(room) as guest, Guest(room) as other:
        guest.ask("step", ticks=20)
        free = int(room.session.colony.grid.index((5, 5, 0)))
        guest.edit({"place": {"what": "rock", "cells": [free]}})
        guest.ask("step", ticks=20)
        guest.ask("export", kind="session")
        saved = guest.until("session.npz")
        before = state_of(room)
        guest.ask("restart")
        both(guest, other, "whole")
        assert room.session.ticks == 0
        guest.socket.send(saved)
        both(guest, other, "whole")
        assert state_of(room) == before
        assert_same(guest, room.session)
        assert_same(other, room.session)
        guest.socket.send(saved[:-200] + b"\0" * 200)
        words = guest.until("error")["words"]
        assert words.startswith("'the loaded file' is damaged")
        assert state_of(room) == before


def test_what_several_in_a_row_have_replaced_comes_back(room):
    """Neither a second press nor a second page takes away the session that was there before."""
    with Guest(room) as guest, Guest(room) as other:

        def replaced(ask: Callable[[Guest], None], by: Guest) -> None:
            ask(by)
            guest.until("whole")

        guest.ask("step", ticks=3)
        cell = int(np.flatnonzero(room.session.colony.snapshot().ground == EMPTY)[0])
        for level in (5, 6, 7):
            guest.edit({"trail": {"level": level, "cells": [cell]}})
        guest.until("state")
        while len(room.session.edits) < 3:
            guest.until("state")
        drawn = room.session
        for one in (guest, other):
            replaced(lambda page: page.ask("undo"), one)
        assert len(room.session.edits) == 1
        replaced(lambda page: page.ask("back"), guest)
        assert room.session is drawn
        asks: list[Callable[[Guest], None]] = [
            lambda page: page.ask("restart"),
            lambda page: page.ask("begin", chosen=CHOSEN),
        ]
        for ask in asks:
            for one in (guest, other):
                replaced(ask, one)
            assert room.session.steps == 0
            replaced(lambda page: page.ask("back"), guest)
            assert room.session is drawn
        # What has happened after an undo is not taken away by the next one.
        replaced(lambda page: page.ask("undo"), guest)
        guest.ask("step", ticks=1)
        state_after(guest, room, 4)
        gone_on = room.session
        replaced(lambda page: page.ask("undo"), guest)
        replaced(lambda page: page.ask("back"), guest)
        assert room.session is gone_on


def state_after(guest: Guest, room, ticks: int) -> object:
    """How the session is as soon as so many ticks have passed and all was answered."""
    guest.until("state")
    while guest.state["ticks"] < ticks:
        guest.until("state")
    return state_of(room)


@pytest.mark.parametrize("name", ATTACKS)
def test_a_file_that_would_hold_the_server_is_refused_at_once(room, name, tmp_path):
    content, before = attack(name, room.session, tmp_path), state_of(room)
    with Guest(room) as guest:
        began = time.monotonic()
        guest.socket.send(content)
        words = guest.until("error")["words"]
        assert time.monotonic() - began < 1.0 * crowding()
    assert ATTACKS[name][1] in words
    assert "\n" not in words
    assert state_of(room) == before
    with pytest.raises(AntsError, match=ATTACKS[name][1]):  # as --session does
        Session.load(tmp_path / "session.npz")


@pytest.fixture
def endless(room, tmp_path) -> bytes:
    """A file of a session that takes minutes to replay."""
    log = room.session.log()
    replace(log, steps=10**8, ticks=10**8).write(tmp_path / "endless.npz")
    return (tmp_path / "endless.npz").read_bytes()


def test_a_replay_can_be_cancelled_and_pages_are_answered_meanwhile(room, endless):
    with Guest(room) as guest:
        before = state_of(room)
        guest.socket.send(endless)
        working(guest, "load")
        asked = time.monotonic()
        guest.ask("speed", value=12)
        guest.until("state")
        assert time.monotonic() - asked < 0.5 * crowding()
        guest.ask("undo")
        assert "a session is being replayed" in guest.until("error")["words"]
        guest.ask("cancel", kind="load")
        guest.until("cancelled")
        assert state_of(room) == before


def working(guest: Guest, kind: str, done: int = 1) -> dict:
    """What a page is told of work that takes long, as soon as so much is done."""
    while True:
        for work in guest.state["works"]:
            if work["kind"] == kind and work["done"] >= done:
                return work
        guest.until("state")


def test_a_file_that_is_made_can_be_cancelled(room, endless):
    with Guest(room) as guest, Guest(room) as other:
        room.session.log = lambda: Log.read("endless", endless)
        guest.ask("export", kind="gif")
        while not other.state["works"]:
            other.until("state")
        assert other.state["works"][0]["kind"] == "gif"
        making = room._jobs["gif"]
        other.ask("cancel", kind="gif")
        both(guest, other, "cancelled")
        for page in (guest, other):
            while page.state["works"]:
                page.until("state")
        making._process.join(2)
        assert not making._process.is_alive()
        guest.ask("export", kind="page")
        while not other.state["works"]:
            other.until("state")
        guest.close()  # nobody waits for it any more
        while other.state["works"] or other.state["pages"] > 1:
            other.until("state")
        assert not room._jobs


@pytest.mark.parametrize(
    ("piece", "length", "steps"),
    [(7, 0, 7), (249, 1000, 249), (250, 1000, 1042), (2400, 1000, 2043), (9.5, 1, 9)],
)
def test_frames_show_the_phases_of_episodes_in_turn(piece, length, steps):
    room = SimpleNamespace(
        _frame_steps=piece, session=SimpleNamespace(setup=SimpleNamespace(ticks_per_episode=length))
    )
    assert server.SessionServer._steps_per_frame(room) == steps
