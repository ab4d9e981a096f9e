"""The command that serves the live page: how it begins and ends, and what it needs."""

import re
import signal
import sys
import time
import urllib.request
from pathlib import Path

import pytest
from command_lines import call, load, promptly, start

from taichi_ants import AntsError
from taichi_ants.live import server
from taichi_ants.live.choices import Choices
from taichi_ants.live.server import SessionServer
from taichi_ants.live.session import Session


@pytest.mark.slow
def test_ctrl_c_ends_it_promptly_in_one_line(kernels: Path, tmp_path: Path) -> None:
    process = start("watch", ["--no-browser"], kernels, tmp_path)
    assert process.stdout is not None
    url = process.stdout.readline().strip()
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/\?token=[\w-]{32}", url)
    with urllib.request.urlopen(url, timeout=30) as page:
        assert b"viewer" in page.read()
    began = time.monotonic()
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=30)
    assert time.monotonic() - began < promptly()
    assert process.returncode == 130
    assert said == "Stopped.\n"
    assert not list(tmp_path.iterdir())


def test_the_first_session_delivers_and_runs(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    rooms = []

    class Recorded(SessionServer):
        def __init__(self, *given: object, **options: object) -> None:
            rooms.append(super().__init__(*given, **options) or self)  # type: ignore[arg-type]

        def run(self, *given: object) -> None:
            """Do not serve."""

    monkeypatch.setattr(server, "SessionServer", Recorded)
    assert call("watch", [], capsys)[0] == 0
    (room,) = rooms
    colony = room.session.colony
    assert room.playing
    assert (colony.episode, colony.ticks, colony.learns) == (20, 300, True)
    assert colony.outcome().deliveries[0, 0] > 100
    # Most of the ants that carry food walk on trails.
    snapshot = colony.snapshot()
    assert (snapshot.trail[snapshot.ant_cells[snapshot.ant_carries]] > 0).mean() > 0.9


def test_a_saved_session_goes_on_for_some_seconds(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    session = Session(Choices({}).setup(load("watch").START))
    session.advance(3)
    session.save(tmp_path / "mine.npz")
    arguments = ["--duration", 1, "--session", tmp_path / "mine.npz"]
    began = time.monotonic()
    status, said, err = call("watch", arguments, capsys)
    assert (status, err) == (0, "")
    assert said.endswith("Ended.\n")
    assert time.monotonic() - began >= 1
    status, _, said = call("watch", ["--session", tmp_path / "none.npz"], capsys)
    assert status == 2
    assert "none.npz" in said


def test_a_browser_is_opened_on_a_private_file(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its command line, which all users of the machine can read, does not hold the token."""
    watch, opened = load("watch"), []
    monkeypatch.setattr(watch.webbrowser, "open", opened.append)
    monkeypatch.setenv("DISPLAY", ":0")
    with watch._opened("http://127.0.0.1:1/?token=secret"):
        path = Path(urllib.request.url2pathname(opened[0].removeprefix("file://")))
        assert "secret" not in opened[0]
        assert 'url=http://127.0.0.1:1/?token=secret"' in path.read_text()
        assert path.stat().st_mode & 0o777 == 0o600
        assert path.parent.stat().st_mode & 0o777 == 0o700
    assert not path.parent.exists()


def test_without_the_library_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "websockets", None)
    session = Session(Choices({}).setup(load("watch").START))
    with pytest.raises(AntsError, match=r'pip install -e "\.\[watch\]" in your clone\.$'):
        SessionServer(session, Choices({}))


def test_a_port_that_is_taken_is_named() -> None:
    session = Session(Choices({}).setup(load("watch").START))
    room = SessionServer(session, Choices({}))
    with pytest.raises(AntsError, match=f"port {room.port} .* choose another --port"):
        SessionServer(session, Choices({}), room.port)
