"""Sweep files: their settings, seeds and measures, checked, and the points that they describe."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from typing import Any, NamedTuple

from taichi_ants import arguments, interventions, measures, protocol, rules, worlds
from taichi_ants import settings as declarations
from taichi_ants.errors import AntsError, check_one_of, checked_whole, expect, refuse, shown
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.measures import finished
from taichi_ants.measures.measure import RUN
from taichi_ants.settings import DeclaredSetting, declared, flat, named_groups, nested
from taichi_ants.studies.design import Axis, Design, Range
from taichi_ants.studies.points import ColonyPoint, Drawn, FixedPolicy, Point, RunPoint
from taichi_ants.task import Task

KINDS: dict[str, type] = {"runs": RunPoint, "colony": ColonyPoint}
# Keys that are not settings of points; docs/reference/sweep_keys.toml has their meanings.
KEYS = [
    *("kind", "measures", "measure_every", "seeds", "vary", "against"),
    *(key.name for key in declared(Design)),
]
# Attributes of points that are not settings.
_PARTS = ("world", "task", "training", "after", "pool", "measures", "measure_every", "protocol")
# Measures of reward, and the deliveries that sweeps report beside them: ants can collect rewards
# without delivering.
_BESIDE = {"reward": "deliveries", "greedy_return": "greedy_deliveries"}
_BESIDE |= {f"return_{of}": f"deliveries_{of}" for of in ("first50", "second50", "last50", "all")}

# The beginnings of names of settings that need a table in the file; those of rules need none.
_GROUPS = [*(group.path for group in named_groups(Task)), *protocol.EVENTS]
_ENTRY = re.compile(rf"({'|'.join(name for name in _GROUPS if name != 'task.rules')})\.[^.]+")

Settings = dict[str, Any]  # by their full names, as "task.pheromone.half_life"


class Base(NamedTuple):
    """The part of a file that does not depend on how its points are chosen.

    Attributes:
        names: The full names of settings and of empty tables; events are numbered: at.1
        fixed: The fixed settings by their full names.
        reading: The arguments of points that are not settings.
    """

    kind: str
    measures: tuple[str, ...]
    seeds: tuple[int, ...]
    names: tuple[str, ...]
    fixed: Settings
    reading: dict[str, Any]

    @classmethod
    def of(cls, file: Settings) -> Base:
        """Return the part of a file; AntsError if a key or value is not allowed."""
        kind: Any = file.get("kind")
        if kind is None:
            raise AntsError(f"kind is missing; set it to one of {', '.join(KINDS)}.")
        check_one_of("kind", kind, tuple(KINDS))
        wanted = as_list(file.get("measures", []))
        if not wanted:
            raise AntsError(f"measures is missing; name one or more of {finished.names_of(kind)}.")
        for name in wanted:
            finished.of_runs(kind, name)
        beside = [_BESIDE[name] for name in wanted if name in _BESIDE]
        wanted = list(dict.fromkeys([*wanted, *beside]))
        tables = dict(file)
        for name in protocol.EVENTS.keys() & file.keys():
            if not isinstance(file[name], list) or kind != "colony":
                raise AntsError(f"[{name}] must be [[{name}]], in a file of kind 'colony'.")
            tables[name] = {str(n): event for n, event in enumerate(file[name], start=1)}
        fixed = flat({name: table for name, table in tables.items() if name not in KEYS})
        seeds = file.get("seeds", 10)
        if not isinstance(seeds, list):
            seeds = range(checked_whole("seeds", seeds, 1, 100_000, ", or a list of seeds"))
        names = tuple(name for name, _ in settings_in(tables))
        reading = _reading(kind, wanted, file.get("measure_every"))
        return cls(kind, tuple(wanted), arguments.checked_seeds(seeds), names, fixed, reading)

    def axes(self, table: Any) -> dict[str, Axis]:
        """Return the values or ranges of the settings in a [vary] table, by their full names.

        AntsError if a range is not allowed, or a setting is fixed, too, or of an event, field,
        caste or food without a table in the file. Points check values.
        """
        if not isinstance(table, dict) or not table:
            raise AntsError("[vary] is empty; add lists of values of the settings that vary.")
        axes: dict[str, Axis] = {}
        for name, values in settings_in(table):
            if not values or name in KEYS:
                raise AntsError(f"{name} cannot vary, or has no values; give a value or a range.")
            for other in self.fixed:  # a group and one of its settings exclude each other, too
                if f"{other}.".startswith(f"{name}.") or f"{name}.".startswith(f"{other}."):
                    raise AntsError(f"{name} is in [vary], and {other} is fixed; remove one.")
            entry = _ENTRY.match(name)
            if entry and not any(f"{other}.".startswith(f"{entry[0]}.") for other in self.names):
                raise AntsError(f"{name} is in [vary], but the file has no {entry[0]}; add it.")
            if isinstance(values, dict):
                declaration = declaration_of(name, self.fixed)
                of_points = (s.name for s in declared(KINDS[self.kind]) if s.kind is int)
                is_whole = name in ("world.seed", *of_points)
                whole = declaration.kind is int if declaration else is_whole
                axes[name] = Range.of(name, values, whole)
                continue
            axes[name] = values
            for n, value in enumerate(values):
                if value in values[:n]:
                    raise AntsError(f"{name} has {shown(value)} more than once; remove one.")
        return axes

    def point(self, row: Settings, built: dict[str, Any]) -> Point:
        """Return the point of the fixed settings and a row of others.

        Reuses worlds and policies in `built`, and adds new ones. Raises AntsError if a setting is
        not allowed, or there are too few episodes for a measure.
        """
        tree = nested(self.fixed | row)
        events = {n: tree.pop(n) for n in protocol.EVENTS if isinstance(tree.get(n), Mapping)}
        world, task, training = (tree.pop(part, {}) for part in _PARTS[:3])
        for part, table in zip(_PARTS, (world, task, training), strict=False):
            expect(part, table, Mapping)
        known = [field.name for field in fields(KINDS[self.kind]) if field.name not in _PARTS]
        for name in tree:  # the world, task, training and events check theirs
            if name not in known:
                of = f"a sweep of kind {self.kind!r}"
                raise AntsError(f"{name!r} {declarations.not_a_setting(name, [*known, *KEYS], of)}")
        preset = task.pop("preset", "paper")
        check_one_of("task.preset", preset, tuple(Task.named()))
        task = Task.named()[preset].replace(**task)
        if "policy" in tree:
            key = f"{tree['policy']!r} {task.observation}"
            if key not in built:
                built[key] = FixedPolicy.named(tree["policy"], task)
            tree["policy"] = built[key]
        if "policy" in tree or (self.kind == "colony" and not task.needs_table):
            training = TrainingConfig.frozen().as_dict()  # `check_training` refuses others
        key = repr(sorted(world.items()))
        if key not in built:
            built[key] = _world(self.kind, world)
        if events:
            lists = {name: [of[n] for n in sorted(of, key=int)] for name, of in events.items()}
            tree["protocol"] = protocol.read(lists)
        config = TrainingConfig.from_dict(training)
        point = KINDS[self.kind](built[key], task, config, **tree, **self.reading)
        for name in self.measures:
            # With fewer than 50 episodes, `compare` uses all of them; a sweep refuses.
            is_last = name.endswith("_last50")
            least = finished.WINDOW if is_last else finished.of_runs(self.kind, name).episodes
            if point.episodes < least:
                raise AntsError(f"{name} needs {least} episodes; use more or another measure.")
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


def settings_in(tree: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the settings in nested tables: full names, with a list of values or a range's table."""
    for name, value in tree.items():
        path = f"{before}.{name}" if before else name
        if isinstance(value, Mapping) and value and not value.keys() & {"from", "to"}:
            yield from settings_in(value, path)
        else:
            yield path, value if isinstance(value, (Mapping, list)) else [value]


def declaration_of(name: str, fixed: Settings) -> DeclaredSetting | None:
    """Return the declaration of a setting; None if the task, training, world and events lack it.

    Also None for the short form of an intervention.
    """
    event = re.fullmatch(rf"({'|'.join(protocol.EVENTS)})\.\d+\.(.*)", name)
    path = event[2] if event else name
    if event and not path.startswith("task."):
        group, _, path = path.rpartition(".")
        of: Any = interventions.INTERVENTIONS.get(group, protocol.EVENTS[event[1]])
        known = [s._replace(path=s.name) for s in declared(of) if not s.is_group]
    else:
        preset = fixed.get("world.preset", "paper")
        of_world = worlds.registry.settings_of(preset) if preset in worlds.names() else ()
        known = [*declarations.all_of(Task), *declared(TrainingConfig), *of_world]
        for named in named_groups(Task):
            entry = re.match(rf"{named.path}\.([^.]+)\.", path)
            # The parameters of rules that are not registered are unknown.
            if entry and (named.path != "task.rules" or entry[1] in rules.names()):
                known += declarations.settings_of_entry(named, entry[1]).values()
    return next((s._replace(path=name) for s in known if s.path == path), None)


def check_training(names: Iterable[str], points: Sequence[Point]) -> None:
    """Raise AntsError if one of the settings is of the training, but no point has training."""
    name = next((name for name in names if name.split(".")[0] == "training"), None)
    if name is None or any(point.episodes for point in points):
        return
    explores = isinstance(points[0], ColonyPoint) and points[0].task.needs_table
    more = ", or set evaluation_epsilon to let them explore" if explores else ""
    raise AntsError(
        f"{name} has no effect, because ants do not learn if episodes is 0; leave it out{more}."
    )


def _world(kind: str, settings: Settings) -> Any:
    preset, first = settings.pop("preset", "paper"), settings.pop("seed", None)
    per_seed, regions = settings.pop("per_seed", False), settings.pop("regions", {})
    expect("world.regions", regions, Mapping)
    if per_seed not in ((True, False) if kind == "colony" else (False,)):
        refuse("world.per_seed", per_seed, "true or false for kind 'colony', else left out")
    if per_seed or first is not None:
        worlds.registry.check_seed_counts(preset, "world.per_seed" if per_seed else "world.seed")
    first = checked_whole("world.seed", first or 0, -(2**62), 2**62)
    if per_seed:
        return Drawn.by(preset, first, regions, **settings)
    return worlds.build(preset, first, **settings).with_regions(regions)
