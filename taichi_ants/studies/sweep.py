"""Sweeps: TOML files with settings, seeds and measures, and the results of these."""

from __future__ import annotations

import difflib
import itertools
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, fields
from functools import cached_property, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from taichi_ants import checks, files, learners, measures, protocol, worlds
from taichi_ants.analysis import designs, sensitivity, sweeps
from taichi_ants.analysis.colony import study as of_colonies
from taichi_ants.analysis.findings import Contrast, above, judge
from taichi_ants.analysis.paper import measures as of_runs
from taichi_ants.errors import AntsError, check_one_of, checked_flag, checked_whole, shown
from taichi_ants.files.results import REPORT, ROWS
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.measures.series import stops
from taichi_ants.settings import Setting, all_of, declared, flat, named_groups, nested
from taichi_ants.studies import design
from taichi_ants.studies.blocks import Blocks
from taichi_ants.studies.design import GRID, Axis, Choices, Design, Range
from taichi_ants.studies.runner import (
    SERIES,
    VALUE,
    Block,
    ColonyPoint,
    FixedPolicy,
    Outcome,
    Point,
    Progress,
    RunPoint,
    Study,
    values_in,
)
from taichi_ants.task import Task
from taichi_ants.task.field import TRAIL

KINDS: dict[str, type] = {"runs": RunPoint, "colony": ColonyPoint}
FIGURES, RUNS, SUMMARY, FINDINGS = "figures", "runs.csv", "summary.csv", "findings.csv"
SERIES_FILE, SENSITIVITY = "series.csv", "sensitivity.csv"
_OF_SERIES = ("seed", "episode", "tick", "measure", "value")  # columns of SERIES_FILE
_BYTES_OF_A_NUMBER = 20  # in a table
_OF_FILE = (
    "kind",
    "seeds",
    "measures",
    "measure_every",
    "margin",
    "against",
    "vary",
    "search",
    *design.KEYS,
)
# Attributes of points that are not settings.
_PARTS = ("world", "task", "training", "after", "pool", "measures", "measure_every", "protocol")
_OF_LEARNERS = [one.name for one in declared(TrainingConfig)]
_WORDS = {"supported": "more", "contradicted": "less", "equivalent": "equal"}

Settings = dict[str, Any]  # by their full names, as "task.pheromone.half_life"


class Measure(NamedTuple):
    """A number for each point and seed: its name for readers, and the fewest episodes it needs."""

    words: str
    episodes: int = 0
    uses_iqm: bool = False


MEASURES = {
    "runs": {
        # With fewer than 50 episodes, the comparison uses all of them; a sweep refuses.
        name: Measure(
            one.words, of_runs.WINDOW if name.endswith("_last50") else one.episodes, one.uses_iqm
        )
        for name, one in of_runs.MEASURES.items()
    },
    "colony": {name: Measure(words) for name, words in of_colonies.MEASURES.items()},
}
# Ants that follow a policy do not learn or explore, unless the file says so.
_WITHOUT_LEARNING = {
    **{"learner": "q_learning", "learning_rate": 1.0, "discount": 1.0},
    **{"epsilon": 0.0, "epsilon_decay": 1.0},
}


def measure_of(kind: str, name: str) -> Measure:
    """Return a measure of this kind; for colonies also a registered one.

    Raises:
        AntsError: There is no such measure; the message lists all names.
    """
    known = MEASURES[kind]
    if name in known:
        return known[name]
    if not isinstance(name, str) or name.partition(".")[0] not in _registered(kind):
        raise AntsError(f"measures is {shown(name)}; it must be one of {_names_of(kind)}.")
    one = measures.get(name)
    words = one.summary or name.replace("_", " ")
    return Measure(f"{words} ({one.unit})" if one.unit else words)


def _registered(kind: str) -> set[str]:
    """Return the names of registered measures that sweeps of this kind can have."""
    return set(measures.names()) - {"occupancy"} if kind == "colony" else set()


def _names_of(kind: str) -> str:
    """Return the names of all measures of this kind, for a message."""
    registered = _registered(kind)
    names = ", ".join([*MEASURES[kind], *sorted(registered - MEASURES[kind].keys())])
    return names + (", or the name of a measure of a plugin (--plugin FILE)" if registered else "")


@dataclass(frozen=True)
class Sweep:
    """A sweep, read from a file.

    Attributes:
        study: The points over the seeds, in the order of `settings`.
        settings: The settings that vary, for each point of the study.
        grids: For each [vary] table of the file, the slice of `settings` that it defines.
        measures: Names of measures; the figure shows the first.
        measure_every: Ticks between two rows of `SERIES_FILE`; None without that file.
        against: The setting and its value with which all others are compared.
        margin: The largest difference in the first measure that is too small to matter.
        design: The design of the points.
        axes: For each [vary] table, the values or ranges of its settings.
    """

    kind: str
    study: Study[Any]
    settings: tuple[Settings, ...]
    grids: tuple[slice, ...]
    measures: tuple[str, ...]
    measure_every: int | None
    against: tuple[str, Any] | None
    margin: float
    design: Design = field(default_factory=Design)
    axes: tuple[Mapping[str, Axis], ...] = ()

    def facts(self) -> dict[str, Any]:
        """Return everything that determines the results."""
        own = {"measures": self.measures, "against": self.against, "margin": self.margin}
        own |= {"measure_every": self.measure_every} if self.measure_every else {}
        return {**self.study.settings(), **own, **self.design.facts(), "vary": self.settings}

    def measured(self, blocks: Path, progress: Progress, **how: Any) -> dict[str, np.ndarray]:
        """Return each measure, float64 (points, seeds); arguments as of `Study.in_blocks`.

        The value of a registered measure is its mean over rollouts, at the last tick of each.
        """
        reduce = partial(_measured, self.kind, self.measures, self.measure_every is not None)
        how = {"bytes_of_a_run": self._bytes_of_a_run, **how}
        with self._rows_as_they_come(blocks.parent / ROWS) as each:
            return self.study.reduced(blocks, reduce, progress, each, **how)

    def _bytes_of_a_run(self, point: Any) -> int:
        """Return the approximate bytes of a run on disk: in a block, and in two tables."""
        values = len(self.measures)
        if self.measure_every is not None:
            several = len(list(stops(point.ticks, self.measure_every)))
            values += len(point.measures) * several * point.rollouts
        return values * (8 + 2 * _BYTES_OF_A_NUMBER)

    @contextmanager
    def _rows_as_they_come(self, folder: Path) -> Iterator[Callable[[Block], None]]:
        """Yield a function that appends the rows of a block to tables in a folder.

        The tables have the columns of `RUNS` and `SERIES_FILE`, and rows in the order of blocks.
        """
        tables: dict[str, files.GrowingTable] = {}
        settings, order = self._settings_of_points, self.study.in_order
        columns, seeds = sweeps.columns_of(self.settings), self.study.seeds

        def append(name: str, rows: Iterable[dict[str, Any]], more: Iterable[str]) -> None:
            if name not in tables:
                path = files.check_writable_folder(folder) / name
                tables[name] = stack.enter_context(files.GrowingTable(path, [*columns, *more]))
            tables[name].append(rows)

        def each(block: Block) -> None:
            values, of_seeds = values_in(block.outcome), [seeds[s] for s in block.seeds]
            own = [(one, row) for row, p in enumerate(block.points) for one in settings[order[p]]]
            several = {name: array[[row for _, row in own]] for name, array in values.items()}
            rows = sweeps.seed_rows([one for one, _ in own], of_seeds, several)
            append(RUNS, rows, ["seed", *values])
            for row, p in enumerate(block.points) if self.measure_every else ():
                of_point = {name: array[row] for name, array in block.outcome.items()}
                append(SERIES_FILE, self._rows_of_series(order[p], of_seeds, of_point), _OF_SERIES)

        with ExitStack() as stack:
            yield each

    @cached_property
    def _settings_of_points(self) -> dict[Any, list[Settings]]:
        """Return the settings of each point, several if it repeats."""
        settings: dict[Any, list[Settings]] = {}
        for point, one in zip(self.study.points, self.settings, strict=True):
            settings.setdefault(point, []).append(one)
        return settings

    def take(self, folder: Path, runs: Mapping[str, Any], blocks: Blocks) -> None:
        """Add finished results, whose `Study.runs` were `runs`, to the blocks.

        Raises:
            AntsError: A table cannot be read.
        """
        rows = files.read_csv(folder / RUNS)
        names = list(rows[0])
        own, wanted = names[: names.index("seed")], names[names.index("seed") + 1 :]
        size = len(rows) // len(runs["rows"])  # seeds
        values = np.array([[row[name] for name in wanted] for row in rows], float)
        values = values.reshape(-1, size, len(wanted))
        point_of = dict(zip(self.study.keys, self.study.in_order, strict=True))
        series: dict[tuple, dict[str, list[Any]]] = {}
        if self.measure_every is not None:
            for row in files.read_csv(folder / SERIES_FILE):
                of_point = series.setdefault(tuple(row.get(name) for name in own), {})
                of_point.setdefault(row["measure"], []).append(row["value"])
        for number, place in enumerate(runs["rows"]):
            key, seeds = runs["points"][place], runs["seeds"][runs["seeds_of"][place]]
            arrays = {f"{VALUE}{name}": values[number, :, n] for n, name in enumerate(wanted)}
            of_point = series.get(tuple(rows[number * size][name] for name in own), {})
            for name, several in of_point.items():
                shape = size, point_of[key].rollouts, -1
                arrays[f"{SERIES}{name}"] = np.array(several, float).reshape(shape)
            blocks.add([key], seeds, {name: array[None] for name, array in arrays.items()})

    def write_series(self, blocks: Path, folder: Path) -> None:
        """Write the series of the registered measures, a row for each value; read finished blocks.

        Does nothing without `measure_every`.
        """
        if self.measure_every is None:
            return
        order, seeds = self.study.in_order, self.study.seeds
        rows = (
            row
            for place, outcome in self.study.read(blocks, range(len(order)))
            for row in self._rows_of_series(order[place], seeds, outcome)
        )
        columns = [*sweeps.columns_of(self.settings), *_OF_SERIES]
        files.write_csv(folder / SERIES_FILE, rows, columns)

    def _rows_of_series(
        self, point: Any, seeds: Sequence[int], outcome: Outcome
    ) -> Iterator[dict[str, Any]]:
        """Yield the rows of a point, whose outcome has arrays (seeds, ...)."""
        settings, ticks = self._settings_of_points, list(stops(point.ticks, self.measure_every))
        for name, array in outcome.items():
            for one in settings[point] if name.startswith(SERIES) else ():
                for (s, episode, row), value in np.ndenumerate(array):
                    found = seeds[s], episode, ticks[row], name.removeprefix(SERIES), value
                    yield {**one, **dict(zip(_OF_SERIES, found, strict=True))}

    def findings(self, values: np.ndarray) -> dict[int, dict[str, Any]]:
        """Return by point the finding on its difference from the point with the value `against`.

        `values` is the first measure, float64 (points, seeds). All intervals of a [vary] table hold
        at the same time.
        """
        if self.against is None:
            return {}
        (name, value), found = self.against, {}
        for some in self.grids:
            rows, own = self.settings[some], values[some]
            others = [{**row, name: value} for row in rows]
            pairs = [(p, rows.index(other)) for p, other in enumerate(others) if other in rows]
            pairs = [(p, other) for p, other in pairs if p != other]
            several = [Contrast("", own[p] - own[other], above(self.margin)) for p, other in pairs]
            for (p, _), one in zip(pairs, judge(several), strict=True):
                said = _WORDS.get(one.verdict.value, "undecided")
                numbers = {"difference": one.effect, "low": one.low, "high": one.high}
                found[some.start + p] = {**rows[p], "finding": said, **numbers}
        return found

    def write(self, values: dict[str, np.ndarray], folder: Path, draws: bool) -> None:
        """Write all results; `values` are those that `measured` returned."""
        first, columns = next(iter(values)), sweeps.columns_of(self.settings)
        of_seeds = sweeps.seed_rows(self.settings, self.study.seeds, values)
        files.write_csv(folder / RUNS, of_seeds, [*columns, "seed", *values])
        with_iqm = [name for name in values if measure_of(self.kind, name).uses_iqm]
        rows = [
            {**one, "seeds": len(self.study.seeds), **sweeps.centre_columns(centres)}
            for one, centres in zip(self.settings, sweeps.centres_of(values, with_iqm), strict=True)
        ]
        files.write_csv(folder / SUMMARY, rows, sweeps.columns_of(rows))
        found = self.findings(values[first])
        if self.against:
            more = ("finding", "difference", "low", "high")
            files.write_csv(folder / FINDINGS, found.values(), [*columns, *more])
        notes = [found.get(p, {}).get("finding", "") for p in range(len(self.settings))]
        if self.design.kind == GRID:
            report = sweeps.report(self.settings, values, self.against, notes)
        else:
            report = designs.first_rows(self.settings, values, f"the design {self.design.kind!r}")
        indices = self.indices(values)
        if indices:
            report = f"{report}\n{sensitivity.report(indices, len(self.study.seeds))}"
            of_all = [one._asdict() for several in indices.values() for one in several]
            files.write_csv(folder / SENSITIVITY, of_all, sensitivity.Index._fields)
        files.write_text(folder / REPORT, report)
        if draws:
            self._draw(values[first], indices.get(first, []), first, folder / FIGURES)

    def indices(self, values: dict[str, np.ndarray]) -> dict[str, list[sensitivity.Index]]:
        """Return the sensitivity indices by measure, from values that `measured` returned.

        Empty if the file does not want them.
        """
        names = list(design.varying(self.axes[0])) if self.design.sensitivity else []
        measured = values.items() if names else ()
        return {name: sensitivity.indices(name, names, array) for name, array in measured}

    def _draw(
        self, values: np.ndarray, indices: Sequence[sensitivity.Index], first: str, folder: Path
    ) -> None:
        """Draw the first measure, float64 (points, seeds), in a figure for each [vary] table."""
        files.check_writable_folder(folder)
        words = measure_of(self.kind, first).words
        for number, (some, axes) in enumerate(zip(self.grids, self.axes, strict=True), start=1):
            path = folder / f"{first}{f'-{number}' * (len(self.grids) > 1)}.png"
            if self.design.kind == GRID:
                sweeps.draw(path, self.settings[some], values[some], words)
            else:
                names, logs = list(design.varying(axes)), design.logarithmic(axes)
                designs.draw(path, self.settings[some], names, logs, values[some], words)
        if indices:
            path = folder / f"sensitivity_{first}.png"
            sensitivity.draw(path, indices, words, values.shape[1])


def read_sweep(path: Path, text: str | None = None) -> Sweep:
    """Return the sweep of a file, or of its text.

    Raises:
        AntsError: The file cannot be read, or a setting is not allowed.
    """
    with contents(path, text) as file:
        return sweep_of(file)


@contextmanager
def contents(path: Path, text: str | None = None) -> Iterator[Settings]:
    """Yield the contents of a file (.toml), or of its text; errors in the context name the file.

    Raises:
        AntsError: The file cannot be read.
    """
    text = files.read_text(path) if text is None else text
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
        wanted = _listed(file.get("measures", []))
        if not wanted:
            what = "empty" if "measures" in file else "missing"
            raise AntsError(f"measures is {what}; name one or more of {_names_of(kind)}.")
        for name in wanted:
            measure_of(kind, name)
        _check_once("measures", wanted)
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
        return cls(kind, tuple(wanted), checks.checked_seeds(seeds), fixed, reading)

    def point(self, row: Settings, built: dict[str, Any]) -> Point:
        """Return the point of the fixed settings and a row of others.

        Reuses the worlds in `built`, and adds new ones. Raises AntsError if a setting is not
        allowed, or there are too few episodes for a measure.
        """
        point = _point(self.kind, {**self.fixed, **row}, self.seeds, built, self.reading)
        for name in self.measures:
            least = measure_of(self.kind, name).episodes
            if point.episodes < least:
                raise AntsError(
                    f"{name} needs {least} episodes; use more or choose another measure."
                )
            whole, _, part = name.partition(".")
            if whole == "entropy" and part and part not in (TRAIL, *point.task.fields):
                allowed = ", ".join(f"{whole}.{one}" for one in (TRAIL, *point.task.fields))
                raise AntsError(f"{name!r} is not a part of {whole}; choose one of {allowed}.")
        return point


def sweep_of(file: Settings) -> Sweep:
    """Return the sweep of the contents of a file; AntsError if a setting is not allowed."""
    base, drawn = Base.of(file), Design.of(file)
    axes = tuple(axes_of(base.kind, table, base.fixed) for table in _listed(file.get("vary", [])))
    _check_entries(file, {name for one in axes for name in one})
    if not axes:
        raise AntsError("[vary] is missing; add it with lists of values of the settings that vary.")
    if drawn.sensitivity and len(axes) > 1:
        raise AntsError(f"sensitivity is for one [vary] table, but there are {len(axes)}.")
    grids = [drawn.rows(one) for one in axes]
    rows, built = tuple(itertools.chain(*grids)), dict[str, Any]()
    points = tuple(base.point(row, built) for row in rows)
    margin = file.get("margin", 0)
    if type(margin) not in (int, float) or not 0 <= margin < math.inf:
        raise AntsError(f"margin is {shown(margin)}; it must be a number of at least 0.")
    against = None
    if "against" in file:
        if drawn.kind != GRID:
            raise AntsError(f"against is for a grid, but design is {drawn.kind!r}; leave it out.")
        given = file["against"]
        pairs = list(flat(given).items()) if isinstance(given, dict) else []
        if len(pairs) != 1 or not any(pairs[0] in row.items() for row in rows):
            raise AntsError(
                f"against is {shown(given)}; it must be one setting with one of its values in "
                "[vary]."
            )
        (against,) = pairs
    elif "margin" in file:
        raise AntsError("margin requires against; add against, or leave margin out.")
    ends = list(itertools.accumulate(map(len, grids), initial=0))
    parts, every = tuple(map(slice, ends, ends[1:])), base.reading.get("measure_every")
    study: Study[Any] = Study(points, base.seeds)
    return Sweep(
        *(base.kind, study, rows, parts, base.measures, every, against, margin, drawn, axes)
    )


def _reading(kind: str, wanted: Sequence[str], every: Any) -> dict[str, Any]:
    """Return the arguments of points for the registered measures."""
    registered = tuple(n for n in wanted if n.partition(".")[0] in measures.names())
    if kind != "colony":
        if every is not None:
            raise AntsError(
                f"measure_every is {shown(every)}, but is for colonies only; leave it out."
            )
        return {}
    if every is None:
        return {"measures": tuple(name for name in registered if name not in MEASURES[kind])}
    if not registered:
        raise AntsError(
            f"measure_every is {shown(every)}, but no measure has a series; add one of "
            f"{', '.join(measures.names())} to measures."
        )
    return {"measures": registered, "measure_every": checked_whole("measure_every", every)}


def _measured(
    kind: str,
    wanted: Sequence[str],
    has_series: bool,
    points: Sequence[Any],
    seeds: Sequence[int],
    outcome: Outcome,
) -> Outcome:
    """Return the measures of a block as `VALUE` arrays, and the series if they are asked for."""
    if kind == "runs":
        columns = of_runs.measures_of_runs(outcome, wanted)
        return {f"{VALUE}{name}": array for name, array in columns.items()}
    (point,) = points
    arrays = {key: array[0] for key, array in outcome.items()}
    found = of_colonies.measures_of(arrays, point.ants, point.ticks)
    columns = {}
    for name in wanted:
        columns |= {name: found[name]} if name in found else _ends(arrays, name)
    kept = {f"{VALUE}{name}": array[None] for name, array in columns.items()}
    series = {name: array for name, array in outcome.items() if name.startswith(SERIES)}
    return {**kept, **series} if has_series else kept


def _ends(outcome: Outcome, name: str) -> Outcome:
    """Return the mean over rollouts of a registered measure at their last ticks, float64 (seeds,).

    A measure with parts has several arrays. Rollouts without a value do not count.
    """
    found = {}
    for key, array in outcome.items():
        column = key.removeprefix(SERIES)
        if key != column and (column == name or column.startswith(f"{name}.")):
            last = array[..., -1]
            known = ~np.isnan(last)
            n = known.sum(axis=1)
            sums = np.where(known, last, 0.0).sum(axis=1)
            found[column] = np.divide(sums, n, out=np.full(len(n), math.nan), where=n > 0)
    return found


def _are_tables(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(one, dict) for one in value) and bool(value)


def _listed(value: Any) -> list:
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
            raise AntsError(f"{name} is an empty list; give at least one value.")
        for one in fixed:  # a group and one of its settings exclude each other, too
            if f"{one}.".startswith(f"{name}.") or f"{name}.".startswith(f"{one}."):
                raise AntsError(
                    f"{name} is in [vary] and {one} in the fixed settings; remove one of them."
                )
        if name in _OF_FILE:
            raise AntsError(f"{name} cannot vary; move it from [vary] to the top of the file.")
        declaration = _declaration(kind, name, fixed)
        if isinstance(values, dict):
            whole = declaration.kind is int if declaration else name in _whole_numbers(kind)
            axes[name] = axis = Range.of(name, values, whole)
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


def _declaration(kind: str, name: str, fixed: Settings) -> Setting | None:
    """Return the declaration of a setting; None if it is not in the task, training or world."""
    preset = fixed.get("world.preset", "paper")
    of_world = worlds.settings_of(preset) if preset in worlds.names() else ()
    known = (*all_of(Task), *declared(TrainingConfig), *of_world)
    return next((one for one in known if one.path == name), None)


def _whole_numbers(kind: str) -> set[str]:
    """Return the settings of points that are whole numbers."""
    return {one.name for one in fields(KINDS[kind]) if str(one.type) in ("int", "int | None")}


def _check_entries(file: Settings, varied: Iterable[str]) -> None:
    """Raise AntsError if [vary] names a field or a kind of food for which the file has no table."""
    for group in named_groups(Task):
        one: Any = file
        for key in group.path.split("."):
            one = one.get(key, {}) if isinstance(one, dict) else {}
        listed = list(one) if isinstance(one, dict) else []
        for name in sorted(varied):
            entry = name.removeprefix(f"{group.path}.").partition(".")[0]
            if name.startswith(f"{group.path}.") and entry not in listed:
                path, near = f"{group.path}.{entry}", difflib.get_close_matches(entry, listed, 3)
                choose = f"choose {', '.join(near or listed)}, or " if listed else ""
                raise AntsError(
                    f"`{path}` is in [vary], but the file has no table [{path}]; {choose}add it."
                )


def _point(
    kind: str,
    settings: Settings,
    seeds: tuple[int, ...],
    built: dict[str, Any],
    reading: Mapping[str, Any],
) -> Point:
    """Return the point of some settings; reuse the worlds in `built`, and add new ones.

    `reading` are the arguments of the point that are not settings.
    """
    learner = settings.get("training.learner")
    more = declared(learners.get(str(learner)).hyperparameters) if learner else ()
    known = [
        *_own(kind),
        "task.preset",
        # A group of settings can be set by a name, if it has names.
        *(one.path for one in all_of(Task) if not one.is_group or one.has_names),
        *(one.path for one in (*declared(TrainingConfig), *more)),
    ]
    tables = ["world.regions", *(one.path for one in named_groups(Task))]
    named = "|".join(map(re.escape, tables))
    settings, events = _without_events(settings)
    for name in settings:
        # The world checks its settings, and named groups check theirs.
        if name not in known and not re.fullmatch(rf"world\.[^.]*|({named})\..*", name):
            raise AntsError(f"{shown(name)} is not a setting {_rather(name, kind, known)}.")
    tree = nested(settings)
    world, task, training = (tree.pop(part, {}) for part in _PARTS[:3])
    preset = task.pop("preset", "paper")
    check_one_of("task.preset", preset, tuple(Task.named()))
    rules = Task.named()[preset].but(**task)
    if "policy" in tree:
        tree["policy"] = FixedPolicy.named(tree["policy"], rules)
    if "policy" in tree or (kind == "colony" and not rules.choice.needs_table):
        training = {**_WITHOUT_LEARNING, **training}
    for name in _OF_LEARNERS[:5]:  # the others have defaults
        if name not in training:
            raise AntsError(f"training.{name} is missing; add it to [training] or [vary].")
    key = repr(sorted(world.items()))
    if key not in built:
        built[key] = _world(kind, world, seeds)
    if events:
        tree["protocol"] = protocol.read(events)
    return KINDS[kind](built[key], rules, TrainingConfig(**training), **tree, **reading)


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


def _world(kind: str, given: Settings, seeds: tuple[int, ...]) -> Any:
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
    drawn_worlds = (worlds.build(preset, first + seed, **given) for seed in seeds)
    return tuple(world.with_regions(regions) for world in drawn_worlds)
