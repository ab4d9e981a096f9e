"""Sweeps: the points of a sweep file over seeds, their measures, tables and figures."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants import files
from taichi_ants.analysis import sensitivity, sweeps
from taichi_ants.analysis.findings import Contrast, above, judge
from taichi_ants.analysis.statistics import known_means
from taichi_ants.errors import AntsError, shown
from taichi_ants.files import tables as tables_of
from taichi_ants.measures import Run, finished
from taichi_ants.measures.measure import RUN
from taichi_ants.measures.series import stops
from taichi_ants.settings import flat
from taichi_ants.studies import design
from taichi_ants.studies.design import GRID, Axis, Design, Range
from taichi_ants.studies.folder import Results
from taichi_ants.studies.points import SERIES
from taichi_ants.studies.store import Arrays, parts_of
from taichi_ants.studies.study import Study
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
_SHOWN_POINTS = 10  # of a design, in the report
_WORDS = {"supported": "more", "contradicted": "less", "equivalent": "equal"}


@dataclass(frozen=True)
class Sweep:
    """A sweep, read from a file.

    Attributes:
        study: The points over the seeds, each point once.
        points: The point of each row of `settings`, which can repeat.
        settings: The settings that vary.
        grids: For each [vary] table of the file, the slice of `settings` that it defines.
        measures: Names of measures; the figure shows the first.
        measure_every: Ticks between two rows of `SERIES_FILE`; None without that file.
        against: The setting and its value with which all others are compared.
        margin: The largest difference in the first measure that is too small to matter.
        design: The design of the points.
        axes: For each [vary] table, the values or ranges of its settings.
    """

    kind: str
    study: Study
    points: tuple[Any, ...]
    settings: tuple[Settings, ...]
    grids: tuple[slice, ...]
    measures: tuple[str, ...]
    measure_every: int | None
    against: tuple[str, Any] | None
    margin: float
    design: Design = field(default_factory=Design)
    axes: tuple[Mapping[str, Axis], ...] = ()

    def facts(self) -> dict[str, Any]:
        """Return what determines the results besides the settings of the points."""
        own = {"measures": self.measures, "against": self.against, "margin": self.margin}
        own |= {"measure_every": self.measure_every} if self.measure_every else {}
        return {**own, **self.design.facts(), "vary": self.settings}

    @cached_property
    def order(self) -> list[int]:
        """The index in the study of the point of each row of `settings`."""
        place = {point: n for n, point in enumerate(self.study.points)}
        return [place[point] for point in self.points]

    def tables(self, results: Results) -> str:
        """Return the report, after writing all tables and figures of the runs that are there.

        The value of a registered measure is its mean over rollouts, at the last tick of each.
        """
        present = results.present[self.order]
        some = np.flatnonzero(present.any(axis=1))
        if not len(some):
            raise AntsError("no runs are finished; wait for the first ones.")
        settings, rows = [self.settings[n] for n in some], np.array(self.order)[some]
        values = {name: array[rows] for name, array in results.read(*self.measures).items()}
        self._write_runs(results, settings, values, present[some])
        self._write_series(results)
        if results.part:
            return sweeps.report(settings, values)
        return self._write_findings(results, values)

    def _write_runs(
        self,
        results: Results,
        settings: Sequence[Settings],
        values: Mapping[str, np.ndarray],
        present: np.ndarray,
    ) -> None:
        """Write a row for each run that is there, and a row for each point."""
        at, of = np.nonzero(present)
        runs = {name: one[at] for name, one in tables_of.table_of(settings).items()}
        runs["seed"] = tables_of.column(self.study.seeds)[of]
        runs |= {name: array[at, of].astype(float) for name, array in values.items()}
        tables_of.write(results.folder / RUNS, runs, results.parquet)
        with_iqm = [name for name in values if finished.of_runs(self.kind, name).uses_iqm]
        gaps = [name for name, array in values.items() if np.isnan(array).any()]
        centres = sweeps.centres_of(values, with_iqm)
        rows = [
            {**one, "seeds": int(seeds), **sweeps.centre_columns(centre, gaps)}
            for one, seeds, centre in zip(settings, present.sum(axis=1), centres, strict=True)
        ]
        tables_of.write(results.folder / SUMMARY, tables_of.table_of(rows), results.parquet)

    def _write_series(self, results: Results) -> None:
        """Write the series of the registered measures, a row for each value, if they are wanted."""
        if self.measure_every is None:
            return
        parts, present = list[tables_of.Table](), results.present
        own = tables_of.table_of(self.settings)
        seeds = tables_of.column(self.study.seeds)
        point: Any
        for place, point in enumerate(self.study.points):
            names = [f"{SERIES}{name}" for name in point.measures]
            found = results.read(*names, points=[place]) if present[place].any() else {}
            ticks = np.array(list(stops(point.ticks, self.measure_every)))
            same = [n for n, at in enumerate(self.order) if at == place]
            for name, array in found.items():
                values = array[0, present[place]]
                s, episode, row = (at.ravel() for at in np.indices(values.shape))
                of = np.full(len(s), name.removeprefix(SERIES), object)
                for n in same:
                    columns = {k: np.repeat(one[n : n + 1], len(s)) for k, one in own.items()}
                    columns |= {"seed": seeds[present[place]][s], "episode": episode}
                    columns |= {"tick": ticks[row], "measure": of, "value": values.ravel()}
                    parts.append(columns)
        table = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        tables_of.write(results.folder / SERIES_FILE, table, results.parquet)

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

    def _write_findings(self, results: Results, values: dict[str, np.ndarray]) -> str:
        """Write what compares points, and the figures; return the report."""
        columns, folder = sweeps.columns_of(self.settings), results.folder
        first = next(iter(values))
        gaps = [name for name, array in values.items() if np.isnan(array).any()]
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
        if results.figures:
            self._draw(values[first], indices.get(first, []), first, folder / FIGURES)
        return report

    def _report_on_first(self, values: dict[str, np.ndarray]) -> str:
        """Return a report on the points of a design with the highest first measure."""
        name, means = next(iter(values)), known_means(next(iter(values.values())))
        order = np.argsort(-means, kind="stable")[:_SHOWN_POINTS]  # nan comes last
        rows = {measure: array[order] for measure, array in values.items()}
        table = sweeps.report([self.settings[p] for p in order], rows)
        most = f"the {len(order)} with the highest {name}" if len(order) < len(means) else "all"
        return f"{len(means)} points of the design {self.design.kind!r}; {most}:\n\n{table}"

    def indices(self, values: dict[str, np.ndarray]) -> dict[str, list[sensitivity.Index]]:
        """Return the sensitivity indices by measure, from values float64 (points, seeds).

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
                sweeps.draw_design(path, self.settings[some], names, logs, values[some], words)
        if indices:
            path = folder / f"sensitivity_{first}.png"
            sensitivity.draw(path, indices, words, values.shape[1])


def plan(options: Mapping[str, Any]) -> Sweep:
    """Return the sweep of the option `file`; this makes a module of a study, see `studies.command`.

    Raises:
        AntsError: The file cannot be read, or a setting is not allowed.
    """
    return read_sweep(Path(options["file"]))


def tables(sweep: Sweep, results: Results) -> str:
    """Return the report, after writing all tables and figures of the runs that are there."""
    return sweep.tables(results)


def read_sweep(path: Path) -> Sweep:
    """Return the sweep of a file; AntsError if it cannot be read, or a setting is not allowed."""
    with contents(path) as file:
        return sweep_of(file)


def sweep_of(file: Settings) -> Sweep:
    """Return the sweep of the contents of a file; AntsError if a setting is not allowed."""
    base, drawn = Base.of(file), Design.of(file)
    axes = tuple(axes_of(base.kind, table, base.fixed) for table in as_list(file.get("vary", [])))
    check_entries(file, {name for one in axes for name in one})
    if not axes:
        raise AntsError("[vary] is missing; add it with lists of values of the settings that vary.")
    if drawn.sensitivity and len(axes) > 1:
        raise AntsError(f"sensitivity is for one [vary] table, but there are {len(axes)}.")
    grids = [drawn.rows(one) for one in axes]
    rows, built = tuple(itertools.chain(*grids)), dict[str, Any]()
    points = tuple(base.point(row, built) for row in rows)
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
    every, arrays = base.reading.get("measure_every"), base.measures
    if every is not None:
        arrays += tuple(f"{SERIES}{name}" for name in base.reading["measures"])
    study = Study(points, base.seeds, arrays, partial(_measured, base.kind, base.measures))
    return Sweep(
        *(base.kind, study, points, rows, parts, base.measures, every),
        *(against, margin, drawn, axes),
    )


def _measured(
    kind: str, wanted: Sequence[str], points: Sequence[Any], seeds: Sequence[int], outcome: Arrays
) -> Arrays:
    """Return the measures of a block, float64 (points, seeds)."""
    if kind == "runs":
        return finished.values_of(Run.of_lone_ant(outcome), wanted)
    (point,) = points
    arrays = {key: array[0] for key, array in outcome.items()}
    run, columns = Run.of_colony(arrays, point.ants, point.ticks), Arrays()
    for measure in (finished.of_runs(kind, name) for name in wanted):
        of_run = {measure.name: measure.computed(run)} if measure.of == RUN else {}
        columns |= of_run or _ends(arrays, measure.name)
    return {name: array[None] for name, array in columns.items()}


def _ends(outcome: Arrays, name: str) -> Arrays:
    """Return the mean over rollouts of a registered measure at their last ticks, float64 (seeds,).

    A measure with parts has several arrays. Rollouts without a value do not count.
    """
    several = parts_of(f"{SERIES}{name}", outcome)
    return {key.removeprefix(SERIES): known_means(outcome[key][..., -1]) for key in several}
