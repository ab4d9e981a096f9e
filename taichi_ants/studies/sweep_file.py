"""Sweeps as TOML files: fixed settings, those that vary, seeds and measures."""

from __future__ import annotations

import difflib
import itertools
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from taichi_ants import checks, learners, worlds
from taichi_ants.errors import AntsError, shown, whole
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.studies.runner import ColonyPoint, Point, RunPoint, Study, flat
from taichi_ants.task import Task

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

KINDS: dict[str, type] = {"runs": RunPoint, "colony": ColonyPoint}
MOST_POINTS = 10_000
_OF_FILE = ("kind", "seeds", "measures", "vary")
_OF_WORLD = ("world.preset", "world.seed", "world.per_seed")
_PARTS = ("world", "task", "training", "after")  # of a point; they have settings of their own

Settings = dict[str, Any]  # by their full names, as "task.pheromone.half_life"


@dataclass(frozen=True)
class Sweep:
    """What a file asks for.

    Attributes:
        kind: "runs" or "colony".
        study: The points over the seeds, in the order of `settings`.
        settings: What varies, for each point of the study.
        measures: Names of measures, the first of which is drawn.
    """

    kind: str
    study: Study[Any]
    settings: tuple[Settings, ...]
    measures: tuple[str, ...]


def read_sweep(path: Path, measures: Mapping[str, Iterable[str]]) -> Sweep:
    """The sweep of a file.

    Args:
        path: The file.
        measures: The names of all measures, by kind.

    Raises:
        AntsError: The file cannot be read, or asks for something that cannot be.
    """
    try:
        file = tomllib.loads(path.read_text("utf-8"))
    except OSError as error:
        raise AntsError(
            f"cannot read {str(path)!r}: {error.strerror}; name a .toml file."
        ) from error
    except (ValueError, RecursionError) as error:  # what is no TOML, or no UTF-8
        raise AntsError(f"{str(path)!r} is no TOML: {error}; mend the file.") from error
    try:
        return _sweep(file, measures)
    except AntsError as error:
        raise AntsError(f"in {str(path)!r}, {error}") from error


def _sweep(file: Settings, measures: Mapping[str, Iterable[str]]) -> Sweep:
    kind = _one_of("kind", file.get("kind"), KINDS)
    wanted = file.get("measures", [])
    wanted = wanted if isinstance(wanted, list) else [wanted]
    if not wanted:
        raise AntsError(f"measures is missing; name one or more of {', '.join(measures[kind])}.")
    for name in wanted:
        _one_of("measures", name, measures[kind])
    fixed = flat({name: value for name, value in file.items() if name not in _OF_FILE})
    grids = file.get("vary", [])
    grids = grids if isinstance(grids, list) else [grids]
    if not grids or not all(isinstance(grid, dict) and grid for grid in grids):
        raise AntsError("[vary] is missing or empty; name in it what varies, with lists of values.")
    varied = [_values(grid) for grid in grids]
    known = _known(kind, fixed, varied)
    fixed = {_full_name(name, known): value for name, value in fixed.items()}
    for name, value in fixed.items():
        if isinstance(value, list) and not name.startswith("world."):
            raise AntsError(f"{name} is a list; put it under [vary].")
    rows = [
        dict(zip((_full_name(name, known) for name in grid), values, strict=True))
        for grid in varied
        for values in _product(grid)
    ]
    for name in fixed:
        if any(name in row for row in rows):
            raise AntsError(f"{name} stands among the fixed settings and in [vary]; leave out one.")
    seeds = file.get("seeds", 10)
    if isinstance(seeds, int) and not isinstance(seeds, bool) and 0 < seeds <= 100_000:
        seeds = range(seeds)
    if not isinstance(seeds, (list, range)):
        raise AntsError(f"seeds is {shown(seeds)}; give their number, or a list of seeds.")
    checked = checks.checked_seeds(seeds)
    built: dict[str, Any] = {}
    points = tuple(_point(kind, {**fixed, **row}, checked, built) for row in rows)
    return Sweep(kind, Study(points, checked), tuple(rows), tuple(wanted))


def _one_of(name: str, value: object, allowed: Iterable[str]) -> str:
    if not isinstance(value, str) or value not in allowed:
        nearest = difflib.get_close_matches(str(value), list(allowed), 1)
        hint = f", for example {nearest[0]!r}" if nearest else ""
        raise AntsError(f"{name} is {shown(value)}; choose of {', '.join(allowed)}{hint}.")
    return value


def _values(grid: Settings, before: str = "") -> dict[str, list]:
    """What varies, as lists: a single value is one of one, a range is drawn out."""
    found: dict[str, list] = {}
    for last, value in grid.items():
        name = before + last
        if isinstance(value, dict) and not {"from", "to"} & set(value):
            found |= _values(value, f"{name}.")
        elif isinstance(value, dict):
            found[name] = _range(name, value)
        elif value == []:
            raise AntsError(f"{name} is an empty list; give at least one value.")
        else:
            found[name] = value if isinstance(value, list) else [value]
    return found


def _range(name: str, given: Settings) -> list:
    """The numbers of { from = 10, to = 50, by = 10 } or { from = 1, to = 64, times = 2 }."""
    step = next((key for key in ("by", "times") if key in given), "")
    numbers = all(isinstance(one, (int, float)) for one in given.values())
    if set(given) != {"from", "to", step} or not numbers:
        raise AntsError(
            f"the range of {name} is {shown(given)}; write {{ from = 10, to = 50, by = 10 }}, or "
            "{ from = 1, to = 64, times = 2 }."
        )
    low, high, size = given["from"], given["to"], given[step]
    if size <= (step == "times") or (step == "times" and low <= 0) or high < low:
        raise AntsError(f"the range of {name} is {shown(given)}, which does not come to an end.")
    values: list = []
    while len(values) <= MOST_POINTS:
        k = len(values)
        value = low + k * size if step == "by" else low * size**k
        if value > high * (1 + 1e-9):
            break
        values.append(value if isinstance(value, int) else float(f"{value:.12g}"))
    return values


def _product(grid: dict[str, list]) -> Iterable[tuple]:
    points = 1
    for values in grid.values():
        points *= len(values)
    if points > MOST_POINTS:
        raise AntsError(f"[vary] makes {points} points; make it {MOST_POINTS} or fewer.")
    return itertools.product(*grid.values())


def _known(kind: str, fixed: Settings, varied: list[dict[str, list]]) -> tuple[str, ...]:
    """The full names of all settings that there are, with those of the worlds and learners used."""

    def used(name: str, usual: str) -> list[str]:
        ends = (name, name.rpartition(".")[2])
        values = [one for grid in varied for key in ends for one in grid.get(key, [])]
        values += [fixed[key] for key in ends if key in fixed]
        return [str(value) for value in values] or [usual]

    own = [field.name for field in fields(KINDS[kind]) if field.name not in _PARTS]
    world = [
        f"world.{one}" for name in used("world.preset", "paper") for one in worlds.settings(name)
    ]
    task = [f"task.{name}" for name in flat(Task().as_dict())]
    training = [f"training.{one.name}" for one in fields(TrainingConfig)][:-1]
    for name in used("training.learner", "sarsa"):
        training += [f"training.{one.name}" for one in fields(learners.get(name).hyperparameters)]
    return tuple(dict.fromkeys([*own, *_OF_WORLD, *world, *task, *training]))


def _full_name(name: str, known: tuple[str, ...]) -> str:
    """A setting's full name, from that or from an end of it that only one setting has."""
    found = [one for one in known if one == name or one.endswith(f".{name}")]
    if name in found:
        return name
    if len(found) > 1:
        raise AntsError(f"{name} can be {' or '.join(found)}; write which.")
    if not found:
        ends = {one.rpartition(".")[2]: one for one in known}
        close = difflib.get_close_matches(name.rpartition(".")[2], ends, 3, 0.5)
        nearest = [ends[one] for one in close] or list(known)
        raise AntsError(f"{shown(name)} is no setting; known are {', '.join(nearest)}.")
    return found[0]


def _point(kind: str, settings: Settings, seeds: tuple[int, ...], built: dict[str, Any]) -> Point:
    parts: dict[str, Settings] = {"": {}, "world": {}, "task": {}, "training": {}}
    for name, value in settings.items():
        part, dot, rest = name.partition(".")
        parts[part if dot else ""][rest or part] = value
    task: Settings = {}
    for name, value in parts["task"].items():
        inner, _, last = name.rpartition(".")
        (task.setdefault(inner, {}) if inner else task)[last] = value
    training = parts["training"]
    for name in ("learner", "learning_rate", "discount", "epsilon", "epsilon_decay"):
        if name not in training:
            raise AntsError(f"training.{name} is missing; write it, fixed or in [vary].")
    world = _world(kind, parts["world"], seeds, built)
    return KINDS[kind](world, Task.from_dict(task), TrainingConfig(**training), **parts[""])


def _world(kind: str, given: Settings, seeds: tuple[int, ...], built: dict[str, Any]) -> Any:
    """The world of some settings, or one for each seed; built once."""
    key = repr(sorted(given.items()))
    if key not in built:
        given = dict(given)
        preset, first = given.pop("preset", "paper"), whole("world.seed", given.pop("seed", 0))
        per_seed = given.pop("per_seed", False)
        if per_seed not in (True, False) or (per_seed and kind == "runs"):
            raise AntsError(
                f"world.per_seed is {shown(per_seed)}; it is true or false, and for colonies only."
            )
        if per_seed:
            built[key] = tuple(worlds.build(preset, first + seed, **given) for seed in seeds)
        else:
            built[key] = worlds.build(preset, first, **given)
    return built[key]
