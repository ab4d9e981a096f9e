"""What a world is: its cells and what stands on them when an episode starts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from taichi_ants.errors import AntsError, check_one_of, shown, whole
from taichi_ants.grid.constants import N_HEADINGS, STREAM_START_CELL, STREAM_START_HEADING
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.grid.randomness import choose, stream_state
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN
from taichi_ants.worlds import validation

Start = Literal["nest", "spread"]
STARTS: tuple[str, ...] = get_args(Start)
# Which cells of a 3 x 3 window (rows r, columns q) are neighbours on the hexagonal grid.
_NEIGHBOURS = np.array([[1, 1, 0], [1, 1, 1], [0, 1, 1]])
_PARTS = ("foods", "obstacles", "trails", "ants")


@dataclass(frozen=True, eq=False, repr=False)
class World:
    """A world of hexagonal cells, as it is when an episode starts.

    Cells may be given in any form of cube coordinates; they are stored in normal form, in read-only
    copies. Foods, obstacles and trails are sets, stored in lexicographic order: two worlds with the
    same contents are equal. Ants keep their order, an ant's place is its number.

    Attributes:
        ranges: (X, Y, Z), the numbers of values of each coordinate, in cells, each at least 1.
        queen: (x, y, z), the queen's cell.
        foods, obstacles: Cells with food, and that cannot be entered, int32 (n, 3); given as a
            sequence of (x, y, z) or such an array.
        trails: int32 (T, 4) = x, y, z, trail level (ticks until it has evaporated); given as a
            sequence of ((x, y, z), level) or such an array. Entries of level 0 are left out. Where
            trails are float32 (see `Pheromone.dense`), levels above 2**24 are rounded to that.
        ants: int32 (A, 4) = x, y, z, heading; given likewise. More ants than these are placed by
            `start`.

    Raises:
        AntsError: A value has the wrong form, lies outside the world, is listed twice, or stands
            where something else stands. Trails may lie under the queen, foods and ants.
    """

    ranges: tuple[int, int, int]
    queen: tuple[int, int, int]
    foods: np.ndarray = ()  # type: ignore[assignment]
    obstacles: np.ndarray = ()  # type: ignore[assignment]
    trails: np.ndarray = ()  # type: ignore[assignment]
    ants: np.ndarray = ()  # type: ignore[assignment]

    if TYPE_CHECKING:  # what is given may be any sequence, what is stored is an array

        def __init__(
            self,
            ranges: Sequence[int],
            queen: Sequence[int],
            foods: npt.ArrayLike = (),
            obstacles: npt.ArrayLike = (),
            trails: npt.ArrayLike = (),
            ants: npt.ArrayLike = (),
        ) -> None: ...

    def __post_init__(self) -> None:
        ranges = validation.parse_ranges(self.ranges)
        grid = AxialGrid(ranges)
        contents = validation.parse_contents(
            grid, self.queen, self.foods, self.obstacles, self.trails, self.ants
        )
        # The dataclass is frozen; this is the one place that writes its fields.
        object.__setattr__(self, "ranges", ranges)
        for name, value in contents.items():
            object.__setattr__(self, name, value)

    @cached_property
    def grid(self) -> AxialGrid:
        """How the cells lie in flat arrays; `grid.size` is the length of all arrays below."""
        return AxialGrid(self.ranges)

    def ground(self) -> np.ndarray:
        """uint8 (grid.size,): EMPTY, OBSTACLE, FOOD or QUEEN; outside the world OBSTACLE."""
        ground = np.where(self.grid.exists, np.uint8(EMPTY), np.uint8(OBSTACLE))
        ground[self.grid.index(self.obstacles)] = OBSTACLE
        ground[self.grid.index(self.foods)] = FOOD
        ground[self.grid.index(self.queen)] = QUEEN
        return ground

    def trail_levels(self) -> np.ndarray:
        """int32 (grid.size,): the trail level of each cell."""
        levels = np.zeros(self.grid.size, dtype=np.int32)
        levels[self.grid.index(self.trails[:, :3])] = self.trails[:, 3]
        return levels

    def distances(self) -> np.ndarray:
        """int32 (grid.size,): steps from each cell to the queen, obstacles ignored; 0 outside."""
        return self.grid.distances(self.queen) * self.grid.exists

    def closer(self) -> np.ndarray:
        """uint8 (grid.size,): bit h is set if the neighbour at heading h is nearer to the queen."""
        here = self.grid.distances(self.queen)
        bits = np.zeros(self.grid.size, dtype=np.uint8)
        for heading, offset in enumerate(self.grid.offsets.tolist()):
            there = np.roll(here, -offset)
            bits |= (there < here).astype(np.uint8) << np.uint8(heading)
        return bits * self.grid.exists

    def walkable(self, starts: np.ndarray) -> np.ndarray:
        """bool (grid.size,): empty cells that can be reached from an empty one of `starts`."""
        # Importing scipy.ndimage takes longer than all else here, and most worlds never need it.
        from scipy.ndimage import label

        ground = self.ground().reshape(self.grid.height, self.grid.width)
        regions = label(ground == EMPTY, structure=_NEIGHBOURS)[0].reshape(-1)
        home = regions[starts]
        return np.isin(regions, home[home > 0])

    def reachable_foods(self) -> np.ndarray:
        """bool (F,): whether an ant can walk from beside the queen to beside a food."""
        found = self.walkable(self.grid.index(self.queen) + self.grid.offsets)
        return found[self.grid.index(self.foods)[:, None] + self.grid.offsets].any(axis=1)

    def start(self, seed: int, n: int = 1, where: str = "nest") -> tuple[np.ndarray, np.ndarray]:
        """Flat indices and headings, int32 (n,), of n ants at the start, the listed ants first.

        Args:
            seed: Any whole number; decides cells (ties of distance), and headings of placed ants.
            n: Number of ants, at least 1. If fewer than the listed ants, the first of these.
            where: "nest": on the free cells nearest to the queen. "spread": on any free cells.
        """
        seed, n = whole("seed", seed), whole("n", n)
        if n < 1:
            raise AntsError(f"n is {shown(n)}; there must be at least 1 ant.")
        check_one_of("where", where, STARTS)
        cells, headings = self.grid.index(self.ants[:n, :3]), self.ants[:n, 3]
        if len(cells) < n:
            placed = self._free_cells(seed, n - len(cells), cells, where)
            words = stream_state(seed, STREAM_START_HEADING, np.arange(len(cells), n))
            headings = np.concatenate([headings, choose(words >> np.uint64(32), N_HEADINGS)])
            cells = np.concatenate([cells, placed])
        return cells.astype(np.int32), headings.astype(np.int32)

    def first_starts(self, seeds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """`start` of one ant in the nest by each seed, uint64 (n,)."""
        if len(self.ants) or not len(seeds):
            listed = self.grid.index(self.ants[:1, :3]), self.ants[:1, 3]
            cells, headings = (np.broadcast_to(one, len(seeds)) for one in listed)
            return cells.astype(np.int32), headings.astype(np.int32)
        free = np.flatnonzero(self.ground() == EMPTY)
        if not len(free):
            self.start(0)  # says that there is no room
        distance = self.distances()[free]
        nearest = free[distance == distance.min()]
        numbers = self.grid.number(self.grid.cells(nearest))
        words = stream_state(seeds[:, None], STREAM_START_CELL, numbers[None, :])
        headings = choose(stream_state(seeds, STREAM_START_HEADING, 0) >> np.uint64(32), N_HEADINGS)
        return nearest[words.argmin(axis=1)].astype(np.int32), headings.astype(np.int32)

    def _free_cells(self, seed: int, n: int, taken: np.ndarray, where: str) -> np.ndarray:
        """The first n free cells by their distance to the queen ("nest" only), then by a hash."""
        free = self.ground() == EMPTY
        free[taken] = False
        index = np.flatnonzero(free)
        if n > len(index):
            raise AntsError(
                f"{shown(n + len(taken))} ants are asked for; this world has room for "
                f"{len(index) + len(taken)}, so ask for fewer ants or choose a larger world."
            )
        if where == "nest":
            distance = self.distances()[index]
            # Only the cells up to the distance at which n are complete need a hash and an order.
            last = np.searchsorted(np.cumsum(np.bincount(distance)), n)
            index, distance = index[distance <= last], distance[distance <= last]
        words = stream_state(seed, STREAM_START_CELL, self.grid.number(self.grid.cells(index)))
        if where == "nest":
            return index[np.lexsort((words, distance))[:n]]
        # The cells of the n smallest words are a sample without replacement.
        first = np.argpartition(words, n - 1)[:n]
        return index[first[np.argsort(words[first])]]

    def as_dict(self) -> dict[str, Any]:
        """Return the world as names and lists of numbers, for files; `from_dict` reads it."""
        parts = {name: getattr(self, name).tolist() for name in _PARTS}
        return {"ranges": [*self.ranges], "queen": [*self.queen], **parts}

    @classmethod
    def from_dict(cls, facts: Mapping[str, Any]) -> World:
        """Return the world of `as_dict`; raises ValueError, KeyError or TypeError."""
        return cls(facts["ranges"], facts["queen"], *(np.array(facts[n]) for n in _PARTS))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, World):
            return NotImplemented
        return self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)

    @cached_property
    def _key(self) -> tuple:
        return (self.ranges, self.queen, *(getattr(self, name).tobytes() for name in _PARTS))

    def __reduce__(self) -> tuple:
        # Copies and pickles are built anew, so that their arrays are read-only as well.
        return World, (self.ranges, self.queen, *(getattr(self, name) for name in _PARTS))

    def __repr__(self) -> str:
        return (
            f"World(ranges={self.ranges}, queen={self.queen}, foods: {len(self.foods)}, "
            f"obstacles: {len(self.obstacles)}, trails: {len(self.trails)}, "
            f"ants: {len(self.ants)})"
        )
