"""Sweep files: their settings, seeds and measures, checked, and the points that they describe."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from taichi_ants import (
    arguments,
    files,
    interventions,
    learners,
    measures,
    protocol,
    rules,
    worlds,
)
from taichi_ants.errors import AntsError, check_one_of, checked_flag, checked_whole, shown
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.measures import finished
from taichi_ants.measures.measure import RUN
from taichi_ants.settings import (
    DeclaredSetting,
    all_of,
    declared,
    flat,
    named_groups,
    nested,
    settings_of_entry,
)
from taichi_ants.studies import design
from taichi_ants.studies.design import Axis, Choices, Range
from taichi_ants.studies.points import ColonyPoint, Drawn, FixedPolicy, Point, RunPoint
from taichi_ants.task import Task

KINDS: dict[str, type] = {"runs": RunPoint, "colony": ColonyPoint}
_OF_FILE = (  # keys that are not settings of points
    *("kind", "seeds", "measures", "measure_every"),
    *("margin", "against", "vary", *design.KEYS),
)
# Attributes of points that are not settings.
_PARTS = ("world", "task", "training", "after", "pool", "measures", "measure_every", "protocol")
# Measures of reward, and the deliveries that sweeps report beside them: ants can collect rewards
# without delivering.
_BESIDE = {"reward": "deliveries", "greedy_return": "greedy_deliveries"}
_BESIDE |= {f"return_{of}": f"deliveries_{of}" for of in ("first50", "second50", "last50", "all")}
_OF_LEARNERS = [one.name for one in declared(TrainingConfig)]

Settings = dict[str, Any]  # by their full names, as "task.pheromone.half_life"


@contextmanager
def contents(path: Path) -> Iterator[Settings]:
    """Yield the contents of a file (.toml); errors in the context name the file.

    Raises:
        AntsError: The file cannot be read.
    """
    text = files.read_text(path)
    try:
        file = files.tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise AntsError(f"{str(path)!r} is not valid TOML: {error}; correct it.") from error
    try:
        yield file
    except AntsError as error:
        raise AntsError(f"in {str(path)!r}, {error}") from error


class Base(NamedTuple):
    """The part of a file that does not depend on how its points are chosen.

    Attributes:
        fixed: The fixed settings by their full names.
        reading: The arguments of points that are not settings.
    """

    kind: str
    measures: tuple[str, ...]
    seeds: tuple[int, ...]
    fixed: Settings
    reading: dict[str, Any]

    @classmethod
    def of(cls, file: Settings) -> Base:
        """Return the part of a file; AntsError if a key or value is not allowed."""
        kind: Any = file.get("kind")
        if kind is None:
            raise AntsError(f"kind is missing; write one of {', '.join(KINDS)}.")
        check_one_of("kind", kind, tuple(KINDS))
        wanted = as_list(file.get("measures", []))
        if not wanted:
            what = "empty" if "measures" in file else "missing"
            raise AntsError(f"measures is {what}; name one or more of {finished.names_of(kind)}.")
        for name in wanted:
            finished.of_runs(kind, name)
        _check_once("measures", wanted)
        beside = [_BESIDE[name] for name in wanted if name in _BESIDE]
        wanted = list(dict.fromkeys([*wanted, *beside]))
        for name in protocol.EVENTS:
            if isinstance(file.get(name), dict):
                raise AntsError(f"[{name}] is one table; write [[{name}]] in double brackets.")
        numbered = {
            name: {str(n): event for n, event in enumerate(events, start=1)}
            for name, events in file.items()
            if name in protocol.EVENTS and _are_tables(events)
        }
        if numbered and kind != "colony":
            raise AntsError(f"[[{next(iter(numbered))}]] is for kind 'colony'; leave it out.")
        file = {**file, **numbered}  # so that [vary] can name the settings of an event: at.1.tick
        reading = _reading(kind, wanted, file.get("measure_every"))
        fixed = flat({name: value for name, value in file.items() if name not in _OF_FILE})
        seeds = file.get("seeds", 10)
        if not isinstance(seeds, list):
            seeds = range(checked_whole("seeds", seeds, 1, 100_000, ", or a list of seeds"))
        return cls(kind, tuple(wanted), arguments.checked_seeds(seeds), fixed, reading)

    def point(self, row: Settings, built: dict[str, Any]) -> Point:
        """Return the point of the fixed settings and a row of others.

        Reuses worlds and policies in `built`, and adds new ones. Raises AntsError if a setting is
        not allowed, or there are too few episodes for a measure.
        """
        point = _point(self.kind, {**self.fixed, **row}, built, self.reading)
        for name in self.measures:
            least = finished.of_runs(self.kind, name).episodes
            # With fewer than 50 episodes, `compare` uses all of them; a sweep refuses.
            least = finished.WINDOW if name.endswith("_last50") else least
            if point.episodes < least:
                raise AntsError(
                    f"{name} needs {least} episodes; use more or choose another measure."
                )
            if isinstance(point, ColonyPoint):
                measures.check_part(name, point.places_of_evaluation[0], point.task)
        return point


def _reading(kind: str, wanted: Sequence[str], every: Any) -> dict[str, Any]:
    """Return the arguments of points for the registered measures."""
    registered = tuple(
        name
        for name in wanted
        if name.partition(".")[0] in measures.names() and measures.get(name).of != RUN
    )
    if kind != "colony":
        if every is not None:
            raise AntsError(
                f"measure_every is {shown(every)}, but is for colonies only; leave it out."
            )
        return {}
    if every is None:
        return {"measures": tuple(name for name in registered if name not in finished.COLONY)}
    if not registered:
        raise AntsError(
            f"measure_every is {shown(every)}, but no measure has a series; add one of "
            f"{', '.join(measures.names())} to measures."
        )
    return {"measures": registered, "measure_every": checked_whole("measure_every", every)}


def _are_tables(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(one, dict) for one in value) and bool(value)


def as_list(value: Any) -> list:
    return value if isinstance(value, list) else [value]


def _check_once(name: str, values: list) -> None:
    for place, value in enumerate(values):
        if value in values[:place]:
            raise AntsError(f"{name} has {shown(value)} more than once; remove one of them.")


def axes_of(kind: str, table: Any, fixed: Settings) -> dict[str, Axis]:
    """Return the values or ranges of the settings in a [vary] table, by their full names.

    Raises:
        AntsError: A value or a range is not allowed, or a setting is in `fixed`, too.
    """
    if not isinstance(table, dict) or not table:
        raise AntsError("[vary] is empty; add lists of values of the settings that vary.")
    given: dict[str, Any] = {}
    for name, values in design.axes_of(table):
        if name in given:
            raise AntsError(f"{name} is in [vary] twice; remove one of them.")
        given[name] = values
    axes: dict[str, Axis] = {}
    for name, values in given.items():
        if not values:
            raise AntsError(f"{name} in [vary] is empty; give at least one value, or a range.")
        for one in fixed:  # a group and one of its settings exclude each other, too
            if f"{one}.".startswith(f"{name}.") or f"{name}.".startswith(f"{one}."):
                other = "" if one == name else f" {one}"
                raise AntsError(
                    f"{name} is in [vary] and{other} in the fixed settings; remove one of them."
                )
        if name in _OF_FILE:
            raise AntsError(f"{name} cannot vary; move it from [vary] to the top of the file.")
        declaration = declaration_of(name, fixed)
        if isinstance(values, dict):
            whole = name in ("world.seed", *_whole_numbers(kind))
            whole = declaration.kind is int if declaration else whole
            axes[name] = axis = Range.of(name, values, whole)
            if name in _whole_numbers(kind):
                if not axis.whole:
                    raise AntsError(f"{name}.whole is False, but {name} is whole; leave it out.")
                checked_whole(f"{name}.from", axis.low, 0 if name == "episodes" else 1)
                checked_whole(f"{name}.to", axis.high)
            values = [axis.low, axis.high]
        else:
            if name == "world.ranges" and not all(isinstance(one, list) for one in values):
                raise AntsError(
                    f"{name} in [vary] is {shown(values)}, but must be a list of ranges; write "
                    f"{shown([values])}."
                )
            _check_once(name, values)
            _check_amounts(name, values)
            axes[name] = Choices(tuple(values))
        if declaration:
            for one in values:
                declaration.checked(one)
    return axes


def _check_amounts(name: str, values: Sequence[Any]) -> None:
    """Raise AntsError if values mix numbers of ants and shares, such as 0 and 0.5."""
    if name.endswith(("remove_ants", "add_ants")) and {type(one) for one in values} >= {int, float}:
        raise AntsError(
            f"{name} in [vary] is {shown(values)}; a whole number is a number of ants, and others "
            f"are shares, so vary {name}.number or {name}.share."
        )


def declaration_of(name: str, fixed: Settings) -> DeclaredSetting | None:
    """Return the declaration of a setting; None if the task, training, world and events lack it.

    Also None for the short form of an intervention.
    """
    event, path = re.fullmatch(rf"({'|'.join(protocol.EVENTS)})\.\d+\.(.*)", name), name
    if event and not event[2].startswith("task."):
        group, _, own = event[2].rpartition(".")
        of: Any = interventions.INTERVENTIONS.get(group, protocol.EVENTS[event[1]])
        found = (one for one in declared(of) if one.name == own and not one.is_group)
        return next((one._replace(path=name) for one in found), None)
    if event:
        path = event[2]
    preset = fixed.get("world.preset", "paper")
    of_world = worlds.settings_of(preset) if preset in worlds.names() else ()
    known = [*all_of(Task), *declared(TrainingConfig), *of_world]
    for one in named_groups(Task):
        entry = path.removeprefix(f"{one.path}.").partition(".")[0]
        # `check_entries` refuses the names of other rules.
        if path.startswith(f"{one.path}.") and (one.path != "task.rules" or entry in rules.names()):
            known += settings_of_entry(one, entry).values()
    return next((one._replace(path=name) for one in known if one.path == path), None)


def _whole_numbers(kind: str) -> set[str]:
    """Return the settings of points that are whole numbers."""
    return {one.name for one in fields(KINDS[kind]) if str(one.type) in ("int", "int | None")}


def check_entries(file: Settings, varied: Iterable[str]) -> None:
    """Raise AntsError if [vary] names a field or a kind of food for which the file has no table.

    The parameters of a registered rule need none.
    """
    for group in named_groups(Task):
        one: Any = file
        for key in group.path.split("."):
            one = one.get(key, {}) if isinstance(one, dict) else {}
        listed = list(one) if isinstance(one, dict) else []
        listed += rules.names() if group.path == "task.rules" else []
        for name in sorted(varied):
            entry = name.removeprefix(f"{group.path}.").partition(".")[0]
            if name.startswith(f"{group.path}.") and entry not in listed:
                path, near = f"{group.path}.{entry}", difflib.get_close_matches(entry, listed, 3)
                choose = f"choose {', '.join(near or listed)}, or " if listed else ""
                raise AntsError(
                    f"`{path}` is in [vary], but the file has no table [{path}]; {choose}add it."
                )


def check_training(names: Iterable[str], points: Sequence[Point]) -> None:
    """Raise AntsError if one of the settings is of the training, but no point has training."""
    name = next((one for one in names if one.split(".")[0] == "training"), None)
    if name is None or any(one.episodes for one in points):
        return
    explores = isinstance(points[0], ColonyPoint) and points[0].task.choice.needs_table
    more = ", or set evaluation_epsilon to let them explore" if explores else ""
    raise AntsError(
        f"{name} has no effect, because ants do not learn if episodes is 0; leave it out{more}."
    )


def _point(
    kind: str, settings: Settings, built: dict[str, Any], reading: Mapping[str, Any]
) -> Point:
    """Return the point of some settings; reuse worlds and policies in `built`, and add new ones.

    `reading` are the arguments of the point that are not settings.
    """
    learner = settings.get("training.learner")
    of_learner: Any = learners.get(str(learner)).hyperparameters if learner else None
    known = _known(kind, of_learner)
    settings, events = _without_events(settings)
    for name in settings:
        # The world checks its settings, and named groups check theirs.
        if name not in known and not _tables().fullmatch(name):
            raise AntsError(f"{shown(name)} is not a setting {_rather(name, kind, [*known])}.")
    tree = nested(settings)
    world, task, training = (tree.pop(part, {}) for part in _PARTS[:3])
    preset = task.pop("preset", "paper")
    check_one_of("task.preset", preset, tuple(Task.named()))
    chosen = Task.named()[preset].replace(**task)
    if "policy" in tree:
        key = f"{tree['policy']!r} {chosen.observation}"
        if key not in built:
            built[key] = FixedPolicy.named(tree["policy"], chosen)
        tree["policy"] = built[key]
    if "policy" in tree or (kind == "colony" and not chosen.choice.needs_table):
        training = TrainingConfig.frozen().as_dict()  # `check_training` refuses others
    for name in _OF_LEARNERS[:5]:  # the others have defaults
        if name not in training:
            raise AntsError(f"training.{name} is missing; add it to [training] or [vary].")
    key = repr(sorted(world.items()))
    if key not in built:
        built[key] = _world(kind, world)
    if events:
        tree["protocol"] = protocol.read(events)
    return KINDS[kind](built[key], chosen, TrainingConfig(**training), **tree, **reading)


@cache
def _known(kind: str, hyperparameters: type | None) -> dict[str, None]:
    """Return the names of the settings of points of this kind, except those of named groups."""
    more = declared(hyperparameters) if hyperparameters else ()
    names = [
        *_own(kind),
        "task.preset",
        # A group of settings can be set by a name, if it has names.
        *(one.path for one in all_of(Task) if not one.is_group or one.has_names),
        *(one.path for one in (*declared(TrainingConfig), *more)),
    ]
    return dict.fromkeys(names)


@cache
def _tables() -> re.Pattern[str]:
    """Return a pattern of the settings of worlds, and of those in tables of entries with names."""
    tables = ["world.regions", *(one.path for one in named_groups(Task))]
    return re.compile(rf"world\.[^.]*|({'|'.join(map(re.escape, tables))})\..*")


def _without_events(settings: Settings) -> tuple[Settings, dict[str, list[Any]]]:
    """Return the settings without those of events, and the tables of the events by kind."""
    own = {k: v for k, v in settings.items() if re.match(r"(at|every|when)\.\d+\.", k)}
    tables = {
        kind: [table for _, table in sorted(events.items(), key=lambda one: int(one[0]))]
        for kind, events in nested(own).items()
    }
    return {k: v for k, v in settings.items() if k not in own}, tables


def _own(kind: str) -> list[str]:
    """Return the settings of a kind that do not belong to a part such as the task."""
    return [field.name for field in fields(KINDS[kind]) if field.name not in _PARTS]


def _rather(name: str, kind: str, known: list[str]) -> str:
    for other in KINDS:
        if name in _own(other):
            return f"of kind {kind!r}, but of {other!r}; leave it out"
    near = [one for one in known if one.endswith(f".{name}")]
    part = name if any(one.startswith(f"{name}.") for one in known) else name.rpartition(".")[0]
    if part and part not in _PARTS:
        near = near or [one for one in known if one.rpartition(".")[0] == part]
    near = near or difflib.get_close_matches(name, [*known, *_OF_FILE], 3)
    near = near or [*_own(kind), *(f"{one}. ..." for one in _PARTS[:3])]
    return f"of this sweep; choose one of {', '.join(near)}"


def _world(kind: str, given: Settings) -> Any:
    preset, drawn = given.pop("preset", "paper"), "seed" in given
    first, per_seed = given.pop("seed", 0), given.pop("per_seed", False)
    regions = given.pop("regions", {})
    if not isinstance(regions, Mapping):
        raise AntsError(f"world.regions is {shown(regions)}; it must be a table of regions.")
    if checked_flag("world.per_seed", per_seed) and kind == "runs":
        raise AntsError('world.per_seed is true, but kind is "runs"; leave it out.')
    if per_seed or drawn:
        worlds.check_seed_counts(preset, "world.per_seed" if per_seed else "world.seed")
    if not per_seed:
        return worlds.build(preset, first, **given).with_regions(regions)
    checked_whole("world.seed", first, -(2**62), 2**62)
    return Drawn.by(preset, first, regions, **given)
