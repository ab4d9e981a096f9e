"""Snapshots of a world, with the text for the panel of their pictures.

A colony of one ant replays an episode, so pictures show the engine's own steps.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from taichi_ants.engines.colony.colony import Colony
from taichi_ants.engines.runs.results import RolloutArguments, Trace
from taichi_ants.engines.runs.training import rollout
from taichi_ants.errors import checked_whole, expect
from taichi_ants.grid.constants import STREAM_ROLLOUT
from taichi_ants.grid.randomness import stream_state
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.records import Snapshot
from taichi_ants.rendering.scene import DEFAULT_SIZE, Scene, Status, name_parts
from taichi_ants.task import Observation
from taichi_ants.task.constants import ACTION_NAMES, N_ACTIONS
from taichi_ants.worlds.world import World

CaptionedSnapshot = tuple[Snapshot, Status]


def at_start(world: World, seed: int = 0, n: int = 1) -> Snapshot:
    """Return a snapshot of a world at the start, with n ants or none, placed by the seed.

    Raises as `World.start` does.

    >>> rendering.at_start(worlds.paper(), n=3).ant_cells.shape
    (3,)
    """
    expect("world", world, World)
    cells, headings = world.start(seed, n) if n else np.zeros((2, 0), np.int32)
    return Snapshot(
        *(world.grid, world.ground(), world.trail_levels(), cells, headings),
        ant_carries=np.zeros(len(cells), dtype=bool),
        food_kinds=world.kinds_by_cell(),
        queens=world.grid.index(world.queens).astype(np.int32),
        world=world,
    )


def picture(world: World, size: tuple[int, int] = DEFAULT_SIZE) -> np.ndarray:
    """Return a picture of a world and its listed ants, uint8 (height, width, 3).

    >>> rendering.picture(worlds.paper(), size=(320, 240)).dtype
    dtype('uint8')
    """
    expect("world", world, World)
    return Scene(world.grid, size).draw(at_start(world, n=len(world.ants)))


def frames(
    snapshots: Iterable[CaptionedSnapshot], size: tuple[int, int] = DEFAULT_SIZE, **look: Any
) -> Iterator[np.ndarray]:
    """Yield pictures of snapshots of one world, uint8 (height, width, 3), one by one.

    Args:
        snapshots: Pairs of a `Snapshot` and its `Status`, or None, as `colony_snapshots` yields.
        size: Width and height in pixels.
        look: Further arguments of `Scene`.

    >>> pictures = rendering.frames(rendering.colony_snapshots(colony), size=(320, 240))
    >>> next(pictures).shape
    (240, 320, 3)
    """
    scene = None
    for snapshot, status in snapshots:
        view = getattr(status, "state", None) is not None
        scene = scene or Scene(snapshot.grid, size, view=view, **look)
        yield scene.draw(snapshot, status)


@dataclass(frozen=True, eq=False)
class Episode:
    """An episode in which an ant follows a policy: rollout 0 of a seed.

    Attributes:
        trace: Its steps.
        name: Its name in the panel of pictures, such as "greedy".

    >>> episode = rendering.Episode.play(worlds.paper(), result.q_values[0, 0])
    >>> len([*episode.snapshots()]) == len(episode.trace) + 1
    True
    """

    trace: Trace
    name: str

    @classmethod
    def play(cls, world: World, q_values: np.ndarray, **rules: Any) -> Episode:
        """Return rollout 0 of a policy; arguments and errors are those of `rollout`."""
        name = f"epsilon {rules['epsilon']:g}" if rules.get("epsilon") else "greedy"
        return cls(rollout(world, q_values, **rules), name)

    @property
    def delivered(self) -> bool:
        """Whether the episode ended with a delivery."""
        return bool(self.trace.delivered[-1])

    def __len__(self) -> int:
        """Return the number of snapshots, which is the number of steps plus 1."""
        return len(self.trace) + 1

    def snapshots(self) -> Iterator[CaptionedSnapshot]:
        """Yield the world before each step, with the action that follows, and at the end."""
        trace, arguments = self.trace, self.trace.arguments
        assert arguments is not None  # `rollout` sets it
        colony, sees = colony_of_rollout(arguments), arguments.task.sees
        states = [*trace.states.tolist(), int(trace.next_states[-1])]
        actions = [*trace.actions.tolist(), None]
        returns = [0, *np.cumsum(trace.rewards).tolist()]
        for step, (state, action, gained) in enumerate(zip(states, actions, returns, strict=True)):
            if step:
                colony.tick()
            lines = [("episode", self.name), ("step", str(step)), ("return", str(gained))]
            last = [("outcome", "delivered")] if self.delivered else []
            if action is not None:
                last = [("action", ACTION_NAMES[action])]
            q_values = colony.q_values[0, state]
            status = _status_of(sees, state, q_values, action, trace.q_values, lines, last)
            yield colony.snapshot(), status


def colony_of_rollout(arguments: RolloutArguments) -> Colony:
    """Return a colony of one ant that repeats a `rollout`: it has the same random numbers."""
    frozen: dict[str, Any] = {"sharing": "frozen", "q_values": arguments.q_values}
    steady = TrainingConfig.frozen(arguments.epsilon)
    colony = Colony(arguments.world, arguments.task, steady, arguments.seed, **frozen)
    colony.begin_episode()
    colony.streams[0, 0] = stream_state(arguments.seed, STREAM_ROLLOUT, arguments.number)
    return colony


def colony_snapshots(
    colony: Colony, ticks: int = 0, frame_interval: int = 1, follow: int | None = None
) -> Iterator[CaptionedSnapshot]:
    """Yield snapshots of a colony's first world: one now, then one every `frame_interval` ticks.

    Args:
        colony: A colony in an episode; it advances by `ticks`.
        ticks: The number of ticks; 0 yields only the present. The last interval may be shorter.
        frame_interval: Ticks between snapshots, at least 1.
        follow: The number of an ant, from 0. Its view, state and action values are shown while it
            lives. None follows no ant.

    >>> [len(shown.ant_cells) for shown, status in rendering.colony_snapshots(colony, ticks=2)]
    [16, 16, 16]
    """
    between = intervals(colony, ticks, frame_interval, follow)
    yield _snapshot(colony, follow)
    for n in between:
        colony.tick(n)
        yield _snapshot(colony, follow)


def intervals(colony: Colony, ticks: int, frame_interval: int, follow: int | None) -> list[int]:
    """Return the ticks between snapshots; arguments and errors as in `colony_snapshots`."""
    expect("colony", colony, Colony)
    ticks = checked_whole("ticks", ticks, least=0)
    every = checked_whole("frame_interval", frame_interval)
    if follow is not None:
        most = 2**31 - 1 if colony.task.life.births else colony.ants - 1
        checked_whole("follow", follow, 0, most)
    return [min(every, ticks - done) for done in range(0, ticks, every)]


def _snapshot(colony: Colony, follow: int | None) -> CaptionedSnapshot:
    snapshot, outcome = colony.snapshot(), colony.outcome()
    blocked = outcome.blocked[0, 0] / max(1, outcome.moves[0, 0])
    lines = [
        ("tick", str(colony.ticks)),
        ("ants", str(len(snapshot.ant_cells))),
        ("with food", str(snapshot.ant_carries.sum())),
        ("delivered", str(outcome.deliveries[0, 0])),
        ("moves blocked", f"{100 * blocked:.0f} %"),
    ]
    (slots,) = np.nonzero(colony.living[0])  # in the order of the snapshot
    followed = colony.numbers[0, slots] == follow
    if follow is None or not followed.any():
        return snapshot, Status(tuple(lines))
    # Pictures mark the view of the first ant, so the followed ant must be first.
    order = np.argsort(~followed, kind="stable")
    snapshot = snapshot.ordered(order)
    # All lines together do not fit into the panel.
    lines = [lines[0], lines[3], ("ant", str(follow))]
    slot, table = int(slots[order[0]]), colony.q_values[0]
    state, rows = int(colony.states[0, slot]), table.reshape(-1, colony.task.n_states, N_ACTIONS)
    q_values = rows[colony.tables_of_ants[0, slot], state]
    return snapshot, _status_of(colony.task.sees, state, q_values, None, table, lines)


def _status_of(
    observation: Observation,
    state: int,
    q_values: np.ndarray,
    action: int | None,
    table: np.ndarray,
    lines: list[tuple[str, str]],
    last: Sequence[tuple[str, str]] = (),
) -> Status:
    """Return a status with the ant's observation; the bars have the scale of the table."""
    task, seen, _ = name_parts(observation, state)
    lines += [("task", task), ("sees", seen)] if task else [("state", seen)]
    lines += [("", observation.letters)] if observation.letters else []
    low, high = float(table.min(initial=0)), float(table.max(initial=0))
    q_range = (low, high) if low < high else (0.0, 1.0)
    return Status((*lines, *last), state, q_values, action, q_range, observation)
