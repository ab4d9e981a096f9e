"""Sweeps: the points of a sweep file over seeds, their measures, tables and figures."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants import files
from taichi_ants.analysis import designs, sensitivity, style, sweeps
from taichi_ants.analysis.findings import Contrast, above, judge
from taichi_ants.analysis.statistics import known_means
from taichi_ants.errors import AntsError, shown
from taichi_ants.files import parquet
from taichi_ants.files.results import REPORT, ROWS
from taichi_ants.measures import Run, finished
from taichi_ants.measures.measure import RUN
from taichi_ants.measures.series import stops
from taichi_ants.settings import flat
from taichi_ants.studies import design
from taichi_ants.studies.blocks import Blocks, Outcome
from taichi_ants.studies.design import GRID, Axis, Design, Range
from taichi_ants.studies.points import SERIES, Progress
from taichi_ants.studies.runner import VALUE, Block, Study, values_in
from taichi_ants.studies.sweep_file import (
    Base,
    Settings,
    as_list,
    axes_of,
    check_entries,
    check_training,
    contents,
)

FIGURES, RUNS, SUMMARY, FINDINGS = "figures", "runs.csv", "summary.csv", "findings.csv"
SERIES_FILE, SENSITIVITY = "series.csv", "sensitivity.csv"
_OF_SERIES = ("seed", "episode", "tick", "measure", "value")  # columns of SERIES_FILE
_SHOW_EVERY = 100  # points
_BYTES_OF_A_NUMBER = 20  # in a table
_SHOWN_POINTS = 10  # of a design, in the report
_WORDS = {"supported": "more", "contradicted": "less", "equivalent": "equal"}


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

    def measured(
        self, blocks: Path, progress: Progress, as_parquet: bool = False, **how: Any
    ) -> dict[str, np.ndarray]:
        """Return each measure, float64 (points, seeds); arguments as of `Study.in_blocks`.

        The value of a registered measure is its mean over rollouts, at the last tick of each. The
        rows of finished blocks are written to tables beside the blocks, with `as_parquet` also as
        Parquet.
        """
        reduce = partial(_measured, self.kind, self.measures, self.measure_every is not None)
        how = {"bytes_of_a_run": self._bytes_of_a_run, **how}
        with self._rows_as_they_come(blocks.parent / ROWS, as_parquet) as each:
            return self.study.reduced(blocks, reduce, progress, each, **how)

    def _bytes_of_a_run(self, point: Any) -> int:
        """Return the approximate bytes of a run on disk: in a block, and in two tables."""
        values = len(self.measures)
        if self.measure_every is not None:
            several = len(list(stops(point.ticks, self.measure_every)))
            values += len(point.measures) * several * point.rollouts
        return values * (8 + 2 * _BYTES_OF_A_NUMBER)

    @contextmanager
    def _rows_as_they_come(
        self, folder: Path, as_parquet: bool
    ) -> Iterator[Callable[[Block], None]]:
        """Yield a function that appends the rows of a block to tables in a folder.

        The tables have the columns of `RUNS` and `SERIES_FILE`, and rows in the order of blocks.
        """
        tables: dict[str, list[Any]] = {}
        settings, order = self._settings_of_points, self.study.in_order
        columns, seeds = sweeps.columns_of(self.settings), self.study.seeds

        def append(name: str, rows: Iterable[dict[str, Any]], more: Iterable[str]) -> None:
            if name not in tables:
                path, names = files.check_writable_folder(folder) / name, [*columns, *more]
                tables[name] = [stack.enter_context(files.GrowingTable(path, names))]
                if as_parquet:
                    types = self._types(names)
                    tables[name] += [parquet.GrowingDataset(path.with_suffix(".parquet"), types)]
            several = list(rows)
            for table in tables[name]:
                table.append(several)

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

    def _types(self, columns: Iterable[str]) -> dict[str, str]:
        """Return the types of columns of tables, as `parquet.types_of` does."""
        known = parquet.types_of(self.settings)
        known |= parquet.types_of([{"seed": seed} for seed in self.study.seeds])
        known |= {"seeds": "int64", "episode": "int64", "tick": "int64", "measure": "string"}
        return {name: known.get(name, "double") for name in columns}

    def write_parquet(self, source: Path, folder: Path) -> None:
        """Write Parquet files to a folder from the tables in a folder of results.

        Raises:
            AntsError: pyarrow is not installed.
        """
        parquet.check_installed()
        for name in (RUNS, SUMMARY, SERIES_FILE):
            if (source / name).exists():
                types = self._types(files.csv_columns(source / name))
                parquet.convert(source / name, (folder / name).with_suffix(".parquet"), types)

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
            for (p, other), one in zip(pairs, judge(several), strict=True):
                said = _WORDS.get(one.verdict.value, "undecided")
                numbers = {"difference": one.effect, "low": one.low, "high": one.high}
                if np.isnan(values).any():
                    numbers["left_out"] = int(np.isnan(own[p] - own[other]).sum())
                found[some.start + p] = {**rows[p], "finding": said, **numbers}
        return found

    def write(self, values: dict[str, np.ndarray], folder: Path, draws: bool) -> None:
        """Write all results; `values` are those that `measured` returned."""
        first, columns = next(iter(values)), sweeps.columns_of(self.settings)
        of_seeds = sweeps.seed_rows(self.settings, self.study.seeds, values)
        files.write_csv(folder / RUNS, of_seeds, [*columns, "seed", *values])
        with_iqm = [name for name in values if finished.of_runs(self.kind, name).uses_iqm]
        gaps = [name for name, array in values.items() if np.isnan(array).any()]
        rows = [
            {**one, "seeds": len(self.study.seeds), **sweeps.centre_columns(centres, gaps)}
            for one, centres in zip(self.settings, sweeps.centres_of(values, with_iqm), strict=True)
        ]
        files.write_csv(folder / SUMMARY, rows, sweeps.columns_of(rows))
        found = self.findings(values[first])
        if self.against:
            more = ["finding", "difference", "low", "high", *["left_out"] * (first in gaps)]
            files.write_csv(folder / FINDINGS, found.values(), [*columns, *more])
        notes = [found.get(p, {}).get("finding", "") for p in range(len(self.settings))]
        if self.design.kind == GRID:
            report = sweeps.report(self.settings, values, self.against, notes)
        else:
            report = self._report_on_first(values)
        indices = self.indices(values)
        if indices:
            report = f"{report}\n{sensitivity.report(indices, len(self.study.seeds))}"
            fields = [name for name in sensitivity.Index._fields if name != "left_out" or gaps]
            of_all = [
                {name: getattr(one, name) for name in fields}
                for several in indices.values()
                for one in several
            ]
            files.write_csv(folder / SENSITIVITY, of_all, fields)
        files.write_text(folder / REPORT, report)
        if draws:
            with style.all_or_none(folder / FIGURES):
                self._draw(values[first], indices.get(first, []), first, folder / FIGURES)

    def _report_on_first(self, values: dict[str, np.ndarray]) -> str:
        """Return a report on the points of a design with the highest first measure."""
        name, means = next(iter(values)), known_means(next(iter(values.values())))
        order = np.argsort(-means, kind="stable")[:_SHOWN_POINTS]  # nan comes last
        rows = {measure: array[order] for measure, array in values.items()}
        table = sweeps.report([self.settings[p] for p in order], rows)
        most = f"the {len(order)} with the highest {name}" if len(order) < len(means) else "all"
        return f"{len(means)} points of the design {self.design.kind!r}; {most}:\n\n{table}"

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
        words = finished.of_runs(self.kind, first).label
        for number, (some, axes) in enumerate(zip(self.grids, self.axes, strict=True), start=1):
            path = folder / f"{first}{f'-{number}' * (len(self.grids) > 1)}.png"
            if self.design.kind == GRID:
                sweeps.draw(path, self.settings[some], values[some], words)
            else:
                names = list(design.varying(axes))
                logs = {n for n, axis in axes.items() if isinstance(axis, Range) and axis.log}
                designs.draw(path, self.settings[some], names, logs, values[some], words)
        if indices:
            path = folder / f"sensitivity_{first}.png"
            sensitivity.draw(path, indices, words, values.shape[1])


def read_sweep(
    path: Path, text: str | None = None, progress: Progress = lambda share: None
) -> Sweep:
    """Return the sweep of a file, or of its text; see `sweep_of` for `progress`.

    Raises:
        AntsError: The file cannot be read, or a setting is not allowed.
    """
    with contents(path, text) as file:
        return sweep_of(file, progress)


def sweep_of(file: Settings, progress: Progress = lambda share: None) -> Sweep:
    """Return the sweep of the contents of a file; AntsError if a setting is not allowed.

    `progress` is called with the share of the points that were built.
    """
    base, drawn = Base.of(file), Design.of(file)
    axes = tuple(axes_of(base.kind, table, base.fixed) for table in as_list(file.get("vary", [])))
    check_entries(file, {name for one in axes for name in one})
    if not axes:
        raise AntsError("[vary] is missing; add it with lists of values of the settings that vary.")
    if drawn.sensitivity and len(axes) > 1:
        raise AntsError(f"sensitivity is for one [vary] table, but there are {len(axes)}.")
    grids = [drawn.rows(one) for one in axes]
    rows, built = tuple(itertools.chain(*grids)), dict[str, Any]()
    points = []
    for number, row in enumerate(rows, start=1):
        points.append(base.point(row, built))
        if number % _SHOW_EVERY == 0:
            progress(number / len(rows))
    ends = list(itertools.accumulate(map(len, grids), initial=0))
    parts = tuple(map(slice, ends, ends[1:]))
    check_training(base.fixed, points)
    for names, part in zip(axes, parts, strict=True):
        check_training(names, points[part])
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
    every = base.reading.get("measure_every")
    study: Study[Any] = Study(tuple(points), base.seeds)
    return Sweep(
        *(base.kind, study, rows, parts, base.measures, every, against, margin, drawn, axes)
    )


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
        columns = finished.values_of(Run.of_lone_ant(outcome), wanted)
        return {f"{VALUE}{name}": array for name, array in columns.items()}
    (point,) = points
    arrays, columns = {key: array[0] for key, array in outcome.items()}, {}
    run = Run.of_colony(arrays, point.ants, point.ticks)
    for measure in (finished.of_runs(kind, name) for name in wanted):
        of_run = {measure.name: measure.computed(run)} if measure.of == RUN else {}
        columns |= of_run or _ends(arrays, measure.name)
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
            found[column] = known_means(array[..., -1])
    return found
