"""What a picture shows: a world with its ants at one moment."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from taichi_ants.errors import AntsError, shown
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.rendering.arguments import expect
from taichi_ants.worlds.world import World


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A world with its ants at one moment. The arrays are taken as they are, without a copy.

    Attributes:
        grid: Where the cells lie in the arrays.
        ground: uint8 (grid.size,), EMPTY, OBSTACLE, FOOD or QUEEN.
        trail: Whole or real numbers (grid.size,), the trail level of each cell.
        ant_cells: Whole numbers (n,), flat indices.
        ant_headings: Whole numbers (n,), 0 to 5.
        ant_carries: bool (n,), whether an ant carries food.
        letters: What ant number `watched` sees to its left, ahead and to its right, for example
            "ETO"; None marks no cells.
        watched: Number of that ant.

    Raises:
        AntsError: An array has the wrong shape or type, or an ant a place or heading that does not
            exist.
    """

    grid: AxialGrid
    ground: np.ndarray
    trail: np.ndarray
    ant_cells: np.ndarray
    ant_headings: np.ndarray
    ant_carries: np.ndarray
    letters: str | None = None
    watched: int = 0

    def __post_init__(self) -> None:
        expect("grid", self.grid, AxialGrid)
        expect("ant_cells", self.ant_cells, np.ndarray)
        expect("letters", self.letters, str, type(None))
        size, n = self.grid.size, len(self.ant_cells)
        _check("ground", self.ground, (size,), "u")
        _check("trail", self.trail, (size,), "iuf")
        _check("ant_cells", self.ant_cells, (n,), "iu")
        _check("ant_headings", self.ant_headings, (n,), "iu")
        _check("ant_carries", self.ant_carries, (n,), "b")
        _check_below("ant_cells", self.ant_cells, size)
        _check_below("ant_headings", self.ant_headings, N_HEADINGS)
        if not self.grid.exists[self.ant_cells].all():
            raise AntsError("ant_cells holds a cell outside the world; ants must stand in it.")
        if self.letters is not None and not (len(self.letters) == 3 and 0 <= self.watched < n):
            raise AntsError(
                f"letters are {self.letters!r} for ant {self.watched} of {n}; "
                "there must be three of them, for an ant that exists."
            )

    @classmethod
    def at_start(cls, world: World, seed: int = 0, n: int = 1) -> Snapshot:
        """A world with n ants as an episode starts; raises as `World.start` does."""
        expect("world", world, World)
        cells, headings = world.start(seed, n)
        return cls(
            grid=world.grid,
            ground=world.ground(),
            trail=world.trail_levels(),
            ant_cells=cells,
            ant_headings=headings,
            ant_carries=np.zeros(n, dtype=bool),
        )

    @classmethod
    def of(cls, moment: Any) -> Snapshot:
        """A snapshot of anything that has its attributes up to `ant_carries`, as colonies do.

        A `Snapshot` is returned as it is.

        Raises:
            AntsError: It is something else.
        """
        if isinstance(moment, cls):
            return moment
        parts = getattr(moment, "__dict__", {})
        names = [field.name for field in fields(cls)]
        if not set(names[:6]) <= parts.keys() <= set(names):
            raise AntsError(
                f"the moment is {shown(moment)}; it must be a Snapshot, or what Colony.snapshot() "
                "returns."
            )
        return cls(**parts)

    def cells_in_view(self) -> np.ndarray:
        """Flat indices (3,) of the cells to the left, ahead and to the right of the watched ant."""
        headings = (self.ant_headings[self.watched] + np.array([-1, 0, 1])) % N_HEADINGS
        return self.ant_cells[self.watched] + self.grid.offsets[headings]


def _check(name: str, array: np.ndarray, shape: tuple[int, ...], kinds: str) -> None:
    if not isinstance(array, np.ndarray) or array.shape != shape or array.dtype.kind not in kinds:
        what = f"{array.dtype} {array.shape}" if isinstance(array, np.ndarray) else repr(array)
        words = {"u": "unsigned whole numbers", "b": "bool", "iu": "whole numbers"}
        raise AntsError(
            f"{name} is {what}; it must be an array of {words.get(kinds, 'numbers')} of shape "
            f"{shape}."
        )


def _check_below(name: str, array: np.ndarray, limit: int) -> None:
    if not len(array):
        return
    lowest, highest = int(array.min()), int(array.max())
    if lowest < 0 or highest >= limit:
        raise AntsError(
            f"{name} holds values from {lowest} to {highest}; they must lie between 0 and "
            f"{limit - 1}."
        )
