"""The server of the live page and of its session.

The server is reachable only from this machine. It serves the live page and a WebSocket for each
open page; a socket requires the server's own page and its token. Pages send requests as JSON, see
`SessionServer._do`; the server sends JSON messages and frames, see `taichi_ants.viewer.frames`.

The thread that calls `SessionServer.run` serves the sockets. What takes long runs in another
thread, one call at a time, so that connections stay open. Work of several turns is a job, see
`taichi_ants.live.exports`.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import json
import logging
import math
import secrets
import socket
import threading
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

from taichi_ants.errors import AntsError, imported, words_of
from taichi_ants.live.choices import Choices, sliders
from taichi_ants.live.exports import LOAD, QUICK, SLOW, Export, Replay
from taichi_ants.live.session import Log, Session
from taichi_ants.viewer.page import assemble, part

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

SCRIPTS = ("socket.js", "source.js", "tools.js", "controls.js")  # a part uses those before it
PARTS = ("controls.html", "live.css", *SCRIPTS)

HOST = "127.0.0.1"
FRAMES_A_SECOND = 30
FASTEST = 1000.0  # ticks/s; at this speed the session runs as fast as possible

_MOST_UPLOAD = 2**22  # bytes of a session file, or another request
_MOST_IN_FLIGHT = 12  # frames sent to a page before it has drawn the first of them
_FEW = 4  # with fewer frames per episode, each frame shows another episode
_PHASES = 24  # number of such frames that together show the course of an episode
_STATE_EVERY = 0.5  # seconds
_PROGRESS_EVERY = 0.2  # seconds
_QUIET = logging.getLogger("taichi_ants.live")  # keeps foreign requests out of the terminal
_QUIET.addHandler(logging.NullHandler())
_QUIET.propagate = False

# Requests to refuse during a replay: they would be lost, or change the session if it is cancelled.
_CHANGES = ("play", "step", "edit", "undo", "load", "back", "begin", "restart")

_HEADERS = {
    "Allow": "GET",
    "Cache-Control": "no-store",
    "Content-Security-Policy": "frame-ancestors 'none'",  # the page itself contains the other rules
    "Cross-Origin-Opener-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
}


@cache
def live_page(server: str) -> str:
    """Return the HTML of the viewer with controls; it connects only to `server`."""
    controls, style, *scripts = (part(name, "taichi_ants.live") for name in PARTS)
    parts = {"controls": controls, "style": style, "script": "\n".join(scripts)}
    return assemble("Taichi Ants, live", **parts, connect=server)


class Closed(Exception):  # noqa: N818
    """The reason to close a socket: a request that the live page never sends."""


class Page:
    """An open page."""

    def __init__(self, connection: ServerConnection) -> None:
        self.connection = connection
        self.in_flight = 0  # frames that were sent, but not drawn yet
        self.behind = False  # if True, the next frame must be a complete one

    def send(self, *messages: str | bytes) -> None:
        """Send messages without waiting; pings disconnect pages that never read."""
        from websockets.asyncio.server import broadcast

        for message in messages:
            broadcast([self.connection], message)

    def show(self, frame: bytes) -> None:
        """Send a frame of changes, unless too many frames are unseen: then the page is behind."""
        self.behind = self.behind or self.in_flight >= _MOST_IN_FLIGHT
        if not self.behind:
            self.in_flight += 1
            self.send(frame)

    def acknowledge(self, frames: int) -> bool:
        """Return whether the page was behind and, after drawing `frames` more, no longer is."""
        self.in_flight = max(0, self.in_flight - frames)
        return self.behind and self.in_flight == 0

    def begin(self, *messages: str | bytes) -> None:
        """Send messages that end with a complete frame."""
        self.in_flight, self.behind = 1, False
        self.send(*messages)


class SessionServer:
    """The server of a session that several pages can watch and change together.

    Pages offer `choices`. The server listens on `port`; 0 means any free port. Worker processes
    that replay the session call `prepare` first, for example to load a plugin. If `playing`, the
    session runs as soon as a page is open. Raises AntsError if the library `websockets` is not
    installed, or the port cannot be used.
    """

    def __init__(
        self,
        session: Session,
        choices: Choices,
        port: int = 0,
        prepare: Callable[[], None] | None = None,
        playing: bool = False,
    ) -> None:
        imported("the live page", "websockets", "watch")
        try:
            self._socket = socket.create_server((HOST, port))
        except OSError as error:
            raise AntsError(
                f"port {port} of {HOST} cannot be used: {error.strerror}; choose another --port."
            ) from None
        self.session, self.choices = session, choices
        self.port = self._socket.getsockname()[1]
        self.token = secrets.token_urlsafe(24)
        self.playing, self.speed = playing, 12.0
        self._shown = secrets.token_hex(8)  # identifies the session for pages that reconnect
        self.pages: set[Page] = set()  # that are open
        self._engine = ThreadPoolExecutor(1, "session")
        self._turns = asyncio.Lock()  # for turns and requests, which use or change the session
        self._over = threading.Event()
        self._ticks_due, self._frame_steps, self._due = 0.0, 1.0, 0.0  # see _advance_frame
        self._prepare = prepare
        self._previous: Session | None = None  # the session before the present one
        self._undone: tuple[int, int] | None = None  # its steps and edits, after an undo
        self._stroke: tuple[Page, float] | None = None  # page and number of the last edit's stroke
        self._jobs: dict[str, Replay | Export] = {}  # running job: LOAD, or a file of SLOW
        self._compiles = False  # whether the first step of a session is running
        self._next_state = 0.0  # time of the next state message

    @property
    def url(self) -> str:
        """The address of the page, with the token."""
        return f"http://{HOST}:{self.port}/?token={self.token}"

    def end(self) -> None:
        """Make `run` return soon; can be called from any thread."""
        self._over.set()

    def run(
        self, seconds: float | None = None, each_turn: Callable[[], object] = lambda: None
    ) -> None:
        """Serve pages and run the session, for some `seconds` or until `end` is called.

        Calls `each_turn` several times per second; its exceptions end the server and propagate.
        """
        asyncio.run(self._run(math.inf if seconds is None else seconds, each_turn))

    async def _run(self, seconds: float, each_turn: Callable[[], object]) -> None:
        from websockets.asyncio.server import serve

        settings: dict[str, Any] = {
            **{"max_size": _MOST_UPLOAD, "max_queue": 4, "compression": None},
            **{"open_timeout": 10, "ping_interval": 20, "ping_timeout": 20, "close_timeout": 0.3},
            **{"process_request": self._open, "logger": _QUIET},
        }
        end = time.monotonic() + seconds
        try:
            async with serve(self._handle_messages, sock=self._socket, **settings):
                while not self._over.is_set() and time.monotonic() < end:
                    each_turn()
                    async with self._turns:
                        await self._turn()
                    wait = self._due - time.monotonic() if self._runs else 1.0
                    await asyncio.sleep(0 if LOAD in self._jobs else min(wait, 1 / FRAMES_A_SECOND))
                self._send(_message("over"))
        finally:
            for job in self._jobs.values():
                job.cancel()
            self._engine.shutdown()

    async def _work(self, act: Callable[..., Any], *arguments: Any) -> Any:
        """Return the result of a call that may take long, in the engine's thread."""
        return await asyncio.get_running_loop().run_in_executor(self._engine, act, *arguments)

    @property
    def _runs(self) -> bool:
        """Whether the session runs; it pauses during a replay of the session that replaces it."""
        return self.playing and LOAD not in self._jobs

    async def _turn(self) -> None:
        """Advance by a frame if one is due, continue jobs, and send the state from time to time."""
        runs = self._runs and bool(self.pages)  # pause if no page is open
        now = time.monotonic()
        if now >= self._next_state:
            interval = _PROGRESS_EVERY if self._jobs else _STATE_EVERY if runs else math.inf
            self._next_state = now + interval
            self._send(self._state())
        for kind, job in [*self._jobs.items()]:
            await self._work(job.proceed)
            if job.result is not None:
                self._finish_job(kind, job)
        if runs and time.monotonic() >= self._due:
            await self._advance_frame()

    def _finish_job(self, kind: str, job: Replay | Export) -> None:
        """Begin the finished session, send the finished file to its page, or send an error."""
        del self._jobs[kind]
        self._next_state = 0.0
        if isinstance(job.result, Session):
            self._begin(job.result, undoes=job.undoes)
        elif isinstance(job.result, bytes):
            self._send(_message("file", name=SLOW[kind][0]), job.result, to=job.page)
        else:
            self._send(_message("error", words=job.result), to=job.page)

    async def _advance_frame(self) -> None:
        began, before = time.monotonic(), self.session.steps
        if self.speed >= FASTEST:
            ticks = self._steps_per_frame()
        else:
            self._ticks_due += max(1.0, self.speed / FRAMES_A_SECOND)
            ticks = int(self._ticks_due)
            self._ticks_due -= ticks
        try:
            await self._advance(ticks)
        except AntsError as error:  # for example if a learner's values are no longer finite
            self.playing = False
            self._send(_message("error", words=str(error)))
        took, passed = time.monotonic() - began, self.session.steps - before
        if passed == ticks and took > 0:
            self._frame_steps = min(2.0 * passed, max(1.0, passed / (took * FRAMES_A_SECOND)))
        interval = 0.0 if self.speed >= FASTEST else 1 / min(self.speed, FRAMES_A_SECOND)
        self._due = max(self._due + interval, began + took)  # do not catch up on lost time

    def _steps_per_frame(self) -> int:
        """Return the estimated number of steps that fill the time of a frame.

        If this is a large part of an episode, each frame shows another episode, at a slightly later
        tick. So pages show the course of an episode slowly.
        """
        steps, length = int(self._frame_steps), self.session.setup.ticks_per_episode
        if not length or _FEW * steps < length:
            return steps
        cycle = length + 1  # including the step that begins the next episode
        return max(1, round(steps / cycle)) * cycle + max(1, length // _PHASES)

    async def _advance(self, ticks: int) -> None:
        """Advance by ticks, and show them; the first call compiles kernels, which takes seconds."""
        self._compiles = self.session.steps == 0
        if self._compiles:
            self._send(self._state())
        try:
            self._show(await self._work(self.session.advance, ticks))
        finally:
            if self._compiles:
                self._compiles, self._next_state = False, 0.0  # send the new state at once

    async def _answer(self, page: Page, request: Any) -> None:
        """Perform a request or send its page an error; then send the state to all pages soon."""
        async with self._turns:
            try:
                await self._do(page, request)
            except (AntsError, MemoryError) as error:
                self._send(_message("error", words=words_of(error)), to=page)
            self._send_state_soon()

    def _send_state_soon(self) -> None:
        self._next_state = min(self._next_state, time.monotonic() + 1 / FRAMES_A_SECOND)

    async def _do(self, page: Page, request: Any) -> None:
        """Perform a JSON request of a page; raise Closed if no live page sends it."""
        if LOAD in self._jobs and isinstance(request, dict) and request.get("do") in _CHANGES:
            raise AntsError("a session is being replayed; wait until it ends, or cancel it.")
        match request:
            case {"do": "play"}:
                self.playing, self._due = True, time.monotonic()
            case {"do": "pause"}:
                self.playing = False
            case {"do": "step", "ticks": int(ticks)} if 1 <= ticks <= 100:
                self.playing = False
                for _ in range(ticks):
                    await self._advance(1)
            case {"do": "speed", "value": int(speed) | float(speed)} if 1 <= speed <= FASTEST:
                self.speed, self._due = float(speed), time.monotonic()  # ticks/s
            case {"do": "edit", "edit": dict(edit), "stroke": int(number)}:
                # See `interventions`; the number is equal for edits of one stroke.
                stroke = page, number
                self._show(await self._work(self.session.apply, edit, stroke == self._stroke))
                self._stroke = stroke
            case {"do": "undo"}:
                sessions, steps = await self._work(self.session.undone)
                self._jobs[LOAD] = Replay(sessions, steps, undoes=True)
            case {"do": "load", "content": bytes(content)}:  # which is a binary message
                log = await self._work(Log.read, "the loaded file", content)
                self._jobs[LOAD] = Replay(Session.replay(log), log.steps)
            case {"do": "back"}:  # return to the session before the present one
                if self._previous is None:
                    raise AntsError("there is no earlier session; continue with this one.")
                self._begin(self._previous, comes_back=True)
            case {"do": "begin", "chosen": chosen}:
                self._begin(await self._work(Session, self.choices.setup(chosen)))
            case {"do": "restart"}:
                self._begin(await self._work(Session, self.session.setup))
            case {"do": "export", "kind": str(kind)} if kind in QUICK:
                name, make = QUICK[kind]
                content = await self._work(make, self.session)
                self._send(_message("file", name=name), content, to=page)
            case {"do": "export", "kind": str(kind)} if kind in SLOW:
                if self._jobs.keys() & SLOW.keys():
                    raise AntsError("another file is being made; wait for it, or cancel it.")
                self._jobs[kind] = Export(kind, self.session, self._prepare, page)
            case {"do": "cancel", "kind": str(kind)}:  # it may have ended already
                if kind in self._jobs:
                    self._jobs.pop(kind).cancel()
                    self._send(_message("cancelled", kind=kind))
            case {"do": "quit"}:
                self.end()
            case _:
                raise Closed("the live page never sends such a request")

    def _begin(self, session: Session, undoes: bool = False, comes_back: bool = False) -> None:
        """Replace the session; pages can return to the previous one with the request "back".

        After several undos in a row, "back" returns to the session before the first. If the new
        session equals the present one, "back" does not change.
        """
        before = self.session
        in_a_row = undoes and self._undone == (before.steps, len(before.edits))
        if comes_back or not (in_a_row or before.to_bytes() == session.to_bytes()):
            self._previous = before
        self._undone = (session.steps, len(session.edits)) if undoes else None
        self.session, self._shown = session, secrets.token_hex(8)
        self.playing, self._frame_steps, self._stroke = False, 1.0, None
        self._send_whole(self.pages)

    def _send_whole(self, pages: Iterable[Page], begins: bool = True) -> None:
        """Send a complete frame to pages; with `begins`, also facts of the session."""
        messages: list[str | bytes] = [_message("snapshot"), self.session.recorder.whole()]
        if begins:
            chosen = self.choices.chosen(self.session.setup)
            facts = {"header": self.session.recorder.header(), "choices": self.choices.as_dict()}
            begin = _message("begin", session=self._shown, chosen=chosen, **facts)
            messages = [begin, self._state(), *messages]
        for page in pages:
            page.begin(*messages)

    def _show(self, frame: bytes) -> None:
        for page in self.pages:
            page.show(frame)

    def _state(self) -> str:
        session = self.session
        works = [
            {"kind": kind, "done": job.done, "total": job.total} for kind, job in self._jobs.items()
        ]
        return _message(
            "state",
            playing=self._runs,
            speed=self.speed,
            pages=len(self.pages),
            ticks=session.ticks,
            can_undo=bool(session.changes),
            can_go_back=self._previous is not None,
            values={name: v._asdict() for name, v in sliders(session.interventions).items()},
            works=works + [{"kind": "kernels", "done": 0, "total": 0}] * self._compiles,
        )

    def _send(self, *messages: str | bytes, to: Page | None = None) -> None:
        for page in [to] if to else self.pages:
            page.send(*messages)

    def _open(self, connection: ServerConnection, request: Request) -> Response | None:
        """Return the page or an error; None opens a socket.

        The page does not contain a secret; a socket requires the token.
        """
        method = getattr(request, "method", "GET")  # websockets before 17 accepts only GET
        url = urlsplit(request.path)
        hosts = {f"{name}:{self.port}" for name in (HOST, "localhost")}
        host, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        opens, tokens = url.path == "/socket", parse_qs(url.query).get("token", [])
        mine = len(host) == 1 and host[0] in hosts
        # The origin of a socket must be this server. The page must not be requested by other pages.
        mine = mine and (origins == [f"http://{host[0]}"] or (not origins and not opens))
        knows = hmac.compare_digest("".join(tokens[:1]).encode(), self.token.encode())
        if method != "GET":
            response = connection.respond(405, "Only GET is allowed here.\n")
        elif not mine or not (knows or (url.path == "/" and not tokens)):
            response = connection.respond(403, "Open the address that the command printed.\n")
        elif opens:
            return None
        elif url.path != "/":
            response = connection.respond(404, "This page does not exist.\n")
        else:
            response = connection.respond(200, live_page(f"ws://{host[0]}"))
            del response.headers["Content-Type"]
            response.headers["Content-Type"] = "text/html; charset=utf-8"
        for name, value in _HEADERS.items():
            response.headers[name] = value
        return response

    async def _handle_messages(self, connection: ServerConnection) -> None:
        from websockets.exceptions import ConnectionClosed

        page = Page(connection)
        try:
            async with self._turns:
                self.pages.add(page)
                self._send_whole([page])
                self._send_state_soon()
            async for message in connection:
                match request := _read(message):
                    case {"do": "seen", "frames": int(frames)} if 0 <= frames <= 1000:
                        if page.acknowledge(frames):
                            async with self._turns:
                                self._send_whole([page], begins=False)
                    case _:
                        await self._answer(page, request)
        except Closed as error:
            await connection.close(1008, str(error))
        except ConnectionClosed:
            pass
        finally:
            self.pages.discard(page)
            async with self._turns:  # cancel the files that this page has asked for
                for kind in [kind for kind, job in self._jobs.items() if job.page is page]:
                    self._jobs.pop(kind).cancel()
                self._send_state_soon()


def _message(kind: str, /, **facts: Any) -> str:
    return json.dumps({"say": kind, **facts}, separators=(",", ":"))


def _read(message: str | bytes) -> Any:
    """Return the request in a message of a page, None if it is not JSON."""
    if isinstance(message, bytes):
        return {"do": "load", "content": message}
    with contextlib.suppress(ValueError, RecursionError):
        return json.loads(message)
    return None
