"""Sweep files: their settings, seeds and measures, checked, and the points that they describe."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from functools import cache
from typing import Any, NamedTuple

from taichi_ants import arguments, interventions, learners, measures, protocol, rules, worlds
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

Settings = dict[str, Any]  # by their full names, as "task.pheromone.half_life"


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
        check_one_of("kind", kind, tuple(KINDS))
        wanted = as_list(file.get("measures", []))
        if not wanted:
            raise AntsError(f"measures is missing; name one or more of {finished.names_of(kind)}.")
        for name in wanted:
            finished.of_runs(kind, name)
        _check_once("measures", wanted)
        beside = [_BESIDE[name] for name in wanted if name in _BESIDE]
        wanted = list(dict.fromkeys([*wanted, *beside]))
        events = [name for name in protocol.EVENTS if name in file]
        for name in events:
            if not isinstance(file[name], list):
                raise AntsError(f"[{name}] is one table; write [[{name}]] in double brackets.")
            if kind != "colony":
                raise AntsError(f"[[{name}]] is for kind 'colony'; leave it out.")
        # So that [vary] can name the settings of an event: at.1.tick
        numbered = {n: dict(zip(map(str, range(1, 10**6)), file[n], strict=False)) for n in events}
        fixed = flat({n: v for n, v in {**file, **numbered}.items() if n not in _OF_FILE})
        seeds = file.get("seeds", 10)
        if not isinstance(seeds, list):
            seeds = range(checked_whole("seeds", seeds, 1, 100_000, ", or a list of seeds"))
        reading = _reading(kind, wanted, file.get("measure_every"))
        return cls(kind, tuple(wanted), arguments.checked_seeds(seeds), fixed, reading)

    def point(self, row: Settings, built: dict[str, Any]) -> Point:
        """Return the point of the fixed settings and a row of others.

        Reuses worlds and policies in `built`, and adds new ones. Raises AntsError if a setting is
        not allowed, or there are too few episodes for a measure.
        """
        settings = {**self.fixed, **row}
        learner = settings.get("training.learner")
        more: Any = learners.get(str(learner)).hyperparameters if learner else None
        known = _known(self.kind, more)
        of_events = re.compile(rf"({'|'.join(protocol.EVENTS)})\.\d+\.")
        for name in settings:
            # The world checks its settings, named groups and events check theirs.
            if not (name in known or _tables().fullmatch(name) or of_events.match(name)):
                raise AntsError(
                    f"{shown(name)} is not a setting {_rather(name, self.kind, known)}."
                )
        tree = nested(settings)
        events = {name: tree.pop(name) for name in protocol.EVENTS if name in tree}
        world, task, training = (tree.pop(part, {}) for part in _PARTS[:3])
        preset = task.pop("preset", "paper")
        check_one_of("task.preset", preset, tuple(Task.named()))
        task = Task.named()[preset].replace(**task)
        if "policy" in tree:
            key = f"{tree['policy']!r} {task.observation}"
            if key not in built:
                built[key] = FixedPolicy.named(tree["policy"], task)
            tree["policy"] = built[key]
        if "policy" in tree or (self.kind == "colony" and not task.choice.needs_table):
            training = TrainingConfig.frozen().as_dict()  # `check_training` refuses others
        key = repr(sorted(world.items()))
        if key not in built:
            built[key] = _world(self.kind, world)
        if events:
            of_kinds = ((kind, sorted(tables, key=int)) for kind, tables in events.items())
            lists = {kind: [events[kind][n] for n in numbers] for kind, numbers in of_kinds}
            tree["protocol"] = protocol.read(lists)
        for setting in declared(TrainingConfig)[:5]:  # the others have defaults
            if setting.name not in training:
                raise AntsError(f"{setting.path} is missing; add it to [training] or [vary].")
        config = TrainingConfig(**training)
        point = KINDS[self.kind](built[key], task, config, **tree, **self.reading)
        for name in self.measures:
            # With fewer than 50 episodes, `compare` uses all of them; a sweep refuses.
            is_last = name.endswith("_last50")
            least = finished.WINDOW if is_last else finished.of_runs(self.kind, name).episodes
            if point.episodes < least:
                raise AntsError(
                    f"{name} needs {least} episodes; use more or choose another measure."
                )
        return point


def _reading(kind: str, wanted: Sequence[str], every: Any) -> dict[str, Any]:
    """Return the arguments of points for the registered measures."""
    registered = tuple(
        name
        for name in wanted
        if name.partition(".")[0] in measures.names() and measures.get(name).of != RUN
    )
    if every is None:
        unfinished = tuple(name for name in registered if name not in finished.COLONY)
        return {"measures": unfinished} if kind == "colony" else {}
    if kind != "colony" or not registered:
        raise AntsError(
            f"measure_every is {shown(every)}, but is for kind 'colony' with a measure that has a "
            f"series ({', '.join(measures.names())}); add one to measures, or leave it out."
        )
    return {"measures": registered, "measure_every": checked_whole("measure_every", every)}


def as_list(value: Any) -> list:
    return value if isinstance(value, list) else [value]


def _check_once(name: str, values: list) -> None:
    for n, value in enumerate(values):
        if value in values[:n]:
            raise AntsError(f"{name} has {shown(value)} more than once; remove one of them.")


def axes_of(kind: str, table: Any, fixed: Settings) -> dict[str, Axis]:
    """Return the values or ranges of the settings in a [vary] table, by their full names.

    Raises:
        AntsError: A range is not allowed, or a setting is in `fixed`, too. Points check values.
    """
    if not isinstance(table, dict) or not table:
        raise AntsError("[vary] is empty; add lists of values of the settings that vary.")
    axes: dict[str, Axis] = {}
    for name, values in design.axes_of(table):
        if not values or name in _OF_FILE:
            raise AntsError(f"{name} cannot vary, or has no values; give at least one, or a range.")
        for other in fixed:  # a group and one of its settings exclude each other, too
            if f"{other}.".startswith(f"{name}.") or f"{name}.".startswith(f"{other}."):
                raise AntsError(
                    f"{name} is in [vary], and {other} in the fixed settings; remove one of them."
                )
        if isinstance(values, dict):
            declaration = declaration_of(name, fixed)
            of_points = (f.name for f in fields(KINDS[kind]) if "int" in str(f.type))
            whole = declaration.kind is int if declaration else name in ("world.seed", *of_points)
            axes[name] = limits = Range.of(name, values, whole)
            if declaration:
                for end in (limits.low, limits.high):  # which drawn points lack
                    declaration.checked(end)
        else:
            _check_once(name, values)
            axes[name] = Choices(tuple(values))
    return axes


def declaration_of(name: str, fixed: Settings) -> DeclaredSetting | None:
    """Return the declaration of a setting; None if the task, training, world and events lack it.

    Also None for the short form of an intervention.
    """
    event, path = re.fullmatch(rf"({'|'.join(protocol.EVENTS)})\.\d+\.(.*)", name), name
    if event and not event[2].startswith("task."):
        group, _, last = event[2].rpartition(".")
        of: Any = interventions.INTERVENTIONS.get(group, protocol.EVENTS[event[1]])
        known = [s._replace(path=s.name) for s in declared(of) if not s.is_group]
        path = last
    else:
        path = event[2] if event else name
        preset = fixed.get("world.preset", "paper")
        of_world = worlds.settings_of(preset) if preset in worlds.names() else ()
        known = [*all_of(Task), *declared(TrainingConfig), *of_world]
        for group in named_groups(Task):
            entry = path.removeprefix(f"{group.path}.").partition(".")[0]
            # `check_entries` refuses the names of other rules.
            is_rule = group.path == "task.rules"
            if path.startswith(f"{group.path}.") and (not is_rule or entry in rules.names()):
                known += settings_of_entry(group, entry).values()
    return next((s._replace(path=name) for s in known if s.path == path), None)


def check_entries(file: Settings, varied: Iterable[str]) -> None:
    """Raise AntsError if [vary] names a field or a kind of food for which the file has no table.

    The parameters of a registered rule need none.
    """
    for group in named_groups(Task):
        tables: Any = file
        for key in group.path.split("."):
            tables = tables.get(key, {}) if isinstance(tables, dict) else {}
        listed = list(tables) if isinstance(tables, dict) else []
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
    name = next((name for name in names if name.split(".")[0] == "training"), None)
    if name is None or any(point.episodes for point in points):
        return
    explores = isinstance(points[0], ColonyPoint) and points[0].task.choice.needs_table
    more = ", or set evaluation_epsilon to let them explore" if explores else ""
    raise AntsError(
        f"{name} has no effect, because ants do not learn if episodes is 0; leave it out{more}."
    )


@cache
def _known(kind: str, hyperparameters: type | None) -> dict[str, None]:
    """Return the names of the settings of points of this kind, except those of named groups."""
    more = declared(hyperparameters) if hyperparameters else ()
    names = [
        *(field.name for field in fields(KINDS[kind]) if field.name not in _PARTS),
        "task.preset",
        # A group of settings can be set by a name, if it has names.
        *(s.path for s in all_of(Task) if not s.is_group or s.has_names),
        *(s.path for s in (*declared(TrainingConfig), *more)),
    ]
    return dict.fromkeys(names)


@cache
def _tables() -> re.Pattern[str]:
    """Return a pattern of the settings of worlds, and of those in tables of entries with names."""
    tables = ["world.regions", *(group.path for group in named_groups(Task))]
    return re.compile(rf"world\.[^.]*|({'|'.join(map(re.escape, tables))})\..*")


def _rather(name: str, kind: str, known: Iterable[str]) -> str:
    """Return the end of a sentence on a setting that does not exist: the nearest ones."""
    for other in KINDS.keys() - {kind}:
        if name in _known(other, None):
            return f"of kind {kind!r}, but of {other!r}; leave it out"
    group, _, last = name.rpartition(".")
    same = [k for k in known if k.endswith(f".{last}") or k.startswith(f"{name}.")]
    near = same or difflib.get_close_matches(name, [*known, *_OF_FILE], 3)
    near = near or [k for k in known if k.rpartition(".")[0] == group]
    return f"of this sweep; choose one of {', '.join(near)}"


def _world(kind: str, settings: Settings) -> Any:
    preset, drawn = settings.pop("preset", "paper"), "seed" in settings
    first, per_seed = settings.pop("seed", 0), settings.pop("per_seed", False)
    regions = settings.pop("regions", {})
    if not isinstance(regions, Mapping):
        raise AntsError(f"world.regions is {shown(regions)}; it must be a table of regions.")
    if checked_flag("world.per_seed", per_seed) and kind == "runs":
        raise AntsError('world.per_seed is true, but kind is "runs"; leave it out.')
    if per_seed or drawn:
        worlds.check_seed_counts(preset, "world.per_seed" if per_seed else "world.seed")
    if not per_seed:
        return worlds.build(preset, first, **settings).with_regions(regions)
    checked_whole("world.seed", first, -(2**62), 2**62)
    return Drawn.by(preset, first, regions, **settings)
