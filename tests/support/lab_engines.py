"""The lab's modules in Node, and its colony in C for this processor."""

from __future__ import annotations

import ctypes
import json
import subprocess
from pathlib import Path
from typing import Any

from command_lines import ROOT

from taichi_ants import lab
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.learners.policies import trail_follower
from taichi_ants.worlds.lab import WORLDS, lab_world

ENGINE = ROOT / "lab" / "engine"


class Node:
    """Node, which answers questions; see answer.js."""

    def __init__(self, folder: Path) -> None:
        command = ["node", ROOT / "tests" / "lab" / "answer.js", folder]
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def __call__(self, name: str, /, question: Any = None, **more: Any) -> Any:
        to, back = self.process.stdin, self.process.stdout
        assert to is not None
        assert back is not None
        to.write(json.dumps([name, more if question is None else question]) + "\n")
        to.flush()
        return json.loads(back.readline())

    def close(self) -> None:
        """End the process."""
        self.process.communicate()


def native_colony(command: str, folder: Path) -> ctypes.CDLL:
    """Return the colony of page.c, compiled for this processor."""
    flags = ("-O1", "-std=c11", "-ffp-contract=off", "-shared", "-fPIC")  # quick to compile
    subprocess.run(
        [command, *flags, "-o", folder / "page.so", ENGINE / "page.c", "-lm"], check=True
    )
    library = ctypes.CDLL(str(folder / "page.so"))
    library.array.restype = ctypes.c_void_p
    library.hash_state.restype = ctypes.c_uint32
    for name, types in (
        ("set_rate", [ctypes.c_double]),
        ("set_numbers", [*[ctypes.c_int] * 2, *[ctypes.c_double] * 2, *[ctypes.c_int] * 2]),
        ("begin", [ctypes.c_uint32, ctypes.c_uint32, ctypes.c_int, ctypes.c_float]),
    ):
        getattr(library, name).argtypes = types
    return library


def replay_in_c(library: ctypes.CDLL, link: str) -> str:
    """Return the hash of the state after a link, replayed by the colony in C."""
    code, tick, _ = link.split(";")
    scene, events = lab.decoded(code)
    world, learner = lab_world(scene["world"], scene["seed"]), lab.LEARNERS.index(scene["learner"])
    library.lay_out(*world.ranges, 10_000, scene["rules"], learner)

    def numbers() -> None:
        level, directed = scene["level"], scene["rules"] & lab.DIRECTED
        slope = max(1, (2 * level + 50) // 100) if directed else 0
        more = scene["discount"], scene["epsilon"], scene["shaping"], scene["regrowth"]
        library.set_numbers(level, slope, *more)
        library.set_rate(scene["rate"] * scene["learns"])

    def view(number: int, kind: Any, n: int) -> Any:
        return (kind * n).from_address(library.array(number))

    ground = world.ground()
    view(0, ctypes.c_uint8, len(ground))[:] = ground.tolist()
    numbers()
    seed = scene["seed"]
    library.begin(seed & 0xFFFFFFFF, seed >> 32, scene["ants"], scene["first"])
    if scene["learner"] == "frozen":
        observation = {128: "paper", 432: "ants", 686: "queues"}[library.states()]
        table = view(11, ctypes.c_float, 8 * library.states())
        for state, row in enumerate(trail_follower(observation).tolist()):
            table[8 * state : 8 * state + 5] = row
        library.read_values()
    brush, grid = view(4, ctypes.c_int32, len(ground)), AxialGrid(world.ranges)
    assert grid.ranges[0] == WORLDS[scene["world"]]["radius"]
    for event in (*events, lab.Event(int(tick), "end")):
        getattr(library, "pass")(event.tick - library.ticks_passed())
        if event.does in lab.SETTINGS:
            scene[event.does] = event.value
            if event.does == "ants":
                library.set_ants(event.value)
            numbers()
        elif event.path:
            cells = lab.cells_within(event, grid)
            brush[: len(cells)] = cells
            if event.does != "scent":
                library.put(len(cells), {"rock": 5, "food": 7, "erase": 0}[event.does])
            if event.does in ("scent", "erase"):
                level = (scene["level"] + 1) // 2 if event.does == "scent" else 0
                library.lay_scent(len(cells), level)
    low, high = (library.hash_state(half) for half in (0, 1))
    return f"{high:08x}{low:08x}"
