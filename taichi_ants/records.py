"""Records: named arrays that the engines return, with short output and comparison by content."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.errors import shown
from taichi_ants.features import arrays
from taichi_ants.features.feature import ANT
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.task.constants import QUEEN

if TYPE_CHECKING:
    from taichi_ants.worlds.world import World

_VIEWS = {f"ant_{array.view}": array.view for _, array in arrays(ANT)}


class Record:
    """Base of dataclasses of arrays, which use `eq=False, repr=False`.

    Two records are equal if all fields without `compare=False` are equal: arrays by type, shape and
    content, where NaN equals NaN. Records have no hash, because their arrays are writable.
    """

    __hash__ = None  # type: ignore[assignment]

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        names = [field.name for field in fields(self) if field.compare]  # type: ignore[arg-type]
        return all(same(getattr(self, name), getattr(other, name)) for name in names)

    def __repr__(self) -> str:
        names = [field.name for field in fields(self) if field.repr]  # type: ignore[arg-type]
        lines = [f"    {name}: {_described(getattr(self, name))}" for name in names]
        return "\n".join([f"{type(self).__name__}(", *lines, ")"])


def _none() -> np.ndarray:
    return np.zeros(0, np.int32)


@dataclass(frozen=True, eq=False, repr=False)
class Snapshot(Record):
    """The state of one world at one time, which `rendering` draws and `measures` read.

    Only a `Colony` sets the attributes after `ant_carries`.

    Attributes:
        ground: uint8 (grid.size,), EMPTY, OBSTACLE, FOOD or QUEEN; EMPTY under ants.
        trail: int32 or float32 (grid.size,), trail levels.
        ant_cells: int32 (n,), flat cell indices of the living ants.
        ant_headings: int32 (n,), their headings, 0 to 5.
        ant_carries: bool (n,), whether each ant carries food.
        ant_carried: int32 (n,), ticks since each ant picked up its food; 0 without food.
        ant_numbers: int32 (n,), the numbers of the ants.
        ant_actions: int32 (n,), the last action of each ant; -1 before its first one.
        ant_events: int32 (n,), the result of the last action, an `Event`.
        ant_nests: int32 (n,), the nest of each ant.
        ant_foods: int32 (n,), the kind of the food that each ant carries; -1 without food.
        food_kinds: uint8 (grid.size,), the kind of the food in each cell; 0 without food.
        queens: int32 (nests,), the flat cell index of the queen of each nest.
        of_ants: The arrays (n,) of the features of the model by their views, which are attributes,
            too, after `ant_`.
        fields: The levels of each pheromone by name, (grid.size,); "trail" is `trail`.
        counts: Counts of the episode so far: the fields of `ColonyEpisodes`, as integers. Also
            `nest_deliveries`, `food_deliveries` and `caste_deliveries`, int32 (nests or kinds of
            food or castes,).
        names: The names of the fields, kinds of food and castes, at "fields", "foods", "castes".
        world: The world at the start of the episode; None if unknown.
    """

    grid: AxialGrid
    ground: np.ndarray
    trail: np.ndarray
    ant_cells: np.ndarray
    ant_headings: np.ndarray
    ant_carries: np.ndarray
    ant_carried: np.ndarray = field(default_factory=_none)
    ant_numbers: np.ndarray = field(default_factory=_none)
    ant_actions: np.ndarray = field(default_factory=_none)
    ant_events: np.ndarray = field(default_factory=_none)
    ant_nests: np.ndarray = field(default_factory=_none)
    ant_foods: np.ndarray = field(default_factory=_none)
    food_kinds: np.ndarray = field(default_factory=lambda: np.zeros(0, np.uint8))
    queens: np.ndarray = field(default_factory=_none)
    of_ants: Mapping[str, np.ndarray] = field(default_factory=dict)
    fields: Mapping[str, np.ndarray] = field(default_factory=dict)
    counts: Mapping[str, Any] = field(default_factory=dict)
    names: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    world: World | None = None

    def __getattr__(self, name: str) -> np.ndarray:
        if name not in _VIEWS:
            raise AttributeError(name)
        return self.of_ants.get(_VIEWS[name], _none())

    def ordered(self, order: np.ndarray) -> Snapshot:
        """Return the snapshot with its ants in the order of some of their indices, int (n,)."""
        names = [field.name for field in fields(self) if field.name.startswith("ant_")]
        columns = {name: getattr(self, name)[order] for name in names}
        of_ants = {view: column[order] for view, column in self.of_ants.items()}
        return replace(self, **columns, of_ants=of_ants)

    @property
    def further_fields(self) -> dict[str, np.ndarray]:
        """The levels of all pheromones except the trail, by name."""
        return {name: levels for name, levels in self.fields.items() if name != "trail"}

    @property
    def distances(self) -> np.ndarray:
        """Steps from each cell to the nearest queen, without obstacles, int32 (grid.size,)."""
        queens = self.grid.cells(np.flatnonzero(self.ground == QUEEN))
        return np.min([self.grid.distances(tuple(queen)) for queen in queens.tolist()], axis=0)


def same(value: object, other: object) -> bool:
    """Return whether two values, arrays or not, are equal; NaN equals NaN in arrays."""
    if isinstance(value, dict) and isinstance(other, dict):
        return value.keys() == other.keys() and all(same(value[key], other[key]) for key in value)
    if not isinstance(value, np.ndarray) or not isinstance(other, np.ndarray):
        return not isinstance(value, np.ndarray) and type(value) is type(other) and value == other
    floats = value.dtype.kind == "f"
    return value.dtype == other.dtype and np.array_equal(value, other, equal_nan=floats)


def _described(value: object) -> str:
    """Return a summary of an array, an indented record, or another value as messages show it."""
    if isinstance(value, Record):
        return repr(value).replace("\n", "\n    ")
    if not isinstance(value, np.ndarray):
        return shown(value)
    form = f"{value.dtype} {value.shape}"
    if not value.size:
        return form
    numbers = value.astype(np.int8) if value.dtype == bool else value
    low, high, mean = numbers.min(), numbers.max(), numbers.mean(dtype=np.float64)
    return f"{form}, mean {mean:.4g}, from {low:.6g} to {high:.6g}"
