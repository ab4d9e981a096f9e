"""The room in which people watch a session: its pages, and the thread in which time passes.

The room serves one page, and a socket for each page that is open. It listens on this machine alone,
and only a page of its own that knows its token gets a socket. A page asks for things in JSON, see
`Room._do`; it is told what happens in JSON and in frames, see `taichi_ants.viewer.frames`.

Two threads: one serves the sockets, the other, which calls `Room.run`, has the session. What pages
ask for goes through a queue; messages to pages go back to the thread of the sockets. Files that
pages upload are checked in further threads and replayed by processes, see `exports.Making`.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import json
import logging
import math
import queue
import secrets
import socket
import threading
import time
from collections.abc import Callable
from functools import cache, partial
from importlib import resources
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

from taichi_ants.errors import AntsError
from taichi_ants.live.choices import Choices
from taichi_ants.live.exports import LOAD, QUICK, SLOW, Making, Undoing, uploaded
from taichi_ants.live.session import Log, Session
from taichi_ants.viewer.page import assemble

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

SCRIPTS = ("token.js", "source.js", "tools.js", "controls.js")  # a part uses those before it
PARTS = ("controls.html", "live.css", *SCRIPTS)

HOST = "127.0.0.1"
FRAMES_A_SECOND = 30
FASTEST = 1000.0  # ticks a second; a page that asks for these gets as many as there can be

_MOST_PAGES = 24
_MOST_TEXT = 2**18  # bytes of a request
_MOST_UPLOAD = 2**22  # bytes of a session
_MOST_UNSEEN = 12  # frames that a page is sent before it has drawn the first of them
_MOST_WAITING = 2**27  # bytes that wait for a page that does not read
_FEW = 4  # frames of an episode, below which each shows another one
_PHASES = 24  # frames that such episodes make one of
_STATE_EVERY = 0.5  # seconds
_PROGRESS_EVERY = 0.2  # seconds
_BREATH = 0.004  # seconds after each frame, in which the thread of the sockets gets its turn
_LONGEST_WAIT = 0.2  # seconds, for a request, before it looks whether it is to end
_QUIET = logging.getLogger("taichi_ants.live")  # what strangers send is no news for the terminal
_QUIET.addHandler(logging.NullHandler())
_QUIET.propagate = False


# What would be lost, or would take away the session that is to go on if a replay is cancelled.
_CHANGES = ("play", "step", "edit", "undo", "back", "begin", "restart")

_HEADERS = {
    "Allow": "GET, HEAD",
    "Cache-Control": "no-store",
    "Content-Security-Policy": "frame-ancestors 'none'",  # the page has its other rules in itself
    "Cross-Origin-Opener-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Resource-Policy": "same-origin",
}


@cache
def live_page(server: str) -> str:
    """The viewer with controls beside the world, as HTML; it connects to `server` alone."""
    folder = resources.files(__package__)
    controls, style, *scripts = (folder.joinpath(name).read_text("utf-8") for name in PARTS)
    more = {"controls": controls, "style": style, "script": "\n".join(scripts)}
    return assemble("Taichi Ants, live", **more, connect=server)


class Closed(Exception):  # noqa: N818
    """A page has sent what no page of ours sends; its socket is closed."""


class Page:
    """One page that is open, in the thread of the sockets."""

    def __init__(self, connection: ServerConnection) -> None:
        self.connection = connection
        self.unseen = 0  # frames that it was sent, but has not drawn
        self.behind = False  # it gets no more frames until it is told how all is

    def tell(self, *messages: str | bytes) -> None:
        """Send messages without waiting; who never reads is cut off."""
        from websockets.asyncio.server import broadcast

        for message in messages:
            broadcast([self.connection], message)
        transport = self.connection.transport
        if transport.get_write_buffer_size() > _MOST_WAITING:
            transport.abort()

    def show(self, frame: bytes) -> None:
        """Send a frame of what has changed; a page with too many unseen ones falls behind."""
        self.behind = self.behind or self.unseen >= _MOST_UNSEEN
        if not self.behind:
            self.unseen += 1
            self.tell(frame)

    def has_seen(self, frames: int) -> bool:
        """Count frames that it has drawn; whether it is behind and has drawn all that it got."""
        self.unseen = max(0, self.unseen - frames)
        return self.behind and self.unseen == 0

    def begin(self, *messages: str | bytes) -> None:
        """Send a frame that holds all, and what stands before it."""
        self.unseen, self.behind = 1, False
        self.tell(*messages)


class Room:
    """A session that people watch and change together.

    Pages can choose from `choices`. It listens on `port`, 0 for one that is free; `prepare` is
    called first in processes that replay the session, as to load a plugin. AntsError if the library
    `websockets` is not installed, or the port cannot be used.
    """

    def __init__(
        self,
        session: Session,
        choices: Choices,
        port: int = 0,
        prepare: Callable[[], None] | None = None,
    ) -> None:
        try:
            import websockets  # noqa: F401
        except ImportError:
            raise AntsError(
                'the library websockets is not installed; run pip install "taichi_ants[watch]".'
            ) from None
        try:
            self._socket = socket.create_server((HOST, port))
        except OSError as error:
            raise AntsError(
                f"port {port} of {HOST} cannot be used: {error.strerror}; choose another --port."
            ) from None
        self.session, self.choices = session, choices
        self.port = self._socket.getsockname()[1]
        self.token = secrets.token_urlsafe(24)
        self.playing, self.speed = False, 12.0
        self._shown = secrets.token_hex(8)  # by which pages that come back know the session
        self._pages: set[Page] = set()
        self._joined = 0  # sockets, a page or not yet
        # Who asks, what is to be done, and what is set when it is done.
        self._requests: queue.Queue[tuple[Page, Callable[[], None], asyncio.Future[None]]]
        self._requests = queue.Queue()
        self._loop = asyncio.new_event_loop()
        self._over, self._leave = threading.Event(), asyncio.Event()
        self._pace, self._piece, self._due = 0.0, 1.0, 0.0  # see _pass
        self._prepare = prepare
        self._former: Session | None = None  # whose place the present one has taken
        self._undone: tuple[int, int] | None = None  # steps and edits, if it is in part undone
        self._stroke: tuple[Page, float] | None = None  # by whom, and which, of the last edit
        self._works: dict[str, Making | Undoing] = {}  # what takes long: LOAD, or a file of SLOW
        self._loaded: Session | None = None  # by another process, and has not gone on yet
        self._compiles = False  # whether the first step of the session goes on
        self._tells = 0.0  # when pages are told next how things stand

    @property
    def url(self) -> str:
        """Where the page is, with the token."""
        return f"http://{HOST}:{self.port}/?token={self.token}"

    @property
    def watched(self) -> bool:
        """Whether a page is open."""
        return bool(self._pages)

    def end(self) -> None:
        """Let `run` return soon; for any thread."""
        self._over.set()

    # In the thread that calls `run`: time, and what pages ask for.

    def run(
        self, seconds: float | None = None, each_turn: Callable[[], object] = lambda: None
    ) -> None:
        """Serve pages and let time pass, for some `seconds` or until somebody ends it.

        `each_turn` is called several times a second; what it raises ends it, too.
        """
        sockets = threading.Thread(target=self._serve, name="sockets", daemon=True)
        sockets.start()
        end = math.inf if seconds is None else time.monotonic() + seconds
        try:
            while not self._over.is_set() and time.monotonic() < end:
                each_turn()
                self._turn()
        finally:
            self._over.set()
            for work in self._works.values():
                work.cancel()
            with contextlib.suppress(RuntimeError):  # it has ended by itself
                self._loop.call_soon_threadsafe(self._leave.set)
            sockets.join(2)

    @property
    def _runs(self) -> bool:
        """Whether time passes; not while another session is replayed to take the place of this."""
        return self.playing and LOAD not in self._works

    def _turn(self) -> None:
        """Let a frame's time pass if it is due, and do what a page asks for."""
        runs = self._runs and bool(self._pages)  # time stands still while nobody looks on
        for kind, work in [*self._works.items()]:
            work.go_on()
            if work.made is not None:
                self._end_work(kind, work)
        if runs and time.monotonic() >= self._due:
            self._pass()
        now = time.monotonic()
        if now >= self._tells:
            every = _PROGRESS_EVERY if self._works else _STATE_EVERY if runs else math.inf
            self._tells = now + every
            self._tell(self._state())
        undoes = isinstance(self._works.get(LOAD), Undoing)
        due = now if undoes else self._due if runs else math.inf
        wait = min(due - now, self._tells - now, _LONGEST_WAIT)
        with contextlib.suppress(queue.Empty):
            for _ in range(1 + len(self._pages)):  # all have their turn
                self._answer(*self._requests.get(timeout=max(wait, _BREATH)))
                wait = 0.0

    def _end_work(self, kind: str, work: Making | Undoing) -> None:
        """Begin the session that was made, give its file to a page, or tell the fault."""
        del self._works[kind]
        self._tells = 0.0
        if isinstance(work.made, Session):
            self._begin(work.made, undoes=isinstance(work, Undoing))
            self._loaded = work.made if isinstance(work, Making) else None
        elif isinstance(work.made, bytes):
            self._tell(_say("file", name=SLOW[kind][0]), work.made, to=work.page)
        else:
            self._tell(_say("error", words=work.made), to=work.page)

    def _pass(self) -> None:
        """Let the ticks of one frame pass, and show it."""
        began, before = time.monotonic(), self.session.steps
        if self.speed >= FASTEST:
            ticks = self._leap()
        else:
            self._pace += max(1.0, self.speed / FRAMES_A_SECOND)
            ticks = int(self._pace)
            self._pace -= ticks
        try:
            self._advance(ticks)
        except AntsError as error:  # as of a learner whose values are no longer finite
            self.playing = False
            self._tell(_say("error", words=str(error)))
        took, passed = time.monotonic() - began, self.session.steps - before
        if passed == ticks and took > 0:
            self._piece = min(2.0 * passed, max(1.0, passed / (took * FRAMES_A_SECOND)))
        usual = 0.0 if self.speed >= FASTEST else 1 / min(self.speed, FRAMES_A_SECOND)
        self._due = max(self._due + usual, began + took)  # lost time is not made up

    def _leap(self) -> int:
        """The steps that fill the time of a frame, as far as is known.

        Where these are a large part of an episode, each frame shows another episode, some ticks
        later in it than the one before: pages see the slow course of an episode.
        """
        steps, length = int(self._piece), self.session.setup.ticks_per_episode
        if not length or _FEW * steps < length:
            return steps
        cycle = length + 1  # with the step that begins the next one
        return max(1, round(steps / cycle)) * cycle + max(1, length // _PHASES)

    def _advance(self, ticks: int) -> None:
        """Let ticks pass, and show them. The first ones compile kernels, which takes seconds."""
        if self.session.steps == 0 or self.session is self._loaded:
            self._compiles, self._loaded = True, None
            self._tell(self._state())
            time.sleep(_BREATH)  # in which the thread of the sockets tells it
        try:
            self._show(self.session.advance() if ticks == 1 else self.session.leap(ticks))
        finally:
            if self._compiles:
                self._compiles, self._tells = False, 0.0  # as soon as that is so

    def _answer(self, page: Page, act: Callable[[], None], answered: asyncio.Future[None]) -> None:
        """Do what a page asks for, or tell it why not; all are told soon how things stand then."""
        refused = None
        try:
            act()
        except Closed as error:
            refused = error
        except (AntsError, MemoryError) as error:
            no_memory = isinstance(error, MemoryError)
            words = "this needs more memory than there is." if no_memory else str(error)
            self._tell(_say("error", words=words), to=page)

        def answer() -> None:
            if not answered.done():  # as where the page has gone
                answered.set_exception(refused) if refused else answered.set_result(None)

        self._post(answer)
        self._tells = min(self._tells, time.monotonic() + 1 / FRAMES_A_SECOND)

    def _do(self, page: Page, request: dict[str, Any]) -> None:
        """Do what a page asks for in JSON."""
        if request["do"] in _CHANGES:
            self._check_free()
        match request["do"]:
            case "play":
                self.playing, self._due = True, time.monotonic()
            case "pause":
                self.playing = False
            case "step":  # {"ticks": 1 to 100}
                self.playing = False
                for _ in range(int(_number(request, "ticks", 1, 100))):
                    self._advance(1)
            case "speed":  # {"value": ticks a second, 1 to FASTEST}
                self.speed, self._due = _number(request, "value", 1, FASTEST), time.monotonic()
            case (
                "edit"
            ):  # {"edit": see taichi_ants.live.edits, "stroke": same in those of a stroke}
                if not isinstance(request.get("edit"), dict):
                    raise Closed("an edit has to be an object")
                stroke = page, _number(request, "stroke", 0, 2**53)
                self._show(self.session.apply(request["edit"], goes_on=stroke == self._stroke))
                self._stroke = stroke
            case "undo":
                self._works[LOAD] = Undoing(self.session)
            case "back":  # go on with the session whose place the present one has taken
                if self._former is None:
                    raise AntsError("there is no session before this one.")
                self._begin(self._former, comes_back=True)
            case "begin":  # {"chosen": see taichi_ants.live.choices}
                self._begin(Session(self.choices.setup(request.get("chosen"))))
            case "restart":
                self._begin(Session(self.session.setup))
            case "export":  # {"kind": of `QUICK` or `SLOW`}
                self._export(page, str(request.get("kind")))
            case "cancel":  # {"kind": of what takes long}; it may have ended meanwhile
                kind = str(request.get("kind"))
                if kind in self._works:
                    self._works.pop(kind).cancel()
                    self._tell(_say("cancelled", kind=kind))
            case "quit":
                self.end()
            case _:
                raise Closed("there is no such request")

    def _check_free(self) -> None:
        if LOAD in self._works:
            raise AntsError("a session is being replayed; wait for its end, or cancel it.")

    def _load(self, log: Log, content: bytes) -> None:
        """Replay a session that was uploaded."""
        self._check_free()
        self._works[LOAD] = Making(LOAD, content, log.steps, self._prepare)

    def _forget(self, page: Page) -> None:
        """Cancel the file of a page that has gone."""
        for kind, work in [*self._works.items()]:
            if work.page is page:
                self._works.pop(kind).cancel()

    def _export(self, page: Page, kind: str) -> None:
        if kind in QUICK:
            name, make = QUICK[kind]
            self._tell(_say("file", name=name), make(self.session), to=page)
        elif kind not in SLOW:
            raise Closed("there is no file of this kind")
        elif self._works.keys() & SLOW.keys():
            raise AntsError("another file is being made; wait for it, or cancel it.")
        else:
            content, ticks = self.session.to_bytes(), self.session.ticks
            self._works[kind] = Making(kind, content, ticks, self._prepare, page)

    def _begin(self, session: Session, undoes: bool = False, comes_back: bool = False) -> None:
        """Go on with another session; pages can go back to the one before.

        That is the one before several in a row, where each undoes a change of the last one, or
        where a session begins that stands as the present one does: nothing would be lost.
        """
        before = self.session
        in_a_row = undoes and self._undone == (before.steps, len(before.edits))
        if comes_back or not (in_a_row or before.same(session)):
            self._former = before
        self._undone = (session.steps, len(session.edits)) if undoes else None
        self.session, self._shown = session, secrets.token_hex(8)
        self.playing, self._piece, self._stroke = False, 1.0, None
        self._tell_whole()

    def _tell_whole(self, page: Page | None = None, begins: bool = True) -> None:
        """Tell a page, or all, how all is now; where a session begins, also what it is about."""
        messages: list[str | bytes] = [_say("snapshot"), self.session.snapshot()]
        if begins:
            header, setup, choices = self.session.header(), self.session.setup, self.choices
            offered = {"choices": choices.as_dict(), "chosen": choices.chosen(setup)}
            begin = _say("begin", session=self._shown, header=header, **offered)
            messages = [begin, self._state(), *messages]

        def show() -> None:
            self._pages.update([page] if page else [])
            for one in [page] if page else self._pages:
                one.begin(*messages)

        self._post(show)

    def _show(self, frame: bytes) -> None:
        """Send a frame to all pages but those that are behind."""
        news = self.session.news()

        def show() -> None:
            for page in self._pages:
                if news:
                    page.tell(_say("names", names=news))
                page.show(frame)

        self._post(show)

    def _state(self) -> str:
        session = self.session
        works = [
            {"kind": kind, "done": work.done, "total": work.total}
            for kind, work in self._works.items()
        ]
        return _say(
            "state",
            playing=self._runs,
            speed=self.speed,
            pages=len(self._pages),
            ticks=session.ticks,
            can_undo=bool(session.changes),
            can_go_back=self._former is not None,
            values=session.values(),
            works=works + [{"kind": "kernels", "done": 0, "total": 0}] * self._compiles,
        )

    def _tell(self, *messages: str | bytes, to: Page | None = None) -> None:
        """Send messages to a page, or to all."""

        def tell() -> None:
            for page in self._pages if to is None else [to]:
                page.tell(*messages)

        self._post(tell)

    def _post(self, act: Callable[[], Any]) -> None:
        """Let the thread of the sockets do something, in the order of these calls."""
        with contextlib.suppress(RuntimeError):  # it has ended
            self._loop.call_soon_threadsafe(act)

    # In the thread of the sockets.

    def _serve(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._listen())
        finally:
            self._over.set()  # nobody can be served any more
            self._loop.close()

    async def _listen(self) -> None:
        from websockets.asyncio.server import serve

        settings: dict[str, Any] = {
            **{"max_size": _MOST_UPLOAD, "max_queue": 4, "compression": None},
            **{"open_timeout": 10, "ping_interval": 20, "ping_timeout": 20, "close_timeout": 0.3},
            **{"process_request": self._open, "logger": _QUIET},
        }
        async with serve(self._hear, sock=self._socket, **settings):
            await self._leave.wait()
            for page in self._pages:
                page.tell(_say("over"))

    def _open(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a request: with the page, with a refusal, or None, which opens a socket.

        The page holds no secret; a socket needs the token.
        """
        method = getattr(request, "method", "GET")  # websockets before 17 takes no other one
        asked = urlsplit(request.path)
        hosts = {f"{name}:{self.port}" for name in (HOST, "localhost")}
        host, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        opens, tokens = asked.path == "/socket", parse_qs(asked.query).get("token", [])
        mine = len(host) == 1 and host[0] in hosts
        # A page of ours has the origin that it was asked for at; the page itself is asked for by
        # nobody's page.
        mine = mine and (origins == [f"http://{host[0]}"] or (not origins and not opens))
        knows = hmac.compare_digest("".join(tokens[:1]).encode(), self.token.encode())
        if method not in ("GET", "HEAD")[: 1 if opens else 2]:
            response = connection.respond(405, "Only GET is allowed here.\n")
        elif not mine or not (knows or (asked.path == "/" and not tokens)):
            response = connection.respond(403, "Open the address that was printed.\n")
        elif opens:
            if self._joined < _MOST_PAGES:
                return None
            response = connection.respond(503, "Too many pages are open.\n")
        elif asked.path != "/":
            response = connection.respond(404, "There is nothing here.\n")
        else:
            response = connection.respond(200, live_page(f"ws://{host[0]}"))
            del response.headers["Content-Type"]
            response.headers["Content-Type"] = "text/html; charset=utf-8"
        for name, value in _HEADERS.items():
            response.headers[name] = value
        if method == "HEAD":
            response.body = b""
        return response

    async def _hear(self, connection: ServerConnection) -> None:
        """All that one page says; what it asks for is done before it is heard further."""
        from websockets.exceptions import ConnectionClosed

        page = Page(connection)
        self._joined += 1
        try:
            await self._ask(page, partial(self._tell_whole, page))
            async for message in connection:
                if isinstance(message, bytes):
                    await self._upload(page, message)
                    continue
                request = _read(message)
                if request["do"] != "seen":
                    await self._ask(page, partial(self._do, page, request))
                elif page.has_seen(int(_number(request, "frames", 0, 1000))):
                    await self._ask(page, partial(self._tell_whole, page, begins=False))
        except Closed as error:
            await connection.close(1008, str(error))
        except ConnectionClosed:
            pass
        finally:
            self._joined -= 1
            self._pages.discard(page)
            self._requests.put((page, partial(self._forget, page), self._loop.create_future()))

    async def _upload(self, page: Page, content: bytes) -> None:
        """Look at a file of a page in a thread, while others are answered."""
        try:
            log = await asyncio.to_thread(uploaded, content)
        except AntsError as error:
            page.tell(_say("error", words=str(error)))
        else:
            await self._ask(page, partial(self._load, log, content))

    async def _ask(self, page: Page, act: Callable[[], None]) -> None:
        answered = self._loop.create_future()
        self._requests.put((page, act, answered))
        await answered


def _say(kind: str, /, **facts: Any) -> str:
    """A message to a page."""
    return json.dumps({"say": kind, **facts}, separators=(",", ":"))


def _read(message: str) -> dict[str, Any]:
    """The request in a message."""
    if len(message) > _MOST_TEXT:
        raise Closed("this is too long")
    try:
        request = json.loads(message, parse_constant=_refuse)
    except (ValueError, RecursionError):
        raise Closed("this is no JSON") from None
    if not isinstance(request, dict) or not isinstance(request.get("do"), str):
        raise Closed('a request has to be an object with a "do"')
    return request


def _refuse(name: str) -> None:
    raise ValueError(f"{name} is no number")


def _number(request: dict[str, Any], name: str, least: float, most: float) -> float:
    """A number of a request; no page of ours sends one that is not allowed."""
    value = request.get(name)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not least <= value <= most:
        raise Closed(f"{name} has to be a number from {least} to {most}")
    return value
