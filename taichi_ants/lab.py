"""Replay links of the lab, the page in `docs/lab.html`, where the same ants run in WebAssembly.

A link is `CODE;TICK;HASH`: a code, the tick at which it was copied, and a hash of the state then.
The code is base64 for addresses of the bytes below. A number has seven bits in each byte, the
lowest first; all but its last byte are above 127.

    version; world | learner << 4; rules
    seed, ants, 1000 epsilon, 1000 learning rate, 1000 discount, learns, first value *, level,
    1 + regrowth, shaping *
    events: ticks since the event before; then
      kind | reach << 3 for a stroke, its first cell, and bytes kind | n << 3:
        0 .. 5: n + 1 steps along this heading; 6: a wait of n + 1 ticks; 7: the end
      4 | setting << 3 for a setting, and its value

Numbers marked * can be negative: n is written as 2 n, or -2 n - 1. Each part of a stroke between
waits is an event, which paints all cells within `reach` of its own cells.
"""

from __future__ import annotations

import base64
import binascii
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple
from urllib.parse import unquote

import numpy as np

from taichi_ants import interventions as changes
from taichi_ants.engines.colony.colony import Colony
from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.errors import AntsError, expect
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.policies import trail_follower
from taichi_ants.reference.random_stream import hash_of
from taichi_ants.task import Task, queueing
from taichi_ants.worlds.lab import STEPS, WORLDS, lab_world

VERSION = 1
STROKES = ("rock", "food", "scent", "erase")
SETTINGS = ("ants", "epsilon", "rate", "discount", "level", "shaping", "learns")
LEARNERS = ("q_learning", "sarsa", "frozen")
DIRECTED, RIGHT_OF_WAY, SEES_ANTS, QUEUES = 1, 2, 4, 8  # bits of rules
RULES = (*range(8), 15)
THOUSANDTHS, SIGNED = ("epsilon", "rate", "discount"), ("first", "shaping")
MOST_TICKS, MOST_ANTS = 1_000_000, 10_000
_SETTING, _WAIT, _END = 4, 6, 7
_SCENE = (
    *("seed", "ants", "epsilon", "rate", "discount", "learns", "first", "level", "regrowth"),
    "shaping",
)
_MOST = {
    **{"seed": 2**53 - 1, "ants": MOST_ANTS, "epsilon": 1000, "rate": 1000, "discount": 1000},
    **{"learns": 1, "first": 1000, "level": 100_000, "regrowth": MOST_TICKS, "shaping": 100},
}


class Event(NamedTuple):
    """A change of a visitor before a tick: a stroke with its cells (q, r), or a setting."""

    tick: int
    does: str
    value: float = 0
    reach: int = 0
    path: tuple[tuple[int, int], ...] = ()


class Visit(NamedTuple):
    """What a code has: settings of the scene by name, and events by tick."""

    scene: dict[str, Any]
    events: list[Event]


@dataclass(frozen=True)
class Replayed:
    """The result of a link that was replayed.

    Attributes:
        tick: The number of ticks.
        deliveries: Food items that ants have delivered.
        hash: The hash of the state: tick, ants, ground, trail and action values.
        expected_hash: The hash in the link, which the page computed.
    """

    tick: int
    deliveries: int
    hash: str
    expected_hash: str

    @property
    def equal(self) -> bool:
        """Whether page and package agree."""
        return self.hash == self.expected_hash


def replay(link: str) -> Replayed:
    """Return the result of a link of the lab, replayed by a `Colony`.

    The link is an address that "Copy link" made, or its part after "#".

    Raises:
        AntsError: The link is damaged, or is not one of the lab.
    """
    expect("link", link, str)
    code, *rest = unquote(link).rpartition("#")[2].strip().split(";")
    try:
        tick, expected = int(rest[0]), f"{int(rest[1], 16):016x}"
        visit = decoded(code)
        if not max((event.tick for event in visit.events), default=0) <= tick <= MOST_TICKS:
            raise ValueError
    except (ValueError, IndexError, binascii.Error) as error:
        raise AntsError(
            "the link is damaged, or is not one of the lab; copy it again with its tick and hash, "
            "CODE;TICK;HASH."
        ) from error
    colony = _begun(visit)
    to, scene = Interventions(colony, lasting=False), dict(visit.scene)
    for event in visit.events:
        if event.tick > colony.ticks:
            colony.tick(event.tick - colony.ticks)
        for change in _changes(event, scene, colony):
            to.apply(change)
    if tick > colony.ticks:
        colony.tick(tick - colony.ticks)
    return Replayed(tick, int(colony.deliveries[0]), state_hash(colony), expected)


def decoded(code: str) -> Visit:
    """Return what a code has; ValueError or IndexError if it is damaged."""
    raw = iter(base64.b64decode(code + "=" * (-len(code) % 4), "-_", validate=True))
    version, both, rules = (next(raw, -1) for _ in range(3))
    scene: dict[str, Any] = {"world": both & 15, "learner": both >> 4, "rules": rules}
    if version != VERSION or both < 0 or scene["world"] >= len(WORLDS):
        raise ValueError
    if rules not in RULES or scene["learner"] >= len(LEARNERS):
        raise ValueError
    for name in _SCENE:
        scene[name] = _number(raw, name)
    events, tick = [], 0
    while (first := next(raw, None)) is not None:
        tick += _varint(raw, first)
        head = _byte(raw)
        if head & 7 == _SETTING:
            name = SETTINGS[head >> 3]
            events.append(Event(tick, name, _number(raw, name)))
        else:
            events += _stroke(
                raw, tick, STROKES[head & 7], head >> 3, WORLDS[scene["world"]].radius
            )
            tick = events[-1].tick
    return Visit(scene, events)


def _byte(raw: Iterator[int]) -> int:
    if (byte := next(raw, None)) is None:
        raise ValueError
    return byte


def _varint(raw: Iterator[int], byte: int) -> int:
    number, unit = byte & 127, 128
    while byte > 127:
        byte = _byte(raw)
        number, unit = number + (byte & 127) * unit, unit * 128
    if number > _MOST["seed"]:
        raise ValueError
    return number


def _number(raw: Iterator[int], name: str) -> float:
    """Return the number of a setting; ValueError if it is not allowed."""
    number: float = _varint(raw, _byte(raw))
    if name in SIGNED:
        number = number // 2 if number % 2 == 0 else -(number + 1) // 2
    number -= name == "regrowth"
    least = 1 if name in ("ants", "level") else -_MOST[name] if name in SIGNED else -1
    if not least <= number <= _MOST[name]:
        raise ValueError
    return number / 1000 if name in THOUSANDTHS else number


def _stroke(raw: Iterator[int], tick: int, does: str, reach: int, radius: int) -> list[Event]:
    """Return the events of a stroke, one for each part between waits."""
    width = 2 * radius + 1
    r, q = (one - radius for one in divmod(_varint(raw, _byte(raw)), width))
    events, path = [], [(q, r)]
    while True:
        kind, n = (byte := _byte(raw)) & 7, (byte >> 3) + 1
        if kind >= _WAIT and path:
            events.append(Event(tick, does, reach=reach, path=tuple(path)))
            path = []
        if kind == _END:
            break
        if kind == _WAIT:
            tick += n
            continue
        for _ in range(n):
            q, r = q + STEPS[kind][0], r + STEPS[kind][1]
            path.append((q, r))
    if any(_far(*cell) >= radius for event in events for cell in event.path):
        raise ValueError
    return events


def _far(q: int, r: int) -> int:
    """Return the distance of a cell from the middle of the world."""
    return max(q, r, 0) - min(q, r, 0)


def _task(scene: dict[str, Any]) -> Task:
    """Return the task of a scene: the paper's, with parts of `foraging`, or `queueing`."""
    rules, parts = scene["rules"], dict[str, Any]()
    if rules & DIRECTED:
        parts["pheromone"] = {"deposit": "fading", "view": "strongest"}
    if rules & RIGHT_OF_WAY:
        parts["traffic"] = "right_of_way"
    if rules & SEES_ANTS:
        parts["observation"] = "ants"
    task = queueing() if rules & QUEUES else Task().replace(**parts)
    regrowth = None if scene["regrowth"] < 0 else scene["regrowth"]
    task = task.replace(evaporation_in_training=True, life={"regrowth": regrowth})
    return task.replace(**_numbers(scene))


def _numbers(scene: dict[str, Any]) -> dict[str, Any]:
    """Return the settings of the task that visitors can change."""
    level = int(scene["level"])
    pheromone = {"level": level}
    if scene["rules"] & DIRECTED:
        pheromone["slope"] = max(1, (2 * level + 50) // 100)
    return {"pheromone": pheromone, "rewards": {"shaping": int(scene["shaping"])}}


def _begun(visit: Visit) -> Colony:
    """Return the colony of a visit at the start of its episode."""
    scene = visit.scene
    world, task = lab_world(scene["world"], scene["seed"]), _task(scene)
    frozen = LEARNERS[scene["learner"]] == "frozen"
    config = TrainingConfig(
        *("q_learning" if frozen else LEARNERS[scene["learner"]], max(scene["rate"], 0.001)),
        *(scene["discount"], scene["epsilon"], 1.0, 0.0),
        initial_q=scene["first"],
    )
    ants = [scene["ants"], *(event.value for event in visit.events if event.does == "ants")]
    colony = Colony(
        *(world, task, config, scene["seed"], int(scene["ants"]), int(max(ants))),
        sharing="frozen" if frozen else "shared",
        q_values=trail_follower(task.observation) if frozen else None,
    )
    colony.begin_episode()
    if not frozen:
        colony.set_learning_rate(scene["rate"] * scene["learns"])
    return colony


def _changes(event: Event, scene: dict[str, Any], colony: Colony) -> Iterator[changes.Intervention]:
    """Yield the interventions of an event, and note its value in the scene."""
    if event.does in STROKES:
        grid, radius = colony.grid, WORLDS[scene["world"]].radius
        around = range(-event.reach, event.reach + 1)
        steps = [(q, r) for q in around for r in around if _far(q, r) <= event.reach]
        near = {(q + a, r + b) for q, r in event.path for a, b in steps}
        inside = sorted(cell for cell in near if _far(*cell) < radius)
        cells = [(r + radius) * grid.width + q + radius for q, r in inside]
        if event.does == "erase":
            yield changes.Clear(cells)
            yield changes.SetTrail(0, cells)
        elif event.does == "scent":
            yield changes.SetTrail((int(scene["level"]) + 1) // 2, cells)
        else:
            yield changes.Place(event.does, cells)  # type: ignore[arg-type]
        return
    scene[event.does] = event.value
    if event.does == "ants":
        yield changes.SetAnts(int(event.value))
    elif event.does == "epsilon":
        yield changes.SetEpsilon(event.value)
    elif event.does == "discount":
        colony.training = colony.training.replace(discount=event.value)
    elif event.does in ("level", "shaping"):
        yield changes.SetTask.from_dict(_numbers(scene))
    elif colony.learns:
        yield changes.SetLearningRate(scene["rate"] * scene["learns"])


def state_hash(colony: Colony) -> str:
    """Return the hash of the state of a colony with one world and one table, 16 hexadecimal digits.

    It hashes the tick. For each ant, by number, it hashes its cell, heading and load in one word,
    and its random stream; for each cell its trail level and content; then all action values.
    """
    slots = np.flatnonzero(colony.living[0])
    slots = slots[np.argsort(colony.numbers[0, slots], kind="stable")]
    cells, headings, loads = (
        np.asarray(of_ants)[0, slots].astype(np.uint64)
        for of_ants in (colony.cells, colony.headings, colony.carrying)
    )
    eight, one = np.uint64(8), np.uint64(1)
    ants = np.stack([cells << eight | headings << one | loads, colony.streams[0, slots]], axis=1)
    stored, clock = colony.stored_pheromone(0, 0)
    levels = np.maximum(stored.astype(np.int64) - clock, 0)
    ground = levels << 8 | (colony.part("ground", 0) & 15)
    values = colony.q_values[0].view(np.uint32)
    words = [colony.ticks, *ants.ravel().tolist(), *ground.tolist(), *values.ravel().tolist()]
    return f"{hash_of(*words):016x}"
