"""The world at each step of a rollout, reconstructed from its trace in plain NumPy."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from taichi_ants.engines.runs.traces import Trace
from taichi_ants.grid.constants import N_HEADINGS, STREAM_ROLLOUT
from taichi_ants.grid.randomness import Stream
from taichi_ants.rendering.snapshot import Snapshot
from taichi_ants.task import Task
from taichi_ants.task.constants import (
    DEPOSIT_LEVEL,
    EMPTY,
    PICK_UP,
    RIGHT,
    SEES_EMPTY,
    SEES_GOAL,
    SEES_LURE,
)
from taichi_ants.task.states import CELL_LETTERS, state_from_index
from taichi_ants.worlds.world import World


class Replay:
    """Steps through a rollout.

    Args:
        world: The world of the rollout.
        trace: What `rollout` returned.
        seed, number: Of the rollout. They decide which of several foods in view was taken, the
            only thing that a trace does not tell.
        task: The rules of the game; None is the paper's.
    """

    def __init__(
        self, world: World, trace: Trace, seed: int = 0, number: int = 0, task: Task | None = None
    ) -> None:
        self._grid = world.grid
        self._trace = trace
        self._cells = world.grid.index(trace.cells)
        self._ground = world.ground()
        self._trail = world.trail_levels()
        self._evaporation = (task or Task()).evaporation_in_evaluation
        self._stream = Stream(seed, STREAM_ROLLOUT, number)

    def snapshots(self) -> Iterator[Snapshot]:
        """The world before each step and, last, after all of them; each with arrays of its own."""
        states = self._trace.states
        for step, state in enumerate(states.tolist()):
            yield self._snapshot(int(self._cells[step]), int(self._trace.headings[step]), state)
            cell, heading = self._do(step)
        if len(states):
            yield self._snapshot(cell, heading, int(self._trace.next_states[-1]))

    def _snapshot(self, cell: int, heading: int, index: int) -> Snapshot:
        state = state_from_index(index)
        return Snapshot(
            grid=self._grid,
            ground=self._ground.copy(),
            trail=self._trail.copy(),
            ant_cells=np.array([cell], dtype=np.int32),
            ant_headings=np.array([heading], dtype=np.int32),
            ant_carries=np.array([state.carries]),
            letters="".join(CELL_LETTERS[state.carries][code] for code in state.view),
        )

    def _do(self, step: int) -> tuple[int, int]:
        """Do a step; the ant's cell and heading after it."""
        self._stream.bits()  # each choice of an action takes one draw
        cell, heading = int(self._cells[step]), int(self._trace.headings[step])
        state = state_from_index(int(self._trace.states[step]))
        action = int(self._trace.actions[step])
        if action <= RIGHT:
            heading = self._turned(heading, action)
            if state.view[action] in (SEES_EMPTY, SEES_LURE):
                cell += int(self._grid.offsets[heading])
                if state.carries:
                    self._trail[cell] = DEPOSIT_LEVEL
        elif action == PICK_UP and not state.carries and SEES_GOAL in state.view:
            foods = [place for place in range(3) if state.view[place] == SEES_GOAL]
            place = foods[self._stream.below(len(foods))] if len(foods) > 1 else foods[0]
            food = cell + int(self._grid.offsets[self._turned(heading, place)])
            self._ground[food] = EMPTY
            self._trail[[food, cell]] = DEPOSIT_LEVEL
            heading = (heading + N_HEADINGS // 2) % N_HEADINGS
        if self._evaporation:
            np.maximum(self._trail - 1, 0, out=self._trail)
        return cell, heading

    @staticmethod
    def _turned(heading: int, place: int) -> int:
        """The heading of what lies to the left (0), ahead (1) or to the right (2)."""
        return (heading + place - 1) % N_HEADINGS
