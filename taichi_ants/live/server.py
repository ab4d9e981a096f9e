"""The room in which people watch a session: its pages, and the thread in which time passes.

The room serves one page, and a socket for each page that is open. It listens on this machine alone,
and only a page of its own that knows its token gets a socket. A page asks for things in JSON,
see `REQUESTS`; it is told what happens in JSON and in frames, see `taichi_ants.viewer.frames`.

Two threads: one serves the sockets, the other, which calls `Room.run`, has the session. Requests
of pages go through a queue; messages to pages go back to the thread of the sockets. Files that
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
from collections.abc import Callable, Iterator
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

from taichi_ants.errors import AntsError
from taichi_ants.live.choices import Choices
from taichi_ants.live.exports import LOAD, QUICK, SLOW, Making
from taichi_ants.live.log import Log
from taichi_ants.live.session import Session
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
_SLICE = 0.05  # seconds of undoing, after which requests are answered
_BREATH = 0.004  # seconds after each frame, in which the thread of the sockets gets its turn
_LONGEST_WAIT = 0.2  # seconds, for a request, before it looks whether it is to end
_QUIET = logging.getLogger("taichi_ants.live")  # what strangers send is no news for the terminal
_QUIET.addHandler(logging.NullHandler())
_QUIET.propagate = False


@cache
def live_page(server: str) -> str:
    """The viewer with controls beside the world, as HTML; it connects to `server` alone."""
    folder = resources.files(__package__)
    controls, style, *scripts = (folder.joinpath(name).read_text("utf-8") for name in PARTS)
    return assemble(
        "Taichi Ants, live",
        controls=controls,
        style=style,
        script="\n".join(scripts),
        connect=server,
    )


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

    def begin(self, *messages: str | bytes) -> None:
        """Send a frame that holds all, and what stands before it."""
        self.unseen, self.behind = 1, False
        self.tell(*messages)


class Room:
    """A session that people watch and change together.

    Args:
        session: That begins.
        choices: What pages can choose from.
        port: On which it listens; 0 for one that is free.
        prepare: Called first in processes that replay the session, as to load a plugin.

    Raises:
        AntsError: The library `websockets` is not installed, or the port cannot be used.
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
        self._requests: queue.Queue[tuple[Page, Any, asyncio.Future[None]]] = queue.Queue()
        self._loop = asyncio.new_event_loop()
        self._over, self._leave = threading.Event(), asyncio.Event()
        self._pace, self._piece, self._due = 0.0, 1.0, 0.0  # see _pass
        self._prepare = prepare
        self._former: Session | None = None  # whose place the present one has taken
        # Steps and edits, where it is one in part undone.
        self._undone: tuple[int, int] | None = None
        self._stroke: tuple[Page, float] | None = None  # by whom, and which, of the last edit
        self._replay: _Replay | None = None  # of a session that is in part undone
        self._loading: Making | None = None  # of a session that somebody has sent
        self._loaded: Session | None = None  # which has not gone on yet
        self._making: Making | None = None
        self._compiles = False  # whether the first step of the session goes on
        self._for: Page | None = None  # who is given the file
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
            for making in (self._making, self._loading):
                if making is not None:
                    making.cancel()
            with contextlib.suppress(RuntimeError):  # it has ended by itself
                self._loop.call_soon_threadsafe(self._leave.set)
            sockets.join(2)

    def _turn(self) -> None:
        """Let a frame's time pass if it is due, and do what a page asks for."""
        runs = self._runs and bool(self._pages)  # time stands still while nobody looks on
        if self._loading is not None and self._loading.over:
            self._end_loading(self._loading)
        if self._replay is not None:
            self._go_on(self._replay)
        elif runs and time.monotonic() >= self._due:
            self._pass()
        now = time.monotonic()
        if now >= self._tells:
            every = _PROGRESS_EVERY if self._works() else _STATE_EVERY if runs else math.inf
            self._tells = now + every
            self._tell_all(self._state())
        due = now if self._replay is not None else self._due if runs else math.inf
        wait = min(due - now, self._tells - now, _LONGEST_WAIT)
        with contextlib.suppress(queue.Empty):
            for _ in range(1 + len(self._pages)):  # all have their turn
                page, request, answered = self._requests.get(timeout=max(wait, _BREATH))
                self._answer(page, request, answered)
                wait = 0.0

    @property
    def _runs(self) -> bool:
        """Whether time passes."""
        return self.playing and not self._replays

    @property
    def _replays(self) -> bool:
        """Whether another session is being replayed, to take the place of the present one."""
        return self._replay is not None or self._loading is not None

    def _go_on(self, replay: _Replay) -> None:
        """Undo for a moment; at the end, the new session takes the place of the present one."""
        until = time.monotonic() + _SLICE
        try:
            for session in replay.pieces:
                replay.session = session
                if time.monotonic() > until:
                    return
            assert replay.session is not None
            self._begin(replay.session, undoes=True)
        except (AntsError, MemoryError) as error:
            self._tell_all(_say("error", words=_words(error)))
        self._replay, self._tells = None, 0.0

    def _works(self) -> list[dict[str, Any]]:
        """What goes on that takes long: what it is, and how many of its ticks are done."""
        works, replay, loading, making = [], self._replay, self._loading, self._making
        if replay is not None:
            done = 0 if replay.session is None else replay.session.steps
            works.append({"kind": LOAD, "done": done, "total": replay.steps})
        if loading is not None:
            works.append({"kind": LOAD, "done": loading.done, "total": loading.total})
        if self._compiles:
            works.append({"kind": "kernels", "done": 0, "total": 0})
        if making is not None and not making.over:
            works.append({"kind": making.kind, "done": making.done, "total": making.total})
        return works

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
            self._show(self.session.advance() if ticks == 1 else self.session.leap(ticks))
        except AntsError as error:  # as of a learner whose values are no longer finite
            self.playing = False
            self._tell_all(_say("error", words=str(error)))
        self._end_preparing()
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

    def _answer(self, page: Page, request: Any, answered: asyncio.Future[None]) -> None:
        """Do what a page asks for, or tell it why not; all are told soon how things stand then."""
        refused = None
        try:
            what = request["do"]
            if self._replays and what in _CHANGES:
                raise AntsError("a session is being replayed; wait for its end, or cancel it.")
            REQUESTS[what](self, page, request)
        except Closed as error:
            refused = error
        except (AntsError, MemoryError) as error:
            self._tell(page, _say("error", words=_words(error)))

        def answer() -> None:
            if not answered.done():  # as where the page has gone
                answered.set_exception(refused) if refused else answered.set_result(None)

        self._post(answer)
        self._tells = min(self._tells, time.monotonic() + 1 / FRAMES_A_SECOND)

    def _load(self, page: Page, request: dict[str, Any]) -> None:
        """Replay a session in a worker process, which can be ended at any time."""
        log = request["log"]
        if isinstance(log, AntsError):
            raise _of_page(log) from log
        self._loading = Making(LOAD, request["content"], log.steps, self._prepare)

    def _end_loading(self, loading: Making) -> None:
        """Let a session that was replayed take the place of the present one."""
        self._loading, made = None, loading.made
        if isinstance(made, Session):
            self._begin(made)
            self._loaded = made
        else:
            self._tell_all(_say("error", words=str(_of_page(made))))
        self._tells = 0.0

    def _undo(self, page: Page, request: dict[str, Any]) -> None:
        """Go back to the moment before the last change."""
        self._replay = _Replay(self.session)

    def _go_back(self, page: Page, request: dict[str, Any]) -> None:
        """Go on with the session whose place the present one has taken."""
        if self._former is None:
            raise AntsError("there is no session before this one.")
        former, self._former = self._former, self.session
        self._show_session(former)

    def _cancel(self, page: Page, request: dict[str, Any]) -> None:
        """End what takes long, of a kind that `_works` names; without it all stays as it is."""
        kinds = [work["kind"] for work in self._works() if work["kind"] != "kernels"]
        if (kind := request.get("kind")) not in kinds:
            return  # it has ended meanwhile
        if kind == LOAD:
            if self._loading is not None:
                self._loading.cancel()
            self._replay = self._loading = None
        elif self._making is not None:
            self._making.cancel()
        self._tell_all(_say("cancelled", kind=kind))

    def _leave_room(self, page: Page, request: dict[str, Any]) -> None:
        """Cancel the file of a page that has gone; the others are told, too."""
        if self._making is not None and self._for is page:
            self._making.cancel()

    def _begin(self, session: Session, undoes: bool = False) -> None:
        """Go on with another session; pages can go back to the one before.

        That is the one before several in a row, where each undoes a change of the last one, or
        where a session begins that stands as the present one does: nothing would be lost.
        """
        before = self.session
        in_a_row = undoes and self._undone == (before.steps, len(before.edits))
        if not (in_a_row or before.same(session)):
            self._former = before
        self._show_session(session)
        self._undone = (session.steps, len(session.edits)) if undoes else None

    def _show_session(self, session: Session) -> None:
        self.session, self._undone, self._shown = session, None, secrets.token_hex(8)
        self.playing, self._piece, self._stroke = False, 1.0, None
        self._compiles = False
        messages = [*self._about(), *self._moment()]

        def show() -> None:
            for page in self._pages:
                page.begin(*messages)

        self._post(show)

    def _welcome(self, page: Page, request: dict[str, Any]) -> None:
        """Tell a new page what the session is about, and how it is now."""
        messages = [*self._about(), *self._moment()]

        def show() -> None:
            self._pages.add(page)
            page.begin(*messages)

        self._post(show)

    def _catch_up(self, page: Page, request: dict[str, Any]) -> None:
        """Tell a page that was slow how all is now."""
        messages = self._moment()
        self._post(lambda: page.begin(*messages))

    def _about(self) -> list[str | bytes]:
        """What a page needs to know before the first frame of a session."""
        header, setup, choices = self.session.header(), self.session.setup, self.choices
        offered = {"choices": choices.as_dict(), "chosen": choices.chosen(setup)}
        return [_say("begin", session=self._shown, header=header, **offered), self._state()]

    def _moment(self) -> list[str | bytes]:
        """All as it is now, for a page that knows nothing of it."""
        return [_say("snapshot"), self.session.snapshot()]

    def _play(self, page: Page, request: dict[str, Any]) -> None:
        self.playing, self._due = True, time.monotonic()
        self._prepare_first()

    def _prepare_first(self) -> None:
        """Tell pages that the first step of a session may take seconds: kernels are compiled."""
        if self.session.steps == 0 or self.session is self._loaded:
            self._compiles, self._loaded = True, None
            self._tell_all(self._state())
            time.sleep(_BREATH)  # in which the thread of the sockets tells it

    def _pause(self, page: Page, request: dict[str, Any]) -> None:
        self.playing = False
        self._end_preparing()

    def _step(self, page: Page, request: dict[str, Any]) -> None:
        self.playing = False
        self._prepare_first()
        try:
            for _ in range(int(_number(request, "ticks", 1, 100))):
                self._show(self.session.advance(1))
        finally:
            self._end_preparing()

    def _end_preparing(self) -> None:
        if self._compiles:
            self._compiles, self._tells = False, 0.0  # as soon as that is so

    def _set_speed(self, page: Page, request: dict[str, Any]) -> None:
        self.speed, self._due = _number(request, "value", 1, FASTEST), time.monotonic()

    def _edit(self, page: Page, request: dict[str, Any]) -> None:
        edit = request.get("edit")
        if not isinstance(edit, dict):
            raise Closed("an edit has to be an object")
        stroke = page, _number(request, "stroke", 0, 2**53)
        self._show(self.session.apply(edit, goes_on=stroke == self._stroke))
        self._stroke = stroke

    def _begin_chosen(self, page: Page, request: dict[str, Any]) -> None:
        self._begin(Session(self.choices.setup(request.get("chosen"))))

    def _restart(self, page: Page, request: dict[str, Any]) -> None:
        self._begin(Session(self.session.setup))

    def _export(self, page: Page, request: dict[str, Any]) -> None:
        kind = request.get("kind")
        if not isinstance(kind, str) or kind not in {**QUICK, **SLOW}:
            raise Closed("there is no file of this kind")
        name = {**QUICK, **SLOW}[kind][0]
        if kind in QUICK:
            content = QUICK[kind][1](self.session)
            self._post(lambda: page.tell(_say("file", name=name), content))
            return
        if self._making is not None and not self._making.over:
            raise AntsError("another file is being made; wait for it, or cancel it.")

        def end(made: Any) -> None:
            if isinstance(made, str):
                self._tell(page, _say("error", words=made))
            else:
                self._post(lambda: page.tell(_say("file", name=name), made))

        content, ticks = self.session.to_bytes(), self.session.ticks
        self._making, self._for = Making(kind, content, ticks, self._prepare, end), page

    def _quit(self, page: Page, request: dict[str, Any]) -> None:
        self.end()

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
        return _say(
            "state",
            playing=self._runs,
            speed=self.speed,
            pages=len(self._pages),
            ticks=session.ticks,
            can_undo=bool(session.changes),
            can_go_back=self._former is not None,
            values=session.values(),
            works=self._works(),
        )

    def _tell_all(self, message: str) -> None:
        def tell() -> None:
            for page in self._pages:
                page.tell(message)

        self._post(tell)

    def _tell(self, page: Page, message: str) -> None:
        self._post(lambda: page.tell(message))

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
        """Answer a request: with the page, with a refusal, or None, which opens a socket."""
        response = self._answer_to(connection, request)
        if response is not None:
            for name, value in _HEADERS.items():
                response.headers[name] = value
            if _method(request) == "HEAD":
                response.body = b""
        return response

    def _answer_to(self, connection: ServerConnection, request: Request) -> Response | None:
        """As `_open`, without headers. The page holds no secret; a socket needs the token."""
        asked = urlsplit(request.path)
        hosts = {f"{name}:{self.port}" for name in (HOST, "localhost")}
        host, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        opens, tokens = asked.path == "/socket", parse_qs(asked.query).get("token", [])
        mine = len(host) == 1 and host[0] in hosts
        # A page of ours has the origin that it was asked for at; the page itself is asked for by
        # nobody's page.
        mine = mine and (origins == [f"http://{host[0]}"] or (not origins and not opens))
        knows = hmac.compare_digest("".join(tokens[:1]).encode(), self.token.encode())
        if _method(request) not in ("GET", "HEAD")[: 1 if opens else 2]:
            return connection.respond(405, "Only GET is allowed here.\n")
        if not mine or not (knows or (asked.path == "/" and not tokens)):
            return connection.respond(403, "Open the address that was printed.\n")
        if opens:
            full = self._joined >= _MOST_PAGES
            return connection.respond(503, "Too many pages are open.\n") if full else None
        if asked.path != "/":
            return connection.respond(404, "There is nothing here.\n")
        response = connection.respond(200, live_page(f"ws://{host[0]}"))
        del response.headers["Content-Type"]
        response.headers["Content-Type"] = "text/html; charset=utf-8"
        return response

    async def _hear(self, connection: ServerConnection) -> None:
        """All that one page says; what it asks for is done before it is heard further."""
        from websockets.exceptions import ConnectionClosed

        page = Page(connection)
        self._joined += 1
        try:
            await self._ask(page, {"do": "join"})
            async for message in connection:
                if isinstance(message, bytes):  # in a thread, while others are answered
                    log = await asyncio.to_thread(_log_or_fault, message)
                    await self._ask(page, {"do": LOAD, "log": log, "content": message})
                    continue
                for request in self._read(page, message):
                    await self._ask(page, request)
        except Closed as error:
            await connection.close(1008, str(error))
        except ConnectionClosed:
            pass
        finally:
            self._joined -= 1
            self._pages.discard(page)
            self._requests.put((page, {"do": "leave"}, self._loop.create_future()))

    def _read(self, page: Page, message: str) -> Iterator[Any]:
        """The request in a message, if the session has to do with it."""
        if len(message) > _MOST_TEXT:
            raise Closed("this is too long")
        try:
            request = json.loads(message, parse_constant=_refuse)
        except (ValueError, RecursionError):
            raise Closed("this is no JSON") from None
        if not isinstance(request, dict) or not isinstance(request.get("do"), str):
            raise Closed('a request has to be an object with a "do"')
        if request["do"] == "seen":
            page.unseen = max(0, page.unseen - int(_number(request, "frames", 0, 1000)))
            if page.behind and page.unseen == 0:
                yield {"do": "catch up"}
        elif request["do"] in REQUESTS and request["do"] not in _INWARD:
            yield request
        else:
            raise Closed("there is no such request")

    async def _ask(self, page: Page, request: Any) -> None:
        answered = self._loop.create_future()
        self._requests.put((page, request, answered))
        await answered


class _Replay:
    """The present session, while `pieces` make it once more without its last change."""

    def __init__(self, session: Session) -> None:
        self.pieces = session.undone()
        self.steps, _ = session.edits[session.changes[-1]]  # at its end
        self.session: Session | None = None  # so far


REQUESTS: dict[str, Callable[[Room, Page, Any], None]] = {
    "join": Room._welcome,  # what a socket says by being opened
    "leave": Room._leave_room,  # what it says by being closed
    "catch up": Room._catch_up,  # what a page says by having seen all that it was sent
    LOAD: Room._load,  # what it says by sending bytes
    "play": Room._play,
    "pause": Room._pause,
    "step": Room._step,  # {"ticks": 1 to 100}
    "speed": Room._set_speed,  # {"value": ticks a second, 1 to FASTEST}
    "edit": Room._edit,  # {"edit": see taichi_ants.live.edits, "stroke": same in those of a stroke}
    "undo": Room._undo,
    "back": Room._go_back,
    "begin": Room._begin_chosen,  # {"chosen": see taichi_ants.live.choices}
    "restart": Room._restart,
    "export": Room._export,  # {"kind": of `QUICK` or `SLOW`}
    "cancel": Room._cancel,  # {"kind": of what takes long}
    "quit": Room._quit,
}
_INWARD = ("join", "leave", "catch up", LOAD)
# What would be lost, or would take away the session that is to go on if a replay is cancelled.
_CHANGES = (LOAD, "play", "step", "edit", "undo", "back", "begin", "restart")

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


def _method(request: Request) -> str:
    """The method; versions of websockets before 17 close all but GET themselves."""
    return getattr(request, "method", "GET")


def _log_or_fault(content: bytes) -> Log | AntsError:
    """The session in a file that a page has sent, or what is wrong with it."""
    try:
        return Log.from_bytes(content)
    except AntsError as error:
        return error


def _of_page(fault: object) -> AntsError:
    """What is wrong with a file, with the way out that a page has."""
    what = str(fault).partition("; ")[0].rstrip(".").replace("'the loaded file'", "the loaded file")
    return AntsError(f"{what}; load a session that Save has made.")


def _words(error: Exception) -> str:
    no_memory = isinstance(error, MemoryError)
    return "this needs more memory than there is." if no_memory else str(error)


def _say(kind: str, /, **facts: Any) -> str:
    """A message to a page."""
    return json.dumps({"say": kind, **facts}, separators=(",", ":"))


def _refuse(name: str) -> None:
    raise ValueError(f"{name} is no number")


def _number(request: dict[str, Any], name: str, least: float, most: float) -> float:
    """A number of a request; no page of ours sends one that is not allowed."""
    value = request.get(name)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not least <= value <= most:
        raise Closed(f"{name} has to be a number from {least} to {most}")
    return value
