"""The server: who gets in, what pages receive, and that no page can do harm."""

import http.client
import time
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

from taichi_ants.learners.policies import Policy, trail_follower
from taichi_ants.live import server
from taichi_ants.live.choices import Choices
from taichi_ants.live.session import Log
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
    while shared.pages:
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
        assert (status, headers["Allow"]) == (405, "GET")
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


def assert_same(guest: Guest, session) -> None:
    """Check that a page has the world of the session."""
    *_, shown = played(Recording(guest.header, guest.frames))
    snapshot = session.colony.snapshot()
    assert shown.clock[1] == session.colony.ticks
    assert np.array_equal(shown.ground, snapshot.ground)
    assert np.array_equal(shown.trail, snapshot.trail)
    assert sorted(shown.cells.tolist()) == sorted(snapshot.ant_cells.tolist())


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
        guest.ask("speed", value=1000)
    while room.pages:
        time.sleep(0.01)
    time.sleep(0.1)
    stands = room.session.ticks
    time.sleep(0.3)
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
    *("\0", "\ufeff{}", "x" * 2**18),
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


def test_what_is_refused_is_one_sentence_for_the_page_that_asked(room):
    before = state_of(room)
    incomplete = {name: CHOSEN[name] for name in list(CHOSEN)[1:]}
    wrong = [{"world": "/etc/passwd"}, {"world": "map", "map": "paper"}, {"policy": "file ../a"}]
    wrong += [{"policy": 7}, {"size": [30, 30, 30]}, {"ants": "12"}, {"ticks": 1e9}]
    chosen = [None, incomplete, *({**CHOSEN, **values} for values in wrong)]
    edits = [{}, {"explode": 1}, {"place": ["ground"]}, {"policy": "random"}, {"epsilon": 7}]
    with Guest(room) as guest:
        for ask in (
            *(lambda one=one: guest.ask("begin", chosen=one) for one in chosen),
            *(lambda one=one: guest.edit(one) for one in edits),
        ):
            ask()
            words = guest.until("error")["words"]
            assert words.endswith(".")
            assert "\n" not in words
        assert state_of(room) == before
        guest.ask("step", ticks=1)  # the page stays open
        guest.until("frame")


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


def test_back_returns_to_the_session_before_several_replacements(room):
    """Neither a second press nor a second page takes away the session that was there before."""
    with Guest(room) as guest, Guest(room) as other:

        def replace_by(page: Guest, what: str, **more) -> None:
            page.ask(what, **more)
            guest.until("whole")

        guest.ask("step", ticks=3)
        cell = int(np.flatnonzero(room.session.colony.snapshot().ground == EMPTY)[0])
        for level in (5, 6, 7):
            guest.edit({"trail": {"level": level, "cells": [cell]}})
        guest.until("state")
        while len(room.session.edits) < 3:
            guest.until("state")
        drawn = room.session
        for what, more, left in (
            ("undo", {}, 1),
            ("restart", {}, 0),
            ("begin", {"chosen": CHOSEN}, 0),
        ):
            for page in (guest, other):
                replace_by(page, what, **more)
            assert len(room.session.edits) == left
            replace_by(guest, "back")
            assert room.session is drawn
        # The next undo keeps what has happened after an undo.
        replace_by(guest, "undo")
        guest.ask("step", ticks=1)
        state_after(guest, room, 4)
        gone_on = room.session
        replace_by(guest, "undo")
        replace_by(guest, "back")
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
    assert state_of(room) == before


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
