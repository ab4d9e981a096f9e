"""Replay links of the lab, the page in `docs/lab.html`, where the same ants run in WebAssembly.

A link is `CODE;TICK;HASH`: a code, the tick at which it was copied, and a hash of the state then.
For the code, see `lab/page/link.js`, which writes it.
"""

import base64
from collections.abc import Iterator
from typing import Any, NamedTuple
from urllib.parse import unquote

import numpy as np

from taichi_ants import interventions as changes
from taichi_ants.engines.colony.colony import Colony
from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.errors import AntsError, expect
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.policies import trail_follower
from taichi_ants.reference.random_stream import hash_of
from taichi_ants.task import Task, queueing
from taichi_ants.worlds.lab import STEPS, WORLDS, distance, lab_world

STROKES = ("rock", "food", "scent", "erase", "", "trail")
SETTINGS = ("ants", "epsilon", "rate", "discount", "level", "shaping", "learns")
LEARNERS = ("q_learning", "sarsa", "frozen")
RULES, DIRECTED, QUEUES = (*range(8), 15), 1, 8
PARTS: dict[int, dict[str, Any]] = {  # of `foraging`, by the bit of rules
    DIRECTED: {"pheromone": {"deposit": "fading", "view": "strongest"}},
    2: {"traffic": "right_of_way"},
    4: {"observation": "ants"},
}
RANGES = {  # of the numbers of a scene, in the order of the code
    **{"seed": (0, 2**53 - 1), "ants": (1, 10_000), "epsilon": (0, 1000), "rate": (0, 1000)},
    **{"discount": (0, 1000), "learns": (0, 1), "first": (-1000, 1000), "level": (1, 100_000)},
    **{"regrowth": (-1, 1_000_000), "shaping": (-100, 100)},
}
MOST_TICKS = 1_000_000
_VERSION, _SETTING, _WAIT, _END = 1, 4, 6, 7


class Event(NamedTuple):
    """A change before a tick: the value of a setting, or a stroke along cells (q, r)."""

    tick: int
    does: str
    value: float = 0
    reach: int = 0
    path: tuple[tuple[int, int], ...] = ()


class Replayed(NamedTuple):
    """The result of a link: ticks, food items delivered, and the hashes of package and page."""

    tick: int
    deliveries: int
    hash: str
    expected_hash: str

    @property
    def equal(self) -> bool:
        """Whether package and page agree."""
        return self.hash == self.expected_hash


def replay(link: str) -> Replayed:
    """Return the result of a link of the lab, which a `Colony` replays.

    The link is an address that the lab has copied, or its part after "#". Raises AntsError if it is
    damaged, or is not one of the lab.

    >>> link = "AQAPVUAeZIQHAQrYBAECwwII_hAeAB4ABTYAHgUWABYABS4AHgUWACYAByEJ3gwHBARkABy2BwAsBA"
    >>> replay(link + ";433;bcf73002ff82a05c").hash
    'bcf73002ff82a05c'
    """
    expect("link", link, str)
    try:
        code, ticks, page_hash = unquote(link).rpartition("#")[2].strip().split(";")
        scene, events = decoded(code)
        tick, expected = int(ticks), f"{int(page_hash, 16):016x}"
        if not max((event.tick for event in events), default=0) <= tick <= MOST_TICKS:
            raise ValueError("it ends before its last event, or late")
    except (ValueError, IndexError) as error:
        raise AntsError(
            "the link is damaged, or is not one of the lab; copy it there again, with its tick and "
            "hash."
        ) from error
    colony = played(scene, events, tick)
    return Replayed(tick, int(colony.deliveries[0]), state_hash(colony), expected)


def played(scene: dict[str, Any], events: list[Event], tick: int) -> Colony:
    """Return the colony of a scene at a tick, after these events."""
    ants = [scene["ants"], *(int(event.value) for event in events if event.does == "ants")]
    colony = _begun(scene, max(ants))
    to = Interventions(colony, lasting=False)
    for event in (*events, Event(tick, "end")):
        if event.tick > colony.ticks:
            colony.tick(event.tick - colony.ticks)
        for change in _changes(event, scene, colony):
            to.apply(change)
    return colony


def decoded(code: str) -> tuple[dict[str, Any], list[Event]]:
    """Return the scene and the events of a code; ValueError or IndexError if it is damaged."""
    raw = _Reader(base64.b64decode(code + "=" * (-len(code) % 4), "-_", validate=True))
    version, both, rules = raw.byte(), raw.byte(), raw.byte()
    scene: dict[str, Any] = {"world": both & 15, "learner": LEARNERS[both >> 4], "rules": rules}
    radius, events, tick = WORLDS[scene["world"]]["radius"], list[Event](), 0
    if version != _VERSION or rules not in RULES:
        raise ValueError("it is of another version")
    scene |= {name: raw.setting(name) for name in RANGES}
    while raw.at < len(raw.code):
        tick += raw.number()
        kind, more = raw.pair()
        if kind == _SETTING:
            events.append(Event(tick, SETTINGS[more], raw.setting(SETTINGS[more])))
        else:
            events += raw.stroke(tick, STROKES[kind], more, radius)
            tick = events[-1].tick
    return scene, events


class _Reader:
    """The bytes of a code, which are read one after the other."""

    def __init__(self, code: bytes) -> None:
        self.code, self.at = code, 0

    def byte(self) -> int:
        self.at += 1
        return self.code[self.at - 1]

    def pair(self) -> tuple[int, int]:
        """Return the three low bits of a byte, and the others."""
        return (byte := self.byte()) & 7, byte >> 3

    def number(self) -> int:
        number, unit, byte = 0, 1, 128
        while byte > 127:
            byte = self.byte()
            number, unit = number + (byte & 127) * unit, unit * 128
        return number

    def setting(self, name: str) -> float:
        """Return the value of a setting; ValueError if it is not allowed."""
        number, (least, most) = self.number(), RANGES[name]
        if least < -1:  # it has a sign
            number = -(number + 1) // 2 if number % 2 else number // 2
        number -= name == "regrowth"
        if not least <= number <= most:
            raise ValueError(f"{name} is {number}")
        return number / 1000 if name in ("epsilon", "rate", "discount") else number

    def stroke(self, tick: int, does: str, reach: int, radius: int) -> Iterator[Event]:
        """Yield the events of a stroke, one for each part between waits."""
        r, q = (one - radius for one in divmod(self.number(), 2 * radius + 1))
        path, kind = [(q, r)], 0
        while kind != _END:
            kind, n = self.pair()
            for _ in range((n + 1) * (kind < _WAIT)):
                q, r = q + STEPS[kind][0], r + STEPS[kind][1]
                path.append((q, r))
            if max((distance(*cell) for cell in path), default=0) >= radius:
                raise ValueError("a stroke leaves the world")
            if kind >= _WAIT and path:
                yield Event(tick, does, reach=reach, path=tuple(path))
                path = []
            tick += (n + 1) * (kind == _WAIT)


def _begun(scene: dict[str, Any], capacity: int) -> Colony:
    """Return the colony of a scene at the start of its episode."""
    task = Task()
    for bit, part in PARTS.items():
        task = task.replace(**part) if scene["rules"] & bit else task
    task = queueing() if scene["rules"] & QUEUES else task
    life = {"regrowth": None if scene["regrowth"] < 0 else scene["regrowth"]}
    task = task.replace(evaporation_in_training=True, life=life, **_numbers(scene))
    learner, policy = scene["learner"], None
    if learner == "frozen":
        learner, policy = "q_learning", trail_follower(task.observation)
    numbers = max(scene["rate"], 0.001), scene["discount"], scene["epsilon"], 1.0, 0.0
    colony = Colony(
        lab_world(scene["world"], scene["seed"]),
        task,
        TrainingConfig(learner, *numbers, initial_q=scene["first"]),
        *(scene["seed"], scene["ants"], capacity),
        sharing="shared" if policy is None else "frozen",
        q_values=policy,
    )
    colony.begin_episode()
    if colony.learns:
        colony._set_learning_rate(scene["rate"] * scene["learns"])
    return colony


def _numbers(scene: dict[str, Any]) -> dict[str, Any]:
    """Return the settings of the task that a visitor can change."""
    slope = {"slope": max(1, (2 * scene["level"] + 50) // 100)}
    pheromone = {"level": scene["level"], **(slope if scene["rules"] & DIRECTED else {})}
    return {"pheromone": pheromone, "rewards": {"shaping": scene["shaping"]}}


def _changes(event: Event, scene: dict[str, Any], colony: Colony) -> Iterator[changes.Intervention]:
    """Yield the interventions of an event; the scene gets the value of a setting."""
    if event.does in SETTINGS:
        scene[event.does] = event.value
    match event.does:
        case "rock" | "food":
            yield changes.Place(event.does, cells_within(event, colony.grid))
        case "scent" | "trail":
            level = scene["level"] if event.does == "trail" else (scene["level"] + 1) // 2
            yield changes.SetTrail(level, cells_within(event, colony.grid))
        case "erase":
            yield changes.Clear(cells_within(event, colony.grid))
            yield changes.SetTrail(0, cells_within(event, colony.grid))
        case "ants":
            yield changes.SetAnts(int(event.value))
        case "epsilon":
            yield changes.SetEpsilon(event.value)
        case "discount":
            colony.training = colony.training.replace(discount=event.value)
        case "level" | "shaping":
            yield changes.SetTask.from_dict(_numbers(scene))
        case "rate" | "learns" if colony.learns:
            yield changes.SetLearningRate(scene["rate"] * scene["learns"])


def cells_within(event: Event, grid: AxialGrid) -> list[int]:
    """Return the flat indices of the cells within reach of the path of a stroke."""
    near = [grid.distances((q, r, 0)) <= event.reach for q, r in event.path]
    return np.flatnonzero(np.any(near, axis=0) & grid.exists).tolist()


def state_hash(colony: Colony) -> str:
    """Return the hash of the state of a colony with one world and one table, 16 hexadecimal digits.

    It hashes the tick. For each ant, by number, it hashes its cell, heading and load in one word,
    and its random stream; for each cell its trail level and content; then all action values.
    """
    slots = np.flatnonzero(colony.living[0])
    slots = slots[np.argsort(colony.numbers[0, slots])]
    cells, headings, carry, streams = (
        column[0, slots].astype(np.uint64).tolist()
        for column in (colony.cells, colony.headings, colony.carrying, colony.streams)
    )
    ants = zip(cells, headings, carry, streams, strict=True)
    words = [word for cell, h, load, s in ants for word in (cell << 8 | h << 1 | load, s)]
    stored, clock = colony._stored_pheromone(0, 0)
    levels = np.maximum(stored.astype(np.int64) - clock, 0)
    words += (levels << 8 | (colony._part("ground", 0) & 15)).tolist()
    words += colony.q_values[0].view(np.uint32).ravel().tolist()
    return f"{hash_of(colony.ticks, *words):016x}"
