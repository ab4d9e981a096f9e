"""The class of worlds: cells and their contents at the start of an episode."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from taichi_ants.errors import AntsError, as_array, check_one_of, checked_whole, shown, whole
from taichi_ants.grid.constants import N_HEADINGS, STREAM_START_CELL, STREAM_START_HEADING
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.grid.randomness import choose, stream_state
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN
from taichi_ants.worlds import validation

Start = Literal["nest", "spread"]
STARTS: tuple[str, ...] = get_args(Start)
_PARTS = ("foods", "obstacles", "trails", "ants")
_MORE = ("food_kinds", "other_queens")  # empty in a world with one nest and one kind of food


@dataclass(frozen=True, eq=False, repr=False, init=False)
class World:
    """A world of hexagonal cells at the start of an episode.

    You can give cells in any form of cube coordinates; read-only copies store them in normal form.
    Foods, obstacles and trails are sets in lexicographic order, so worlds with the same contents
    are equal. Ants are a list in which the index of an ant is its number.

    Attributes:
        ranges: (X, Y, Z), the number of values of each coordinate, in cells, each at least 1.
        queen: (x, y, z), the cell of the queen of the first nest. Give one cell, or a sequence of
            cells for several nests, at most 7.
        foods: Cells with food, int32 (n, 3). Give a sequence of (x, y, z), or such an array. A food
            item can also be ((x, y, z), kind).
        obstacles: Cells with rocks, likewise.
        trails: Cells with trails, int32 (T, 4) = x, y, z, level (ticks until the trail has
            evaporated). Give a sequence of ((x, y, z), level), or such an array. Level 0 means no
            trail. If `Pheromone.dense`, levels are float32, so those above 2**24 are rounded.
        ants: Listed ants, int32 (A, 4) = x, y, z, heading. Give a sequence of ((x, y, z), heading),
            or such an array. `start` places additional ants.
        food_kinds: The kind of each food item, uint8 (n,), 0 to 7; empty if all are of kind 0.
        other_queens: The cells of the queens of all nests but the first, int32 (N - 1, 3).
        regions: The cells of regions by name, each int32 (n, 3), for interventions and measures. A
            region is a sequence of (x, y, z), or a mapping with a `centre` and a `radius` in steps.
            Regions can overlap, and do not change the rules.

    Raises:
        AntsError: A value has the wrong form, is outside the world or listed twice, or shares a
            cell. Only trails can share a cell, with the queen, food or ants.

    >>> worlds.paper().grid.exists.sum().item()  # cells
    271
    """

    ranges: tuple[int, int, int]
    queen: tuple[int, int, int]
    foods: np.ndarray
    obstacles: np.ndarray
    trails: np.ndarray
    ants: np.ndarray
    food_kinds: np.ndarray
    other_queens: np.ndarray
    regions: Mapping[str, np.ndarray]

    def __init__(
        self,
        ranges: Sequence[int],
        queen: Sequence[int] | Sequence[Sequence[int]],
        foods: npt.ArrayLike = (),
        obstacles: npt.ArrayLike = (),
        trails: npt.ArrayLike = (),
        ants: npt.ArrayLike = (),
        food_kinds: npt.ArrayLike = (),
        other_queens: npt.ArrayLike = (),
        regions: Mapping[str, Any] | None = None,
    ) -> None:
        others = np.asarray(other_queens).tolist()
        grid = AxialGrid(validation.parse_ranges(ranges))
        parts = {"foods": foods, "obstacles": obstacles, "trails": trails, "ants": ants}
        contents: dict[str, Any] = validation.parse_contents(
            grid, [queen, *others] if others else queen, food_kinds, **parts
        )
        queens = contents.pop("queens")
        if not contents["food_kinds"].any():
            contents["food_kinds"] = contents["food_kinds"][:0]
        contents |= {"ranges": grid.ranges, "queen": tuple(queens[0].tolist())}
        contents |= {"other_queens": queens[1:]}
        contents["regions"] = validation.parse_regions(grid, {} if regions is None else regions)
        for name, value in contents.items():
            object.__setattr__(self, name, value)  # the dataclass is frozen

    @cached_property
    def grid(self) -> AxialGrid:
        """The layout of flat arrays; `grid.size` is the length of all arrays below."""
        return AxialGrid(self.ranges)

    @cached_property
    def queens(self) -> np.ndarray:
        """The cells of the queens, int32 (N, 3), by nest."""
        return np.concatenate([np.array([self.queen], np.int32), self.other_queens])

    @property
    def n_nests(self) -> int:
        """The number of nests, 1 to 7."""
        return 1 + len(self.other_queens)

    @property
    def n_food_kinds(self) -> int:
        """The number of kinds of food, at least 1."""
        return int(self.food_kinds.max(initial=0)) + 1

    def uses(self) -> dict[str, str]:
        """Return the features in use, each with the words of messages about it; see `Task.uses`."""
        counts = {"nests": self.n_nests, "kinds of food": self.n_food_kinds}
        return {name: f"the world has {n} {name}" for name, n in counts.items() if n > 1}

    def with_regions(self, regions: Mapping[str, Any]) -> World:
        """Return the world with more regions, which replace those of the same names.

        >>> near = {"near": {"centre": (0, 9, 9), "radius": 2}}
        >>> len(worlds.paper().with_regions(near).region("near"))
        9
        """
        by_name = validation.parse_regions(self.grid, regions)
        return replace(self, regions={**self.regions, **by_name}) if by_name else self

    def region(self, name: str) -> np.ndarray:
        """Return the flat indices of the cells of a region by name; AntsError if there is none."""
        if name not in self.regions:
            known = ", ".join(self.regions) or "none"
            raise AntsError(
                f"there is no region {shown(name)} in the world, whose regions are: {known}; "
                "choose one of them, or add it to the world."
            )
        return self.grid.index(self.regions[name])

    def ground(self) -> np.ndarray:
        """Return EMPTY, OBSTACLE (also outside), FOOD or QUEEN by cell, uint8 (grid.size,).

        They are constants in `taichi_ants.task.constants`.

        >>> from taichi_ants.task.constants import FOOD
        >>> (worlds.paper().ground() == FOOD).sum().item()
        1
        """
        return self._ground.copy()

    @cached_property
    def _ground(self) -> np.ndarray:
        ground = np.where(self.grid.exists, np.uint8(EMPTY), np.uint8(OBSTACLE))
        ground[self.grid.index(self.obstacles)] = OBSTACLE
        ground[self.grid.index(self.foods)] = FOOD
        ground[self.grid.index(self.queens)] = QUEEN
        return ground

    def kinds_by_cell(self) -> np.ndarray:
        """Return the kind of the food in each cell, uint8 (grid.size,); 0 without food.

        >>> worlds.paper().kinds_by_cell().max().item()
        0
        """
        kinds = np.zeros(self.grid.size, np.uint8)
        if len(self.food_kinds):
            kinds[self.grid.index(self.foods)] = self.food_kinds
        return kinds

    def trail_levels(self) -> np.ndarray:
        """Return the trail level of each cell, int32 (grid.size,).

        >>> worlds.paper().trail_levels().max().item()
        25
        """
        levels = np.zeros(self.grid.size, dtype=np.int32)
        levels[self.grid.index(self.trails[:, :3])] = self.trails[:, 3]
        return levels

    def distances(self, nest: int = 0) -> np.ndarray:
        """Return the steps to the queen of a nest without obstacles, int32 (grid.size,).

        Those outside the world are 0. Nests are numbered from 0.

        >>> world = worlds.paper()
        >>> world.distances()[world.grid.index((9, 0, 0))].item()
        18
        """
        return self._far(nest) * self.grid.exists

    def _far(self, nest: int) -> np.ndarray:
        return self.grid.distances(tuple(self.queens[nest].tolist()))

    def closer(self, nest: int = 0) -> np.ndarray:
        """Return bit h by cell, 1 if the neighbour at heading h is nearer to a queen (uint8)."""
        return self.grid.closer_to(tuple(self.queens[nest].tolist()))

    def walkable(self, starts: np.ndarray) -> np.ndarray:
        """Return the empty cells within reach of empty cells in `starts`, bool (grid.size,).

        `starts` are flat indices of cells.

        >>> world = worlds.paper()
        >>> world.walkable(world.start(seed=0)[0]).sum().item()
        269
        """
        free, reached = self.ground() == EMPTY, np.zeros(self.grid.size, bool)
        new = as_array("starts", starts, "iu", (None,), 0, self.grid.size - 1)
        while len(new := np.unique(new[free[new] & ~reached[new]])):
            reached[new] = True
            new = (new[:, None] + self.grid.offsets).ravel()
        return reached

    def reachable_foods(self) -> np.ndarray:
        """Return for each food item whether an ant can walk to it from a queen, bool (F,).

        >>> worlds.paper().reachable_foods().tolist()
        [True]
        """
        around = self.grid.index(self.queens)[:, None] + self.grid.offsets
        is_walkable = self.walkable(around.reshape(-1))
        return is_walkable[self.grid.index(self.foods)[:, None] + self.grid.offsets].any(axis=1)

    def start(self, seed: int, n: int = 1, where: str = "nest") -> tuple[np.ndarray, np.ndarray]:
        """Return flat indices and headings, int32 (n,), of n ants at the start, listed ants first.

        Args:
            seed: Any whole number; determines cells (ties of distance) and headings of placed ants.
            n: Number of ants, at least 1; the first n listed ants if there are more.
            where: "nest" for the free cells nearest to the ant's queen, "spread" for any free
                cells. With several nests, ants choose in the order of their numbers.

        >>> cells, headings = worlds.paper().start(seed=0, n=3)
        >>> worlds.paper().grid.cells(cells)[0].tolist()
        [0, 8, 8]
        """
        seed, n = whole("seed", seed), checked_whole("n", n)
        check_one_of("where", where, STARTS)
        cells, headings = self.grid.index(self.ants[:n, :3]), self.ants[:n, 3]
        if len(cells) < n:
            free = self.ground() == EMPTY
            free[cells] = False
            room = len(cells) + int(np.count_nonzero(free))
            if n > room:
                raise AntsError(
                    f"the number of ants is {n}; this world has room for {room}, so start fewer "
                    "ants or choose a larger world."
                )
            nests = self.nests_of(n)[len(cells) :]
            placed = free_cells(self.grid, free, self.queens, nests, seed, where)
            words = stream_state(seed, STREAM_START_HEADING, np.arange(len(cells), n))
            headings = np.concatenate([headings, choose(words >> np.uint64(32), N_HEADINGS)])
            cells = np.concatenate([cells, placed])
        return cells.astype(np.int32), headings.astype(np.int32)

    def nests_of(self, n: int) -> np.ndarray:
        """Return the nests of the ants that start, int32 (n,), by number.

        A listed ant belongs to the nearest queen, or to the first of several; ant number i to nest
        i % N otherwise.
        """
        cells = self.grid.index(self.ants[:n, :3])
        far = [self._far(nest)[cells] if len(cells) else cells for nest in range(self.n_nests)]
        listed = np.argmin(far, axis=0)
        others = np.arange(len(listed), n) % self.n_nests
        return np.concatenate([listed, others]).astype(np.int32)

    def first_starts(self, seeds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return `start` of one ant in the nest for each seed, uint64 (n,)."""
        if len(self.ants) or not len(seeds):
            listed = self.grid.index(self.ants[:1, :3]), self.ants[:1, 3]
            cells, headings = (np.broadcast_to(numbers, len(seeds)) for numbers in listed)
            return cells.astype(np.int32), headings.astype(np.int32)
        free = np.flatnonzero(self.ground() == EMPTY)
        if not len(free):
            self.start(0)  # raises AntsError because there is no room
        distance = self.distances()[free]
        nearest = free[distance == distance.min()]
        numbers = self.grid.number(nearest)
        words = stream_state(seeds[:, None], STREAM_START_CELL, numbers[None, :])
        headings = choose(stream_state(seeds, STREAM_START_HEADING, 0) >> np.uint64(32), N_HEADINGS)
        return nearest[words.argmin(axis=1)].astype(np.int32), headings.astype(np.int32)

    def as_dict(self) -> dict[str, Any]:
        """Return the world as names and lists of numbers; `from_dict` reads it."""
        parts = {name: getattr(self, name).tolist() for name in _PARTS}
        parts |= {name: getattr(self, name).tolist() for name in _MORE if len(getattr(self, name))}
        if self.regions:
            parts["regions"] = {name: cells.tolist() for name, cells in self.regions.items()}
        return {"ranges": [*self.ranges], "queen": [*self.queen], **parts}

    @classmethod
    def from_dict(cls, facts: Mapping[str, Any]) -> World:
        """Return the world of `as_dict`; raises ValueError, KeyError or TypeError.

        >>> World.from_dict(worlds.paper().as_dict()) == worlds.paper()
        True
        """
        names = (*_PARTS, *(name for name in _MORE if name in facts))
        parts = {name: np.array(facts[name]) for name in names}
        return cls(facts["ranges"], facts["queen"], **parts, regions=facts.get("regions", {}))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, World):
            return NotImplemented
        return self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)

    @cached_property
    def _key(self) -> tuple:
        regions = ((name, cells.tobytes()) for name, cells in self.regions.items())
        arrays = (getattr(self, name).tobytes() for name in (*_PARTS, *_MORE))
        return self.ranges, self.queen, *arrays, *regions

    def __reduce__(self) -> tuple:
        # Copies and unpickled worlds are built from their contents, so that arrays are read-only.
        arrays = (getattr(self, name) for name in (*_PARTS, *_MORE))
        return World, (self.ranges, self.queen, *arrays, dict(self.regions))

    def __repr__(self) -> str:
        queens = f"queen={self.queen}" if self.n_nests == 1 else f"queens: {self.n_nests}"
        counts = ", ".join(f"{name}: {len(getattr(self, name))}" for name in _PARTS)
        return f"World(ranges={self.ranges}, {queens}, {counts})"


def free_cells(
    grid: AxialGrid, free: np.ndarray, queens: np.ndarray, nests: np.ndarray, seed: int, where: str
) -> np.ndarray:
    """Return a free cell for each of n ants, of which each takes its first that is not taken.

    Cells are in the order of a hash with the seed or, if `where` is "nest", by distance to the
    queen of the ant's nest, then by hash. `free` is bool (grid.size,) with at least n free cells,
    `queens` are the cells of queens, (nests, 3), `nests` are the nests of the ants, (n,).
    """
    index, n = np.flatnonzero(free), len(nests)

    def words(cells: np.ndarray) -> np.ndarray:
        return stream_state(seed, STREAM_START_CELL, grid.number(cells))

    if where == "spread":
        order = words(index)
        if n < len(order):  # sort only the smallest of perhaps millions; no two are equal
            first = order < np.partition(order, n)[n]
            index, order = index[first], order[first]
        return index[np.argsort(order)]
    queues = []
    for queen in queens.tolist():
        distance = grid.distances(tuple(queen))[index]
        # Ants take at most the n nearest cells, so only these need a hash and an order.
        near = distance <= np.searchsorted(np.cumsum(np.bincount(distance)), n)
        cells = index[near]
        queues.append(iter(cells[np.lexsort((words(cells), distance[near]))].tolist()))
    taken: dict[int, None] = {}
    for nest in nests.tolist():
        taken[next(cell for cell in queues[nest] if cell not in taken)] = None
    return np.fromiter(taken, np.int64, n)
