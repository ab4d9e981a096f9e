"""The protocol of the live page: the server in Python and the lab's worker answer alike."""

import base64
import json
import shutil
import subprocess
from typing import Any

import pytest
from lab_engines import ENGINE, Node
from rooms import Guest, running

from taichi_ants import lab
from taichi_ants.live.choices import Choices
from taichi_ants.live.setup import Setup
from taichi_ants.worlds.lab import lab_world

FIRST = {**lab.decoded("AQAPVUAeZIQHAQrYBAEC")[0], "learner": 0}  # the first screen


class LabSetup(Setup):
    """A setup with a world of the lab, which has no name in the package."""

    def build_world(self):
        return lab_world(int(self.world), self.seed)


def setup_of(scene: dict[str, Any]) -> Setup:
    """The setup of a session with the colony of a scene."""
    colony = lab.played({**scene, "learner": lab.LEARNERS[scene["learner"]]}, [], 0)
    policy: Any = colony.training if colony.learns else colony.q_values[0].reshape(-1, 5)
    more = {"seed": scene["seed"], "epsilon": scene["epsilon"]}
    return LabSetup(str(scene["world"]), colony.task, policy, scene["ants"], **more)


class Worker(Guest):
    """The worker in Node in place of a page's server."""

    def __init__(self, link: str) -> None:
        command = ["node", ENGINE.parents[1] / "tests" / "lab" / "live_worker.js", ENGINE, link]
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True)
        self.socket: Any = self
        self.frames, self.errors, self.strokes = [], [], 0

    def send(self, message: str) -> None:
        self.process.stdin.write(message + "\n")
        self.process.stdin.flush()

    def recv(self, seconds: float) -> str | bytes:
        line = self.process.stdout.readline().strip()
        return line if line.startswith("{") else base64.b64decode(line)

    def close(self) -> None:
        self.process.communicate()


def comparable(message: str | bytes) -> Any:
    """A message of either without what differs by design: names of sessions, and the form."""
    if isinstance(message, bytes):
        return message
    said = json.loads(message)
    values = said.get("values", {})
    own = {"session": "", "choices": None, "chosen": None, "can_go_back": False}
    if values:
        kept = ("value", "least", "most", "step", "path")
        names = values.keys() & {"ants", "epsilon", "learning_rate"}
        own["values"] = {name: {key: values[name][key] for key in kept} for name in names}
    said.pop("link", None)  # of the worker only
    return {key: own.get(key, one) for key, one in said.items()}


CELLS = range(2100, 2112)
EDITS = [
    {"place": {"what": "rock", "cells": [*CELLS]}},
    {"clear": {"cells": [*CELLS[:4]]}},
    {"trail": {"level": 500, "cells": [*CELLS[2:], 2000]}},
    {"ants": 30},
    {"ants": 50},
    {"place": {"what": "food", "cells": [*CELLS[:3]]}},
    {"epsilon": 0.25},
]


def visit(guest: Guest) -> list[Any]:
    """What a page hears while its user steps, draws, undoes and starts again."""
    heard, hear = [], guest.socket.recv
    guest.socket.recv = lambda seconds: heard.append(hear(seconds)) or heard[-1]
    learns = [{"learning_rate": 0.03}] * ("learning_rate" in guest.state["values"])
    for number, edit in enumerate([*EDITS, *learns], 1):
        guest.ask("step", ticks=9)
        for _ in range(9):
            guest.until("frame")
        guest.ask("edit", edit=edit, stroke=number // 2)
        guest.until("frame")
        guest.seen(10)
    guest.ask("undo")
    for what in ("whole", "state"):
        guest.until(what)
    guest.ask("speed", value=20)
    guest.ask("restart")
    guest.until("whole")
    guest.ask("undo")  # there is nothing to undo
    guest.until("error")
    return [comparable(one) for one in heard]


def told(heard: list[Any], kind: str) -> list[Any]:
    return [one for one in heard if isinstance(one, dict) and one["say"] == kind]


@pytest.fixture(scope="module")
def served():
    """The messages of the server in Python and of the worker, for a visit to a scene."""
    if shutil.which("node") is None:
        pytest.skip("there is no Node")

    def both(**more: Any) -> list[list[Any]]:
        scene, node = {**FIRST, "epsilon": 0.1, "level": 500, **more}, Node(ENGINE)
        code, heard = node("encode", scene=scene, events=[]), []
        node.close()
        with running(Choices({}), setup=setup_of(scene)) as room, Guest(room) as guest:
            guest.ask("restart")  # the session has advanced by a tick
            guest.until("whole")
            guest.until("state")
            heard.append(visit(guest))
        with Worker(code) as worker:
            worker.until("state")
            heard.append(visit(worker))
        return heard

    return both


@pytest.mark.parametrize(("rules", "learner"), [(15, 0), (7, 1), (0, 2)])
def test_server_and_worker_send_the_same_frames_and_messages(rules, learner, served):
    """Byte for byte; after an undo, points of curves depend on the time of the replay."""
    python, worker = served(rules=rules, learner=learner)
    frames = [[one for one in heard if isinstance(one, bytes)] for heard in (python, worker)]
    undone = 10 * (len(EDITS) + (learner != 2))
    assert len(frames[0]) > undone
    for number, (mine, theirs) in enumerate(zip(*frames, strict=True)):
        if number != undone:
            assert mine == theirs, number
    for kind in ("begin", "error", "snapshot"):
        assert told(python, kind) == told(worker, kind)
        assert told(python, kind)
    last = [told(heard, "state")[-1] for heard in (python, worker)]
    assert last[0] == last[1]
