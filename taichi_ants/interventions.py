"""Interventions: all that can be changed in a colony between two ticks.

Each intervention is a record of settings; `Interventions.apply` makes it. Sweep files, protocols,
the live page and its session files use the same names and settings:

    interventions.from_dict({"remove_ants": {"share": 0.5}}) == RemoveAnts(share=0.5)

A cell is a triple (x, y, z) in any form of cube coordinates, or the flat index of a cell in the
grid of the world, see `taichi_ants.grid.hexgrid`. The name of a region of the world stands for its
cells, which can differ between the worlds of a colony.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, TypeVar

import numpy as np

from taichi_ants import settings
from taichi_ants.errors import AntsError, as_array, check_one_of, count, entries_of, is_flag, refuse
from taichi_ants.features import FEATURES
from taichi_ants.features.fields import TRAIL
from taichi_ants.features.pheromone import MAX_DEPOSIT
from taichi_ants.settings import Setting, Settings, Share, declared
from taichi_ants.task import Task
from taichi_ants.task.model import Model

if TYPE_CHECKING:
    from taichi_ants.grid.hexgrid import AxialGrid
    from taichi_ants.worlds.world import World

__all__ = [
    "AddAnts", "Clear", "Episode", "Intervention", "Move", "Place", "RemoveAnts", "SetAnts",
    "SetEpsilon", "SetLearningRate", "SetTask", "SetTrail", "from_dict",
]  # fmt: skip
One = TypeVar("One", bound="ShorthandSettings")
_MOST = 2**24  # ants, see `arguments.MAX_ANTS`
_CELLS = Setting("cells, each [x, y, z], or the name of a region", or_region=True)
_NAMED = {group.name: group for group in settings.named_groups(Task)}
_SHORT = {  # the short forms of interventions, by the setting that such a value is
    "number": "a whole number of ants",
    "share": "a share such as 0.5",
    "cells": "a list of cells, the name of a region",
    "level": "a level, which is a whole number",
    "value": "a number",
}
INTERVENTIONS: dict[str, type[Intervention]] = {}


class ShorthandSettings(Settings):
    """Settings that a mapping or, for some classes, a single value can stand for.

    `short_for` are the names of the settings that such a value can be, tried in this order.
    """

    short_for: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def from_dict(cls: type[One], facts: Any) -> One:
        """Return the record of a mapping of settings, or of a short form."""
        record = cls.converted(facts)
        return record if isinstance(record, cls) else super().from_dict(facts)

    @classmethod
    def converted(cls: type[One], value: Any) -> Any:
        """Return the record that a mapping or a short form stands for; else the value itself."""
        if isinstance(value, cls):
            return value
        values = value if settings.is_table(value) else cls._short(value)
        if values is None:
            return value
        return cls(**{**cls._required(values), **values})

    @classmethod
    def _short(cls, value: Any) -> dict[str, Any] | None:
        """Return the settings that a single value stands for; None if it is not allowed."""
        is_whole = isinstance(value, (int, np.integer)) and not is_flag(value)
        fits = {"number": is_whole, "level": is_whole, "share": isinstance(value, float)}
        fits |= {"cells": isinstance(value, str) or entries_of(value) is not None, "value": True}
        return next(({name: value} for name in cls.short_for if fits[name]), None)

    def as_dict(self) -> dict[str, Any]:
        """Return the settings that differ from their defaults, JSON-compatible."""
        values = ((setting, getattr(self, setting.name)) for setting in declared(type(self)))
        return {one.name: _plain(value) for one, value in values if value != one.default}

    def facts(self) -> dict[str, Any]:
        """Return the name and the settings, JSON-compatible."""
        return {self.path: self.as_dict()}


def _plain(value: Any) -> Any:
    """Return a value of a setting in the form that JSON has for it."""
    if isinstance(value, ShorthandSettings):
        return value.as_dict()
    return [_plain(entry) for entry in value] if isinstance(value, tuple) else value


class Intervention(ShorthandSettings):
    """A change of a colony between two ticks; the path of the class is its name.

    `Interventions.apply` makes it. `in_all_worlds` says whether worlds of a colony share what it
    changes. A class with a path is added to `INTERVENTIONS`.

    >>> Interventions(colony).apply(SetTrail(level=0))  # clears the trail
    >>> colony.snapshot().trail.max().item()
    0
    """

    in_all_worlds: ClassVar[bool] = False

    def __init_subclass__(cls, path: str = "", short_for: tuple[str, ...] = (), **_: Any) -> None:
        super().__init_subclass__(path)
        cls.short_for = short_for or cls.short_for
        *forms, last = *(_SHORT[name] for name in cls.short_for), "a table of settings"
        cls.form = f"{', '.join(forms)}, or {last}" if forms else last
        if path:
            INTERVENTIONS[path] = cls

    def check(self) -> None:
        super().check()
        cells, path = getattr(self, "cells", None), f"`{self.path}.cells`"
        if not isinstance(cells, str | None):
            rows = as_array(path, cells, "iu")
            if not len(rows) or rows.shape[1:] not in ((), (3,)):
                refuse(path, cells, "a list of cells, each three whole numbers [x, y, z]")
            cells = tuple(rows.tolist() if rows.ndim == 1 else map(tuple, rows.tolist()))
            object.__setattr__(self, "cells", cells)

    def check_in(self, world: World, task: Task, learns: bool) -> None:
        """Raise an AntsError if the change is impossible in worlds like this one, with this task.

        `learns` says whether ants learn, instead of following a policy.
        """
        cells = getattr(self, "cells", None) or ()
        if isinstance(cells, str):
            world.region(cells)
        else:
            flat_indices(world.grid, cells)
        if (nest := getattr(self, "nest", None)) is not None and nest >= world.n_nests:
            raise AntsError(
                f"`{self.path}.nest` is {nest}, but the world has {count(world.n_nests, 'nest')}, "
                "numbered from 0; choose one of them."
            )

    def _check_count(self, n: int, form: str) -> None:
        """Raise AntsError unless there are n cells; `form` says which."""
        cells: Any = self.cells  # type: ignore[attr-defined]
        if isinstance(cells, str) or len(cells) != n:
            refuse(f"`{self.path}.cells`", cells, form)


@dataclass(frozen=True)
class _OfAnts(Intervention, short_for=("number", "share", "cells")):
    """An intervention on a number of ants, a share of the living ants, or the ants on cells."""

    number: Annotated[int | None, Setting("number of ants", least=0, most=_MOST)] = None
    share: Annotated[float | None, Setting("share of the living ants", least=0)] = None
    cells: Annotated[Sequence | None, _CELLS] = None
    nest: Annotated[int | None, Setting("nest of the ants; any if left out", least=0)] = None

    def check(self) -> None:
        super().check()
        ways = [name for name in self.short_for if getattr(self, name) is not None]
        if len(ways) != 1:
            raise AntsError(
                f"`{self.path}` has {' and '.join(ways) or 'neither number, share nor cells'}; "
                "give one of number, share and cells."
            )


@dataclass(frozen=True)
class RemoveAnts(_OfAnts, path="remove_ants"):
    """Remove ants with the food that they carry: random ants, or those on cells; or of one nest.

    A share is rounded to a number of ants, halves up.

    >>> Interventions(colony).apply(RemoveAnts(share=0.5))
    >>> colony.living.sum().item()
    8
    """

    share: Annotated[float | None, Setting("share of the living ants", least=0, most=1)] = None


@dataclass(frozen=True)
class AddAnts(_OfAnts, path="add_ants"):
    """Add ants on the cells on which further ants would start, or on those of the cells given
    that are empty.

    A share of the living ants, or of those of the nest, is rounded to a number, halves up. Without
    `nest`, nests take turns, and ants on given cells belong to the nearest queen.

    >>> change = Interventions(colony)
    >>> change.apply(RemoveAnts(number=4))
    >>> change.apply(AddAnts(number=2))
    >>> colony.living.sum().item()
    14
    """


@dataclass(frozen=True)
class SetAnts(Intervention, path="ants", short_for=("number",)):
    """Set the number of living ants; ants with the highest numbers are removed first.

    >>> Interventions(colony).apply(SetAnts(10))
    >>> colony.living.sum().item()
    10
    """

    number: Annotated[int, Setting("number of ants", least=1, most=_MOST)]


@dataclass(frozen=True)
class Place(Intervention, path="place", short_for=("cells",)):
    """Place rock or food on cells, or the queen on one cell; ants there move aside.

    Rock and food leave out the cells of queens, and cells whose ant has no room nearby. Without
    `nest` or `kind`, the queen is that of nest 0, and the food is of the first kind.

    >>> At(100, place=Place("rock", [(4, 0, 0)])).place.what
    'rock'
    """

    what: Annotated[Literal["rock", "food", "queen"], Setting("thing to place")]
    cells: Annotated[Sequence, _CELLS]
    nest: Annotated[int | None, Setting("nest of a queen", least=0, only=("what", "queen"))] = None
    kind: Annotated[str | None, Setting("kind of food", only=("what", "food"))] = None

    def check(self) -> None:
        super().check()
        if self.what == "queen":
            self._check_count(1, "a list of a single cell for the queen")

    def check_in(self, world: World, task: Task, learns: bool) -> None:
        super().check_in(world, task, learns)
        if self.kind is not None and self.kind not in task.foods:
            none = "left out, because the task has no kinds of food in `task.foods`"
            allowed = f"one of {', '.join(task.foods)}" if task.foods else none
            refuse("`place.kind`", self.kind, allowed)


@dataclass(frozen=True)
class Move(Intervention, path="move", short_for=("cells",)):
    """Move rock, food or the queen to an empty cell; an ant there moves aside.

    Has no effect if there is nothing to move, or the new cell is not free.

    >>> At(100, move=[(4, 0, 0), (5, 0, 0)]).move
    Move(cells=((4, 0, 0), (5, 0, 0)))
    """

    cells: Annotated[Sequence, Setting("cell to move from and cell to move to, each [x, y, z]")]

    def check(self) -> None:
        super().check()
        self._check_count(2, "the cell to move from, then the cell to move to")


@dataclass(frozen=True)
class Clear(Intervention, path="clear", short_for=("cells",)):
    """Remove rock and food from cells.

    >>> At(100, clear=[(4, 0, 0)]).clear
    Clear(cells=((4, 0, 0),))
    """

    cells: Annotated[Sequence, _CELLS]


@dataclass(frozen=True)
class SetTrail(Intervention, path="trail", short_for=("level",)):
    """Set the level of the trail, or of another field, on cells without rock, by default on all.

    >>> At(100, trail=SetTrail(25, cells=[(4, 0, 0)])).trail.level
    25
    """

    level: Annotated[int, Setting("trail level", least=0, most=MAX_DEPOSIT)]
    cells: Annotated[Sequence | None, _CELLS] = None
    field: Annotated[str, Setting("name of the field")] = TRAIL

    def check_in(self, world: World, task: Task, learns: bool) -> None:
        super().check_in(world, task, learns)
        check_one_of("`trail.field`", self.field, (*task.pheromones,))


@dataclass(frozen=True)
class SetTask(Intervention, path="task"):
    """Change settings of the task that kernels read as numbers, for example "pheromone.half_life".

    A setting by which kernels are compiled, such as the observation, cannot change in an episode.

    >>> At(100, task={"pheromone.level": 300}).task
    SetTask(values=(('pheromone.level', 300),))
    """

    values: tuple[tuple[str, Any], ...]  # the names of settings without "task.", and their values
    in_all_worlds = True

    def check(self) -> None:
        if not (changes := settings.table_of("task", self.values)):
            raise AntsError("`task` has no settings; name at least one, with its new value.")
        values = []
        for name, value in changes.items():
            group, entry, *_ = [*name.split("."), "", ""]
            known = {setting.path: setting for setting in settings.all_of(Task)}
            if entry and group in _NAMED:
                known = settings.settings_of_entry(_NAMED[group], entry)
            if (setting := known.get(f"task.{name}")) is None:
                names = [path.removeprefix("task.") for path in known]
                raise AntsError(f"`task.{name}` {settings.not_a_setting(name, names)}")
            values.append((name, setting.checked(value)))
        object.__setattr__(self, "values", tuple(sorted(values)))

    @classmethod
    def converted(cls, value: Any) -> Any:
        return cls(tuple(settings.flat(value).items())) if settings.is_table(value) else value

    def as_dict(self) -> dict[str, Any]:
        return dict(self.values)

    def changed(self, task: Task) -> Task:
        """Return the task with the new values."""
        return task.replace(**settings.nested(dict(self.values)))

    def check_in(self, world: World, task: Task, learns: bool) -> None:
        changed = self.changed(task)
        castes, new_castes = (
            {n: [one.fixed(caste) for one in FEATURES] for n, caste in rules.castes.items()}
            for rules in (task, changed)
        )
        if castes != new_castes or Model(task, learns) != Model(changed, learns):
            old, new = settings.flat(task.as_dict()), settings.flat(changed.as_dict())
            names = [name for name in {**old, **new} if old.get(name) != new.get(name)]
            changes = (f"{name} from {old.get(name)!r} to {new.get(name)!r}" for name in names)
            raise AntsError(
                f"the task cannot change {' and '.join(changes)} in an episode, because that "
                "requires other kernels or castes; change settings that kernels read as numbers, "
                "for example pheromone.level."
            )


@dataclass(frozen=True)
class SetEpsilon(Intervention, path="epsilon", short_for=("value",)):
    """Set the exploration rate, which then does not decay.

    >>> At(100, epsilon=0.2).epsilon
    SetEpsilon(value=0.2)
    """

    value: Annotated[Share, Setting("exploration rate")]
    in_all_worlds = True


@dataclass(frozen=True)
class SetLearningRate(Intervention, path="learning_rate", short_for=("value",)):
    """Set the learning rate, which then does not decay.

    >>> At(100, learning_rate=0.02).learning_rate
    SetLearningRate(value=0.02)
    """

    value: Annotated[Share, Setting("learning rate")]
    in_all_worlds = True

    def check_in(self, world: World, task: Task, learns: bool) -> None:
        if not learns:
            raise AntsError("the ants do not learn, so they have no learning rate; leave it out.")


@dataclass(frozen=True)
class Episode(Intervention, path="episode"):
    """End the episode and begin the next one.

    >>> Interventions(colony).apply(Episode())
    >>> colony.episode, colony.ticks
    (1, 0)
    """

    in_all_worlds = True


def from_dict(facts: Any) -> Intervention:
    """Return the intervention of a mapping from its name to its settings or its short form.

    The names are the keys of `At`, such as "remove_ants".

    >>> from_dict({"remove_ants": {"share": 0.5}}) == from_dict({"remove_ants": 0.5})
    True
    """
    if not isinstance(facts, Mapping) or len(facts) != 1:
        names = ", ".join(INTERVENTIONS)
        refuse("an intervention", facts, f"a table with the name of one intervention: {names}")
    ((name, values),) = facts.items()
    check_one_of("the name of an intervention", name, tuple(INTERVENTIONS))
    return INTERVENTIONS[name].from_dict(values)


def flat_indices(grid: AxialGrid, cells: Sequence[Any]) -> list[int]:
    """Return the flat indices of cells or of flat indices; AntsError if one does not exist."""
    flat = [int(cell if np.ndim(cell) == 0 else grid.index(cell)) for cell in cells]
    for cell, index in zip(cells, flat, strict=True):
        if not 0 <= index < grid.size or not grid.exists[index]:
            raise AntsError(
                f"the cell {cell} is outside the world; choose a cell within the ranges "
                f"{grid.ranges}."
            )
    return flat
