"""What environments of single ants draw: pictures and text maps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.engines.runs.batched import BatchedEnvironments
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN
from taichi_ants.worlds import text_map

if TYPE_CHECKING:
    from taichi_ants.rendering import Scene

_MARKS = {
    EMPTY: text_map.EMPTY,
    OBSTACLE: text_map.OBSTACLE,
    FOOD: text_map.FOOD,
    QUEEN: text_map.QUEEN,
}


class Drawing:
    """Draws ants and their worlds in the mode that was asked for, None for none."""

    def __init__(self, batched: BatchedEnvironments, mode: str | None) -> None:
        self._batched, self._mode = batched, mode
        self._scene: Scene | None = None

    def draw(self, number: int) -> Any:
        """The world of an ant: uint8 (720, 1280, 3), or text."""
        if self._mode is None:
            return None
        return self._picture(number) if self._mode == "rgb_array" else self._text(number)

    def _facts(self, number: int) -> list[tuple[str, str]]:
        """What is said beside the world."""
        arrays, observation = self._batched.arrays, self._batched.task.sees
        return [
            ("step", str(arrays["steps"][number])),
            ("reward", f"{arrays['rewards_of'][number]:g}"),
            ("state", observation.name_of(int(arrays["states"][number]))),
        ]

    def _picture(self, number: int) -> np.ndarray:
        from taichi_ants import rendering

        snapshot, task = self._batched.snapshot(number), self._batched.task
        if self._scene is None:
            self._scene = rendering.Scene(snapshot.grid, view=True, strongest=task.pheromone.level)
        lines, state = tuple(self._facts(number)), int(self._batched.arrays["states"][number])
        return self._scene.draw(snapshot, rendering.Status(lines, state, observation=task.sees))

    def _text(self, number: int) -> str:
        """A text map, see `worlds.text_map`, below comments; an ant is its heading."""
        now = self._batched.snapshot(number)
        grid, exists = now.grid, now.grid.exists
        marks = [
            (grid.cells(np.flatnonzero((now.ground == ground) & exists)), mark)
            for ground, mark in _MARKS.items()
        ]
        marks.append(
            (grid.cells(np.flatnonzero((now.trail > 0) & (now.ground == EMPTY))), text_map.TRAIL)
        )
        on_trail = now.trail[now.ant_cells[0]] > 0
        letters = text_map.ANTS_ON_TRAIL if on_trail else text_map.ANTS
        marks.append((grid.cells(now.ant_cells), letters[now.ant_headings[0]]))
        head = ", ".join(f"{name} {value}" for name, value in self._facts(number))
        return f"; {head}\n" + text_map.drawing(grid.ranges, marks)

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "_scene": None}  # it is drawn anew
