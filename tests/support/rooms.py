"""A running server of the live page, and test clients in the place of pages."""

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from taichi_ants.live.choices import Choices
from taichi_ants.live.server import SessionServer
from taichi_ants.live.session import Session
from taichi_ants.live.setup import Setup

SECONDS = 60.0  # timeout of a client that waits for a message

# A small session: ants that learn in the paper's world.
CHOSEN: dict[str, Any] = {
    **{"world": "paper", "map": "", "world_seed": 0, "size": 30},
    **{
        "settings": {
            "task.observation": "ants",
            "task.pheromone.deposit": "fading",
            "task.pheromone.level": 500,
            "task.pheromone.view": "strongest",
            "task.evaporation_in_training": True,
        },
        "policy": "learn sarsa",
        "ants": 12,
        "seed": 5,
        "ticks": 50,
    },
}


@contextmanager
def running(
    choices: Choices, chosen: dict[str, Any] | None = None, setup: Setup | None = None
) -> Iterator[SessionServer]:
    """Yield a server whose session runs in another thread."""
    session = Session(setup or choices.setup(chosen or CHOSEN))  # starts Taichi, in this thread
    session.advance()
    room = SessionServer(session, choices)
    thread = threading.Thread(target=room.run, daemon=True)
    thread.start()
    yield room
    room.end()
    thread.join(10)
    assert not thread.is_alive()


class Guest:
    """A client that sends requests and receives messages as a page does."""

    def __init__(self, room: SessionServer, **given: Any) -> None:
        self.room = room
        address = room.url.replace("http", "ws").replace("/?", "/socket?")
        usual = {"origin": f"http://127.0.0.1:{room.port}", "max_size": None, "proxy": None}
        usual["close_timeout"] = 1  # seconds, if there are unread messages
        self.socket: ClientConnection = connect(address, **{**usual, **given}).__enter__()
        self.header: dict[str, Any] = {}
        self.chosen: dict[str, Any] = {}
        self.frames: list[bytes] = []  # the last complete frame, and all later ones
        self.state: dict[str, Any] = {}
        self.errors: list[str] = []
        self.strokes = 0

    def ask(self, what: str, **more: Any) -> None:
        self.socket.send(json.dumps({"do": what, **more}))

    def edit(self, edit: dict[str, Any]) -> None:
        """Send an edit as a separate change."""
        self.strokes += 1
        self.ask("edit", edit=edit, stroke=self.strokes)

    def hear(self) -> tuple[str, Any]:
        """Return the kind and the content of the next message."""
        message = self.socket.recv(SECONDS)
        if isinstance(message, bytes):
            self.frames.append(message)
            return "frame", message
        said = json.loads(message)
        if said["say"] == "begin":
            self.header, self.chosen = said["header"], said["chosen"]
        elif said["say"] == "state":
            self.state = said
        elif said["say"] == "error":
            self.errors.append(said["words"])
        elif said["say"] == "snapshot":
            self.frames = [self.socket.recv(SECONDS)]  # type: ignore[list-item]
            return "whole", self.frames[0]
        elif said["say"] == "file":
            return said["name"], self.socket.recv(SECONDS)
        return said["say"], said

    def until(self, kind: str) -> Any:
        """Return the content of the next message of a kind."""
        while True:
            heard, message = self.hear()
            if heard == kind:
                return message

    def until_cut_off(self) -> None:
        """Receive messages until the server closes the socket."""
        with pytest.raises(ConnectionClosed):
            self.until("the end")

    def seen(self, frames: int) -> None:
        self.ask("seen", frames=frames)

    def close(self) -> None:
        self.socket.close()

    def __enter__(self):
        self.until("whole")
        return self

    def __exit__(self, *failure: object) -> None:
        self.close()
