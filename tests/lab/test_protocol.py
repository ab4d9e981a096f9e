"""The live page's protocol: the server in Python and the worker of the lab give the same answers."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
from typing import Any

import numpy as np
import pytest
from lab_engines import ENGINE, Node
from rooms import Guest, running

from taichi_ants import lab
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.live.choices import Choices
from taichi_ants.live.session import Session
from taichi_ants.live.setup import Setup
from taichi_ants.viewer import Recorder
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
